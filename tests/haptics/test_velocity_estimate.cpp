// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/haptics/velocity_estimate.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

using namespace palpate;

namespace {

constexpr double quantum = 55e-6;
double rounded(double x) { return quantum * std::round(x / quantum); }

/// The estimate along x after a path x(t) of `ticks` positions.
template <class Estimator, class Path>
double estimate(Estimator estimator, Path const& path, int ticks) {
  double v = 0;
  for (int k = 0; k < ticks; ++k) v = double(estimator({static_cast<typename Estimator::Scalar>(path(k * 1e-3)), 0, 0}).x());
  return v;
}

/// The largest estimate of the error alone.
template <class Estimator, class Path>
double largest(Estimator estimator, Path const& path, int ticks, int from, double velocity) {
  double most = 0;
  for (int k = 0; k < ticks; ++k) {
    double const v = estimator({path(k * 1e-3), 0, 0}).x();
    if (k >= from) most = std::max(most, std::abs(v - velocity));
  }
  return most;
}

}  // namespace

// Yardstick: the velocity itself, on a straight way in space.
TEMPLATE_TEST_CASE("C6-S2: constant velocity is found exactly, from the second position on", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Vector3<S> const v(S(0.25), S(-0.5), S(0.125));
  auto const check = [&](auto estimator) {
    CHECK(estimator(Vector3<S>::Zero()) == Vector3<S>::Zero());
    for (int k = 1; k < 60; ++k) {
      INFO(k);
      CHECK((estimator(S(k * 1e-3) * v) - v).norm() < S(k) * S(64) * std::numeric_limits<S>::epsilon());
    }
    estimator.reset();
    CHECK(estimator(Vector3<S>::Ones()) == Vector3<S>::Zero());
  };
  check(BackwardDifference<S>());
  check(BackwardDifference<S, 15>());
  check(WindowedVelocity<S, 2>());
  check(WindowedVelocity<S, 15>());
  check(WindowedVelocity<S, 16>());
  check(AdaptiveWindowVelocity<S>());
}

// Yardstick: by hand. v(t) = a t comes half a window late, and half of a step of the velocity is seen half a window after it.
TEST_CASE("C6-S2: an estimate is half its window late") {
  double const a = 2.0, t = 0.1;
  auto const speeding = [&](double s) { return a * s * s / 2; };
  int const ticks = 101;   // the last position is that of t
  CHECK(estimate(BackwardDifference<double>(), speeding, ticks) == Approx(a * (t - 0.0005)));
  CHECK(estimate(BackwardDifference<double, 15>(), speeding, ticks) == Approx(a * (t - 0.0075)));
  CHECK(estimate(WindowedVelocity<double, 16>(), speeding, ticks) == Approx(a * (t - 0.0075)));
  CHECK(estimate(WindowedVelocity<double, 5>(), speeding, ticks) == Approx(a * (t - 0.002)));
  auto const starting = [](double s) { return 0.2 * std::max(s - 0.05, 0.0); };
  CHECK(estimate(BackwardDifference<double, 14>(), starting, 51 + 7) == Approx(0.1));
  CHECK(estimate(WindowedVelocity<double, 15>(), starting, 51 + 7) == Approx(0.1));
  CHECK(estimate(WindowedVelocity<double, 15>(), starting, 51 + 14) == Approx(0.2));
  CHECK(estimate(WindowedVelocity<double, 15>(), starting, 51) == Approx(0.0).margin(1e-12));
}

// Yardsticks: steps of 55 µm make 55 mm/s over a tick and 3.7 mm/s over 15; the bounds of the headers, met by the worst errors of each sign.
TEST_CASE("C6-S2: what steps of the position make of a slow motion is within the printed bounds, and the bounds are met") {
  auto const at_rest = [](double s) { return rounded(27.5e-6 + 1e-6 * std::sin(400 * s)); };   // between two steps
  CHECK(largest(BackwardDifference<double>(), at_rest, 2000, 1, 0.0) == Approx(0.055).epsilon(1e-9));
  CHECK(largest(BackwardDifference<double, 15>(), at_rest, 2000, 15, 0.0) == Approx(0.0036667).epsilon(1e-4));
  for (double const speed : {0.0007, 0.0123, 0.1011}) {
    auto const slow = [&](double s) { return rounded(speed * s); };
    CAPTURE(speed);
    CHECK(largest(BackwardDifference<double>(), slow, 3000, 1, speed) <= 0.055 * (1 + 1e-9));
    CHECK(largest(BackwardDifference<double, 15>(), slow, 3000, 15, speed) <= 0.0036667 * 1.0001);
    CHECK(largest(WindowedVelocity<double, 15>(), slow, 3000, 15, speed) <= 3 * 27.5e-6 / 0.015 * (1 + 1e-9));
    CHECK(largest(WindowedVelocity<double, 16>(), slow, 3000, 16, speed) <= 3 * 27.5e-6 * 16 / (255 * 0.001) * (1 + 1e-9));
    CHECK(largest(AdaptiveWindowVelocity<double>(), slow, 3000, 16, speed) <= 3 * 27.5e-6 * 16 / (255 * 0.001) * (1 + 1e-9));
  }
  auto const worst = [](int n) {
    return [n](double s) {
      long const k = 2 * std::lround(s * 1000);
      return k < n - 1 ? -27.5e-6 : k == n - 1 ? 0.0 : 27.5e-6;
    };
  };
  CHECK(estimate(WindowedVelocity<double, 15>(), worst(15), 15) == Approx(3 * 27.5e-6 / 0.015));
  CHECK(estimate(WindowedVelocity<double, 16>(), worst(16), 16) == Approx(3 * 27.5e-6 * 16 / (255 * 0.001)));
}

// Yardstick: the variance of the slope of a regression, σ² 12/(T² n (n² − 1)), and 2 σ²/(n − 1)² T² of a difference.
TEST_CASE("of independent errors a best fit leaves less than a difference over the same time") {
  Random random(Seed{4});
  WindowedVelocity<double, 16> fit;
  BackwardDifference<double, 15> difference;
  double const sigma = 1e-5;
  double of_fit = 0, of_difference = 0;
  int const ticks = 200000;
  for (int k = -20; k < ticks; ++k) {
    Vector3<double> const x(sigma * random.normal(), sigma * random.normal(), 0);
    double const a = fit(x).squaredNorm() / 2, b = difference(x).squaredNorm() / 2;
    if (k >= 0) of_fit += a, of_difference += b;
  }
  CHECK(std::sqrt(of_fit / ticks) == Approx(sigma * std::sqrt(12.0 / (16 * 255)) / 1e-3).epsilon(0.03));
  CHECK(std::sqrt(of_difference / ticks) == Approx(sigma * std::sqrt(2.0) / 0.015).epsilon(0.03));
}

// Yardstick: the sagitta of a parabola, a (n T)²/8 at the middle of an even n, a (n² − 1) T²/8 beside that of an odd one.
TEST_CASE("the adaptive window is whole at rest and at constant velocity, and short where the velocity changes") {
  AdaptiveWindowVelocity<double, 32> estimator;
  for (int k = 0; k < 500; ++k) estimator({rounded(27.5e-6 + 1e-6 * std::sin(0.4 * k)), 0, rounded(0.01 + 0.0314 * k * 1e-3)});
  CHECK(estimator.window() == 31);
  for (double const a : {0.5, 3.0, 10.0, 40.0, 1000.0}) {
    AdaptiveWindowVelocity<double, 32> moving;
    Vector3<double> v;
    for (int k = 0; k <= 100; ++k) v = moving({a * k * k * 1e-6 / 2, 0, 0});
    int n = 1;
    while (n < 31 && a * ((n + 1) * (n + 1) - (n + 1) % 2) * 1e-6 / 8 <= quantum) ++n;
    CAPTURE(a, n);
    CHECK(moving.window() == n);
    CHECK(v.x() == Approx(a * (0.1 - n * 0.5e-3)));
  }
  // After 0.2 s of rest a blow: the whole window would still say less than half after 7 ticks.
  AdaptiveWindowVelocity<double> quick;
  WindowedVelocity<double> slow;
  double found = 0, late = 0;
  for (int k = 0; k <= 205; ++k) {
    double const x = rounded(0.5 * 1e-3 * std::max(k - 200, 0));
    found = quick({x, 0, 0}).x(), late = slow({x, 0, 0}).x();
  }
  CHECK(quick.window() <= 5);
  CHECK(found > 0.45);
  CHECK(late < 0.25);
}

// One window for all axes: what shortens it on one does so on all.
TEST_CASE("the adaptive window keeps the direction") {
  AdaptiveWindowVelocity<double> estimator;
  Vector3<double> v;
  for (int k = 0; k <= 50; ++k) v = estimator({8.0 * k * k * 1e-6, 2.0 * k * k * 1e-6, 0});
  CHECK(v.y() / v.x() == Approx(0.25));
  CHECK(estimator.window() < 15);
}

TEST_CASE("a device that does not know its step is estimated with that of the options, whatever device came before") {
  auto const window = [](AdaptiveWindowVelocity<double>& estimator) {
    for (int k = 0; k <= 50; ++k) estimator({8.0 * k * k * 1e-6, 0, 0});
    return estimator.window();
  };
  AdaptiveWindowVelocity<double> estimator({.quantum = 1e-6});
  int const own = window(estimator);
  CHECK(own < 5);
  estimator.begin_session(0.001, 0.01);
  CHECK(window(estimator) == 15);
  estimator.begin_session(0.001, 0.0);
  CHECK(window(estimator) == own);
}

TEST_CASE("a position that is no number begins anew, malformed options are refused, and a tick allocates nothing") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  auto const check = [&](auto estimator) {
    for (int k = 0; k < 20; ++k) estimator({1e-4 * k, 0, 0});
    CHECK(estimator({nan, 0, 0}) == Vector3<double>::Zero());
    CHECK(estimator({5, 0, 0}) == Vector3<double>::Zero());
    CHECK(estimator({5.001, 0, 0}).x() == Approx(1.0));
    palpate_test::AllocationCount const allocations;
    for (int k = 0; k < 100; ++k) estimator({1e-4 * k, 0, 0});
    long const counted = allocations.count();
    CHECK(counted == 0);
  };
  check(BackwardDifference<double, 3>());
  check(WindowedVelocity<double>());
  check(AdaptiveWindowVelocity<double>());
  CHECK_THROWS_WITH(BackwardDifference<double>({.period = 0.0}), says(".period is 0 s", "0.001"));
  CHECK_THROWS_AS(WindowedVelocity<double>({.period = nan}), InvalidArgument);
  CHECK_THROWS_AS(AdaptiveWindowVelocity<double>({.period = -1.0}), InvalidArgument);
  CHECK_THROWS_WITH(AdaptiveWindowVelocity<double>({.quantum = 0.0}), says(".quantum is 0 m", "resolution"));
}
