// SPDX-License-Identifier: MIT
// A soft body against a plain loop over its springs, integrated by an extrapolation method that the library does not have.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/region/whole_body.hpp>

#include "body/naive_twin.hpp"
#include "catch.hpp"

#include <cmath>
#include <utility>

using namespace palpate;
using palpate_test::GridScene;
using palpate_test::NaiveBody;

namespace {

struct Midpoint {
  static constexpr int order = 2;
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    using Matrix = typename System::Matrix;
    Matrix const x = system.positions();
    Matrix const v = system.velocities();
    Matrix const half_v = v + h / 2 * system.acceleration(x, v);
    system.positions() = x + h * half_v;
    system.velocities() = v + h * system.acceleration(x + h / 2 * v, half_v);
  }
};

Vector3<double> const push(0.05, -0.1, -0.4);
constexpr int pushed = 7;
constexpr double duration = 0.02;

/// The same push, constant from the start: {error of the positions, error of the velocities} at the end.
template <class I>
std::array<double, 2> errors(GridScene const& scene, NaiveBody const& exact, int steps) {
  SoftBody body(scene.tissue(), I{}, WholeBody{});
  for (int k = 0; k < steps; ++k) {
    body.apply_force(pushed, push);
    REQUIRE(body.step(duration / steps));
  }
  return {(body.positions() - exact.x).norm(), (body.velocities() - exact.v).norm()};
}

NaiveBody reference(GridScene const& scene) {
  NaiveBody exact = scene.plain();
  exact.force.col(pushed) = push;
  exact.advance(duration, 100);
  return exact;
}

}  // namespace

TEST_CASE("the reference of these tests has converged") {
  GridScene const scene{.nails = palpate_test::grid_border(5, 4)};
  NaiveBody once = reference(scene), twice = scene.plain();
  twice.force.col(pushed) = push;
  twice.advance(duration, 200);
  CHECK((once.x - twice.x).norm() < 1e-15);
  CHECK((once.v - twice.v).norm() < 1e-12);
}

TEMPLATE_TEST_CASE("a body converges with its integrator's order to the reference, damped at home and in the links", "", ExplicitEuler,
                   SymplecticEuler, LeapfrogVerlet, VelocityVerlet, RungeKutta4, Midpoint) {
  for (double const prestrain : {0.0, 0.05}) {
    GridScene const scene{.prestrain = prestrain, .nails = palpate_test::grid_border(5, 4)};
    NaiveBody const exact = reference(scene);
    int const steps = TestType::order == 1 ? 3200 : TestType::order == 2 ? 800 : 200;
    auto const coarse = errors<TestType>(scene, exact, steps), fine = errors<TestType>(scene, exact, 2 * steps);
    CAPTURE(prestrain, coarse[0], fine[0], coarse[1], fine[1]);
    CHECK(std::log2(coarse[0] / fine[0]) == Approx(TestType::order).margin(0.1));
    CHECK(std::log2(coarse[1] / fine[1]) == Approx(TestType::order).margin(0.1));   // velocities belong to the same time
    CHECK(fine[0] < 1e-3 * (exact.x - exact.home).norm());
  }
}

TEST_CASE("a force that changes from step to step is the reference's with the same changes") {
  GridScene const scene{.prestrain = 0.02, .nails = {0, 4, 15, 19}};
  NaiveBody exact = scene.plain();
  SoftBody body(scene.tissue(), RungeKutta4{}, WholeBody{});
  // The settled start of the library is where the reference starts too.
  exact.x = body.positions();
  for (int k = 0; k < 40; ++k) {
    Vector3<double> const force(0.2 * std::sin(k), 0.1 * std::cos(2.0 * k), k % 3 == 0 ? -0.5 : 0.1);
    exact.force.col(pushed) = force;
    exact.advance(1e-4, 1);
    body.apply_force(pushed, force);
    body.step(1e-4);
  }
  CHECK((body.positions() - exact.x).cwiseAbs().maxCoeff() < 1e-9);
  CHECK((body.velocities() - exact.v).cwiseAbs().maxCoeff() < 1e-7);
}

TEST_CASE("tissue with pre-tension starts where a plain loop finds no force") {
  GridScene const scene{.nx = 7, .ny = 6, .prestrain = 0.1, .nails = {0, 6, 20}};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  NaiveBody plain = scene.plain();
  palpate_test::Points const residual = plain.accelerations(body.positions(), body.velocities()) * plain.mass[0];
  CHECK(residual.cwiseAbs().maxCoeff() < 1e-7 * scene.link * scene.spacing);
  CHECK((body.positions() - plain.home).cwiseAbs().maxCoeff() > 1e-4);   // it did move
  for (int k = 0; k < 42; ++k) CHECK(body.reference_position(k) == body.positions().col(k));
  auto const start = body.positions().eval();
  for (int k = 0; k < 1000; ++k) body.step(1e-4);
  CHECK((body.positions() - start).cwiseAbs().maxCoeff() < 1e-6 * scene.spacing);
}
