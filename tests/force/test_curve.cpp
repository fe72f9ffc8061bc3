// SPDX-License-Identifier: MIT
#include <palpate/force/curve.hpp>
#include <palpate/force/network.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

using namespace palpate;

TEMPLATE_TEST_CASE("a network curve is the network inside its range and a bounded tangent outside", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  bool was_negative = false, was_capped = false;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Network<S, 2, 3, 4, 1> const network(Seed{seed});
    S const cap = S(2.5);
    NetworkCurve const curve(network, DepthRange<S>{S(-0.5), S(1.5)}, CurveGuard<S>{.largest_force = cap});
    CHECK(curve.guard().largest_force == cap);
    for (int flag = 0; flag < 2; ++flag) {
      Phase const phase = flag == 0 ? Phase::loading : Phase::unloading;
      for (S depth = S(-0.5); depth <= S(1.5); depth += S(0.125)) REQUIRE(curve(depth, phase) == network(depth, S(flag)));

      // Yardstick: a straight line through the end with the central difference's slope, cut off at 0, or at the end's force below, and at the cap.
      for (S end : {S(-0.5), S(1.5)}) {
        S const step = std::cbrt(std::numeric_limits<S>::epsilon());
        S const slope = (network(end + step, S(flag)) - network(end - step, S(flag))) / (2 * step);
        S const force = network(end, S(flag)), out = end < 0 ? S(-1) : S(1);
        for (S way : {S(0.01), S(0.25), S(1), S(3), S(10)}) {
          S const line = force + slope * out * way;
          was_negative |= line < 0;
          was_capped |= line > cap;
          CHECK(curve(end + out * way, phase) == Approx(std::min(std::max(line, std::min(force, S(0))), cap)).margin(20 * step * step * way));
        }
        // No step at the end.
        CHECK(curve(std::nextafter(end, end + out), phase) == Approx(force).margin(10 * std::numeric_limits<S>::epsilon()));
      }
    }
  }
  CHECK(was_negative);
  CHECK(was_capped);
}

// Yardstick: a network by hand that is the line 2 − 4 d.
TEST_CASE("a network curve without a cap grows without end and stops at zero, and is finite at any depth with one") {
  Network<double, 1, 1>::Layers layers;
  std::get<0>(layers).weights[0][0] = -4.0;
  std::get<0>(layers).bias[0] = 2.0;
  Network<double, 1, 1> const line(layers);
  NetworkCurve const free(line, DepthRange<double>{0.0, 0.25});
  CHECK(free(-10.0) == Approx(42.0));
  CHECK(free(0.375) == Approx(0.5));
  CHECK(free(0.5) == 0.0);
  CHECK(free(100.0) == 0.0);
  NetworkCurve const capped(line, DepthRange<double>{0.0, 0.25}, CurveGuard<double>{.largest_force = 2.0});
  CHECK(capped(-std::numeric_limits<double>::max()) == 2.0);
  CHECK(capped(std::numeric_limits<double>::max()) == 0.0);

  // An end below zero: no further below, and no step.
  NetworkCurve const below(line, DepthRange<double>{0.0, 1.0});
  CHECK(below(1.0) == -2.0);
  CHECK(below(1.5) == -2.0);

  CHECK_THROWS_WITH(NetworkCurve(line, DepthRange<double>{0.0, 0.25}, CurveGuard<double>{.largest_force = 1.5}), says(".largest_force is 1.5 N", "2 N at 0 m", "no less"));
  CHECK_THROWS_AS(NetworkCurve(line, DepthRange<double>{0.0, 0.25}, CurveGuard<double>{.largest_force = std::nan("")}), InvalidArgument);
  std::get<0>(layers).weights[0][0] = 1e308;
  CHECK_THROWS_WITH(NetworkCurve(Network<double, 1, 1>(layers), DepthRange<double>{0.0, 100.0}), says("inf N", "100 m", "finite results"));
}

TEST_CASE("the range of a curve is that of its samples") {
  std::vector<Sample<float, 2, 1>> const samples{{{0.003f, 1.0f}, {0.1f}}, {{0.001f, 0.0f}, {0.2f}}, {{0.002f, 1.0f}, {0.3f}}};
  DepthRange<float> const range = depth_range(samples);
  CHECK(range.low == 0.001f);
  CHECK(range.high == 0.003f);
  CHECK_THROWS_WITH(depth_range(std::vector<Sample<double, 1, 1>>{}), says("no samples", "two depths"));
}

TEST_CASE("a network curve rejects a range without extent") {
  Network<double, 1, 2, 1> const network(Seed{1});
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(NetworkCurve(network, DepthRange<double>{0.0, 0.0}), InvalidArgument);
  CHECK_THROWS_AS(NetworkCurve(network, DepthRange<double>{nan, 1.0}), InvalidArgument);
  CHECK_THROWS_WITH(NetworkCurve(network, DepthRange<double>{0.02, 0.01}), says("the depth range is 0.02 … 0.01 m", "the lower one first"));
}

TEST_CASE("a scaled curve is the curve times the factor") {
  auto const line = [](double depth) noexcept { return 2.0 * depth; };
  auto const loop = [](double depth, Phase phase) noexcept { return phase == Phase::loading ? depth : 0.5 * depth; };
  auto const scaled_line = scaled(line, 3.0);
  auto const scaled_loop = scaled(loop, 4.0);
  STATIC_REQUIRE(DepthCurve<decltype(scaled_line), double>);
  STATIC_REQUIRE_FALSE(HysteresisCurve<decltype(scaled_line), double>);
  STATIC_REQUIRE(HysteresisCurve<decltype(scaled_loop), double>);
  CHECK(scaled_line(0.01) == Approx(0.06));
  CHECK(scaled_loop(0.01, Phase::loading) == Approx(0.04));
  CHECK(scaled_loop(0.01, Phase::unloading) == Approx(0.02));
  CHECK_THROWS_WITH(scaled(line, std::numeric_limits<double>::infinity()), says("the factor is inf", "finite"));
}
