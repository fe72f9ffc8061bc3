// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate::detail {

/// An axis-aligned box. Made empty; a coordinate that is not a number does not extend it.
template <RealScalar Scalar>
struct Box {
  Vector3<Scalar> low = Vector3<Scalar>::Constant(std::numeric_limits<Scalar>::infinity());
  Vector3<Scalar> high = Vector3<Scalar>::Constant(-std::numeric_limits<Scalar>::infinity());

  template <class Point>
  void add(Point const& point) noexcept {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k]);   // in this order NaN loses
      high[k] = std::max(high[k], point[k]);
    }
  }
  /// A triangle at once: shorter chains of dependent operations than corner by corner. When the first corner is not a number, the
  /// triangle may be left out.
  template <class Point>
  void add(Point const& a, Point const& b, Point const& c) noexcept {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], std::min(std::min(a[k], b[k]), c[k]));
      high[k] = std::max(high[k], std::max(std::max(a[k], b[k]), c[k]));
    }
  }
  bool overlaps(Box const& other) const noexcept {
    for (int k = 0; k < 3; ++k)
      if (!(low[k] <= other.high[k] && other.low[k] <= high[k])) return false;
    return true;
  }
  /// Whether the straight way between two points may meet it.
  bool may_meet(Vector3<Scalar> const& from, Vector3<Scalar> const& to) const noexcept {
    Scalar begin = 0, end = 1;
    for (int k = 0; k < 3; ++k) {
      Scalar const way = to[k] - from[k];
      if (!(std::abs(way) > 0)) {
        if (from[k] < low[k] || from[k] > high[k]) return false;
        continue;
      }
      Scalar const one = (low[k] - from[k]) / way, two = (high[k] - from[k]) / way;
      begin = std::max(begin, std::min(one, two)), end = std::min(end, std::max(one, two));
    }
    return begin <= end * (1 + 16 * std::numeric_limits<Scalar>::epsilon()) + 16 * std::numeric_limits<Scalar>::epsilon();
  }
  bool operator==(Box const& other) const noexcept { return low == other.low && high == other.high; }
  Scalar perimeter() const noexcept { return (high - low).sum(); }
};

}  // namespace palpate::detail
