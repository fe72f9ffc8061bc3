// SPDX-License-Identifier: MIT
#include <palpate/force/blade.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>

#include "catch.hpp"

#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;

static_assert(HysteresisCurve<BladedCurve<decltype(liver_hysteresis<float>()), float>, float>);
static_assert(DepthCurve<BladedCurve<decltype(liver_loading<double>()), double>, double> && !HysteresisCurve<BladedCurve<decltype(liver_loading<double>()), double>, double>);

// Yardstick: the four factors by hand; a line of 100 N/m under 60 degrees is 200 N/m along the way, 100 N/m along the normal again.
TEMPLATE_TEST_CASE("a blade's width, sharpness, draw and lean scale a measured curve", "[force]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const line = [](S depth) noexcept { return S(100) * depth; };
  auto const square = [](S depth) noexcept { return S(1000) * depth * depth; };
  S const d = S(0.01);
  CHECK(double(bladed(line, BladeFactors<S>{})(d)) == Approx(1.0));
  CHECK(double(bladed(line, BladeFactors<S>{.width_ratio = S(1.5)})(d)) == Approx(1.5));
  CHECK(double(bladed(line, BladeFactors<S>{.sharpness = S(2)})(d)) == Approx(0.5));
  CHECK(double(bladed(line, BladeFactors<S>{.slice_push_ratio = S(2)})(d)) == Approx(0.2));
  S const lean = std::numbers::pi_v<S> / 3;
  CHECK(double(bladed(line, BladeFactors<S>{.entry_angle = lean})(d)) == Approx(1.0).epsilon(1e-5));
  CHECK(double(bladed(square, BladeFactors<S>{.entry_angle = -lean})(d)) == Approx(0.1 * 4 / 2).epsilon(1e-5));
  auto const both = bladed(liver_hysteresis<S>(), BladeFactors<S>{.width_ratio = S(3), .sharpness = S(1.5), .slice_push_ratio = S(1)});
  CHECK(double(both(d, Phase::loading)) == Approx(double(liver_hysteresis<S>()(d, Phase::loading))).epsilon(1e-5));
  CHECK(double(both(d, Phase::unloading)) == Approx(double(liver_hysteresis<S>()(d, Phase::unloading))).epsilon(1e-5));
}

TEST_CASE("a bladed curve is a part of a cutting force, and malformed factors are refused") {
  CuttingForce force(bladed(liver_loading<double>(), BladeFactors<double>{.width_ratio = 2.0}));
  CHECK(force(ToolContact<double>{.phase = CuttingPhase::moving, .depth = 0.01, .previous_depth = 0.009}).z() == Approx(2 * liver_loading<double>()(0.01)));
  auto const curve = liver_loading<double>();
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(bladed(curve, BladeFactors<double>{.width_ratio = 0.0}), says(".width_ratio is 0", "above zero"));
  CHECK_THROWS_WITH(bladed(curve, BladeFactors<double>{.entry_angle = 2.0}), says(".entry_angle is 2", "between -pi/2 and pi/2"));
  CHECK_THROWS_AS(bladed(curve, BladeFactors<double>{.sharpness = nan}), InvalidArgument);
  CHECK_THROWS_AS(bladed(curve, BladeFactors<double>{.slice_push_ratio = nan}), InvalidArgument);
}
