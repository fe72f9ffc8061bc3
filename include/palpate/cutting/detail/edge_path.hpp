// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/sparse_table.hpp>
#include <palpate/cutting/detail/blade_way.hpp>
#include <palpate/cutting/detail/border_walk.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate::detail {

/// Visits the particles that share an edge with p, most of them twice.
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

/// Finds the path of mesh edges along the blade's way: the shortest, where what lies beside the way counts more.
///   cost of an edge ab = |ab| (1 + (d_a² + 4 d_m² + d_b²)/s²),   d the distance from the way, m the middle of ab, s the mean edge
/// A vertex farther off the way than its longest edge is not on the path, the goal excepted.
/// Cost       O(m log m), m the vertices beside the way, however large the body is. Allocates when m has grown.
template <RealScalar Scalar>
class EdgePath {
 public:
  using Vector = Vector3<Scalar>;

  /// From one of `starts` to `goal`, both included; false when no path leads there.
  template <class Body>
  bool find(Body const& body, BladeWay<Scalar> const& way, std::span<int const> starts, int goal) {
    seen_.clear(), open_.clear(), settled_.clear(), path_.clear();
    squared_scale_ = body.mean_edge() * body.mean_edge();
    end_ = body.tissue().rest_position(goal);
    for (int const start : starts) {
      Vector const at = body.tissue().rest_position(start);
      reach(seen_[start], start, at, way.squared_distance(at), -1, 0);
    }
    while (!open_.empty()) {
      std::pop_heap(open_.begin(), open_.end());
      int const p = open_.back().particle;
      open_.pop_back();
      if (seen_[p].state == State::settled) continue;
      seen_[p].state = State::settled;
      settled_.push_back(p);
      if (p == goal) {
        trace(goal);
        return true;
      }
      Vector const at = body.tissue().rest_position(p);
      Scalar const off = seen_[p].off, so_far = seen_[p].cost;
      for_each_beside(body, p, [&](int q) {
        Seen& there = seen_[q];
        if (there.state == State::settled || there.state == State::beside || there.from == p) return;
        Vector const to = body.tissue().rest_position(q);
        bool const is_new = there.state == State::unseen;
        Scalar const off_there = is_new ? way.squared_distance(to) : there.off;
        if (is_new && q != goal && off_there > longest_squared(body, q)) {
          there.state = State::beside;
          return;
        }
        reach(there, q, to, off_there, p, so_far + cost(way, at, off, to, off_there));
      });
    }
    return false;
  }

  /// After a search that failed: from one of the starts to where the surface ends on the way to a place; false when it does not. What is left counts
  /// twice, so that the path goes on as far as the surface does.
  template <class Body>
  bool find_border(Body const& body, Vector const& place) {
    int best = -1;
    Scalar best_cost = std::numeric_limits<Scalar>::infinity();
    for (int const p : settled_) {
      if (!is_on_border(body, p) || is_wound_end(body, p)) continue;
      Scalar const whole = seen_[p].cost + 2 * (place - body.tissue().rest_position(p)).norm();
      if (whole < best_cost) best_cost = whole, best = p;
    }
    if (best < 0) return false;
    trace(best);
    return true;
  }

  /// Of the longest edge at a particle [m²].
  template <class Body>
  static Scalar longest_squared(Body const& body, int p) {
    Vector const at = body.tissue().rest_position(p);
    Scalar longest = 0;
    for_each_beside(body, p, [&](int q) { longest = std::max(longest, (body.tissue().rest_position(q) - at).squaredNorm()); });
    return longest;
  }

  std::vector<int> const& particles() const noexcept { return path_; }
  void reverse() { std::reverse(path_.begin(), path_.end()); }

 private:
  enum class State { unseen, beside, reached, settled };
  struct Seen {
    State state = State::unseen;
    int from = -1;
    Scalar cost = 0;
    Scalar off = 0;   // m², from the way
  };
  struct Open {
    Scalar estimate;
    int particle;
    bool operator<(Open const& other) const noexcept {   // the heap's top is the least estimate, then the least index
      return estimate != other.estimate ? estimate > other.estimate : particle > other.particle;
    }
  };

  Scalar cost(BladeWay<Scalar> const& way, Vector const& a, Scalar off_a, Vector const& b, Scalar off_b) const {
    Scalar const off_middle = way.squared_distance(Vector((a + b) / 2));
    return (b - a).norm() * (1 + (off_a + 4 * off_middle + off_b) / squared_scale_);
  }

  void reach(Seen& there, int p, Vector const& at, Scalar off, int from, Scalar cost) {
    if (there.state == State::reached && there.cost <= cost) return;
    there = {State::reached, from, cost, off};
    open_.push_back({cost + (end_ - at).norm(), p});
    std::push_heap(open_.begin(), open_.end());
  }

  void trace(int end) {
    path_.clear();
    for (int p = end; p >= 0; p = seen_[p].from) path_.push_back(p);
    std::reverse(path_.begin(), path_.end());
  }

  SparseTable<Seen> seen_;
  std::vector<Open> open_;
  std::vector<int> settled_, path_;
  Vector end_ = Vector::Zero();
  Scalar squared_scale_ = 1;   // m²
};

}  // namespace palpate::detail
