// SPDX-License-Identifier: MIT
// Implicit integrators on single modes. Yardstick: the closed forms of what a step of the theta scheme does to x'' = -κ x - γ x'.
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/measured_stability.hpp>
#include <palpate/testing/integrator.hpp>

#include "catch.hpp"

#include <cmath>
#include <limits>

using namespace palpate;

TEST_CASE("no mode grows under an implicit step, however large") {
  for (double const stiffness : {1.0, 1e4, 1e10})
    for (double const damping : {0.0, 1e-3, 1.0, 1e4})
      for (double const h : {1e-4, 1e-2, 1.0, 1e3}) {
        CAPTURE(stiffness, damping, h);
        CHECK(amplification(BackwardEuler{}, stiffness, damping, h) < 1);
        CHECK(amplification(CrankNicolson{}, stiffness, damping, h) < 1 + 1e-9);
        CHECK(amplification(ThetaScheme{.theta = 0.75}, stiffness, damping, h) < 1 + 1e-12);
        if (damping > 0) continue;
        CHECK(amplification(BackwardEuler{}, stiffness, 0.0, h) == Approx(1 / std::sqrt(1 + h * h * stiffness)).epsilon(1e-9).margin(1e-7));
        CHECK(amplification(CrankNicolson{}, stiffness, 0.0, h) == Approx(1.0).epsilon(1e-9));
      }
  CHECK(BackwardEuler{}.stable_step(ModalBounds<float>{1.0F, 1.0F, 0.0F}) == std::numeric_limits<float>::infinity());
  CHECK(CrankNicolson{}.stable_step(ModalBounds<double>{1.0, 1.0, 0.0}) == std::numeric_limits<double>::infinity());
}

TEST_CASE("the theta scheme below one half states its limit, and it is sharp") {
  for (double const theta : {0.0, 0.2, 0.4}) {
    ThetaScheme const scheme{.theta = theta};
    CHECK(testing::to_text(testing::check_integrator(scheme)) == "");
    double const h = scheme.stable_step(ModalBounds<double>{100.0, 0.5, 0.5});
    CHECK(h == Approx(0.5 / (100.0 * (1 - 2 * theta))));
    CHECK(amplification(scheme, 100.0, 0.5, 1.01 * h) > 1);
    CHECK(scheme.stable_step(ModalBounds<double>{100.0, 0.0, 0.0}) == 0);
  }
}

TEST_CASE("theta = 0 is the explicit method of Euler") {
  testing::TwoParticles implicit, plain;
  for (int k = 0; k < 50; ++k) {
    implicit.advance(ThetaScheme{.theta = 0, .tolerance = 1e-14}, 0.01);
    plain.advance(ExplicitEuler{}, 0.01);
  }
  CHECK((implicit.positions() - plain.positions()).norm() < 1e-13);
}

TEST_CASE("a linearised step solves the equation it states") {
  // (1 + hθγ + h²θ²κ) Δv = −hκx − hγv − h²θκv, for κ = 9, γ = 2 from x = 1 and from v = 1.
  double const h = 0.3, k = 9, c = 2;
  for (double const theta : {0.5, 0.8, 1.0}) {
    detail::OscillatorSystem<double> system(k, c);
    ThetaScheme{.theta = theta, .tolerance = 1e-14}.step(system, h);
    double const inverse = 1 / (1 + h * theta * c + h * h * theta * theta * k);
    double const from_x = -h * k * inverse, from_v = -(h * c + h * h * theta * k) * inverse;
    CHECK(system.velocities()(0) == Approx(from_x));
    CHECK(system.positions()(0) == Approx(1 + h * theta * from_x));
    CHECK(system.velocities()(1) == Approx(1 + from_v));
    CHECK(system.positions()(1) == Approx(h * (1 + theta * from_v)));
    CHECK(system.previous_acceleration()(1) == Approx(from_v / h));
  }
}

TEST_CASE("forces that are no numbers reach the body") {
  testing::TwoParticles system;
  system.velocities()(1, 1) = std::numeric_limits<double>::quiet_NaN();
  system.advance(BackwardEuler{}, 0.01);
  CHECK(!system.velocities().allFinite());
}
