// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/material_blade.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate::detail {

/// Where an edge of the undeformed solid goes through what a blade has swept.
struct SweepCrossing {
  double s;                 // from the first end to the second
  double time;              // 0 … 1 of the sweep
  Vector3<double> normal;   // of the sheet there, unit: along the blade × its way
};

/// What a blade, a chain of material points, sweeps from one tick to the next: quadrilaterals between neighbouring points, each of two triangles. An edge that
/// goes through the seam of two is seen by exactly one: both ask for the same sign of the same number.
class BladeSweep {
 public:
  /// `reaches` is memory for it, kept from tick to tick.
  BladeSweep(std::span<MaterialPoint const> before, std::span<MaterialPoint const> now, std::vector<std::array<double, 2>>& reaches)
      : before_(before), now_(now), reaches_(reaches), along_(now.back().at - now.front().at) {
    reaches_.clear();
    for (std::size_t i = 0; i + 1 < now_.size(); ++i) {
      auto const [low, high] = std::minmax({along_.dot(point(2 * i)), along_.dot(point(2 * i + 1)), along_.dot(point(2 * i + 2)), along_.dot(point(2 * i + 3))});
      reaches_.push_back({low, high});
    }
  }

  /// Whether a tetrahedron may meet it, by box and by side.
  bool may_meet(std::array<Vector3<double>, 4> const& corners, double margin) const noexcept {
    Vector3<double> low = corners[0], high = corners[0];
    for (auto const& corner : corners) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
    low.array() -= margin, high.array() += margin;
    auto const [first, last] = std::minmax({along_.dot(corners[0]), along_.dot(corners[1]), along_.dot(corners[2]), along_.dot(corners[3])});
    double const more = margin * along_.norm();
    for (std::size_t i = 0; i + 1 < now_.size(); ++i) {
      if (!(reaches_[i][0] <= last + more && first - more <= reaches_[i][1])) continue;
      std::array const own{point(2 * i), point(2 * i + 1), point(2 * i + 2), point(2 * i + 3)};
      Vector3<double> own_low = own[0], own_high = own[0];
      for (auto const& p : own) own_low = own_low.cwiseMin(p), own_high = own_high.cwiseMax(p);
      if ((own_low.array() <= high.array()).all() && (low.array() <= own_high.array()).all() && straddle(own, corners, margin)) return true;
    }
    return false;
  }

  /// Calls visit(crossing) for each place where the edge from a to b goes through.
  template <class Visit>
  void for_each_crossing(Vector3<double> const& a, Vector3<double> const& b, Visit const& visit) const {
    auto const [first, last] = std::minmax({along_.dot(a), along_.dot(b)});
    double const more = 1e-9 * (std::abs(first) + std::abs(last));
    for (std::size_t i = 0; i + 1 < now_.size(); ++i) {
      if (!(reaches_[i][0] <= last + more && first - more <= reaches_[i][1])) continue;
      // before: 2 i, 2 i + 2; now: 2 i + 1, 2 i + 3
      cross({2 * i, 2 * i + 2, 2 * i + 3}, a, b, visit);
      cross({2 * i, 2 * i + 3, 2 * i + 1}, a, b, visit);
    }
  }

 private:
  Vector3<double> const& point(std::size_t n) const noexcept { return n % 2 == 0 ? before_[n / 2].at : now_[n / 2].at; }

  /// Not all corners are on one side of the quadrilateral, as far as that is flat.
  static bool straddle(std::array<Vector3<double>, 4> const& own, std::array<Vector3<double>, 4> const& corners, double margin) noexcept {
    Vector3<double> const normal = (own[3] - own[0]).cross(own[2] - own[1]);
    double const length = normal.norm();
    if (!(length > 0)) return true;
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, own_lowest = lowest, own_highest = highest;
    for (auto const& p : corners) lowest = std::min(lowest, normal.dot(p) / length), highest = std::max(highest, normal.dot(p) / length);
    for (auto const& p : own) own_lowest = std::min(own_lowest, normal.dot(p) / length), own_highest = std::max(own_highest, normal.dot(p) / length);
    return lowest <= own_highest + margin && own_lowest - margin <= highest;
  }

  /// Whether (b − a) · (p − a) × (q − a) is positive, zero included; the other way round, whether it is not.
  bool turns(Vector3<double> const& a, Vector3<double> const& b, std::size_t p, std::size_t q) const noexcept {
    if (p > q) return !turns(a, b, q, p);
    return (b - a).dot((point(p) - a).cross(point(q) - a)) >= 0;
  }

  template <class Visit>
  void cross(std::array<std::size_t, 3> const& n, Vector3<double> const& a, Vector3<double> const& b, Visit const& visit) const {
    bool const first = turns(a, b, n[0], n[1]);
    if (turns(a, b, n[1], n[2]) != first || turns(a, b, n[2], n[0]) != first) return;
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
    double const time = (n[2] % 2 == 1 ? second : 0) + (n[1] % 2 == 1 ? one : 0);
    visit(SweepCrossing{s, std::clamp(time, 0.0, 1.0), normal});
  }

  std::span<MaterialPoint const> before_, now_;
  std::vector<std::array<double, 2>>& reaches_;   // of each quadrilateral along the blade, from and to
  Vector3<double> along_;
};

}  // namespace palpate::detail
