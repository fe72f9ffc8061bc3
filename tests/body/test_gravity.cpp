// SPDX-License-Identifier: MIT
// Gravity, nails and hands. Yardsticks: −g m/k, the balance of all forces, and the plain loop.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>

#include "body/naive_twin.hpp"
#include "catch.hpp"

#include <concepts>
#include <utility>

using namespace palpate;
using palpate_test::GridScene;

namespace {

/// Runs until nothing moves.
template <class Body>
void come_to_rest(Body& body, double h, int steps) {
  for (int k = 0; k < steps; ++k) REQUIRE(body.step(typename Body::Scalar(h)));
}

template <class Body>
Vector3<double> sum_of_reactions(Body const& body) {
  Vector3<double> sum = Vector3<double>::Zero();
  for (int i = 0; i < body.size(); ++i)
    if (body.tissue().nailed(i) || body.is_held(i)) sum += body.reaction(i).template cast<double>();
  return sum;
}

/// What the home springs pull with, all together.
template <class Body>
Vector3<double> home_forces(Body const& body) {
  Vector3<double> sum = Vector3<double>::Zero();
  for (int i = 0; i < body.size(); ++i) sum -= double(body.tissue().home(i).stiffness) * body.displacement(i).template cast<double>();
  return sum;
}

}  // namespace

TEMPLATE_TEST_CASE("a free uniform body sags by g m/k on its home springs, settled or in time", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  GridScene const scene{.home_damping = 0.05};
  double const sag = 9.81 * (0.02 / 20) / 5.0;   // every particle alike, so no link stretches
  double const tolerance = std::same_as<S, float> ? 2e-3 : 2e-5;   // settle() stops at 1e-8 of an edge, in force over the whole stiffness
  SoftBody settled(scene.tissue<S>(), LeapfrogVerlet{}, WholeBody{});
  settled.set_gravity({S(0), S(0), S(-9.81)});
  settled.settle();
  SoftBody stepped(scene.tissue<S>(), LeapfrogVerlet{}, WholeBody{});
  stepped.set_gravity({S(0), S(0), S(-9.81)});
  come_to_rest(stepped, 2e-4, 5000);
  SoftBody zone(scene.tissue<S>(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  zone.set_gravity({S(0), S(0), S(-9.81)});
  come_to_rest(zone, 2e-4, 20000);
  CHECK(zone.step(S(2e-4)).moving == 0);
  for (int i = 0; i < 20; ++i) {
    CHECK(double(settled.displacement(i).z()) == Approx(-sag).epsilon(tolerance));
    CHECK(double(stepped.displacement(i).z()) == Approx(-sag).epsilon(tolerance));
    CHECK(double(zone.displacement(i).z()) == Approx(-sag).epsilon(3 * tolerance));
    CHECK(double(settled.reference_position(i).z()) == Approx(-sag).epsilon(tolerance));
    CHECK(double(stepped.reference_position(i).z()) == 0.0);   // only settle() moves the home shape
  }
}

TEST_CASE("a zone does not wake a body that is settled under its gravity") {
  SoftBody body(GridScene{}.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  body.set_gravity({0.0, 0.0, -9.81});
  body.settle();
  CHECK(body.step(1e-4).moving == 0);
  body.reset();
  CHECK(body.step(1e-4).moving == 0);
  body.set_gravity({0.0, -9.81, 0.0});
  CHECK(body.step(1e-4).moving == 20);
  body.reset();   // the home shape belongs to another gravity
  CHECK(body.step(1e-4).moving == 20);
  come_to_rest(body, 1e-4, 40000);
  CHECK(body.displacement(0).y() == Approx(-9.81 * 1e-3 / 5.0).epsilon(5e-5));
  CHECK(body.step(1e-4).moving == 0);
}

TEST_CASE("at rest nails carry weight, applied forces and what the home springs do not") {
  Vector3<double> const push(0.1, 0.05, -0.3), gravity(0.0, -2.0, -9.81);
  for (double const home : {0.0, 5.0}) {
    GridScene const scene{.home = home, .home_damping = 0.05, .nails = {0, 4, 15, 19, 2, 17}};
    SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
    body.set_gravity(gravity);
    body.hold(9);
    for (int k = 0; k < 40000; ++k) {
      body.apply_force(7, push);
      body.apply_force(0, {1.0, 2.0, 3.0});   // on a nail
      body.apply_force(9, {0.5, 0.0, 0.0});   // on a hand
      body.step(2e-4);
    }
    CAPTURE(home);
    CHECK(body.velocities().cwiseAbs().maxCoeff() < 1e-9);
    Vector3<double> const outside = push + Vector3<double>(1.5, 2.0, 3.0) + 0.02 * gravity + home_forces(body);
    CHECK((sum_of_reactions(body) + outside).norm() < 1e-7);
    for (int const i : {0, 4, 15, 19, 2, 17, 9}) CHECK(body.displacement(i).norm() == 0);
    // Each reaction by itself, from the plain loop.
    auto plain = scene.plain();
    plain.gravity = gravity;
    plain.force.col(0) << 1.0, 2.0, 3.0;
    plain.force.col(7) = push;
    plain.force.col(9) << 0.5, 0.0, 0.0;
    auto const forces = plain.forces(body.positions(), body.velocities());
    for (int const i : {0, 4, 9, 17}) CHECK((body.reaction(i) + forces.col(i)).norm() < 1e-12);
    CHECK(forces.col(7).norm() < 1e-7);   // a free particle is in balance
  }
}

TEST_CASE("a force on a nailed particle moves nothing and is felt there for one step") {
  GridScene const scene{.nails = {7}};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  auto const before = body.positions().eval();
  body.apply_force(7, {1.0, -2.0, 3.0});
  CHECK(body.reaction(7).norm() == 0);
  body.step(1e-4);
  CHECK(body.positions() == before);
  CHECK(body.reaction(7) == Vector3<double>(-1.0, 2.0, -3.0));
  body.step(1e-4);
  CHECK(body.reaction(7).norm() == 0);
}

TEST_CASE("a held particle goes where it is dragged, pulls the others along, and leaves with the velocity it had") {
  GridScene const scene{};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  Vector3<double> const speed(0.0, 0.0, 0.02);
  Vector3<double> const start = body.positions().col(7);
  for (int k = 1; k <= 500; ++k) {
    body.drag(7, start + k * 1e-4 * speed, speed);
    body.step(1e-4);
    REQUIRE(body.positions().col(7) == start + k * 1e-4 * speed);
  }
  CHECK(body.is_held(7));
  CHECK(body.displacement(8).z() > 1e-5);
  CHECK(body.reaction(7).z() > 0);   // the hand pulls up
  body.release(7);
  CHECK_FALSE(body.is_held(7));
  CHECK(body.velocities().col(7) == speed);
  body.step(1e-5);
  CHECK(body.displacement(7).z() > 500 * 1e-4 * 0.02);   // it goes on for a moment
  come_to_rest(body, 1e-4, 40000);
  CHECK((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("a body held displaced is where a plain loop finds all others in balance") {
  GridScene const scene{.nx = 7, .ny = 6, .home_damping = 0.05};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  Vector3<double> const place = body.positions().col(24) + Vector3<double>(0.002, 0.001, -0.004);
  body.drag(24, place);
  body.settle();
  auto forces = scene.plain().forces(body.positions(), body.velocities());
  CHECK((body.reaction(24) + forces.col(24)).norm() < 1e-12);
  CHECK(body.reaction(24).norm() > 1e-3);
  forces.col(24).setZero();
  CHECK(forces.cwiseAbs().maxCoeff() < 1e-7 * 50.0 * 0.01);
  CHECK(body.positions().col(24) == place);
}

TEST_CASE("holding and releasing in a zone wakes the neighbours and lets them come home") {
  GridScene const scene{.nx = 12, .ny = 12};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  CHECK(body.step(1e-4).moving == 0);
  body.drag(66, body.positions().col(66) + Vector3<double>(0.0, 0.0, -0.005));
  CHECK(body.step(1e-4).moving == 18);   // nineteen less the held one
  for (int k = 0; k < 2000; ++k) body.step(1e-4);
  CHECK(body.displacement(67).z() < -1e-4);
  body.release(66);
  CHECK(body.step(1e-4).moving == 19);
  for (int k = 0; k < 60000 && body.step(1e-4).moving > 0; ++k) {}
  CHECK(body.step(1e-4).moving == 0);
  CHECK((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() < 1e-5 * 0.01 * 12);
}

TEMPLATE_TEST_CASE("a piece that nothing holds falls for as long as the rest is simulated", "", LeapfrogVerlet, BackwardEuler) {
  // Yardstick: g h² n (n + 1)/2 after n steps, of which both methods are half a step off at most; what is nailed, alone. Half a minute: 4.4 km.
  auto const cube = make_block<double>(2, 2, 2, 0.01);
  auto both = cube;
  both.points.conservativeResize(3, 16), both.tetrahedra.conservativeResize(4, 2 * cube.tetrahedra.cols());
  both.points.rightCols(8) = cube.points.colwise() + Vector3<double>(0.05, 0, 0);
  both.tetrahedra.rightCols(cube.tetrahedra.cols()) = (cube.tetrahedra.array() + 8).matrix();
  auto const hung = [](auto const& mesh) {
    MassSpring<double> tissue(mesh, {.mass = {.total = 1e-3 * static_cast<double>(mesh.points.cols())}, .link = {.stiffness = 50, .damping = 0.02}});
    for (int i = 0; i < 4; ++i) tissue.nail(i);
    SoftBody body(std::move(tissue), TestType{});
    body.set_gravity({0, 0, -9.81});
    return body;
  };
  auto body = hung(both), alone = hung(cube);
  double const h = 1e-3;
  int const steps = 30000;
  REQUIRE((h < body.stable_step() || std::same_as<TestType, BackwardEuler>));
  int taken = 0;
  for (int k = 0; k < steps; ++k) taken += bool(body.step(h)), alone.step(h);
  CHECK(taken == steps);
  CHECK(body.displacement(12).z() == Approx(-9.81 * h * h * steps * (steps + 1.0) / 2).epsilon(1e-3));
  CHECK(body.displacement(6).norm() > 1e-5);
  CHECK((body.displacement(6) - alone.displacement(6)).norm() < 0.01 * alone.displacement(6).norm());
}

TEST_CASE("a nail driven in later stops its particle") {
  GridScene const scene{};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  body.apply_force(7, {0.0, 0.0, -5.0});
  body.step(1e-4);
  body.step(1e-4);
  body.nail(7);
  Vector3<double> const place = body.positions().col(7);
  for (int k = 0; k < 100; ++k) body.step(1e-4);
  CHECK(body.positions().col(7) == place);
  CHECK(body.velocities().col(7).norm() == 0);
}

TEST_CASE("settling starts from where the body is, and a body that can not settle stays as it was") {
  // Without nails and home springs gravity has nothing to hang on.
  SoftBody body(GridScene{.home = 0.0, .home_damping = 0.0}.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  body.apply_force(7, {0.0, 0.0, -1.0});
  body.step(1e-4);
  SoftBody twin = body;
  body.set_gravity({0.0, 0.0, -9.81});
  CHECK_THROWS_WITH(body.settle(), says("imbalance is", "raise the home stiffness"));
  CHECK(body.positions() == twin.positions());
  CHECK(body.velocities() == twin.velocities());
  body.set_gravity({0.0, 0.0, 0.0});
  twin.set_gravity({0.0, 0.0, 0.0});
  for (int k = 0; k < 10; ++k) {
    body.step(1e-4);
    twin.step(1e-4);
  }
  CHECK(body.positions() == twin.positions());
}
