// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <unordered_map>
#include <utility>
#include <vector>

namespace palpate::detail {

/// The smallest and the largest of the six dihedral angles of a tetrahedron of positive volume [degrees].
inline std::array<double, 2> dihedral_range(Matrix<double, 3, 4> const& p) {
  std::array<Vector3<double>, 4> normal;   // of the face opposite a corner, inwards
  for (int c = 0; c < 4; ++c) {
    Vector3<double> const a = p.col((c + 1) % 4), b = p.col((c + 2) % 4), d = p.col((c + 3) % 4), n = (b - a).cross(d - a), top = p.col(c);
    normal[static_cast<std::size_t>(c)] = n.dot(top - a) < 0 ? Vector3<double>(-n) : n;
  }
  std::array<double, 2> range{180, 0};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      double const angle = 180 - std::atan2(normal[i].cross(normal[j]).norm(), normal[i].dot(normal[j])) * 180 / std::numbers::pi;
      range = {std::min(range[0], angle), std::max(range[1], angle)};
    }
  return range;
}

/// Isosurface stuffing: tetrahedra of a body-centred cubic lattice where a field is negative, those at its surface warped or cut to it.
/// A lattice vertex that the surface passes close to is moved there, along the edge that is cut nearest; the tetrahedra that are still cut are divided.
/// Source     \cite labelle2007. How near is near (`near_on_long`, `near_on_short`, shares of an edge) goes with how quadrilaterals are divided: there the
///            paper leaves a choice. Ours go with this division: 10.8 to 164.1 degrees in 10⁷
///            tetrahedra of random fields made to come near the shares; the paper's pair, 0.24999 and 0.41189, gave 9.8 in easier ones.
class StuffedLattice {
 public:
  double near_on_long = 0.288, near_on_short = 0.39;

  /// nx × ny × nz cubes of the lattice constant `edge` from a corner on.
  StuffedLattice(Vector3<double> const& corner, double edge, std::array<int, 3> const& cubes)
      : corner_(corner), edge_(edge), n_(cubes), corners_(1ll * (cubes[0] + 1) * (cubes[1] + 1) * (cubes[2] + 1)) {}

  std::int64_t size() const noexcept { return corners_ + 1ll * n_[0] * n_[1] * n_[2]; }

  /// The field is negative inside and asked in the order of the lattice; its crossings with edges are found from its values by bisection and secants.
  template <class Field>
  TetrahedralMesh<double> fill(Field const& field) {
    value_.resize(static_cast<std::size_t>(size()));
    for (std::int64_t v = 0; v < size(); ++v) {
      double const f = field(position(v));
      value(v) = at_border(v) && !(f > 0) ? edge_ : f;   // nothing of a surface that ends before the border is there
    }
    find_crossings(field);
    warp();
    divide();
    return collect();
  }

 private:
  struct Crossing {
    Vector3<double> point;
    int number = -1;   // in the mesh that is made
  };
  struct Corner {      // of a tetrahedron that is made
    std::int64_t vertex;
    Crossing* crossing;
    Vector3<double> point;
  };
  using Ends = std::array<std::int64_t, 2>;
  static constexpr std::uint64_t edges_of_vertex = 11;   // three long ones, and of the middle of a cube eight short ones

  std::int64_t corner_at(int i, int j, int k) const { return (1ll * k * (n_[1] + 1) + j) * (n_[0] + 1) + i; }
  std::int64_t middle_at(int i, int j, int k) const { return corners_ + (1ll * k * n_[1] + j) * n_[0] + i; }
  bool is_middle(std::int64_t v) const { return v >= corners_; }
  std::array<int, 3> place(std::int64_t v) const {
    std::int64_t const extra = is_middle(v) ? 0 : 1, m = is_middle(v) ? v - corners_ : v, row = n_[0] + extra, column = n_[1] + extra;
    return {static_cast<int>(m % row), static_cast<int>(m / row % column), static_cast<int>(m / row / column)};
  }
  Vector3<double> position(std::int64_t v) const {
    auto const [i, j, k] = place(v);
    return corner_ + edge_ * (Vector3<double>(i, j, k) + Vector3<double>::Constant(is_middle(v) ? 0.5 : 0.0));
  }
  bool at_border(std::int64_t v) const {
    auto const p = place(v);
    for (std::size_t a = 0; a < 3; ++a)
      if (p[a] == 0 || p[a] == n_[a] - (is_middle(v) ? 1 : 0)) return true;
    return false;
  }
  double& value(std::int64_t v) { return value_[static_cast<std::size_t>(v)]; }
  double value(std::int64_t v) const { return value_[static_cast<std::size_t>(v)]; }

  /// The other end of an edge that a vertex has; −1 where the lattice ends.
  std::int64_t other_end(std::int64_t v, int direction) const {
    auto p = place(v);
    if (direction < 3) {
      std::size_t const axis = static_cast<std::size_t>(direction);
      if (++p[axis] >= n_[axis] + (is_middle(v) ? 0 : 1)) return -1;
      return is_middle(v) ? middle_at(p[0], p[1], p[2]) : corner_at(p[0], p[1], p[2]);
    }
    if (!is_middle(v)) return -1;
    int const c = direction - 3;
    return corner_at(p[0] + (c & 1), p[1] + (c >> 1 & 1), p[2] + (c >> 2 & 1));
  }
  bool is_long(std::int64_t a, std::int64_t b) const { return is_middle(a) == is_middle(b); }
  /// The name of an edge that there is.
  std::uint64_t key(std::int64_t a, std::int64_t b) const {
    if (is_long(a, b)) {
      if (b < a) std::swap(a, b);
      auto const p = place(a), q = place(b);
      return static_cast<std::uint64_t>(a) * edges_of_vertex + static_cast<std::uint64_t>(q[1] - p[1] + 2 * (q[2] - p[2]));
    }
    if (!is_middle(a)) std::swap(a, b);
    auto const p = place(a), q = place(b);
    return static_cast<std::uint64_t>(a) * edges_of_vertex + static_cast<std::uint64_t>(3 + (q[0] - p[0]) + 2 * (q[1] - p[1]) + 4 * (q[2] - p[2]));
  }
  Ends ends(std::uint64_t key) const {
    auto const v = static_cast<std::int64_t>(key / edges_of_vertex);
    return {v, other_end(v, static_cast<int>(key % edges_of_vertex))};
  }

  template <class Field>
  void find_crossings(Field const& field) {
    for (std::int64_t v = 0; v < size(); ++v)
      for (int d = 0; d < (is_middle(v) ? 11 : 3); ++d) {
        std::int64_t const w = other_end(v, d);
        if (w < 0 || !(value(v) * value(w) < 0)) continue;
        keys_.push_back(static_cast<std::uint64_t>(v) * edges_of_vertex + static_cast<std::uint64_t>(d));
        crossings_.emplace(keys_.back(), Crossing{crossing(field, v, w)});
      }
  }
  /// Where the field changes its sign between two vertices: to 10⁻⁴ of the edge, also where it jumps.
  template <class Field>
  Vector3<double> crossing(Field const& field, std::int64_t v, std::int64_t w) const {
    Vector3<double> const from = position(v), along = position(w) - from;
    double low = 0, high = 1, f_low = value(v), f_high = value(w), t = f_low / (f_low - f_high);
    for (int pass = 0; pass < 12 && high - low > 1e-4; ++pass) {
      t = std::clamp(pass % 3 == 2 ? (low + high) / 2 : low + (high - low) * f_low / (f_low - f_high), low + 1e-5 * (high - low), high - 1e-5 * (high - low));
      double const f = field(Vector3<double>(from + t * along));
      if (std::abs(f) < 1e-4 * edge_) break;
      if ((f < 0) == (f_low < 0))
        low = t, f_low = f;
      else
        high = t, f_high = f;
    }
    return from + t * along;
  }

  void warp() {
    std::vector<std::pair<std::int64_t, std::uint64_t>> at;
    for (std::uint64_t const k : keys_)
      for (std::int64_t const v : ends(k)) at.emplace_back(v, k);
    std::sort(at.begin(), at.end());
    for (std::size_t i = 0; i < at.size();) {
      std::int64_t const v = at[i].first;
      Vector3<double> const here = position(v);
      Crossing const* nearest = nullptr;
      double least = edge_;
      for (; i < at.size() && at[i].first == v; ++i) {
        auto const [a, b] = ends(at[i].second);
        if (!(value(a) * value(b) < 0)) continue;   // its other end has been moved
        Crossing const& cut = crossings_.at(at[i].second);
        double const distance = (cut.point - here).norm();
        double const limit = is_long(a, b) ? near_on_long * edge_ : near_on_short * edge_ * std::numbers::sqrt3 / 2;
        if (distance < limit && distance < least) nearest = &cut, least = distance;
      }
      if (nearest == nullptr) continue;
      moved_.emplace(v, nearest->point);
      value(v) = 0;
    }
  }

  Corner vertex(std::int64_t v) const {
    auto const moved = moved_.find(v);
    return {v, nullptr, moved != moved_.end() ? moved->second : position(v)};
  }
  Corner cut(std::int64_t a, std::int64_t b) {
    Crossing& crossing = crossings_.at(key(a, b));
    return {-1, &crossing, crossing.point};
  }

  void divide() {
    for (int k = 0; k < n_[2]; ++k)
      for (int j = 0; j < n_[1]; ++j)
        for (int i = 0; i < n_[0]; ++i)
          for (std::size_t axis = 0; axis < 3; ++axis) {
            std::array<int, 3> const p{i, j, k};
            std::size_t const u = (axis + 1) % 3, w = (axis + 2) % 3;
            if (p[axis] + 1 >= n_[axis]) continue;
            std::int64_t const own = middle_at(i, j, k), next = other_end(own, static_cast<int>(axis));
            for (int side = 0; side < 4; ++side) {   // of the square between the two cubes
              auto const square = [&](int s) {
                std::array<int, 3> c = p;
                ++c[axis];
                c[u] += s == 1 || s == 2, c[w] += s == 2 || s == 3;
                return corner_at(c[0], c[1], c[2]);
              };
              divide({own, next, square(side), square((side + 1) % 4)});
            }
          }
  }

  /// One tetrahedron of the lattice.
  void divide(std::array<std::int64_t, 4> const& corners) {
    std::array<std::int64_t, 4> inside, zero, outside;
    std::size_t ins = 0, zeros = 0, outs = 0;
    for (std::int64_t const v : corners) {
      if (value(v) < 0)
        inside[ins++] = v;
      else if (value(v) > 0)
        outside[outs++] = v;
      else
        zero[zeros++] = v;
    }
    if (ins == 0) return;
    if (outs == 0) return add(vertex(corners[0]), vertex(corners[1]), vertex(corners[2]), vertex(corners[3]));
    if (ins == 1) {
      std::array<Corner, 4> all{vertex(inside[0]), {}, {}, {}};
      for (std::size_t c = 0; c < zeros; ++c) all[1 + c] = vertex(zero[c]);
      for (std::size_t c = 0; c < outs; ++c) all[1 + zeros + c] = cut(inside[0], outside[c]);
      return add(all[0], all[1], all[2], all[3]);
    }
    std::int64_t const o = outside[0];
    if (ins == 3) {
      Prism const prism{{vertex(inside[0]), vertex(inside[1]), vertex(inside[2])}, {cut(inside[0], o), cut(inside[1], o), cut(inside[2], o)}};
      return add(prism, {from_first(inside[0], inside[1], o), from_first(inside[0], inside[2], o), from_first(inside[1], inside[2], o)});
    }
    std::int64_t const a = inside[0], b = inside[1];
    if (zeros == 1) {   // a pyramid over a quadrilateral
      Corner const top = vertex(zero[0]), ca = cut(a, o), cb = cut(b, o);
      bool const first = from_first(a, b, o);
      add(top, vertex(a), vertex(b), first ? cb : ca);
      return add(top, ca, cb, first ? vertex(a) : vertex(b));
    }
    std::int64_t const q = outside[1];
    Prism const prism{{vertex(a), cut(a, o), cut(a, q)}, {vertex(b), cut(b, o), cut(b, q)}};
    bool const one = from_first(a, b, o), two = from_first(a, b, q);
    Diagonals const with{one, two, true}, without{one, two, false};   // that on the surface nobody shares
    bool const take = one && !two ? false : !one && two ? true : worst(prism, with) >= worst(prism, without);
    add(prism, take ? with : without);
  }

  /// Two triangles and the three quadrilaterals between them; diagonals of (0, 1), (0, 2), (1, 2): from the first of `low` to the second of `high`, or the other way.
  struct Prism {
    std::array<Corner, 3> low, high;
  };
  using Diagonals = std::array<bool, 3>;

  /// How the quadrilateral a, b and their crossings with edges to o is divided: from a to the crossing of b, or the other way. Both tetrahedra at it see the
  /// same: to the crossing of the long edge, else the shorter way.
  bool from_first(std::int64_t a, std::int64_t b, std::int64_t o) {
    bool const long_a = is_long(a, o), long_b = is_long(b, o);
    if (long_a != long_b) return long_b;
    double const first = (vertex(a).point - cut(b, o).point).squaredNorm(), second = (vertex(b).point - cut(a, o).point).squaredNorm();
    return first != second ? first < second : a < b;
  }

  using Parts = std::array<std::array<Corner, 4>, 3>;
  static Parts parts(Prism const& p, Diagonals const& d) {
    std::array<int, 3> starts{d[0] + d[1], !d[0] + d[2], !d[1] + !d[2]};   // diagonals that begin in each corner of `low`: 2, 1, 0 in some order
    std::array<std::size_t, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return starts[i] > starts[j]; });
    auto const& [s, t, u] = order;
    return {{{p.low[s], p.low[t], p.low[u], p.high[u]}, {p.low[s], p.low[t], p.high[t], p.high[u]}, {p.low[s], p.high[s], p.high[t], p.high[u]}}};
  }
  static double worst(Prism const& prism, Diagonals const& diagonals) {
    double least = 180;
    for (auto const& part : parts(prism, diagonals)) {
      Matrix<double, 3, 4> p;
      for (int c = 0; c < 4; ++c) p.col(c) = part[static_cast<std::size_t>(c)].point;
      auto const [low, high] = dihedral_range(p);
      least = std::min({least, low, 180 - high});
    }
    return least;
  }
  void add(Prism const& prism, Diagonals const& diagonals) {
    for (auto const& part : parts(prism, diagonals)) add(part[0], part[1], part[2], part[3]);
  }
  void add(Corner const& a, Corner const& b, Corner const& c, Corner const& d) {
    std::array<int, 4> made{number(a), number(b), number(c), number(d)};
    if (Vector3<double>(b.point - a.point).cross(c.point - a.point).dot(d.point - a.point) < 0) std::swap(made[2], made[3]);
    tetrahedra_.push_back(made);
  }
  int number(Corner const& corner) {
    int& known = corner.crossing != nullptr ? corner.crossing->number : numbers_.try_emplace(corner.vertex, -1).first->second;
    if (known < 0) {
      known = static_cast<int>(points_.size());
      points_.push_back(corner.point);
    }
    return known;
  }

  TetrahedralMesh<double> collect() const {
    TetrahedralMesh<double> mesh;
    mesh.points.resize(3, static_cast<Eigen::Index>(points_.size()));
    mesh.tetrahedra.resize(4, static_cast<Eigen::Index>(tetrahedra_.size()));
    for (std::size_t i = 0; i < points_.size(); ++i) mesh.points.col(static_cast<Eigen::Index>(i)) = points_[i];
    for (std::size_t t = 0; t < tetrahedra_.size(); ++t)
      for (std::size_t c = 0; c < 4; ++c) mesh.tetrahedra(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(t)) = tetrahedra_[t][c];
    return mesh;
  }

  Vector3<double> corner_;
  double edge_;
  std::array<int, 3> n_;
  std::int64_t corners_;
  std::vector<double> value_;
  std::vector<std::uint64_t> keys_;
  std::unordered_map<std::uint64_t, Crossing> crossings_;
  std::unordered_map<std::int64_t, Vector3<double>> moved_;
  std::unordered_map<std::int64_t, int> numbers_;
  std::vector<Vector3<double>> points_;
  std::vector<std::array<int, 4>> tetrahedra_;
};

}  // namespace palpate::detail
