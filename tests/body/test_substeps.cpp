// SPDX-License-Identifier: MIT
// Durations split into stable steps, and what a step reports. Yardsticks: the same steps taken by hand, Newton's second law, and a plain loop.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>

#include "allocation_trap.hpp"
#include "body/naive_twin.hpp"
#include "catch.hpp"

#include <cmath>
#include <limits>

using namespace palpate;
using palpate_test::GridScene;

TEST_CASE("a duration is split into the fewest equal steps not above the stable one") {
  auto const exact = split_duration(1.0, 0.25, 100);
  CHECK((exact.count == 4 && exact.each == 0.25 && !exact.capped));
  auto const more = split_duration(1.0, 0.24, 100);
  CHECK((more.count == 5 && more.each == 0.2 && !more.capped));
  auto const short_one = split_duration(0.1, 0.24, 100);
  CHECK((short_one.count == 1 && short_one.each == 0.1 && !short_one.capped));
  auto const capped = split_duration(1.0, 0.01, 10);
  CHECK((capped.count == 10 && capped.each == 0.01 && capped.capped));
  auto const never = split_duration(1.0, 0.0, 10);
  CHECK((never.count == 10 && never.each == 0.1 && never.capped));
  auto const any = split_duration(1.0, std::numeric_limits<double>::infinity(), 10);
  CHECK((any.count == 1 && any.each == 1.0 && !any.capped));
  auto const nothing = split_duration(0.0, 0.1, 10);
  CHECK((nothing.count == 1 && nothing.each == 0.0 && !nothing.capped));
  auto const single = split_duration(1.0F, 0.1F, 100);   // 0.1F is a hair above a tenth
  CHECK((single.count == 10 && !single.capped));
}

TEMPLATE_PRODUCT_TEST_CASE("advance takes the steps that one would take by hand, to the bit", "", std::pair,
                           ((LeapfrogVerlet, WholeBody), (StoermerVerlet, WholeBody), (LeapfrogVerlet, ZoneOfInfluence))) {
  using I = typename TestType::first_type;
  using R = typename TestType::second_type;
  SoftBody split(GridScene{.nx = 8, .ny = 8}.tissue(), I{}, R{});
  SoftBody by_hand = split;
  double const duration = 4.3 * split.stable_step();
  by_hand.stable_step();
  for (int tick = 0; tick < 20; ++tick) {
    split.apply_force(27, {0.0, 0.01, -0.1});
    split.apply_force(30, {0.02, 0.0, 0.0});
    auto const report = split.advance(duration);
    CHECK(report.status == StepStatus::ok);
    CHECK(report.steps == 5);
    for (int k = 0; k < 5; ++k) {
      by_hand.apply_force(27, {0.0, 0.01, -0.1});
      by_hand.apply_force(30, {0.02, 0.0, 0.0});
      by_hand.step(duration / 5);
    }
  }
  CHECK(split.positions() == by_hand.positions());
  CHECK(split.velocities() == by_hand.velocities());
  CHECK(split.time() == Approx(20 * duration));
  CHECK(split.reaction(27) == by_hand.reaction(27));
}

TEMPLATE_TEST_CASE("a force acts through all substeps and is consumed by them", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  // A free body: its momentum is force times duration.
  GridScene const scene{.link_damping = 0.05, .home = 0.0, .home_damping = 0.0};
  SoftBody body(scene.template tissue<S>(), LeapfrogVerlet{}, WholeBody{});
  S const duration = 7 * body.stable_step();
  body.apply_force(3, {S(0.01), S(0), S(-0.02)});
  CHECK(body.advance(duration).steps >= 7);
  CHECK(body.momentum().x() == Approx(0.01 * duration).epsilon(1e-4));
  CHECK(body.momentum().z() == Approx(-0.02 * duration).epsilon(1e-4));
  body.advance(duration);
  CHECK(body.momentum().z() == Approx(-0.02 * duration).epsilon(1e-4));
}

TEST_CASE("with too few steps allowed the body falls behind and stays stable") {
  SoftBody body(GridScene{}.tissue(), LeapfrogVerlet{}, WholeBody{});
  double const h = body.stable_step();
  auto const report = body.advance(50 * h, {.most = 8});
  CHECK(report.status == StepStatus::behind);
  CHECK(bool(report));
  CHECK(report.steps == 8);
  CHECK(body.time() == Approx(8 * h));
}

TEST_CASE("where no step is stable the duration is split as far as allowed, and that is reported") {
  SoftBody body(GridScene{.link_damping = 0.0, .home_damping = 0.0}.tissue(), ExplicitEuler{}, WholeBody{});
  auto const report = body.advance(1e-5, {.most = 8});
  CHECK(report.status == StepStatus::above_stable_step);
  CHECK(report.steps == 8);
  CHECK(body.time() == Approx(1e-5));
}

TEST_CASE("an adaptive integrator splits by itself") {
  SoftBody body(GridScene{}.tissue(), DormandPrince{}, WholeBody{});
  CHECK(body.stable_step() == std::numeric_limits<double>::infinity());
  body.apply_force(5, {0.0, 0.0, -0.1});
  CHECK(body.advance(0.05).steps == 1);
  // The plain loop, extrapolated.
  auto plain = GridScene{}.plain();
  plain.force.col(5) << 0.0, 0.0, -0.1;
  plain.advance(0.05, 200);
  CHECK((body.positions() - plain.x).norm() < 1e-5 * (plain.x - plain.home).norm());
}

TEST_CASE("after the tissue has changed the stable step is found anew") {
  SoftBody body(GridScene{}.tissue(), LeapfrogVerlet{}, WholeBody{});
  double const h = body.stable_step();
  CHECK(body.advance(2.5 * h).steps == 3);
  for (int i = 0; i < body.size(); ++i)
    if (i % 2 == 0) body.nail(i);   // every other particle: what is left is slower or as fast
  double const last = body.advance(2.5 * h).stable_step;
  CHECK(last > h);
}

TEST_CASE("bad durations and substeps are refused in a sentence") {
  SoftBody body(GridScene{}.tissue(), LeapfrogVerlet{}, WholeBody{});
  CHECK_THROWS_WITH(body.advance(-1.0), says("-1 s", "not negative"));
  CHECK_THROWS_WITH(body.advance(1.0, {.most = 0}), says("0 substeps", "at least 1"));
}

TEMPLATE_TEST_CASE("divergence is reported with the particle, its value and the step that would have been stable", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SoftBody body(GridScene{.link_damping = 0.0, .home_damping = 0.0}.template tissue<S>(), LeapfrogVerlet{}, WholeBody{});
  S const stable = body.stable_step();
  S const far = S(2e3) * 0.05;   // the body is 5 cm long
  StepReport<S> report;
  body.apply_force(7, {S(0), S(0), S(-1e-3)});
  for (int k = 0; k < 1000; ++k)
    if (report = body.step(20 * stable); !report) break;
  REQUIRE(report.status == StepStatus::diverged);
  CHECK(report.particle >= 0);
  CHECK((!std::isfinite(report.value) || std::abs(report.value) > S(0.1) * far));
  CHECK(report.stable_step > 0);
  CHECK(report.stable_step < 20 * stable);
  CHECK(body.positions().allFinite());
  // It goes on with the step reported, and the value of a good step is nothing.
  auto const good = body.step(S(0.5) * report.stable_step);
  CHECK(good.particle == -1);
  CHECK(good.value == 0);
}

TEST_CASE("an adaptive integrator that gives up is reported as divergence, the body stays as it was") {
  SoftBody body(GridScene{}.tissue(), DormandPrince{.relative = 1e-12, .absolute = 1e-16, .max_inner_steps = 2}, WholeBody{});
  body.apply_force(5, {0.0, 0.0, -1.0});
  auto const report = body.step(1.0);
  CHECK(report.status == StepStatus::diverged);
  CHECK(report.particle >= 0);
  CHECK(std::isnan(report.value));
  CHECK(body.positions() == body.rest_mesh().points);
}

TEST_CASE("substeps do not allocate, divergence neither") {
  REQUIRE(palpate_test::trap_works());
  SoftBody body(GridScene{.nx = 10, .ny = 10}.tissue(), LeapfrogVerlet{}, WholeBody{});
  double const h = body.stable_step();
  body.advance(3 * h);
  palpate_test::AllocationCount const allocations;
  bool diverged = false;
  for (int k = 0; k < 100; ++k) {
    body.apply_force(k % body.size(), {0.0, 0.0, -0.01});
    body.advance(3 * h);
  }
  for (int k = 0; k < 1000; ++k) diverged = diverged || !body.step(100 * h);
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(diverged);
}
