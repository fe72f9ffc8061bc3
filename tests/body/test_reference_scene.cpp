// SPDX-License-Identifier: MIT
// A square of 10 × 10 particles, its border nailed, pressed by a force that grows to −10 N in 7 s and is then gone.
// Yardstick: an adaptive eighth-order integration of the same equations, made with another program.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <utility>

using namespace palpate;

namespace {

template <RealScalar S>
MassSpring<S> square() {
  auto const skin = make_grid<S>(10, 10, S(1));
  MassSpring<S> tissue(skin, {.mass = {.total = S(1), .lumping = Lumping::equal},
                              .link = {.stiffness = S(1), .damping = S(1)},
                              .home = {.stiffness = S(2), .damping = S(1)}});
  tissue.nail(boundary_vertices(skin));
  return tissue;
}

constexpr int touched = 44;   // (4, 4)

/// The ramp, its force taken in the middle of each step.
template <class Body>
void press(Body& body, double h) {
  using S = typename Body::Scalar;
  int const steps = static_cast<int>(7.0 / h + 0.5);
  for (int step = 0; step < steps; ++step) {
    body.apply_force(touched, {S(0), S(0), S(-10.0 * (step + 0.5) * h / 7.0)});
    REQUIRE(body.step(S(h)).status == StepStatus::ok);
  }
}

template <class Body>
void rest(Body& body, double h) {
  for (int step = 0; step < static_cast<int>(7.0 / h + 0.5); ++step) body.step(typename Body::Scalar(h));
}

template <class Body>
double ring_mean(Body const& body, int ring) {
  auto const rings = vertex_rings(body.mesh(), touched, ring);
  double sum = 0;
  for (int const i : rings[static_cast<std::size_t>(ring)]) sum += double(body.displacement(i).z());
  return sum / double(rings[static_cast<std::size_t>(ring)].size());
}

}  // namespace

TEMPLATE_TEST_CASE("the pressed square follows the published reference, whole and in zones", "", LeapfrogVerlet, VelocityVerlet, RungeKutta4) {
  SECTION("whole body") {
    SoftBody body(square<double>(), TestType{}, WholeBody{});
    press(body, 1e-3);
    CHECK(body.displacement(touched).z() == Approx(-2.13427).margin(6e-6));
    CHECK(ring_mean(body, 1) == Approx(-0.37843).margin(6e-6));
    CHECK(ring_mean(body, 2) == Approx(-0.01946).margin(6e-6));
    rest(body, 1e-3);
    auto const away = (body.positions() - body.rest_mesh().points).cwiseAbs().eval();
    CHECK(away.row(2).maxCoeff() < 1e-5);
    CHECK(away.topRows(2).maxCoeff() < 3e-5);
  }
  SECTION("two rings") {
    SoftBody body(square<double>(), TestType{}, ZoneOfInfluence{.rings = 2});
    press(body, 1e-3);
    CHECK(body.displacement(touched).z() == Approx(-2.13352).margin(6e-6));
  }
  SECTION("one ring") {
    SoftBody body(square<double>(), TestType{}, ZoneOfInfluence{.rings = 1});
    press(body, 1e-3);
    CHECK(body.displacement(touched).z() == Approx(-2.12335).margin(6e-6));
  }
}

TEST_CASE("the pressed square in float is the one in double, to the digits of a float") {
  SoftBody body(square<float>(), LeapfrogVerlet{}, WholeBody{});
  press(body, 1e-3);
  CHECK(double(body.displacement(touched).z()) == Approx(-2.13427).margin(1e-4));
  CHECK(ring_mean(body, 1) == Approx(-0.37843).margin(1e-4));
  rest(body, 1e-3);
  // Coordinates up to 9 m have a last digit of 1e-6 m: nobody slower than 1e-3 m/s moves on in steps of a millisecond.
  CHECK(double((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff()) < 1e-3);
}
