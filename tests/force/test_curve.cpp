// SPDX-License-Identifier: MIT
#include <palpate/force/curve.hpp>

#include "catch.hpp"

#include <cmath>
#include <limits>

using namespace palpate;

TEMPLATE_TEST_CASE("a network curve is the network inside its range and a tangent outside", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Network<S, 2, 3, 4, 1> const network(Seed{3});
  NetworkCurve const curve(network, DepthRange<S>{S(-0.5), S(1.5)});
  for (int flag = 0; flag < 2; ++flag) {
    Phase const phase = flag == 0 ? Phase::loading : Phase::unloading;
    for (S depth = S(-0.5); depth <= S(1.5); depth += S(0.125)) CHECK(curve(depth, phase) == network(depth, S(flag)));

    // Yardstick: a straight line through the end with the central difference's slope, and that the line is straight.
    for (S end : {S(-0.5), S(1.5)}) {
      S const step = std::cbrt(std::numeric_limits<S>::epsilon());
      S const slope = (network(end + step, S(flag)) - network(end - step, S(flag))) / (2 * step);
      S const out = end < 0 ? S(-1) : S(1);
      CHECK(curve(end + out, phase) == Approx(network(end, S(flag)) + slope * out).margin(20 * step * step));
      CHECK(curve(end + 3 * out, phase) - curve(end + 2 * out, phase) ==
            Approx(curve(end + 2 * out, phase) - curve(end + out, phase)).margin(100 * std::numeric_limits<S>::epsilon()));
    }
  }
}

TEST_CASE("a network curve rejects a range without extent") {
  Network<double, 1, 2, 1> const network(Seed{1});
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(NetworkCurve(network, DepthRange<double>{0.0, 0.0}), InvalidArgument);
  CHECK_THROWS_AS(NetworkCurve(network, DepthRange<double>{nan, 1.0}), InvalidArgument);
  CHECK_THROWS_WITH(NetworkCurve(network, DepthRange<double>{0.02, 0.01}),
                    "NetworkCurve: the depth range is 0.02 … 0.01 m; give two finite depths, the lower one first");
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
  CHECK_THROWS_WITH(scaled(line, std::numeric_limits<double>::infinity()), "scaled: the factor is inf; give a finite number");
}
