// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

struct SmoothnessOptions {
  double window = 0.1;   ///< s, over which derivatives are fitted; of a jerk at 1/window [Hz], 10 Hz here, 56 % is left, at half that 88 %
};

/// How smooth a movement was.
///   dimensionless_jerk = T³ / v_peak² ∫ |x‴|² dt, smaller is smoother; −ln of it is the log dimensionless jerk
///   A single reach of minimum jerk has 204.8 (\cite flash1985: ∫ = 720 L²/T⁵, v_peak = 15/8 L/T), and nothing is smoother.
struct Smoothness {
  double seconds = 0.0;              ///< T
  double peak_speed = 0.0;           ///< m/s
  double jerk_integral = 0.0;        ///< m²/s⁵, ∫ |x‴|² dt
  double dimensionless_jerk = 0.0;   ///< 0 where nothing moved

  double log_dimensionless_jerk() const noexcept { return dimensionless_jerk > 0.0 ? -std::log(dimensionless_jerk) : 0.0; }
};

namespace detail {

/// The least-squares polynomial of fourth degree through values at x = −1 … 1, 2 half + 1 of them evenly: column k holds what each value adds to the
/// coefficient of xᵏ. By columns made square to those before (modified Gram and Schmidt): P = Q R, P⁺ = R⁻¹ Qᵀ.
inline Matrix<double, Dynamic, 5> quartic_fit(Eigen::Index half) {
  Eigen::Index const width = 2 * half + 1;
  Matrix<double, Dynamic, 5> q(width, 5);
  for (Eigen::Index k = 0; k < width; ++k)
    for (Eigen::Index power = 0; power < 5; ++power)
      q(k, power) = std::pow(static_cast<double>(k - half) / static_cast<double>(half), static_cast<double>(power));
  Matrix<double, 5, 5> r = Matrix<double, 5, 5>::Zero();
  for (Eigen::Index j = 0; j < 5; ++j) {
    for (Eigen::Index i = 0; i < j; ++i) {
      r(i, j) = q.col(i).dot(q.col(j));
      q.col(j) -= r(i, j) * q.col(i);
    }
    r(j, j) = q.col(j).norm();
    q.col(j) /= r(j, j);
  }
  for (Eigen::Index j = 4; j >= 0; --j) {   // back substitution
    for (Eigen::Index i = j + 1; i < 5; ++i) q.col(j) -= r(j, i) * q.col(i);
    q.col(j) /= r(j, j);
  }
  return q;
}

}  // namespace detail

/// Smoothness of a path at `rate` points a second. Positions are sampled and rounded, and a third difference of 1 kHz multiplies a rounding by
/// 10⁹: derivatives are those of the polynomial of fourth degree fitted to the points of a window, at its middle; the first and the last
/// window serve half of it more. Position noise of rms σ leaves a jerk of 6 √2800 σ / (n^3.5 h³)
/// for n points h apart: 0.03 m/s³ per µm with 0.1 s at 1 kHz.
/// Units      points 3 × n [m].
/// Source     \cite balasubramanian2012 for the measure, \cite savitzky1964 for the fit
/// Errors     `InvalidArgument` for fewer than 7 points, and a rate or window that is not positive. A window shorter than 7 points is
///            taken as 7, one longer than the path as the path.
/// Cost       O(n · points a window).
inline Smoothness smoothness(Matrix3X<double> const& points, double rate, SmoothnessOptions const& options = {}) {
  using Index = Eigen::Index;
  if (!(rate > 0.0) || !std::isfinite(rate)) throw InvalidArgument(detail::message("smoothness: the rate is ", rate, " Hz; give a positive one"));
  detail::OptionCheck{"smoothness", true}(options.window > 0.0, ".window", options.window, " s", "give a positive time, for example 0.1");
  if (points.cols() < 7) throw InvalidArgument(detail::message("smoothness: there are ", points.cols(), " points; give 7 or more"));

  Index const most = (points.cols() - 1) / 2;
  Index const half = std::clamp(static_cast<Index>(std::lround(std::min(0.5 * options.window * rate, 1e9))), Index(3), most);
  Index const width = 2 * half + 1;
  double const unit = static_cast<double>(half) / rate;   // s, from the middle of a window to its end
  Matrix<double, Dynamic, 5> const fit = detail::quartic_fit(half);

  Smoothness result;
  result.seconds = static_cast<double>(points.cols() - 1) / rate;
  for (Index i = 0; i < points.cols(); ++i) {
    Index const middle = std::clamp(i, half, points.cols() - 1 - half);
    double const x = static_cast<double>(i - middle) / static_cast<double>(half);
    Eigen::VectorXd const first = fit.col(1) + 2.0 * x * fit.col(2) + 3.0 * x * x * fit.col(3) + 4.0 * x * x * x * fit.col(4);
    Eigen::VectorXd const third = 6.0 * fit.col(3) + 24.0 * x * fit.col(4);
    auto const window = points.middleCols(middle - half, width);
    Vector3<double> const velocity = window * first / unit;
    Vector3<double> const jerk = window * third / (unit * unit * unit);
    bool const end = i == 0 || i + 1 == points.cols();
    result.peak_speed = std::max(result.peak_speed, velocity.norm());
    result.jerk_integral += (end ? 0.5 : 1.0) * jerk.squaredNorm() / rate;
  }
  if (points.colwise().operator-(points.col(0)).isZero(0.0)) return {.seconds = result.seconds};
  double const cubed = result.seconds * result.seconds * result.seconds;
  result.dimensionless_jerk = cubed * result.jerk_integral / (result.peak_speed * result.peak_speed);
  return result;
}

}  // namespace palpate
