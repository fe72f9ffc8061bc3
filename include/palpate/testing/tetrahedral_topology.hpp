// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/testing/violations.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate::testing {

struct TetrahedralChecks {
  int most = 20;           ///< stop after so many violations
  bool manifold = false;   ///< at most one border triangle may hold a directed edge
};

namespace detail {

class TetrahedralLaws {
 public:
  TetrahedralLaws(TetrahedralTopology const& topology, TetrahedralChecks const& checks) : topology_(topology), checks_(checks) {}

  Violations check() {
    if (!check_corners()) return std::move(found_);
    check_lists();
    check_faces();
    check_border();
    check_edges();
    return std::move(found_);
  }

 private:
  using Triangle = std::array<int, 3>;
  struct Face {
    Triangle sorted, corners;   // corners: counter-clockwise seen from outside
    int tetrahedron;
  };

  template <class... Parts>
  void report(Parts const&... parts) {
    if (static_cast<int>(found_.size()) < checks_.most) found_.push_back(palpate::detail::message(parts...));
  }

  static bool is_rotation(Triangle const& a, Triangle const& b) {
    return a == b || a == Triangle{b[1], b[2], b[0]} || a == Triangle{b[2], b[0], b[1]};
  }

  /// Corners are vertices, distinct; all faces, from the corners alone.
  bool check_corners() {
    auto const tetrahedra = topology_.tetrahedra();
    faces_.reserve(4 * static_cast<std::size_t>(topology_.tetrahedron_count()));
    for (int t = 0; t < topology_.tetrahedron_count(); ++t) {
      std::array<int, 4> const c{tetrahedra(0, t), tetrahedra(1, t), tetrahedra(2, t), tetrahedra(3, t)};
      auto sorted = c;
      std::sort(sorted.begin(), sorted.end());
      if (sorted[0] < 0 || sorted[3] >= topology_.vertex_count() || std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
        report("tetrahedron ", t, " has the corners ", c[0], " ", c[1], " ", c[2], " ", c[3], " of ", topology_.vertex_count(), " vertices");
        continue;
      }
      for (Triangle const& corners : {Triangle{c[1], c[2], c[3]}, Triangle{c[0], c[3], c[2]}, Triangle{c[0], c[1], c[3]}, Triangle{c[0], c[2], c[1]}}) {
        faces_.push_back({corners, corners, t});
        std::sort(faces_.back().sorted.begin(), faces_.back().sorted.end());
      }
    }
    std::sort(faces_.begin(), faces_.end(), [](Face const& a, Face const& b) { return a.sorted != b.sorted ? a.sorted < b.sorted : a.tetrahedron < b.tetrahedron; });
    return found_.empty();
  }

  void check_lists() {
    auto const check = [&](auto const& elements, char const* kind, auto const& listed) {
      std::vector<std::vector<int>> at(static_cast<std::size_t>(topology_.vertex_count()));
      for (Eigen::Index e = 0; e < elements.cols(); ++e)
        for (Eigen::Index k = 0; k < elements.rows(); ++k) at[static_cast<std::size_t>(elements(k, e))].push_back(static_cast<int>(e));
      for (int v = 0; v < topology_.vertex_count(); ++v) {
        auto const& here = at[static_cast<std::size_t>(v)];
        auto const list = listed(v);
        if (!std::is_permutation(list.begin(), list.end(), here.begin(), here.end()))
          report("the list of ", kind, " at vertex ", v, " is not what their corners say");
      }
    };
    check(topology_.tetrahedra(), "tetrahedra", [&](int v) { return topology_.tetrahedra_at(v); });
    if (topology_.border().vertex_count() != topology_.vertex_count())
      report("the border has ", topology_.border().vertex_count(), " vertices instead of ", topology_.vertex_count());
    else
      check(topology_.border().triangles(), "border triangles", [&](int v) { return topology_.border().triangles_at(v); });
  }

  /// Which face of its tetrahedron it is, by the vertex that it leaves out.
  int number(Face const& face) const {
    for (int k = 0; k < 4; ++k)
      if (std::find(face.sorted.begin(), face.sorted.end(), topology_.corners(face.tetrahedron)[static_cast<std::size_t>(k)]) == face.sorted.end()) return k;
    return -1;
  }

  void check_faces() {
    for (std::size_t i = 0, end = 0; i < faces_.size(); i = end) {
      for (end = i; end < faces_.size() && faces_[end].sorted == faces_[i].sorted;) ++end;
      Face const &one = faces_[i], &other = faces_[end - 1];
      auto const& s = one.sorted;
      if (end - i > 2) {
        report("the face ", s[0], " ", s[1], " ", s[2], " has ", end - i, " tetrahedra");
      } else if (end - i == 2) {
        if (is_rotation(one.corners, other.corners)) report("tetrahedra ", one.tetrahedron, " and ", other.tetrahedron, " lie on the same side of a face");
        for (auto const& [a, b] : {std::pair(one, other), std::pair(other, one)})
          if (topology_.neighbour(a.tetrahedron, number(a)) != b.tetrahedron || topology_.border_triangle(a.tetrahedron, number(a)) != -1)
            report("tetrahedron ", a.tetrahedron, " does not know ", b.tetrahedron, " as its neighbour across face ", number(a));
      } else {
        ++single_;
        int const t = one.tetrahedron, k = number(one), triangle = topology_.border_triangle(t, k);
        if (topology_.neighbour(t, k) != -1) report("tetrahedron ", t, " has a neighbour across face ", k, ", which no other has");
        if (triangle < 0 || triangle >= topology_.border().triangle_count())
          report("face ", k, " of tetrahedron ", t, " has the border triangle ", triangle);
        else if (auto const back = topology_.border_face(triangle); back.tetrahedron != t || back.face != k)
          report("border triangle ", triangle, " lies on face ", k, " of tetrahedron ", t, " but knows face ", back.face, " of ", back.tetrahedron);
        else if (!is_rotation(topology_.border().corners(triangle), one.corners))
          report("border triangle ", triangle, " is not face ", k, " of tetrahedron ", t, " seen from outside");
      }
      for (std::size_t f = i; f < end; ++f) {
        auto const& [sorted, c, t] = faces_[f];
        if (!is_rotation(topology_.face(t, number(faces_[f])), c)) report("face ", number(faces_[f]), " of tetrahedron ", t, " is not outward");
        if (end - i <= 2 && topology_.tetrahedron_with_face(c[0], c[1], c[2]) != t) report("the face ", c[0], " ", c[1], " ", c[2], " is not found");
      }
    }
  }

  /// It is all faces with one tetrahedron, and closed.
  void check_border() {
    auto const& border = topology_.border();
    if (border.triangle_count() != single_) report("the border has ", border.triangle_count(), " triangles, but ", single_, " faces have one tetrahedron");
    if (!found_.empty()) return;
    std::vector<std::pair<int, int>> directed;
    for (int t = 0; t < border.triangle_count(); ++t)
      for (int k = 0; k < 3; ++k) directed.push_back(side(t, k));
    std::sort(directed.begin(), directed.end());
    auto const count_of = [&](std::pair<int, int> const& edge) {
      auto const [first, end] = std::equal_range(directed.begin(), directed.end(), edge);
      return static_cast<int>(end - first);
    };
    for (std::size_t k = 0; k < directed.size(); ++k) {
      auto const& edge = directed[k];
      if (k > 0 && directed[k - 1] == edge) continue;
      int const count = count_of(edge), opposite = count_of({edge.second, edge.first});
      if (opposite != count)
        report("the border is open at the edge ", edge.first, " -> ", edge.second, ": ", count, " triangles, ", opposite, " opposite");
      if (count > 1 && checks_.manifold) report(count, " border triangles hold the edge ", edge.first, " -> ", edge.second);
      if (topology_.fans_round(edge.first, edge.second) != count)
        report("the tetrahedra round the border's edge ", edge.first, " -> ", edge.second, " are not ", count, " fans");
    }
    for (int t = 0; t < border.triangle_count(); ++t)
      for (int k = 0; k < 3; ++k) {
        auto const [from, to] = side(t, k);
        int const beside = topology_.border_neighbour(t, k);
        bool paired = false;
        for (int l = 0; l < 3; ++l) paired = paired || (side(beside, l) == std::pair(to, from) && topology_.border_neighbour(beside, l) == t);
        if (!paired) report("border triangle ", t, " has ", beside, " beside its edge ", from, " -> ", to, ", which says otherwise");
      }
  }
  std::pair<int, int> side(int triangle, int k) const {
    auto const c = topology_.border().corners(triangle);
    return {c[static_cast<std::size_t>(k)], c[static_cast<std::size_t>((k + 1) % 3)]};
  }

  /// Round each edge all its tetrahedra, in order; neighbours of each vertex.
  void check_edges() {
    std::vector<std::vector<int>> at(static_cast<std::size_t>(topology_.vertex_count()));
    for (int t = 0; t < topology_.tetrahedron_count(); ++t)
      for (int const v : topology_.corners(t)) at[static_cast<std::size_t>(v)].push_back(t);
    std::vector<std::pair<int, int>> round;   // the other end of an edge and a tetrahedron that holds it
    std::vector<int> neighbours, visited;
    for (int a = 0; a < topology_.vertex_count(); ++a) {
      round.clear();
      for (int const t : at[static_cast<std::size_t>(a)])
        for (int const b : topology_.corners(t))
          if (b != a) round.emplace_back(b, t);
      std::sort(round.begin(), round.end());
      neighbours.clear();
      for (auto begin = round.begin(), end = begin; begin != round.end(); begin = end) {
        int const b = begin->first;
        end = std::find_if(begin, round.end(), [&](auto const& held) { return held.first != b; });
        neighbours.push_back(b);
        check_edge(a, b, {begin, end});
      }
      visited.clear();
      topology_.for_each_neighbour(a, [&](int w) { visited.push_back(w); });
      std::sort(visited.begin(), visited.end());
      if (visited != neighbours) report("the neighbours of vertex ", a, " are not what the tetrahedra say");
    }
  }
  void check_edge(int a, int b, std::span<std::pair<int, int> const> expected) {
    round_.clear();
    topology_.for_each_round(a, b, [&](int t) { round_.push_back(t); });
    ascending_ = round_;
    std::sort(ascending_.begin(), ascending_.end());
    if (!std::equal(ascending_.begin(), ascending_.end(), expected.begin(), expected.end(), [](int t, auto const& held) { return t == held.second; }))
      return report("round the edge ", a, " - ", b, " not each of its ", expected.size(), " tetrahedra is visited once");
    int breaks = 0;   // a step leads over the face a b c, outward from the first; there is one break less than fans
    for (std::size_t i = 0; i + 1 < round_.size(); ++i) {
      bool joined = false;
      for (int const c : topology_.corners(round_[i]))
        joined = joined || (c != a && c != b && topology_.tetrahedron_with_face(a, b, c) == round_[i] && topology_.tetrahedron_with_face(b, a, c) == round_[i + 1]);
      breaks += joined ? 0 : 1;
    }
    if (breaks + 1 != topology_.fans_round(a, b)) report("the tetrahedra round the edge ", a, " - ", b, " do not come in order");
  }

  TetrahedralTopology const& topology_;
  TetrahedralChecks checks_;
  Violations found_;
  std::vector<Face> faces_;
  int single_ = 0;   // faces with one tetrahedron
  std::vector<int> round_, ascending_;   // tetrahedra round an edge
};

inline int euler_characteristic(TetrahedralTopology const& topology) {
  std::vector<int> vertices;
  std::vector<std::array<int, 2>> edges;
  std::vector<std::array<int, 3>> faces;
  for (int t = 0; t < topology.tetrahedron_count(); ++t) {
    auto c = topology.corners(t);
    std::sort(c.begin(), c.end());
    for (std::size_t i = 0; i < 4; ++i) {
      vertices.push_back(c[i]);
      for (std::size_t j = i + 1; j < 4; ++j) {
        edges.push_back({c[i], c[j]});
        for (std::size_t k = j + 1; k < 4; ++k) faces.push_back({c[i], c[j], c[k]});
      }
    }
  }
  auto const distinct = [](auto& list) {
    std::sort(list.begin(), list.end());
    return static_cast<int>(std::unique(list.begin(), list.end()) - list.begin());
  };
  return distinct(vertices) - distinct(edges) + distinct(faces) - topology.tetrahedron_count();
}

}  // namespace detail

/// What holds for every tetrahedral topology, whatever was edited: checked against its list of corners alone.
///
///   CHECK(testing::to_text(testing::check_tetrahedral_topology(topology)) == "");
///
/// Faces      each has one or two tetrahedra, two on opposite sides; neighbours know each other.
/// Border     its triangles are the faces with one tetrahedron, counter-clockwise seen from outside; each knows its face, and each face its triangle. It
///            is closed: every directed edge occurs as often as its opposite, and as there are fans of tetrahedra round it; across a side
///            lies the triangle that says so too. With `manifold`, every directed edge occurs once.
/// Queries    lists at vertices, tetrahedra round each edge in order, neighbours of vertices and faces are those of a search of all.
/// Cost       O(m log m) for m tetrahedra.
inline Violations check_tetrahedral_topology(TetrahedralTopology const& topology, TetrahedralChecks const& checks = {}) {
  return detail::TetrahedralLaws(topology, checks).check();
}

/// The same, and that every tetrahedron has a positive volume at these points and all have this one [m³] together, to 1e-12 (double) or 1e-5 (float).
template <class Derived>
Violations check_tetrahedral_topology(TetrahedralTopology const& topology, Eigen::MatrixBase<Derived> const& points, double volume,
                                      TetrahedralChecks const& checks = {}) {
  Violations found = check_tetrahedral_topology(topology, checks);
  double sum = 0;
  for (int t = 0; t < topology.tetrahedron_count(); ++t) {
    auto const c = topology.corners(t);
    auto const p = [&](std::size_t k) { return Vector3<double>(points.col(c[k]).template cast<double>()); };
    double const part = (p(1) - p(0)).cross(p(2) - p(0)).dot(p(3) - p(0)) / 6;
    sum += part;
    if (!(part > 0) && static_cast<int>(found.size()) < checks.most)
      found.push_back(palpate::detail::message("tetrahedron ", t, " has a volume of ", part, " m3"));
  }
  if (!(std::abs(sum - volume) <= (sizeof(typename Derived::Scalar) == sizeof(float) ? 1e-5 : 1e-12) * volume))
    found.push_back(palpate::detail::message("the volume is ", sum, " m3 instead of ", volume));
  return found;
}

/// What one operator must have done, by its record: found from the topology before it by a search of all tetrahedra.
/// Insertion  each tetrahedron that holds all N parents has become N, each border triangle N with them; the Euler characteristic
///            V − E + F − T is as it was.
/// Split      the tetrahedra at the copy were at its parent; each of the m faces that opened has two border triangles; with e the edges from the parent to
///            vertices on both sides, the Euler characteristic has grown by 1 − e + m.
/// All        what the record does not name is as it was, numbers included.
inline Violations check_tetrahedral_edit(TetrahedralTopology const& before, TopologyEdit const& edit, TetrahedralTopology const& after) {
  Violations found;
  auto const report = [&](auto const&... parts) { found.push_back(palpate::detail::message(parts...)); };
  if (edit.vertex != before.vertex_count() || after.vertex_count() != before.vertex_count() + 1)
    report("vertex ", edit.vertex, " is not one new vertex at the end");
  if (edit.first_tetrahedron != before.tetrahedron_count() || edit.end_tetrahedron != after.tetrahedron_count())
    report("the record does not name the tetrahedra that were added");
  if (edit.first_triangle != before.border().triangle_count() || edit.end_triangle != after.border().triangle_count())
    report("the record does not name the border triangles that were added");
  if (!found.empty()) return found;
  auto const parents = edit.parents();
  int const n = edit.vertex, last = parents.back();
  auto const holds_all = [&](auto const& corners) {
    return std::all_of(parents.begin(), parents.end(), [&](int p) { return std::find(corners.begin(), corners.end(), p) != corners.end(); });
  };

  std::vector<std::array<int, 4>> expected, appended;
  std::vector<bool> is_replaced(static_cast<std::size_t>(before.tetrahedron_count()));
  int replaced = 0, here = 0;
  for (int t = 0; t < before.tetrahedron_count(); ++t) {
    auto const was = before.corners(t), is = after.corners(t);
    bool const whole = holds_all(was);
    here += whole ? 1 : 0;
    if (!(edit.is_copy() ? whole && is != was : whole)) {
      if (is != was) report("tetrahedron ", t, " is not at what was divided, but has changed");
      continue;
    }
    is_replaced[static_cast<std::size_t>(t)] = true;
    ++replaced;
    for (int const p : parents) {
      auto part = was;
      std::replace(part.begin(), part.end(), p, n);
      if (p != last)
        expected.push_back(part);
      else if (part != is)
        report("tetrahedron ", t, " has not got vertex ", n, " in the place of ", p, " alone");
    }
  }
  if (replaced == 0 || (edit.is_copy() && replaced == here)) report(replaced, " of ", here, " tetrahedra were replaced");
  for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) appended.push_back(after.corners(t));
  if (!std::is_permutation(appended.begin(), appended.end(), expected.begin(), expected.end()))
    report("the ", appended.size(), " tetrahedra added are not the parts of the ", replaced, " divided");

  int triangles = 0;
  for (int t = 0; t < before.border().triangle_count(); ++t) {
    auto now = before.border().corners(t);
    bool const follows = holds_all(now) && (!edit.is_copy() || is_replaced[static_cast<std::size_t>(before.border_face(t).tetrahedron)]);
    if (follows) std::replace(now.begin(), now.end(), last, n), triangles += edit.parent_count - 1;
    if (after.border().corners(t) != now) report("border triangle ", t, " is not what the edit makes of it");
  }
  int growth = 0;   // of the Euler characteristic
  if (edit.is_copy()) {
    std::vector<std::array<int, 3>> faces;   // at the parent, with two more vertices and whether the copy has it
    std::vector<std::array<int, 2>> edges;
    for (int const t : before.tetrahedra_at(last)) {
      int const side = is_replaced[static_cast<std::size_t>(t)] ? 1 : 0;
      for (int const a : before.corners(t))
        for (int const b : before.corners(t)) {
          if (a == last || b == last || a == b) continue;
          edges.push_back({a, side});
          if (a < b) faces.push_back({a, b, side});
        }
    }
    auto const on_both = [](auto& list) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
      int count = 0;
      for (auto const& entry : list) {
        auto other = entry;
        if (entry.back() == 0) other.back() = 1, count += std::binary_search(list.begin(), list.end(), other) ? 1 : 0;
      }
      return count;
    };
    int const opened = on_both(faces);
    triangles = 2 * opened, growth = 1 - on_both(edges) + opened;
  }
  if (edit.end_triangle - edit.first_triangle != triangles) report(edit.end_triangle - edit.first_triangle, " border triangles were added instead of ", triangles);
  int const is = detail::euler_characteristic(after), was = detail::euler_characteristic(before);
  if (is != was + growth) report("the Euler characteristic is ", is, " instead of ", was + growth);
  return found;
}

}  // namespace palpate::testing
