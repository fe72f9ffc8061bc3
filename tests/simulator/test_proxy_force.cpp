// SPDX-License-Identifier: MIT
// The proxy in a whole simulator. Yardsticks: the tissue's own reaction (which test_simulator.cpp holds against Newton's method), the closed form of what a
// late plane does on a ball, the cone of friction.
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/press_then_cut.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace palpate;

namespace {

Trajectory<double> press_and_wait(double depth) {
  return Trajectory<double>::start({0.0512, 0.0533, 0.004}).line({0.0512, 0.0533, -depth}, 0.4).hold(2.0);
}

/// A ball of 20 mm radius that hardly gives way.
auto hard_ball() {
  auto const mesh = make_sphere<double>(0.02, 16);
  MassSpring<double> tissue(mesh, {.mass = {.total = 10.0}, .link = {.stiffness = 20.0, .damping = 20.0}, .home = {.stiffness = 3e6, .damping = 3e4}});
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
}

/// Slides over a ball at 0.1 m/s, 1 mm deep, with models of the body every `every` ticks; the largest change of force from tick to tick after the first touch.
double largest_step(ProxyForce<double> force, int every) {
  BodyLoop loop(hard_ball(), NoCutter<double>{}, ContactCoupling{.stiffness = 500.0, .damping = 0.5}, 100);
  loop.sense_surface(force.surface_kind());
  force.begin_session(1000.0, 1000.0 / every);
  LocalModel<double> model;
  Vector3<double> before = Vector3<double>::Zero();
  double largest = 0.0;
  auto const at = [](int k) {
    double const angle = -0.6 + 0.1 / 0.019 * 0.001 * std::max(k - 200, 0), r = k < 200 ? 0.019 + 1e-5 * (200 - k) : 0.019;
    return Vector3<double>(r * std::sin(angle), 0.0003, r * std::cos(angle));
  };
  LocalModel<double> next;
  for (int k = 0; k < 430; ++k) {
    if (k % every == 0) {
      model = next;   // a frame late, as a body's thread is
      next = loop.tick({.position = at(k), .velocity = k == 0 ? Vector3<double>(Vector3<double>::Zero()) : Vector3<double>((at(k) - at(k - 1)) / 0.001)}, 0.001 * every);
    }
    Vector3<double> const now = force.on_surface(model, {.tip = at(k), .seconds = 0.001});
    if (k > 280) largest = std::max(largest, (now - before).norm());
    before = now;
  }
  CHECK(before.norm() > 0.2);
  return largest;
}

}  // namespace

TEST_CASE("at rest the proxy's spring is the tissue's reaction, where it is as stiff as the contact", "[simulator][proxy]") {
  auto const at_rest = [](auto force) {
    Simulator simulator(ScriptedDevice<double>(press_and_wait(0.003)), palpate_test::skin<double>(WholeBody{}), NoCutter<double>({.tip_radius = 1e-3}), force, {.coupling = {.stiffness = 600.0}});
    return simulator.run(2.4).ticks().back().force;
  };
  Vector3<double> const tissue = at_rest(TissueReaction{});
  CHECK(tissue.z() > 0.05);
  for (SurfaceKind const kind : {SurfaceKind::plane, SurfaceKind::ball, SurfaceKind::facets}) {
    CAPTURE(static_cast<int>(kind));
    Vector3<double> const proxy = at_rest(ProxyForce<double>({.surface = kind, .max_stiffness = 2000.0}));
    CHECK((proxy - tissue).norm() <= 0.15 * tissue.norm());   // the normals differ: of the surface as it is, of the undisturbed one
  }
}

// Closed form: the plane that was right a frame ago jumps by 3 K (v τ)²/2R when the next one comes; interpolated it goes up by a part of that in each tick.
TEST_CASE("C4-L1: a tool that slides over a ball feels late planes as steps, with a hand-over or a ball next to nothing", "[simulator][proxy]") {
  int const every = 33;
  double const jump = 1.5 * 500.0 * std::pow(0.1 * 0.001 * every, 2) / 0.02;
  double const planes = largest_step(ProxyForce<double>({.surface = SurfaceKind::plane, .handover = 1}), every);
  double const eased = largest_step(ProxyForce<double>({.surface = SurfaceKind::plane}), every);
  double const balls = largest_step(ProxyForce<double>({.surface = SurfaceKind::ball}), every);
  CAPTURE(planes, eased, balls, jump);
  CHECK(planes > 0.4 * jump);
  CHECK(eased < planes / 5);
  CHECK(balls < planes / 5);
}

TEST_CASE("the surface is there before the first touch, and not while the tool cuts", "[simulator][proxy]") {
  BodyLoop loop(palpate_test::skin<double>(ZoneOfInfluence{.rings = 3}), ProgressiveCutter<double>({.puncture_depth = 0.006, .snap = 5e-4}), ContactCoupling{}, 100);
  loop.sense_surface(SurfaceKind::facets);
  std::uint64_t last = 0;
  bool near = false, cuts = false;
  for (int k = 0; k < 200; ++k) {
    Vector3<double> const tip{0.0512, 0.0533, 0.010 - 1e-4 * k};
    auto const model = loop.tick({.position = tip, .velocity = {0, 0, -0.1}}, 0.001);
    CHECK(model.surface.sequence == ++last);
    if (tip.z() > 0.0051) CHECK(model.surface.stiffness() == 0.0);
    if (tip.z() < 0.0049 && tip.z() > 1e-4) {
      near = true;
      CHECK(model.surface.stiffness() == 2000.0);
      CHECK(model.surface.patch.distance(tip) == Approx(tip.z()).margin(1e-6));
      CHECK(model.surface.planes.count() >= 1);
    }
    if (model.phase == CuttingPhase::moving) {
      cuts = true;
      CHECK(model.surface.stiffness() == 0.0);
      CHECK(model.surface.planes.count() == 0);
    }
  }
  CHECK((near && cuts));
}

// Yardstick: a third of the force at the puncture, and of what the cutting force is there, for the way of a tick that the steepest of the springs makes.
TEST_CASE("where a cut begins and ends a proxy's force has no step, alone and with a cutting force that takes over", "[simulator][proxy]") {
  auto const at = [](int k) -> Vector3<double> {   // down to 10 mm at 50 mm/s, along, and out
    if (k < 300) return {0.0312, 0.0533, 0.005 - 5e-5 * k};
    if (k < 600) return {0.0312 + 1e-4 * (k - 300), 0.0533, -0.010};
    return {0.0612, 0.0533, -0.010 + 5e-5 * (k - 600)};
  };
  auto const curve = [](double depth) noexcept { return 40.0 * depth; };
  for (int const every : {1, 33}) {
    BodyLoop loop(palpate_test::skin<double>(ZoneOfInfluence{.rings = 3}), ProgressiveCutter<double>({.puncture_depth = 0.006, .snap = 5e-4}), ContactCoupling{}, 100);
    loop.sense_surface(SurfaceKind::plane);
    ProxyForceOptions const options{.surface = SurfaceKind::plane, .max_stiffness = 300.0, .static_friction = 0.3, .dynamic_friction = 0.2};
    ProxyForce<double> alone(options);
    PressThenCut both(ProxyForce<double>(options), curve);
    alone.begin_session(1000.0, 1000.0 / every);
    both.begin_session(1000.0, 1000.0 / every);
    LocalModel<double> model;
    Vector3<double> felt = Vector3<double>::Zero(), joined = Vector3<double>::Zero();
    double step = 0, joined_step = 0, at_puncture = 0;
    int cuts = 0, ends = 0;
    for (int k = 0; k < 1000; ++k) {
      CuttingPhase const before = model.phase;
      if (k % every == 0) model = loop.tick({.position = at(k), .velocity = k == 0 ? Vector3<double>(Vector3<double>::Zero()) : Vector3<double>((at(k) - at(k - 1)) / 0.001)}, 0.001 * every);
      ToolMotion<double> const motion{.tip = at(k), .velocity = k == 0 ? Vector3<double>(Vector3<double>::Zero()) : Vector3<double>((at(k) - at(k - 1)) / 0.001), .continues = true};
      Vector3<double> const now = alone.on_surface(model, motion), also = both.on_surface(model, motion);
      step = std::max(step, (now - felt).norm());
      joined_step = std::max(joined_step, (also - joined).norm());
      if (model.phase != CuttingPhase::moving) {
        CHECK(also == now);
      } else if (before == CuttingPhase::indenting) {
        at_puncture = felt.norm();
      }
      if (model.phase == CuttingPhase::moving && k > 400) {   // the cut is under way
        ++cuts;
        CHECK(now.isZero(0));
        CHECK((also - 40.0 * model.depth(at(k)) * CurveJoin<double>{}.fade(model.depth(at(k))) * model.normal).norm() < 1e-12);
      }
      if (model.phase == CuttingPhase::no_contact && k > 600) ++ends;
      felt = now;
      joined = also;
    }
    CAPTURE(every, step, joined_step, at_puncture);
    CHECK(cuts > 300);
    CHECK(ends > 100);
    CHECK(at_puncture > 0.05);   // at once it would be a step of this
    CHECK(step < at_puncture / 3 + 300.0 * 5e-5);
    CHECK(joined_step < (at_puncture + 40.0 * 0.006) / 3 + 300.0 * 5e-5);
    CHECK(felt.isZero(0));
    CHECK(joined.isZero(0));
  }
}

TEST_CASE("the proxy lags in its cone of friction behind a tool that is drawn along", "[simulator][proxy]") {
  auto const path = Trajectory<double>::start({0.04, 0.0533, 0.002}).line({0.04, 0.0533, -0.002}, 0.2).hold(0.3).line({0.06, 0.0533, -0.002}, 1.0);
  Simulator simulator(ScriptedDevice<double>(path), palpate_test::skin<double>(WholeBody{}), NoCutter<double>{},
                      ProxyForce<double>({.surface = SurfaceKind::plane, .static_friction = 0.4, .dynamic_friction = 0.3}));
  auto const ticks = simulator.run(1.4).ticks();
  Vector3<double> const rest = ticks[450].force, drawn = ticks.back().force;
  CHECK(std::abs(rest.x()) < 0.15 * rest.z());   // far inside the static cone, 0.4; the facet under the point is tilted
  CHECK(-drawn.x() == Approx(0.3 * drawn.z()).epsilon(0.15));   // the dent tilts the surface a little
}

TEMPLATE_TEST_CASE("a tick with a proxy allocates nothing", "[simulator][proxy]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(palpate_test::trap_works());
  Simulator simulator(ScriptedDevice<S>(palpate_test::stroke<S>(0.004)), palpate_test::skin<S>(ZoneOfInfluence{.rings = 3}), NoCutter<S>{}, ProxyForce<S>({.surface = SurfaceKind::facets}));
  simulator.run(0.5);
  long most = 0;
  std::optional<palpate_test::AllocationCount> before;
  simulator.run(0.4, [&](Tick const&) {
    if (before) most = std::max(most, before->count());
    before.emplace();
  });
  CHECK(most == 0);
}
