// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <cmath>
#include <numbers>

namespace palpate {

namespace detail {

/// P(|t| < x) of Student's distribution with a whole number of degrees of freedom: the finite sums of \cite abramowitz1964 26.7.3 and 26.7.4.
inline double student_probability(double x, int freedom) noexcept {
  double const angle = std::atan(x / std::sqrt(static_cast<double>(freedom)));
  double const cosine = std::cos(angle), square = cosine * cosine;
  if (freedom % 2 == 1) {
    double term = cosine, sum = freedom > 1 ? cosine : 0.0;
    for (int k = 3; k <= freedom - 2; k += 2) sum += term *= square * (k - 1) / k;
    return 2.0 / std::numbers::pi * (angle + std::sin(angle) * sum);
  }
  double term = 1.0, sum = 1.0;
  for (int k = 2; k <= freedom - 2; k += 2) sum += term *= square * (k - 1) / k;
  return std::sin(angle) * sum;
}

}  // namespace detail

/// How many standard errors to either side hold a mean with this probability, when the standard error is estimated from the same data:
/// P(|t| < result) = confidence for Student's t. With 95 % and many degrees of freedom 1.96.
/// Errors     InvalidArgument unless 0 < confidence < 1 and freedom ≥ 1.
inline double student_quantile(double confidence, int freedom) {
  if (!(confidence > 0.0 && confidence < 1.0))
    throw InvalidArgument(detail::message("student_quantile: the confidence is ", confidence, "; give a share between 0 and 1, for example 0.95"));
  if (freedom < 1) throw InvalidArgument(detail::message("student_quantile: there are ", freedom, " degrees of freedom; give one or more"));
  int const counted = freedom < 2000 ? freedom : 2000;   // beyond, the quantile changes by less than 1e-3 of itself
  double low = 0.0, high = 2.0;
  while (detail::student_probability(high, counted) < confidence && high < 1e9) high *= 2.0;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    double const middle = low + (high - low) / 2.0;
    (detail::student_probability(middle, counted) < confidence ? low : high) = middle;
  }
  return low + (high - low) / 2.0;
}

}  // namespace palpate
