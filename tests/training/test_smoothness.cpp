// SPDX-License-Identifier: MIT
// Yardsticks: the jerk of minimum-jerk movements, of polynomials and of sines, by hand; the noise of a fit, by hand.
#include "catch.hpp"

#include "device/message.hpp"

#include <palpate/core/random.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/training/smoothness.hpp>

#include <cmath>
#include <numbers>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

Matrix3X<double> reach(double length, double seconds, double rate) {
  auto const path = Trajectory<double>::start({0, 0, 0}).line({0.6 * length, 0, 0.8 * length}, seconds, Pace::minimum_jerk);
  auto const n = static_cast<Eigen::Index>(std::lround(seconds * rate)) + 1;
  Matrix3X<double> points(3, n);
  for (Eigen::Index i = 0; i < n; ++i) points.col(i) = path.at(static_cast<double>(i) / rate).position;
  return points;
}

Matrix3X<double> sine(double amplitude, double frequency, double seconds, double rate) {
  auto const n = static_cast<Eigen::Index>(std::lround(seconds * rate)) + 1;
  Matrix3X<double> points = Matrix3X<double>::Zero(3, n);
  for (Eigen::Index i = 0; i < n; ++i) points(1, i) = amplitude * std::sin(2 * std::numbers::pi * frequency * static_cast<double>(i) / rate);
  return points;
}

}  // namespace

TEST_CASE("a reach of minimum jerk has the jerk 720 L² / T⁵ and the dimensionless jerk 204.8", "[training][smoothness]") {
  for (double const length : {0.02, 0.3})
    for (double const seconds : {0.8, 2.0, 5.0}) {
      Smoothness const found = smoothness(reach(length, seconds, 1000.0), 1000.0);
      CHECK(found.seconds == Approx(seconds));
      CHECK(found.peak_speed == Approx(1.875 * length / seconds).epsilon(1e-3));
      CHECK(found.jerk_integral == Approx(720 * length * length / std::pow(seconds, 5)).epsilon(0.01));
      CHECK(found.dimensionless_jerk == Approx(204.8).epsilon(0.01));
      CHECK(found.log_dimensionless_jerk() == Approx(-std::log(204.8)).margin(0.01));
    }
}

TEST_CASE("the jerk of a polynomial of fourth degree is exact, at the ends too", "[training][smoothness]") {
  // x = t³ − 2 t⁴: x‴ = 6 − 48 t; ∫ from 0 to 1 of (6 − 48 t)² is 36 − 288 + 768.
  Matrix3X<double> points = Matrix3X<double>::Zero(3, 1001);
  for (Eigen::Index i = 0; i < 1001; ++i) {
    double const t = static_cast<double>(i) / 1000.0;
    points(2, i) = 0.25 + t * t * t - 2 * t * t * t * t;
  }
  CHECK(smoothness(points, 1000.0).jerk_integral == Approx(516.0).epsilon(1e-5));   // the trapezium's own error is 2e-6 of it
  CHECK(smoothness(points, 1000.0).peak_speed == Approx(5.0).epsilon(1e-6));   // |3 − 8| at the end
}

TEST_CASE("a tremor that the window lets pass has the jerk a² ω⁶ / 2 a second; a quicker one is smoothed away", "[training][smoothness]") {
  auto const gain = [](double frequency, double window) {
    double const omega = 2 * std::numbers::pi * frequency;
    Smoothness const found = smoothness(sine(1e-3, frequency, 4.0, 1000.0), 1000.0, {.window = window});
    return std::sqrt(found.jerk_integral / 4.0 / (1e-6 * std::pow(omega, 6) / 2));
  };
  CHECK(gain(1.0, 0.1) == Approx(1.0).epsilon(0.01));
  CHECK(gain(5.0, 0.1) == Approx(0.88).epsilon(0.02));
  CHECK(gain(10.0, 0.02) == Approx(0.98).epsilon(0.02));
  CHECK(gain(10.0, 0.1) == Approx(0.56).epsilon(0.02));   // a tremor of a hand is seen with the default
  CHECK(gain(40.0, 0.1) < 0.2);
}

TEST_CASE("rounded positions tell nearly the same smoothness as exact ones, which differences would not", "[training][smoothness]") {
  Matrix3X<double> const exact = reach(0.1, 1.5, 1000.0);
  Matrix3X<double> rounded = exact;
  for (double& x : rounded.reshaped()) x = std::round(x / 2e-5) * 2e-5;   // 0.02 mm, the step of a Touch
  double const difference = smoothness(rounded, 1000.0).log_dimensionless_jerk() - smoothness(exact, 1000.0).log_dimensionless_jerk();
  CHECK(std::abs(difference) < 0.5);
  double crude = 0;
  for (Eigen::Index i = 3; i < rounded.cols(); ++i)
    crude += ((rounded.col(i) - 3 * rounded.col(i - 1) + 3 * rounded.col(i - 2) - rounded.col(i - 3)) * 1e9).squaredNorm() / 1000.0;
  CHECK(crude > 1e6 * smoothness(exact, 1000.0).jerk_integral);
}

TEST_CASE("noise becomes as much jerk as the comment says", "[training][smoothness]") {
  Random random(Seed{3});
  Matrix3X<double> points = Matrix3X<double>::Zero(3, 60'000);
  for (double& x : points.row(0).reshaped()) x = 1e-6 * random.normal();
  double const expected = 6 * std::sqrt(2800.0) * 1e-6 / (std::pow(101.0, 3.5) * 1e-9);
  Smoothness const found = smoothness(points, 1000.0);
  CHECK(std::sqrt(found.jerk_integral / found.seconds) == Approx(expected).epsilon(0.05));
  CHECK(expected == Approx(0.03).epsilon(0.05));
}

TEST_CASE("what does not move is as smooth as can be, and too little is refused", "[training][smoothness]") {
  Matrix3X<double> const still = Matrix3X<double>::Constant(3, 50, 0.3);
  CHECK(smoothness(still, 1000.0).dimensionless_jerk == 0.0);
  CHECK(smoothness(still, 1000.0).log_dimensionless_jerk() == 0.0);
  CHECK(smoothness(reach(0.1, 0.02, 1000.0), 1000.0).dimensionless_jerk > 0.0);   // shorter than the window
  CHECK(unsaid(message_of([&] { smoothness(still.leftCols(6), 1000.0); }), "smoothness: there are 6 points; give 7 or more") == "");
  CHECK(unsaid(message_of([&] { smoothness(still, 0.0); }), "the rate is 0 Hz") == "");
  CHECK(unsaid(message_of([&] { smoothness(still, 1000.0, {.window = -1.0}); }), ".window is -1 s") == "");
}
