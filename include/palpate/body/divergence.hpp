// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_view.hpp>

#include <cmath>
#include <limits>

namespace palpate {

/// A particle that left its body.
template <class Scalar>
struct Divergence {
  int particle = -1;    // −1: none that stands out
  Scalar value = 0;     // the coordinate [m] or velocity [m/s] that is out of bounds, NaN included
};

/// The coordinate of x that is not within `bound` of the origin, or else the component of v that is not finite.
template <RealScalar Scalar, class X, class V>
Scalar diverged_value(X const& x, V const& v, Scalar bound) noexcept {
  for (int k = 0; k < 3; ++k)
    if (!(std::abs(x[k]) < bound)) return x[k];
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(v[k])) return v[k];
  return 0;
}

/// The first column that is farther than `bound` [m] from the origin or has a velocity that is not finite.
template <RealScalar Scalar>
Divergence<Scalar> find_diverged(StridedView<Scalar> const& x, StridedView<Scalar> const& v, Scalar bound) noexcept {
  if (padded_view(x).squaredNorm() < bound * bound && padded_view(v).squaredNorm() <= std::numeric_limits<Scalar>::max()) return {};   // no NaN passes
  for (int i = 0; i < x.cols(); ++i)
    for (int k = 0; k < 3; ++k)
      if (!(std::abs(x(k, i)) < bound) || !std::isfinite(v(k, i))) return {i, diverged_value<Scalar>(x.col(i), v.col(i), bound)};
  return {};
}

}  // namespace palpate
