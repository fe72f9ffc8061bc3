// SPDX-License-Identifier: MIT
// Yardsticks: the known amplification factors of each method on λ² + γλ + κ = 0, and the definition of stability.
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/explicit_midpoint.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/measured_stability.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/velocity_verlet.hpp>

#include "catch.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

using namespace palpate;

namespace {

using Complex = std::complex<double>;

/// The larger modulus of the roots of λ² − t λ + d.
double larger_root(Complex t, Complex d) {
  Complex const root = std::sqrt(t * t - 4.0 * d);
  return std::max(std::abs((t + root) / 2.0), std::abs((t - root) / 2.0));
}

/// The larger modulus of R(hλ) over the roots of λ² + γλ + κ.
template <class R>
double one_step(R growth, double stiffness, double damping, double h) {
  Complex const root = std::sqrt(Complex(damping * damping - 4 * stiffness));
  return std::max(std::abs(growth(h * (-damping + root) / 2.0)), std::abs(growth(h * (-damping - root) / 2.0)));
}

/// The largest modulus of the roots of 2λ³ + (2q + 3g − 4) λ² + (2 − 4g) λ + g, q = h²κ, g = hγ.
double stoermer_root(double q, double g) {
  Eigen::Matrix3d companion;
  companion << -(q + 1.5 * g - 2), -(1 - 2 * g), -g / 2, 1, 0, 0, 0, 1, 0;
  return companion.eigenvalues().cwiseAbs().maxCoeff();
}

struct Midpoint {   // of a user, states no stable step
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

/// The strongest growth of any mode with κ up to `stiffness` and γ between `least` and `damping`.
template <class I>
double worst_growth(I const& integrator, double stiffness, double damping, double least, double h) {
  double worst = 0;
  for (double const share : {1.0, 0.9, 0.5, 0.1, 1e-2, 1e-4, 1e-6, 0.0})
    for (double const part : {0.0, 0.1, 0.5, 0.9, 1.0})
      worst = std::max(worst, amplification(integrator, share * stiffness, least + part * (damping - least), h));
  return worst;
}

}  // namespace

TEST_CASE("the measured amplification is the known one of Euler's and Runge and Kutta's methods") {
  for (double const stiffness : {0.5, 4.0, 90.0})
    for (double const damping : {0.0, 0.3, 5.0, 30.0})   // none critical: a double root has half the digits
      for (double const h : {0.01, 0.1, 0.3}) {
        CAPTURE(stiffness, damping, h);
        CHECK(amplification(ExplicitEuler{}, stiffness, damping, h) ==
              Approx(one_step([](Complex z) { return 1.0 + z; }, stiffness, damping, h)).epsilon(1e-9));
        CHECK(amplification(Midpoint{}, stiffness, damping, h) ==
              Approx(one_step([](Complex z) { return 1.0 + z + z * z / 2.0; }, stiffness, damping, h)).epsilon(1e-9));
        CHECK(amplification(RungeKutta4{}, stiffness, damping, h) ==
              Approx(one_step([](Complex z) { return 1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))); }, stiffness, damping, h))
                  .epsilon(1e-9));
        CHECK(amplification(ExplicitMidpoint{}, stiffness, damping, h) == Approx(amplification(Midpoint{}, stiffness, damping, h)).epsilon(1e-12));
        CHECK(amplification(StoermerVerlet{}, stiffness, damping, h) == Approx(stoermer_root(h * h * stiffness, h * damping)).epsilon(1e-6));
        // v⁺ = (1 − hγ) v − hκ x, x⁺ = x + h v⁺: trace 2 − hγ − h²κ, determinant 1 − hγ.
        CHECK(amplification(SymplecticEuler{}, stiffness, damping, h) ==
              Approx(larger_root(2 - h * damping - h * h * stiffness, 1 - h * damping)).epsilon(1e-9));
      }
  // Undamped leapfrog and velocity Verlet neither grow nor decay below hω = 2.
  for (double const h : {0.1, 1.0, 1.99}) {
    CHECK(amplification(StoermerVerlet{}, 1.0, 0.0, h) == Approx(1.0).margin(1e-11));
    CHECK(amplification(LeapfrogVerlet{}, 1.0, 0.0, h) == Approx(1.0).margin(1e-11));
    CHECK(amplification(VelocityVerlet{}, 1.0, 0.0, h) == Approx(1.0).margin(1e-11));
  }
  CHECK(amplification(StoermerVerlet{}, 1.0, 0.0, 2.01) > 1.1);
  CHECK(amplification(LeapfrogVerlet{}, 1.0, 0.0, 2.01) > 1.1);
  CHECK(amplification(VelocityVerlet{}, 1.0, 0.0, 2.01) > 1.1);
}

TEMPLATE_TEST_CASE("a stated stable step is stable, and little more is not", "", ExplicitEuler, SymplecticEuler, StoermerVerlet,
                   LeapfrogVerlet, VelocityVerlet, ExplicitMidpoint, RungeKutta4) {
  // Euler's steps, the midpoint rule's, Störmer's and leapfrog's are sharp. Runge and Kutta's is that of the narrowest place of a region, and velocity Verlet's that of
  // the worst of all dampings: with modes of all dampings up to the largest, as here, 10 % and 42 % more is too much. docs/integrators.md has one mode alone.
  double const beyond = std::same_as<TestType, RungeKutta4> ? 1.1 : std::same_as<TestType, VelocityVerlet> ? 1.42 : 1.005;
  for (double const stiffness : {1e-2, 1.0, 3e4})
    for (double const ratio : {0.0, 0.05, 0.7, 1.0, 2.0, 30.0})
      for (double const least : {0.0, 0.3, 1.0}) {
        double const damping = ratio * std::sqrt(stiffness);
        double const h = TestType{}.stable_step(ModalBounds<double>{stiffness, damping, least * damping});
        CAPTURE(stiffness, damping, least, h);
        if (h > 0) CHECK(worst_growth(TestType{}, stiffness, damping, least * damping, 0.9999 * h) < 1 + 1e-9);
        if (beyond > 1.01 && least > 0) continue;   // the least damping is not used
        double const more = h > 0 ? beyond * h : 0.1 / std::sqrt(stiffness);
        CHECK(worst_growth(TestType{}, stiffness, damping, least * damping, more) > 1 + 1e-8);
      }
}

TEST_CASE("without stiffness and damping any step is stable") {
  ModalBounds<double> const free{};
  double const infinite = std::numeric_limits<double>::infinity();
  CHECK(ExplicitEuler{}.stable_step(free) == infinite);
  CHECK(SymplecticEuler{}.stable_step(free) == infinite);
  CHECK(StoermerVerlet{}.stable_step(free) == infinite);
  CHECK(ExplicitMidpoint{}.stable_step(free) == infinite);
  CHECK(LeapfrogVerlet{}.stable_step(free) == infinite);
  CHECK(VelocityVerlet{}.stable_step(free) == infinite);
  CHECK(RungeKutta4{}.stable_step(free) == infinite);
  CHECK(measured_stable_step(Midpoint{}, free) == infinite);
}

TEMPLATE_TEST_CASE("Euler's and the midpoint rule have no stable step without damping, stated or measured", "", ExplicitEuler, ExplicitMidpoint) {
  CHECK(TestType{}.stable_step(ModalBounds<double>{100.0, 0.0, 0.0}) == 0.0);
  CHECK(TestType{}.stable_step(ModalBounds<double>{100.0, 5.0, 0.0}) == 0.0);   // some mode may be undamped
  if (std::same_as<TestType, ExplicitEuler>) CHECK(measured_stable_step(TestType{}, ModalBounds<double>{100.0, 0.0, 0.0}) == 0.0);
  for (double const h : {1e-1, 1e-2, 1e-3})
    CHECK(amplification(TestType{}, 100.0, 0.0, h) ==
          Approx(std::same_as<TestType, ExplicitEuler> ? std::sqrt(1 + 100 * h * h) : std::sqrt(1 + std::pow(10 * h, 4) / 4)).epsilon(1e-12));
}

TEST_CASE("the measured stable step is the known one") {
  // Leapfrog and velocity Verlet undamped: 2/ω. Midpoint on pure damping: 2/γ. Explicit Euler, oscillating: γ/κ.
  CHECK(measured_stable_step(LeapfrogVerlet{}, ModalBounds<double>{100.0, 0.0, 0.0}) == Approx(0.2).epsilon(1e-3));
  CHECK(measured_stable_step(VelocityVerlet{}, ModalBounds<double>{100.0, 0.0, 0.0}) == Approx(0.2).epsilon(1e-3));
  CHECK(measured_stable_step(Midpoint{}, ModalBounds<double>{0.0, 10.0, 10.0}) == Approx(0.2).epsilon(1e-3));
  CHECK(measured_stable_step(ExplicitEuler{}, ModalBounds<double>{100.0, 1.0, 1.0}) == Approx(0.01).epsilon(1e-3));
}
