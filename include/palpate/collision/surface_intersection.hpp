// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/detail/own_contours.hpp>
#include <palpate/collision/detail/sided_sets.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/refill.hpp>
#include <palpate/mesh/surface_topology.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {

/// A closed surface as it is now, with a tree that fits it.
template <RealScalar Scalar>
struct MovingSurface {
  SurfaceTopology const& topology;
  SurfaceTree<Scalar> const& tree;
  typename SurfaceTree<Scalar>::Points points;   // 3 × vertices [m]

  template <class Visit>
  void visit_triangles_in_box(Vector3<Scalar> const& low, Vector3<Scalar> const& high, Visit&& visit) const {
    tree.visit_in_box(low, high, visit);
  }
};

/// The volume that two closed surfaces have in common, region by region, and how it changes with each of their vertices.
///
///   SurfaceIntersection<double> common;
///   common.find(MovingSurface<double>{skin_a, tree_a, points_a}, MovingSurface<double>{skin_b, tree_b, points_b});
///   for (auto const& [vertex, gradient] : common.gradient(0)) a.apply_force(vertex, -pressure * gradient);
///
/// Regions    a volume that is enclosed by itself: the parts of both surfaces that contours join.
/// Gradient   ∂V/∂x_i = ∫ N_i n dA over the part of the vertex's surface that is inside the other one, N_i the vertex's linear shape function, n outward.
///            Those of both surfaces add up to nothing, and have no moment: their parts together bound the volume. V = 1/3 Σ x_i·∂V/∂x_i.
/// Moments    ∫ x dV = ½ ∮ (x² n_x, y² n_y, z² n_z) dA, and the border's second moments, are exact too.
/// Method     each pair of triangles that meet has a piece of the contour in common. A part of a triangle is bounded by such pieces and by what of its own edges is
///            inside; its integrals are sums over these, so that it may have any shape, and holes. Whether an edge crosses a triangle is asked in the
///            same order of corners, whichever triangle asks, so that neighbours agree. The second surface is shifted by 1e-11 of the first one's size,
///            or faces in one plane would have no answer.
/// Units      m³, and m² for gradients.
/// Cost       O(vertices of the first, for its box, triangles of the second in there, pairs whose boxes overlap, and facets inside). Allocates until its memory has
///            the size that is needed.
/// Limits     both are closed, turned outwards, and do not cross themselves: not checked; of one that is inside out it is the volume outside the other. A surface
///            that lies within the other without touching it has no contour: nothing is found. Where it lies within and touches
///            only with faces in one plane, there is a contour or none, by the side of the shift.
/// Source     \cite deformable_survey, tissue–tissue collision, from the contour to the facets inside. Ours: exact parts and their integrals.
template <RealScalar Scalar>
class SurfaceIntersection {
  using Place = Vector3<double>;

 public:
  struct VertexGradient {
    int vertex;
    Vector3<Scalar> gradient;   // m²
  };

  /// What they have in common in one place, and where in gradient(0) and gradient(1) its own entries begin and end.
  struct Region {
    double volume = 0;                                                        ///< m³
    Vector3<double> middle = Vector3<double>::Zero();                         ///< m, of the volume
    Matrix<double, 3, 3> spread = Matrix<double, 3, 3>::Zero();               ///< m⁴: ∫ (x − x̄)(x − x̄)ᵀ dA of its border about the border's middle x̄, half of it: a side's
    std::array<std::size_t, 2> begin{}, end{};
  };

  /// A surface has topology, points and visit_triangles_in_box(low, high, visit).
  template <class First, class Second>
  void find(First&& first, Second&& second) {
    clear(), begin(sides_[0], first), begin(sides_[1], second);
    if (first.topology.triangle_count() == 0 || second.topology.triangle_count() == 0) return;
    Vector3<Scalar> const low = first.points.rowwise().minCoeff(), high = first.points.rowwise().maxCoeff();
    reference_ = ((low + high) / 2).template cast<double>();
    shift_ = 1e-11 * static_cast<double>((high - low).norm()) * Place(0.5437, 0.3121, -0.7791);
    // Boxes are those of the surface that is not shifted: they are widened by more than that.
    Scalar const rounding = 4 * std::numeric_limits<Scalar>::epsilon() * low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff();
    Vector3<Scalar> const margin = Vector3<Scalar>::Constant(static_cast<Scalar>(2 * shift_.norm()) + rounding);
    second.visit_triangles_in_box(low - margin, high + margin, [&](int b) {
      auto const c = second.topology.corners(b);
      Vector3<Scalar> const p = second.points.col(c[0]), q = second.points.col(c[1]), r = second.points.col(c[2]);
      first.visit_triangles_in_box(p.cwiseMin(q).cwiseMin(r) - margin, p.cwiseMax(q).cwiseMax(r) + margin, [&](int a) { candidates_.push_back({a, b}); });
    });
    std::sort(candidates_.begin(), candidates_.end());   // sums do not depend on how the trees are fitted
    for (auto const& [a, b] : candidates_) meet(sides_[0], first, a, sides_[1], second, b);
    if (pairs_ == 0) return;
    close(0, first), close(1, second);
    join();
    sum(0, 0, first, Place::Zero()), sum(1, 1, second, shift_);
    finish();
  }

  /// Where a closed surface is in itself: each region has two sheets, which are its sides. near.visit(surface, margin, visit) calls visit(a, b) for all pairs of
  /// triangles that may meet and have no vertex in common, each pair once and in the same order; see NearTriangles. A region counts where presses(a, b) is true of a
  /// pair that crosses; the vertices of others are in held_back(). What is none: a contour that ends somewhere, as at a vertex where a fold is pinched, and a region
  /// whose sheets hang together; see folds(). Where faces are in one plane each vertex is shifted by 1e-10 of the size, its own way.
  template <class Surface, class Near, class Presses>
  void find_own(Surface const& surface, Near& near, Presses const& presses) {
    clear(), begin(sides_[0], surface), sides_[1].triangles.clear(), sides_[1].gradient.clear();
    if (surface.topology.triangle_count() == 0) return;
    Vector3<Scalar> const low = surface.points.rowwise().minCoeff(), high = surface.points.rowwise().maxCoeff();
    reference_ = ((low + high) / 2).template cast<double>();
    double const scatter = 1e-10 * static_cast<double>((high - low).norm());
    Scalar const margin = static_cast<Scalar>(4 * scatter) + 4 * std::numeric_limits<Scalar>::epsilon() * low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff();
    near.visit(surface, margin, [&](int a, int b) { candidates_.push_back({a, b}); });
    meet_itself(surface);
    if (is_degenerate_ || !contours_.find(joints_.size())) {   // as it is, there is no answer
      scatter_ = scatter;
      meet_itself(surface);
      if (!contours_.find(joints_.size())) keep_contours(surface);
    }
    if (pairs_ > 0) close(0, surface), join();
    for (int left = 8; !torn_.empty() && left > 0; --left) {   // a small contour that is no boundary must not end the others
      drop_smallest_of_torn(surface);
      torn_.clear(), regions_.clear();
      if (pairs_ > 0) close(0, surface), join();
    }
    if (pairs_ == 0) return;
    detail::refill(is_apart_, regions_.size(), char{0});
    for (auto const& [a, b] : joints_)
      if (presses(a, b)) is_apart_[at(region_[at(sides_[0].place[at(a)])])] = 1;
    for (int const t : torn_) is_apart_[at(region_[at(sides_[0].place[at(t)])])] = 2;
    folds_ += static_cast<int>(std::count(is_apart_.begin(), is_apart_.end(), 2));
    for (std::size_t n = 0; n < region_.size(); ++n)
      if (char const is = is_apart_[at(region_[n])]; is != 1) {
        region_[n] = -1;
        if (is == 0)
          for (int const vertex : surface.topology.corners(sides_[0].triangles[n])) held_back_.push_back(vertex);
      }
    std::sort(held_back_.begin(), held_back_.end());
    held_back_.erase(std::unique(held_back_.begin(), held_back_.end()), held_back_.end());
    sum(0, 0, surface, Place::Zero()), sum(1, 0, surface, Place::Zero());
    for (Region& one : regions_) {
      Place off = Place::Zero();
      double size = 0;
      for (int side = 0; side < 2; ++side)
        for (auto const& part : gradient(side, one)) off += part.gradient.template cast<double>(), size += static_cast<double>(part.gradient.norm());
      if (off.norm() <= std::max(1e-9, 100.0 * static_cast<double>(std::numeric_limits<Scalar>::epsilon())) * size) continue;   // else rounding tore it
      for (int side = 0; side < 2; ++side) one.end[at(side)] = one.begin[at(side)];
      one.volume = 0, ++folds_;
    }
    finish();
  }

  bool touches() const noexcept { return pairs_ > 0; }
  double volume() const noexcept {
    double sum = 0;
    for (Region const& one : regions_) sum += one.volume;
    return sum;
  }
  /// In the order of the first surface's triangles.
  std::span<Region const> regions() const noexcept { return regions_; }
  /// Of the first surface, 0, or the second: the vertices on which V depends, region by region, ascending in each.
  std::span<VertexGradient const> gradient(int surface) const noexcept { return sides_[at(surface)].gradient; }
  std::span<VertexGradient const> gradient(int surface, Region const& of) const noexcept {
    return gradient(surface).subspan(of.begin[at(surface)], of.end[at(surface)] - of.begin[at(surface)]);
  }
  int pairs() const noexcept { return pairs_; }       ///< triangles that cross each other
  int visited() const noexcept { return visited_; }   ///< pairs that were looked at
  int folds() const noexcept { return folds_; }       ///< places where a surface is in itself whose sheets are not told apart
  std::span<int const> held_back() const noexcept { return held_back_; }   ///< vertices at places where a surface is in itself and does not press, ascending

 private:
  using Uv = std::array<double, 2>;        // weights of a triangle's corners 1 and 2
  using Corners = std::array<Place, 3>;
  struct Crossing {                        // of an edge, from its lower to its higher vertex, with the other surface
    int low, high;
    double share;
    bool enters;
    auto key() const noexcept { return std::tuple(low, high, share); }
  };
  struct Integrals {
    std::array<double, 3> shape{};     // of the corners' shape functions
    std::array<double, 6> products{};  // of pairs of them: 00, 01, 02, 11, 12, 22
    bool is_part = false;              // a piece of its boundary is on it
  };
  static constexpr Integrals whole{.shape = {1.0 / 6, 1.0 / 6, 1.0 / 6}, .products = {1.0 / 12, 1.0 / 24, 1.0 / 24, 1.0 / 12, 1.0 / 24, 1.0 / 12}};
  struct Moments {                     // of a region, from the reference
    Place volume = Place::Zero(), first = Place::Zero();   // ∫ x dV, ∮ x dA
    Matrix<double, 3, 3> second = Matrix<double, 3, 3>::Zero();
    double area = 0;
  };
  struct Side {
    std::vector<Crossing> crossings;
    std::vector<int> triangles, inside;                   // those that count; vertices inside the other surface
    std::vector<int> place;                               // of each triangle among those that count
    std::vector<Integrals> integrals;                     // of each triangle, over its part, per twice its area
    std::vector<std::uint64_t> triangle_stamp, vertex_stamp, outside_stamp;
    std::vector<VertexGradient> gradient;
    std::uint64_t stamp = 0;
  };
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  void clear() noexcept {
    pairs_ = visited_ = folds_ = 0;
    scatter_ = 0, shift_ = Place::Zero();
    regions_.clear(), joints_.clear(), candidates_.clear(), torn_.clear(), contours_.clear(), held_back_.clear();
  }
  template <class Surface>
  static void begin(Side& side, Surface const& surface) {
    auto const triangles = at(surface.topology.triangle_count()), vertices = at(surface.topology.vertex_count());
    if (side.integrals.size() < triangles) side.integrals.resize(triangles), side.triangle_stamp.resize(triangles, 0), side.place.resize(triangles);
    if (side.vertex_stamp.size() < vertices) side.vertex_stamp.resize(vertices, 0), side.outside_stamp.resize(vertices, 0);
    ++side.stamp;
    side.crossings.clear(), side.triangles.clear(), side.inside.clear(), side.gradient.clear();
  }
  static void count(Side& side, int triangle) {
    if (std::exchange(side.triangle_stamp[at(triangle)], side.stamp) == side.stamp) return;
    side.place[at(triangle)] = static_cast<int>(side.triangles.size());
    side.triangles.push_back(triangle), side.integrals[at(triangle)] = {};
  }
  /// Adds a piece of a part's boundary, which goes round it counter-clockwise: the triangle that it makes with corner 0.
  static void add_piece(Side& side, int triangle, Uv const& p, Uv const& q) noexcept {
    double const area = (p[0] * q[1] - p[1] * q[0]) / 6;
    std::array<double, 3> const a{1 - p[0] - p[1], p[0], p[1]}, b{1 - q[0] - q[1], q[0], q[1]}, sum{1 + a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    auto& [shape, products, is_part] = side.integrals[at(triangle)];
    is_part = true;
    for (std::size_t i = 0, n = 0; i < 3; ++i) {
      shape[i] += area * sum[i];
      for (std::size_t j = i; j < 3; ++j, ++n) products[n] += area / 4 * (sum[i] * sum[j] + a[i] * a[j] + b[i] * b[j] + (i == 0 && j == 0 ? 1.0 : 0.0));
    }
  }
  static Uv on_corner(std::size_t k) noexcept { return {k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; }
  static Uv between(std::size_t from, std::size_t to, double share) noexcept {
    Uv const a = on_corner(from), b = on_corner(to);
    return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])};
  }

  /// Six times the volume of a tetrahedron, computed in the order of the numbers of its last corners: the same but for its sign, whoever asks.
  static double across_edge(Place const& low, Place const& high, int i, Place const& p, int j, Place const& q) noexcept {
    return i < j ? (high - low).dot((p - low).cross(q - low)) : -(high - low).dot((q - low).cross(p - low));
  }
  static double above(SurfaceTopology::Corners const& c, Corners const& x, Place const& p) noexcept {
    std::array<std::size_t, 3> order{0, 1, 2};
    bool odd = false;
    for (auto const& [i, j] : {std::pair<std::size_t, std::size_t>{0, 1}, {1, 2}, {0, 1}})
      if (c[order[i]] > c[order[j]]) std::swap(order[i], order[j]), odd = !odd;
    Place const& o = x[order[0]];
    double const value = (p - o).dot((x[order[1]] - o).cross(x[order[2]] - o));
    return odd ? -value : value;
  }

  struct End {   // of a piece of the contour
    Uv on_first, on_second;
    Place place;
    std::array<int, 2> edge;   // that crosses the other triangle
    bool is_of_first;
  };

  /// Where the edges of one triangle cross the other.
  static void cross(Side& side, SurfaceTopology::Corners const& c, Corners const& x, std::array<double, 3> const& height, SurfaceTopology::Corners const& other,
                    Corners const& y, bool is_first, std::array<End, 6>& ends, std::size_t& count) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::size_t const n = (k + 1) % 3, low = c[k] < c[n] ? k : n, high = c[k] < c[n] ? n : k;
      if ((height[low] > 0) == (height[high] > 0)) continue;
      std::array<double, 3> weight;   // of the other's corners
      for (std::size_t j = 0; j < 3; ++j) {
        std::size_t const u = (j + 1) % 3, v = (j + 2) % 3;
        weight[j] = across_edge(x[low], x[high], other[u], y[u], other[v], y[v]);
      }
      bool const positive = weight[0] > 0;
      if ((weight[1] > 0) != positive || (weight[2] > 0) != positive) continue;
      double const sum = weight[0] + weight[1] + weight[2], share = height[low] / (height[low] - height[high]);
      if (!(std::abs(sum) > 0)) continue;
      if (low == k) side.crossings.push_back({c[low], c[high], share, height[low] > 0});
      if (count == 6) return;
      Uv const own = between(low, high, share), there{weight[1] / sum, weight[2] / sum};
      ends[count++] = {is_first ? own : there, is_first ? there : own, Place(x[low] + share * (x[high] - x[low])), {c[low], c[high]}, is_first};
    }
  }

  template <class First, class Second>
  void meet(Side& its, First const& first, int a, Side& others, Second const& second, int b) {
    ++visited_;
    auto const ca = first.topology.corners(a), cb = second.topology.corners(b);
    Corners x, y;
    for (std::size_t k = 0; k < 3; ++k) x[k] = place(first, ca[k], Place::Zero()), y[k] = place(second, cb[k], shift_);
    std::array<double, 3> over_b, over_a;
    for (std::size_t k = 0; k < 3; ++k) over_b[k] = above(cb, y, x[k]);
    if (over_b[0] == 0 && over_b[1] == 0 && over_b[2] == 0) is_degenerate_ = true;
    if ((over_b[0] > 0) == (over_b[1] > 0) && (over_b[1] > 0) == (over_b[2] > 0)) return;
    for (std::size_t k = 0; k < 3; ++k) over_a[k] = above(ca, x, y[k]);
    if ((over_a[0] > 0) == (over_a[1] > 0) && (over_a[1] > 0) == (over_a[2] > 0)) return;
    std::array<End, 6> ends;
    std::size_t n = 0;
    cross(its, ca, x, over_b, cb, y, true, ends, n), cross(others, cb, y, over_a, ca, x, false, ends, n);
    if (n == 0) return;
    ++pairs_;
    count(its, a), count(others, b);
    joints_.push_back({a, b});
    if (&its == &others)
      for (std::size_t k = 0; k < n; ++k) contours_.add(ends[k].edge, ends[k].is_of_first ? b : a, static_cast<int>(joints_.size()) - 1);
    if (n != 2) return void(is_degenerate_ = true);   // by rounding alone
    Place const along = (x[1] - x[0]).cross(x[2] - x[0]).cross((y[1] - y[0]).cross(y[2] - y[0]));
    if ((ends[1].place - ends[0].place).dot(along) < 0) std::swap(ends[0], ends[1]);
    add_piece(its, a, ends[0].on_first, ends[1].on_first);
    add_piece(others, b, ends[1].on_second, ends[0].on_second);
  }
  template <class Surface>
  Place place(Surface const& surface, int vertex, Place const& shift) const {
    Place const exact = Vector3<Scalar>(surface.points.col(vertex)).template cast<double>() - reference_ + shift;
    if (!(scatter_ > 0)) return exact;
    std::uint32_t const mixed = (static_cast<std::uint32_t>(vertex) + 1) * 2654435769U;   // any numbers, other ones for each vertex
    auto const any = [&](std::uint32_t factor) { return static_cast<double>((mixed ^ (mixed >> 15)) * factor) / 4294967296.0 - 0.5; };
    return exact + scatter_ * Place(any(2246822519U), any(3266489917U), any(668265263U));
  }
  template <class Surface>
  void meet_itself(Surface const& surface) {
    begin(sides_[0], surface);
    pairs_ = visited_ = 0, is_degenerate_ = false, joints_.clear(), contours_.clear();
    for (auto const& [a, b] : candidates_) meet(sides_[0], surface, a, sides_[0], surface, b);
  }
  /// Forgets the pairs of contours that are left out.
  template <class Surface>
  void keep_contours(Surface const& surface) {
    folds_ += contours_.left_out();
    candidates_.clear();
    for (std::size_t k = 0; k < joints_.size(); ++k)
      if (!contours_.is_left_out(contours_.of(static_cast<int>(k)))) candidates_.push_back(joints_[k]);
    meet_itself(surface);
  }
  /// Leaves out, of each region whose sheets are not told apart, the contour of fewest pairs.
  template <class Surface>
  void drop_smallest_of_torn(Surface const& surface) {
    auto const region_of = [&](int triangle) { return at(region_[at(sides_[0].place[at(triangle)])]); };
    detail::refill(is_apart_, regions_.size(), char{0});
    for (int const t : torn_) is_apart_[region_of(t)] = 1;
    contours_.find(joints_.size());
    detail::refill(size_, joints_.size(), 0), detail::refill(smallest_, regions_.size(), -1);
    for (std::size_t k = 0; k < joints_.size(); ++k) ++size_[at(contours_.of(static_cast<int>(k)))];
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      std::size_t const region = region_of(joints_[k][0]);
      int const contour = contours_.of(static_cast<int>(k));
      if (int& best = smallest_[region]; is_apart_[region] == 1 && (best < 0 || size_[at(contour)] < size_[at(best)])) best = contour;
    }
    for (int const contour : smallest_)
      if (contour >= 0) contours_.leave_out(contour);
    keep_contours(surface);
  }

  /// The crossings of an edge, in order.
  static std::span<Crossing const> crossings_of(Side const& side, int a, int b) noexcept {
    std::pair const edge{std::min(a, b), std::max(a, b)};
    auto const begin = std::lower_bound(side.crossings.begin(), side.crossings.end(), edge, [](Crossing const& c, auto const& e) { return std::pair(c.low, c.high) < e; });
    auto end = begin;
    while (end != side.crossings.end() && end->low == edge.first && end->high == edge.second) ++end;
    return {begin, end};
  }
  static bool is_inside(Side const& side, int vertex) noexcept { return side.vertex_stamp[at(vertex)] == side.stamp; }
  static bool is_outside(Side const& side, int vertex) noexcept { return side.outside_stamp[at(vertex)] == side.stamp; }

  /// From the contour to what is inside it.
  template <class Surface>
  void close(int which, Surface const& surface) {
    Side& side = sides_[at(which)];
    std::sort(side.crossings.begin(), side.crossings.end(), [](Crossing const& a, Crossing const& b) { return a.key() < b.key(); });
    auto const mark = [&](int vertex) {
      if (std::exchange(side.vertex_stamp[at(vertex)], side.stamp) != side.stamp) side.inside.push_back(vertex);
    };
    for (std::size_t k = 0; k < side.crossings.size(); ++k) {
      Crossing const& one = side.crossings[k];
      auto const same = [&](std::size_t other) { return other < side.crossings.size() && side.crossings[other].low == one.low && side.crossings[other].high == one.high; };
      if (k == 0 || !same(k - 1)) one.enters ? void(side.outside_stamp[at(one.low)] = side.stamp) : mark(one.low);
      if (!same(k + 1)) one.enters ? mark(one.high) : void(side.outside_stamp[at(one.high)] = side.stamp);
    }
    for (int const vertex : side.inside)
      if (is_outside(side, vertex)) torn_.push_back(surface.topology.triangles_at(vertex)[0]);
    for (std::size_t k = 0; k < side.inside.size(); ++k)   // grows
      for (int const t : surface.topology.triangles_at(side.inside[k])) {
        count(side, t);
        for (int const other : surface.topology.corners(t))
          if (other != side.inside[k] && !is_inside(side, other) && crossings_of(side, side.inside[k], other).empty())
            is_outside(side, other) ? torn_.push_back(t) : mark(other);   // it stops where the contour is not whole
      }
    for (int const t : side.triangles) {
      auto const c = surface.topology.corners(t);
      std::array<std::span<Crossing const>, 3> const crossings{crossings_of(side, c[0], c[1]), crossings_of(side, c[1], c[2]), crossings_of(side, c[2], c[0])};
      Integrals& all = side.integrals[at(t)];
      bool const is_whole = !all.is_part && std::ranges::all_of(c, [&](int i) { return is_inside(side, i); }) && std::ranges::all_of(crossings, [](auto const& on) { return on.empty(); });
      if (is_whole)
        all = whole;
      else
        for (std::size_t k = 0; k < 3; ++k) add_edge(side, t, c, crossings[k], k, (k + 1) % 3);
    }
    for (std::size_t k = 0; k < side.inside.size(); ++k) {   // what meets at a vertex inside is of one region
      auto const around = surface.topology.triangles_at(side.inside[k]);
      for (int const t : around) inner_[at(which)].push_back({around[0], t});
    }
  }
  /// Which triangles are of one region, and on which side of it: those of the first surface come before those of the second.
  void join() {
    int const seconds = static_cast<int>(sides_[0].triangles.size()), other = sides_[1].triangles.empty() ? 0 : 1;
    sets_.reset(at(seconds) + sides_[1].triangles.size());
    auto const number = [&](int side, int triangle) { return side * seconds + sides_[at(side)].place[at(triangle)]; };
    for (auto const& [a, b] : joints_)
      if (!sets_.unite(number(0, a), number(other, b), true)) torn_.push_back(a);
    for (int side = 0; side < 2; ++side) {
      for (auto const& [a, b] : inner_[at(side)])
        if (!sets_.unite(number(side, a), number(side, b), false)) torn_.push_back(a);
      inner_[at(side)].clear();
    }
    detail::refill(region_, sets_.size(), -1), detail::refill(is_second_, sets_.size(), false);
    for (int k = 0; k < static_cast<int>(sets_.size()); ++k) {
      auto const [first, is_second] = sets_.of(k);
      if (first == k) region_[at(k)] = static_cast<int>(regions_.size()), regions_.push_back({});
      region_[at(k)] = region_[at(first)], is_second_[at(k)] = is_second;
    }
  }
  /// The parts of a side of all regions, by region and vertex: they are of the surface whose triangles are in sides_[from].
  template <class Surface>
  void sum(int which, int from, Surface const& surface, Place const& shift) {
    Side& side = sides_[at(which)];
    Side const& source = sides_[at(from)];
    moments_.resize(regions_.size());
    parts_.clear();
    for (std::size_t n = 0; n < source.triangles.size(); ++n) {
      std::size_t const k = n + (from == 0 ? 0 : sides_[0].triangles.size());
      if (region_[k] < 0 || is_second_[k] != (which == 1)) continue;
      int const t = source.triangles[n], region = region_[k];
      auto const c = surface.topology.corners(t);
      Corners const x{place(surface, c[0], shift), place(surface, c[1], shift), place(surface, c[2], shift)};
      Place const normal = (x[1] - x[0]).cross(x[2] - x[0]);
      auto const& [shape, products, is_part] = source.integrals[at(t)];
      for (std::size_t j = 0; j < 3; ++j) parts_.push_back({region, c[j], t, shape[j] * normal});
      add_moments(moments_[at(region)], x, normal, shape, products);
    }
    std::sort(parts_.begin(), parts_.end(), [](Part const& a, Part const& b) { return a.key() < b.key(); });
    for (std::size_t k = 0, n = 0; n < regions_.size(); ++n) {
      regions_[n].begin[at(which)] = side.gradient.size();
      while (k < parts_.size() && parts_[k].region == static_cast<int>(n)) {
        Place sum = Place::Zero();
        int const vertex = parts_[k].vertex;
        for (; k < parts_.size() && parts_[k].vertex == vertex && parts_[k].region == static_cast<int>(n); ++k) sum += parts_[k].gradient;
        side.gradient.push_back({vertex, sum.template cast<Scalar>()});
        regions_[n].volume += place(surface, vertex, shift).dot(sum) / 3;
      }
      regions_[n].end[at(which)] = side.gradient.size();
    }
  }
  void finish() {
    for (std::size_t n = 0; n < regions_.size(); ++n) {
      Moments const& of = moments_[n];
      if (regions_[n].volume > 0) regions_[n].middle = of.volume / regions_[n].volume + reference_;
      if (of.area > 0) regions_[n].spread = (of.second - of.first * of.first.transpose() / of.area) / 2;
    }
    moments_.clear();
  }
  static void add_moments(Moments& to, Corners const& x, Place const& normal, std::array<double, 3> const& shape, std::array<double, 6> const& products) noexcept {
    double const twice = normal.norm();
    auto const& p = products;
    Matrix<double, 3, 3> second = x[0] * (p[0] * x[0] + p[1] * x[1] + p[2] * x[2]).transpose();   // per twice the area
    second += x[1] * (p[1] * x[0] + p[3] * x[1] + p[4] * x[2]).transpose();
    second += x[2] * (p[2] * x[0] + p[4] * x[1] + p[5] * x[2]).transpose();
    to.area += twice * (shape[0] + shape[1] + shape[2]), to.first += twice * (shape[0] * x[0] + shape[1] * x[1] + shape[2] * x[2]);
    to.second += twice * second, to.volume += second.diagonal().cwiseProduct(normal) / 2;
  }
  /// What of an edge of a triangle is inside.
  static void add_edge(Side& side, int t, SurfaceTopology::Corners const& c, std::span<Crossing const> crossings, std::size_t from, std::size_t to) {
    std::size_t const low = c[from] < c[to] ? from : to, high = c[from] < c[to] ? to : from;
    if (crossings.empty()) {
      if (is_inside(side, c[from])) add_piece(side, t, on_corner(from), on_corner(to));
      return;
    }
    double begun = 0;
    bool inside = !crossings.front().enters;
    auto const end = [&](double share) {
      Uv const p = between(low, high, begun), q = between(low, high, share);
      low == from ? add_piece(side, t, p, q) : add_piece(side, t, q, p);
    };
    for (Crossing const& one : crossings) {
      if (inside && !one.enters) end(one.share);
      inside = one.enters, begun = one.share;
    }
    if (inside) end(1);
  }

  struct Part {
    int region, vertex, triangle;
    Place gradient;
    auto key() const noexcept { return std::tuple(region, vertex, triangle); }
  };

  std::array<Side, 2> sides_;
  std::vector<Part> parts_;
  Place reference_ = Place::Zero(), shift_ = Place::Zero();   // m; the second surface is shifted
  double scatter_ = 0;                                           // m; each vertex of a surface in itself is, by less
  std::vector<Region> regions_;
  std::vector<Moments> moments_;                                 // of each region
  std::vector<std::array<int, 2>> candidates_, joints_;          // triangles of the two whose boxes overlap, and that cross each other
  std::array<std::vector<std::array<int, 2>>, 2> inner_;         // of one surface that meet inside the other
  detail::SidedSets sets_;                                       // of the triangles that count: regions
  std::vector<int> region_;
  std::vector<bool> is_second_;                                  // on which side of it
  std::vector<int> torn_;                                        // triangles of regions whose sides are not told apart
  detail::OwnContours contours_;
  std::vector<int> held_back_, size_, smallest_;                 // size_: of each contour, its pairs; smallest_: contour of each region
  std::vector<char> is_apart_;                                   // of each region of a surface in itself: 1 it counts, 2 its sheets hang together
  int pairs_ = 0, visited_ = 0, folds_ = 0;
  bool is_degenerate_ = false;                                   // of what has met so far
};

}  // namespace palpate
