// SPDX-License-Identifier: MIT
#include <palpate/fitting/fitted_force.hpp>
#include <palpate/force/liver.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace palpate;

namespace {

template <RealScalar S>
ToolContact<S> touching(CuttingPhase phase, S depth, S inward_speed = S(0)) {
  return {.phase = phase, .depth = depth, .previous_depth = depth - inward_speed / 1000, .velocity = {S(0.5), S(0), -inward_speed}};
}

std::vector<Measurement> probe() {
  std::vector<Measurement> all;
  for (double const speed : {0.01, 0.05})
    for (int k = 1; k <= 20; ++k) {
      double const depth = k * 5e-4;
      all.push_back({depth, speed, MeasuredPhase::indenting, 900 * std::pow(depth, 1.5) * (1 + 3 * speed)});
    }
  return all;
}

}  // namespace

// Yardstick: the formula the measurements were made with, at the speed and, faster than measured, at the fastest measured, by hand.
TEMPLATE_TEST_CASE("a fitted force is its model up to the speeds that were measured, and counts what is faster", "[fitting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  FittedForce<S> force(force_preset(fit(probe(), HuntCrossleyModel{}), "made for this test"));
  CHECK(force.source() == "made for this test");
  CHECK(force.speeds().high == 0.05);
  double const elastic = 900 * std::pow(0.008, 1.5);
  CHECK(double(force(touching(CuttingPhase::indenting, S(0.008), S(0.02))).z()) == Approx(elastic * 1.06).epsilon(1e-5));
  CHECK(force.too_fast() == 0);
  CHECK(double(force(touching(CuttingPhase::indenting, S(0.008), S(0.5))).z()) == Approx(elastic * 1.15).epsilon(1e-5));
  CHECK(double(force(touching(CuttingPhase::indenting, S(0.008), S(-0.5))).z()) == Approx(elastic * 0.85).epsilon(1e-5));
  CHECK(force.too_fast() == 2);
  CHECK(force(touching(CuttingPhase::no_contact, S(0.008), S(0.5))).norm() == S(0));
  CHECK(force.too_fast() == 2);
  force.reset();
  CHECK(force.too_fast() == 0);
}

// Yardstick: by hand: at 30 mm the law has what it has at 10 mm, the deepest measured; and a needle's tip keeps its way through a preset.
TEST_CASE("deeper than measured a fitted force grows no more, and what a model fixes is in its preset") {
  FittedForce<double> deep(ForcePreset{"polynomial", {{"k1", 0.0}, {"k2", 0.0}, {"k3", 1e6}}, {0.001, 0.01}, {0.0, 0.1}, ""});
  CHECK(deep(touching(CuttingPhase::indenting, 0.03)).z() == Approx(1.0));
  CHECK(deep.too_deep() == 1);
  std::vector<Measurement> data;
  for (int k = 1; k <= 20; ++k) {
    data.push_back({0.001 * k, 0.01, MeasuredPhase::loading, 0.5 + 10 * 0.001 * k});
    data.push_back({0.001 * k, 0.02, MeasuredPhase::unloading, -10 * 0.001 * k});
  }
  ForcePreset const preset = force_preset(fit(data, NeedleModel{.tip_depth = 0.005}), "made for this test");
  CHECK(preset.source.find("not determined by the measurements: a1, a2") != std::string::npos);
  FittedForce<double> needle(preset);
  needle(touching(CuttingPhase::moving, 0.01));
  CHECK(needle(touching(CuttingPhase::moving, 0.0075)).z() == Approx(0.25 - 10 * 0.0075).margin(0.02));   // half of the tip's force, the shaft pulls
}

TEST_CASE("every model makes a force, networks too") {
  auto const at = [](ForcePreset preset, CuttingPhase phase) {
    preset.depths = {0.0, 0.02}, preset.speeds = {0.0, 0.1};
    FittedForce<double> force(preset);
    return force(touching(phase, 0.01)).z();
  };
  // Yardstick: the formulas by hand at 10 mm.
  CHECK(at({"linear", {{"k", 150.0}}, {}, {}, ""}, CuttingPhase::indenting) == Approx(1.5));
  CHECK(at({"polynomial", {{"k3", 1e6}, {"k1", 100.0}, {"k2", 0.0}}, {}, {}, ""}, CuttingPhase::indenting) == Approx(2.0));
  CHECK(at({"exponential", {{"a", 0.1}, {"b", 100.0}}, {}, {}, ""}, CuttingPhase::indenting) == Approx(0.1 * std::expm1(1.0)));
  CHECK(at({"needle", {{"a1", 100.0}, {"a2", 0.0}, {"cutting", 0.7}, {"dynamic", 0.0}, {"viscous", 0.0}}, {}, {}, ""}, CuttingPhase::moving) == Approx(0.7));
  FittedForce<double> loading(liver_loading<double>(), {0.0, 0.001}, "the thesis");
  CHECK(loading(touching(CuttingPhase::moving, 0.015)).z() == Approx(liver_loading<double>()(0.015)));
  CHECK(loading(touching(CuttingPhase::indenting, 0.015)).z() == Approx(liver_loading<double>()(0.015)));   // no spring that nobody measured
  CHECK(loading.depths().high == 0.02283);
  FittedForce<double> both(liver_hysteresis<double>(), {0.0, 0.001}, "the thesis");
  CHECK(both(touching(CuttingPhase::moving, 0.015)).z() == Approx(liver_hysteresis<double>()(0.015, Phase::loading)));
}

TEST_CASE("malformed presets are refused with a reason, and a tick allocates nothing") {
  using Force = FittedForce<double>;
  ForcePreset const good{"exponential", {{"a", 0.1}, {"b", 100.0}}, {0.0, 0.01}, {0.0, 0.1}, ""};
  CHECK_NOTHROW(Force(good));
  auto bad = good;
  bad.model = "spline";
  CHECK_THROWS_WITH(Force(bad), says("\"spline\"", "hunt-crossley"));
  bad = good, bad.coefficients.pop_back();
  CHECK_THROWS_WITH(Force(bad), says("\"b\"", "1/m"));
  bad = good, bad.coefficients.emplace_back("c", 1.0);
  CHECK_THROWS_AS(Force(bad), InvalidArgument);
  bad = good, bad.coefficients[0].second = -1.0;
  CHECK_THROWS_WITH(Force(bad), says("a = -1", "not below 0"));
  bad = good, bad.speeds = {0.2, 0.1};
  CHECK_THROWS_AS(Force(bad), InvalidArgument);
  bad = good, bad.depths.high = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(Force(bad), InvalidArgument);

  Force force(good);
  auto const contact = touching(CuttingPhase::indenting, 0.005, 0.5);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) force(contact);
  long const counted = allocations.count();
  CHECK(counted == 0);
}
