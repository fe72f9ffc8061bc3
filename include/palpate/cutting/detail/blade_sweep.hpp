// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Where an edge goes through what a blade has swept.
struct SweepCrossing {
  double s;                 // from the first end to the second
  double time;              // up to 1, the end of the sweep
  Vector3<double> normal;   // of the sheet there, unit: along the blade × its way
};

/// One quadrilateral of a sweep, between two neighbouring points of the blade.
struct SweptQuadrilateral {
  std::array<double, 2> along;            // reach along the blade
  std::array<double, 2> across, on;       // reach along the normal, and along the blade's way
  Vector3<double> low, high;              // its box
  Vector3<double> normal, way;            // unit; zero where the quadrilateral has no area
};

/// What a blade, a chain of points, sweeps from one place to the next: quadrilaterals between neighbouring points, each of two triangles. An edge that goes through
/// the seam of two is seen by exactly one: both ask for the same sign of the same number.
class BladeSweep {
 public:
  /// As many points before as now, which is time 1, and the times before; `memory` is kept from tick to tick.
  BladeSweep(std::span<Vector3<double> const> before, std::span<double const> times, std::span<Vector3<double> const> now, std::vector<SweptQuadrilateral>& memory)
      : before_(before), now_(now), times_(times), quadrilaterals_(memory), along_(now.back() - now.front()) {
    quadrilaterals_.clear();
    for (std::size_t i = 0; i + 1 < now_.size(); ++i) {
      SweptQuadrilateral& q = quadrilaterals_.emplace_back();
      std::array const corners{point(2 * i), point(2 * i + 1), point(2 * i + 2), point(2 * i + 3)};
      q.along = reach(along_, corners);
      q.low = q.high = corners[0];
      for (auto const& p : corners) q.low = q.low.cwiseMin(p), q.high = q.high.cwiseMax(p);
      q.normal = (corners[3] - corners[0]).cross(corners[2] - corners[1]);
      double const length = q.normal.norm();
      if (length > 0) q.normal /= length;
      q.across = reach(q.normal, corners);
      q.way = q.normal.cross(along_.normalized());
      q.on = reach(q.way, corners);
      is_monotone_ = is_monotone_ && (i == 0 || (quadrilaterals_[i - 1].along[0] <= q.along[0] && quadrilaterals_[i - 1].along[1] <= q.along[1]));
    }
  }

  std::span<SweptQuadrilateral const> quadrilaterals() const noexcept { return quadrilaterals_; }

  /// Whether a tetrahedron may meet it, by box and by side.
  bool may_meet(std::array<Vector3<double>, 4> const& corners, double margin) const noexcept {
    auto const [first, last] = reach(along_, corners);
    Vector3<double> low = corners[0], high = corners[0];
    for (auto const& corner : corners) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
    low.array() -= margin, high.array() += margin;
    double const more = margin * along_.norm();
    auto const [begin, end] = range(first - more, last + more);
    for (std::size_t i = begin; i < end; ++i) {
      SweptQuadrilateral const& q = quadrilaterals_[i];
      if (!(q.along[0] <= last + more && first - more <= q.along[1])) continue;
      if (!((q.low.array() <= high.array()).all() && (low.array() <= q.high.array()).all())) continue;
      auto const [lowest, highest] = reach(q.normal, corners);   // zero without area
      if (!(lowest <= q.across[1] + margin && q.across[0] - margin <= highest)) continue;
      auto const [nearest, farthest] = reach(q.way, corners);
      if (nearest <= q.on[1] + margin && q.on[0] - margin <= farthest) return true;
    }
    return false;
  }

  /// Calls visit(crossing) for each place where the edge from a to b goes through.
  template <class Visit>
  void for_each_crossing(Vector3<double> const& a, Vector3<double> const& b, Visit const& visit) const {
    double const from = along_.dot(a), to = along_.dot(b), first = std::min(from, to), last = std::max(from, to);
    double const more = 1e-9 * (std::abs(first) + std::abs(last));
    auto const [begin, end] = range(first - more, last + more);
    for (std::size_t i = begin; i < end; ++i) {
      SweptQuadrilateral const& q = quadrilaterals_[i];
      if (!(q.along[0] <= last + more && first - more <= q.along[1])) continue;
      double const below = q.normal.dot(a), above = q.normal.dot(b), margin = 1e-9 * (std::abs(below) + std::abs(above));
      if (!(std::min(below, above) <= q.across[1] + margin && q.across[0] - margin <= std::max(below, above))) continue;
      double const near = q.way.dot(a), far = q.way.dot(b), more_on = 1e-9 * (std::abs(near) + std::abs(far));
      if (!(std::min(near, far) <= q.on[1] + more_on && q.on[0] - more_on <= std::max(near, far))) continue;
      // before: 2 i, 2 i + 2; now: 2 i + 1, 2 i + 3. The sides along the blade are asked for first: most edges are beyond both.
      bool const diagonal = turns(a, b, 2 * i, 2 * i + 3);
      if (turns(a, b, 2 * i, 2 * i + 2) != diagonal && turns(a, b, 2 * i + 2, 2 * i + 3) != diagonal) cross({2 * i, 2 * i + 2, 2 * i + 3}, a, b, visit);
      if (turns(a, b, 2 * i + 1, 2 * i + 3) != diagonal && turns(a, b, 2 * i, 2 * i + 1) != diagonal) cross({2 * i, 2 * i + 3, 2 * i + 1}, a, b, visit);
    }
  }

 private:
  Vector3<double> const& point(std::size_t n) const noexcept { return n % 2 == 0 ? before_[n / 2] : now_[n / 2]; }

  static std::array<double, 2> reach(Vector3<double> const& direction, std::array<Vector3<double>, 4> const& points) noexcept {
    double const a = direction.dot(points[0]), b = direction.dot(points[1]), c = direction.dot(points[2]), d = direction.dot(points[3]);
    return {std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d))};
  }
  /// Which quadrilaterals may reach from `first` to `last` along the blade.
  std::pair<std::size_t, std::size_t> range(double first, double last) const noexcept {
    std::size_t const count = quadrilaterals_.size();
    if (!is_monotone_) return {0, count};
    double const from = quadrilaterals_.front().along[0], reach = quadrilaterals_.back().along[1] - from;   // a straight blade's are equally long
    double const guess = reach > 0 ? std::clamp((first - from) / reach, 0.0, 1.0) * static_cast<double>(count) : 0;
    std::size_t begin = std::min(static_cast<std::size_t>(guess), count);
    while (begin > 0 && quadrilaterals_[begin - 1].along[1] >= first) --begin;
    while (begin < count && quadrilaterals_[begin].along[1] < first) ++begin;
    std::size_t end = begin;
    while (end < count && quadrilaterals_[end].along[0] <= last) ++end;
    return {begin, end};
  }

  /// Whether (b − a) · (p − a) × (q − a) is positive, zero included; the other way round, whether it is not.
  bool turns(Vector3<double> const& a, Vector3<double> const& b, std::size_t p, std::size_t q) const noexcept {
    if (p > q) return !turns(a, b, q, p);
    return (b - a).dot((point(p) - a).cross(point(q) - a)) >= 0;
  }

  /// Of an edge whose line goes through the triangle.
  template <class Visit>
  void cross(std::array<std::size_t, 3> const& n, Vector3<double> const& a, Vector3<double> const& b, Visit const& visit) const {
    Vector3<double> const &p = point(n[0]), u = point(n[1]) - p, v = point(n[2]) - p;
    Vector3<double> normal = u.cross(v);
    double const length = normal.norm();
    if (!(length > 1e-12 * (u.squaredNorm() + v.squaredNorm()))) return;
    normal /= length;
    double const above = normal.dot(a - p), beyond = normal.dot(b - p);
    double const digits = 1e-10 * (b - a).norm();
    bool const from_sheet = std::abs(above) <= digits, to_sheet = std::abs(beyond) <= digits;   // where a vertex lies in it, rounding says on which side
    if (from_sheet == to_sheet && (from_sheet || (above >= 0) == (beyond >= 0))) return;
    double const s = from_sheet ? 0 : to_sheet ? 1 : above / (above - beyond);
    Vector3<double> const hit = a + s * (b - a) - p;
    double const second = u.cross(hit).dot(normal) / length, one = hit.cross(v).dot(normal) / length;   // weights of n[2] and n[1]
    auto const time = [&](std::size_t k) { return k % 2 == 1 ? 1.0 : times_[k / 2]; };
    visit(SweepCrossing{s, std::min(1.0, (1 - one - second) * time(n[0]) + one * time(n[1]) + second * time(n[2])), normal});
  }

  std::span<Vector3<double> const> before_, now_;
  std::span<double const> times_;
  std::vector<SweptQuadrilateral>& quadrilaterals_;
  Vector3<double> along_;
  bool is_monotone_ = true;
};

}  // namespace palpate::detail
