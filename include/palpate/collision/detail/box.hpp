// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
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
  void add(Box const& other) noexcept {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  Scalar perimeter() const noexcept { return (high - low).cwiseMax(Scalar(0)).sum(); }
};

}  // namespace palpate::detail
