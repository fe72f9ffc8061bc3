// SPDX-License-Identifier: MIT
// One step and what it reports: forces, faults, divergence, determinism. Yardsticks: Newton's law, exact texts, copies of the state.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>

#include "body/naive_twin.hpp"
#include "catch.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

using namespace palpate;
using palpate_test::GridScene;

namespace {

GridScene const square{.nx = 10, .ny = 10};
double const no_number = std::numeric_limits<double>::quiet_NaN();
double const infinite = std::numeric_limits<double>::infinity();

template <class Body>
bool same_state(Body const& a, Body const& b) {
  return a.positions() == b.positions() && a.velocities() == b.velocities() && a.time() == b.time();
}

/// Moves everything and then gives up.
struct GivesUp {
  template <System S>
  void step(S& system, typename S::Scalar h) const {
    system.positions() += h * system.velocities();
    system.velocities().setOnes();
    system.previous_acceleration().setOnes();
    if (h > 1e-3) throw std::runtime_error("too long a step for me");
  }
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const&) const {
    return 1;
  }
};

}  // namespace

TEST_CASE("an integrator that throws leaves the body as it was") {
  SoftBody body(square.tissue(), GivesUp{}, WholeBody{});
  REQUIRE(body.step(1e-4));
  SoftBody const before = body;
  CHECK_THROWS_WITH(body.step(0.1), "too long a step for me");
  CHECK(same_state(body, before));
  CHECK(body.step(1e-4));
}

TEMPLATE_TEST_CASE("forces add up, act during one step and are gone", "", ExplicitEuler, SymplecticEuler, LeapfrogVerlet, VelocityVerlet, RungeKutta4) {
  // Free tissue without home springs and dampers: momentum = Σ force · h, whatever the springs do.
  SoftBody body(GridScene{.home = 0.0, .home_damping = 0.0}.tissue(), TestType{}, WholeBody{});
  body.apply_force(3, {1.0, 0.0, 0.0});
  body.apply_force(3, {0.5, 2.0, 0.0});
  body.apply_force(8, {0.0, 0.0, -1.0});
  body.step(1e-4);
  CHECK((body.momentum() - Vector3<double>(1.5e-4, 2e-4, -1e-4)).norm() < 1e-15);
  for (int k = 0; k < 100; ++k) body.step(1e-4);   // nothing is applied any more: the springs keep the momentum
  CHECK((body.momentum() - Vector3<double>(1.5e-4, 2e-4, -1e-4)).norm() < 1e-14);
  body.apply_force(5, {-1.5, -2.0, 1.0});
  body.step(1e-4);
  CHECK(body.momentum().norm() < 1e-14);
}

TEST_CASE("a force taken back and given again counts once") {
  SoftBody body(square.tissue(), LeapfrogVerlet{}, WholeBody{});
  SoftBody twin(square.tissue(), LeapfrogVerlet{}, WholeBody{});
  Vector3<double> const force(0.1, 0.2, 0.3);
  body.apply_force(44, force);
  body.apply_force(44, -force);
  body.apply_force(44, force);
  twin.apply_force(44, force);
  for (int k = 0; k < 2; ++k) {
    body.step(1e-4);
    twin.step(1e-4);
    CHECK(same_state(body, twin));
    CHECK(body.reaction(44) == twin.reaction(44));
  }
}

TEMPLATE_TEST_CASE("a zero step moves nothing, consumes the force and keeps the time", "", ExplicitEuler, SymplecticEuler, LeapfrogVerlet,
                   VelocityVerlet, RungeKutta4) {
  SoftBody body(square.tissue(), TestType{}, WholeBody{});
  for (int k = 0; k < 5; ++k) {
    body.apply_force(44, {0.0, 0.0, -1.0});
    body.step(1e-4);
  }
  SoftBody const before = body;
  body.apply_force(44, {0.0, 0.0, -1.0});
  CHECK(body.step(0.0).status == StepStatus::ok);
  CHECK(same_state(body, before));
  SoftBody after = before;
  after.step(1e-4);
  body.step(1e-4);
  CHECK(same_state(body, after));
}

TEST_CASE("wrong calls say what is wrong and leave the body as it was") {
  SoftBody body(square.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  body.apply_force(44, {0.0, 0.0, -1.0});
  body.step(1e-4);
  body.apply_force(44, {0.0, 0.0, -1.0});
  SoftBody twin = body;
  CHECK_THROWS_WITH(body.apply_force(100, {0, 0, 1}), says("particle index 100", "0 … 99"));
  CHECK_THROWS_WITH(body.apply_force(-1, {0, 0, 1}), says("particle index -1", "0 … 99"));
  CHECK_THROWS_AS(body.apply_force(100, {0, 0, 1}), OutOfRange);
  CHECK_THROWS_WITH(body.apply_force(7, {0.0, no_number, 1.0}), says("the force on particle 7 is (0, nan, 1)", "finite"));
  CHECK_THROWS_AS(body.apply_force(7, {infinite, 0.0, 0.0}), InvalidArgument);
  CHECK_THROWS_WITH(body.set_gravity({0.0, 0.0, -infinite}), says("gravity is (0, 0, -inf)", "finite"));
  CHECK_THROWS_WITH(body.drag(7, {no_number, 0.0, 0.0}), says("the position for particle 7 is (nan, 0, 0)", "finite"));
  CHECK_THROWS_WITH(body.drag(7, {0.0, 0.0, 0.0}, {0.0, no_number, 0.0}), says("the velocity for particle 7 is (0, nan, 0)", "finite"));
  CHECK_THROWS_WITH(body.step(-1e-3), says("a step of -0.001 s", "not negative"));
  CHECK_THROWS_WITH(body.step(no_number), says("a step of nan s", "not negative"));
  CHECK_THROWS_AS(body.step(infinite), InvalidArgument);
  CHECK_THROWS_AS(body.hold(100), OutOfRange);
  CHECK_THROWS_AS(body.release(-1), OutOfRange);
  CHECK_THROWS_AS(body.nail(100), OutOfRange);
  CHECK_THROWS_AS(body.reaction(100), OutOfRange);
  CHECK_THROWS_AS(body.displacement(100), OutOfRange);
  CHECK_THROWS_WITH(body.nearest_vertex({no_number, 0.0, 0.0}), says("nearest_vertex", "not finite"));
  CHECK_FALSE(body.nearest_point({no_number, 0.0, 0.0}).found());
  CHECK(same_state(body, twin));
  for (int k = 0; k < 10; ++k) {
    body.step(1e-4);
    twin.step(1e-4);
  }
  CHECK(same_state(body, twin));
}

TEMPLATE_TEST_CASE("a body that blows up says so, keeps its last finite state and can go on", "", ExplicitEuler, SymplecticEuler, LeapfrogVerlet,
                   VelocityVerlet, RungeKutta4) {
  SoftBody body(square.tissue(), TestType{}, WholeBody{});
  double const h = body.stable_step();
  body.apply_force(44, {0.0, 0.0, -1.0});
  auto report = body.step(h / 2);
  CHECK(report.status == StepStatus::ok);
  SoftBody last = body;
  for (int k = 0; k < 10000 && report.status != StepStatus::diverged; ++k) {
    last = body;
    report = body.step(20 * h);
    REQUIRE(body.positions().allFinite());
    REQUIRE(body.velocities().allFinite());
  }
  REQUIRE(report.status == StepStatus::diverged);
  CHECK_FALSE(report);
  CHECK(report.particle >= 0);
  CHECK(report.particle < body.size());
  CHECK(same_state(body, last));
  body.reset();
  body.apply_force(44, {0.0, 0.0, -1.0});
  for (int k = 0; k < 500; ++k) REQUIRE(body.step(h / 2).status == StepStatus::ok);
  CHECK(body.positions().allFinite());
  CHECK((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() < 0.01);
}

TEST_CASE("a step that would leave all bounds is not taken; the next one is as if it had never been asked") {
  SoftBody body(square.tissue(), LeapfrogVerlet{}, WholeBody{});
  for (int k = 0; k < 20; ++k) {
    body.apply_force(44, {0.0, 0.0, -1.0});
    body.step(1e-4);
  }
  SoftBody twin = body;
  for (Vector3<double> const& huge : {Vector3<double>(0, 0, 1e300), Vector3<double>(1e12, 0, 0)}) {
    body.apply_force(13, huge);
    auto const report = body.step(1e-4);
    CHECK(report.status == StepStatus::diverged);
    CHECK(report.particle == 13);
    CHECK(same_state(body, twin));
  }
  for (int k = 0; k < 20; ++k) {
    body.step(1e-4);
    twin.step(1e-4);
  }
  CHECK(same_state(body, twin));
  CHECK(body.reaction(13) == twin.reaction(13));
}

TEMPLATE_TEST_CASE("two runs agree to the last bit", "", WholeBody, ZoneOfInfluence) {
  auto const run = [] {
    SoftBody body(square.tissue(), LeapfrogVerlet{}, TestType{});
    for (int k = 0; k < 300; ++k) {
      body.apply_force((7 * k) % 100, {0.1, 0.0, -0.3});
      if (k == 100) body.hold(33);
      if (k == 200) body.release(33);
      body.step(1e-4);
    }
    return body;
  };
  CHECK(same_state(run(), run()));
}

TEST_CASE("without home springs the springs keep the momentum, and turn nothing by themselves") {
  SoftBody body(GridScene{.home = 0.0, .home_damping = 0.0}.tissue(), LeapfrogVerlet{}, WholeBody{});
  for (int k = 0; k < 20; ++k) {
    for (int i = 0; i < 20; ++i) body.apply_force(i, {0.01 * (i % 3), 0.02 * (i % 4), -0.03 * (i % 5)});
    body.step(1e-4);
  }
  auto const angular = [&] {
    Vector3<double> sum = Vector3<double>::Zero();
    for (int i = 0; i < 20; ++i)
      sum += body.tissue().mass(i) * Vector3<double>(body.positions().col(i)).cross(Vector3<double>(body.velocities().col(i)));
    return sum;
  };
  Vector3<double> const momentum = body.momentum(), spin = angular();
  REQUIRE(momentum.norm() > 1e-5);
  for (int k = 0; k < 2000; ++k) body.step(1e-4);
  CHECK((body.momentum() - momentum).norm() < 1e-12 * momentum.norm() * 100);
  CHECK((angular() - spin).norm() < 1e-3 * spin.norm());   // damping acts half a step away from the drift: second order in h
}

TEST_CASE("undamped, leapfrog keeps the energy within a bounded band for a hundred thousand steps") {
  GridScene const scene{.link_damping = 0.0, .home_damping = 0.0, .nails = palpate_test::grid_border(5, 4)};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  double const h = body.stable_step() / 10;
  body.apply_force(7, {0.02, 0.0, 0.0});
  body.apply_force(12, {0.0, 0.01, 0.01});
  body.step(h);
  double const start = body.kinetic_energy() + body.potential_energy();
  double low = start, high = start;
  for (int k = 0; k < 100000; ++k) {
    body.step(h);
    double const energy = body.kinetic_energy() + body.potential_energy();
    low = std::min(low, energy), high = std::max(high, energy);
  }
  // (hω/2)²/… of the energy: h is a tenth of 2/ω, so a per cent; a drift would have no bound.
  CHECK(high < 1.02 * start);
  CHECK(low > 0.98 * start);
}

TEST_CASE("damping only takes energy away") {
  SoftBody body(GridScene{}.tissue(), LeapfrogVerlet{}, WholeBody{});
  body.apply_force(7, {0.5, 0.0, -1.0});
  double const h = body.stable_step() / 50;
  body.step(h);
  double last = body.kinetic_energy() + body.potential_energy();
  double const start = last;
  for (int k = 0; k < 20000; ++k) {
    body.step(h);
    double const energy = body.kinetic_energy() + body.potential_energy();
    CHECK(energy < last + 1e-4 * start);
    last = energy;
  }
  CHECK(last < 1e-3 * start);
}
