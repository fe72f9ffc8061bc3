// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/blade_way.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate::detail {

/// Whether one side of an edge is a border or a lip: nothing holds there, nothing is to cut.
template <class Body>
bool is_open_edge(Body const& body, int a, int b) noexcept {
  auto const& surface = body.tissue().surface();
  return surface.triangle_with_edge(a, b) < 0 || surface.triangle_with_edge(b, a) < 0;
}

/// Visits the particles that share an edge with p, some of them twice.
template <class Body, class Visit>
void for_each_beside(Body const& body, int p, Visit visit) {
  auto const& surface = body.tissue().surface();
  for (int const t : surface.triangles_at(p))
    for (int const q : surface.corners(t))
      if (q != p) visit(q);
}

template <class Body>
bool is_beside(Body const& body, int p, int q) noexcept {
  auto const& surface = body.tissue().surface();
  return surface.triangle_with_edge(p, q) >= 0 || surface.triangle_with_edge(q, p) >= 0;
}

template <class Body>
bool is_on_border(Body const& body, int p) {
  bool border = false;
  for_each_beside(body, p, [&](int q) { border = border || is_open_edge(body, p, q); });
  return border;
}

/// Finds the path of mesh edges along the blade's way: the shortest, where what lies beside the way counts more.
///   cost of an edge ab = |ab| (1 + (d_a² + 4 d_m² + d_b²)/s²),   d the distance from the way, m the middle of ab, s the mean edge
/// A vertex farther off the way than 1½ of its longest edge is not on the path, the goal excepted.
/// Cost       O(m log m), m the vertices beside the way. Allocates when the body has grown.
template <RealScalar Scalar>
class EdgePath {
 public:
  using Vector = Vector3<Scalar>;

  /// From one of `starts` to `goal`, both included; false when no path leads there.
  template <class Body>
  bool find(Body const& body, BladeWay<Scalar> const& way, std::span<int const> starts, int goal) {
    begin(body);
    Vector const end = body.tissue().rest_position(goal);
    for (int const start : starts) reach(body, start, -1, 0, end);
    while (!open_.empty()) {
      std::pop_heap(open_.begin(), open_.end());
      int const p = open_.back().particle;
      open_.pop_back();
      if (mark(p) == round_ + 1) continue;
      mark(p) = round_ + 1;
      settled_.push_back(p);
      if (p == goal) {
        trace(goal);
        return true;
      }
      Vector const at = body.tissue().rest_position(p);
      Scalar const off = way.squared_distance(at);
      for_each_beside(body, p, [&](int q) {
        if (mark(q) == round_ + 1) return;
        Vector const to = body.tissue().rest_position(q);
        Scalar const off_there = way.squared_distance(to);
        if (q != goal && mark(q) < round_ && off_there > Scalar(2.25) * longest_squared(body, q)) return;
        reach(body, q, p, cost_[index(p)] + cost(way, at, off, to, off_there), end);
      });
    }
    return false;
  }

  /// After a search that failed: from one of the starts to where the surface ends on the way to a place; false when it does not.
  template <class Body>
  bool find_border(Body const& body, BladeWay<Scalar> const& way, Vector const& place) {
    int best = -1;
    Scalar best_cost = std::numeric_limits<Scalar>::infinity();
    Scalar const off_place = way.squared_distance(place);
    for (int const p : settled_) {
      if (!is_on_border(body, p)) continue;
      Vector const at = body.tissue().rest_position(p);
      Scalar const whole = cost_[index(p)] + cost(way, at, way.squared_distance(at), place, off_place);
      if (whole < best_cost) best_cost = whole, best = p;
    }
    if (best < 0) return false;
    trace(best);
    return true;
  }

  std::vector<int> const& particles() const noexcept { return path_; }
  void reverse() { std::reverse(path_.begin(), path_.end()); }

 private:
  struct Open {
    Scalar estimate;
    int particle;
    bool operator<(Open const& other) const noexcept {   // the heap's top is the least estimate, then the least index
      return estimate != other.estimate ? estimate > other.estimate : particle > other.particle;
    }
  };

  static std::size_t index(int p) noexcept { return static_cast<std::size_t>(p); }
  unsigned& mark(int p) noexcept { return mark_[index(p)]; }
  Scalar cost(BladeWay<Scalar> const& way, Vector const& a, Scalar off_a, Vector const& b, Scalar off_b) const {
    Scalar const off_middle = way.squared_distance(Vector((a + b) / 2));
    return (b - a).norm() * (1 + (off_a + 4 * off_middle + off_b) / squared_scale_);
  }

  template <class Body>
  void begin(Body const& body) {
    std::size_t const n = index(body.size());
    if (mark_.size() < n) mark_.resize(n, 0), cost_.resize(n), from_.resize(n);
    if (round_ > std::numeric_limits<unsigned>::max() - 4) std::fill(mark_.begin(), mark_.end(), 0u), round_ = 0;
    round_ += 2;   // marks: below round_ not seen in this search, round_ reached, round_ + 1 settled
    open_.clear(), settled_.clear(), path_.clear();
    squared_scale_ = body.mean_edge() * body.mean_edge();
  }

  template <class Body>
  void reach(Body const& body, int p, int from, Scalar cost, Vector const& end) {
    if (mark(p) == round_ && cost_[index(p)] <= cost) return;
    mark(p) = round_;
    cost_[index(p)] = cost;
    from_[index(p)] = from;
    open_.push_back({cost + (end - body.tissue().rest_position(p)).norm(), p});
    std::push_heap(open_.begin(), open_.end());
  }

  template <class Body>
  static Scalar longest_squared(Body const& body, int p) {
    Vector const at = body.tissue().rest_position(p);
    Scalar longest = 0;
    for_each_beside(body, p, [&](int q) { longest = std::max(longest, (body.tissue().rest_position(q) - at).squaredNorm()); });
    return longest;
  }

  void trace(int end) {
    path_.clear();
    for (int p = end; p >= 0; p = from_[index(p)]) path_.push_back(p);
    std::reverse(path_.begin(), path_.end());
  }

  std::vector<unsigned> mark_;
  std::vector<Scalar> cost_;
  std::vector<int> from_;
  std::vector<Open> open_;
  std::vector<int> settled_, path_;
  unsigned round_ = 0;
  Scalar squared_scale_ = 1;   // m²
};

}  // namespace palpate::detail
