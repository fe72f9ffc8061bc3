// SPDX-License-Identifier: MIT
// Yardsticks: the closed forms of one damped particle, and an extrapolated midpoint reference that uses none of these integrators.
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/testing/integrator.hpp>

#include "catch.hpp"

#include <array>
#include <cmath>
#include <limits>

using namespace palpate;

namespace {

struct Midpoint {   // of a user: no remembered acceleration, no stable step, matrices instead of scratch
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

struct PlainLeapfrog {   // forgets that damping belongs into the middle of the step: first order, although it says 2
  static constexpr int order = 2;

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    system.positions() += h / 2 * system.velocities();
    typename System::Matrix const a = system.acceleration(system.positions(), system.velocities());
    system.velocities() += h * a;
    system.positions() += h / 2 * system.velocities();
  }
};

struct Restless : Midpoint {   // moves without time
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    Midpoint::step(system, h);
    system.positions() *= 1 + 1e-15;
  }
};

struct Boastful : LeapfrogVerlet {   // states twice its stable step
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return 2 * LeapfrogVerlet::stable_step(modes);
  }
};

/// Particles on home springs, one a column, each with its own damping ratio.
template <RealScalar S>
struct HomeSprings {
  using Scalar = S;
  using Matrix = Matrix3X<S>;

  explicit HomeSprings(std::array<double, 5> const& ratios) : x(3, 5), v(3, 5), memory(Matrix::Zero(3, 5)) {
    x.setZero();
    v.setZero();
    v.row(2).setConstant(S(0.5));
    for (int i = 0; i < 5; ++i) damping[i] = S(2 * ratios[static_cast<std::size_t>(i)] * 4.0 * 0.01);
    for (auto& columns : unused) columns.setConstant(3, 5, std::numeric_limits<S>::quiet_NaN());
  }
  Matrix& positions() { return x; }
  Matrix& velocities() { return v; }
  template <class X, class V>
  Matrix acceleration(X const& at, V const& speed) const {
    return (-S(0.16) * at - speed * damping.asDiagonal()) / S(0.01);
  }
  template <class X, class V, class Out>
  void acceleration(X const& at, V const& speed, Out&& out) const {
    out = acceleration(at, speed);
  }
  Matrix& scratch(int k) { return unused[k]; }
  Matrix& remembered_acceleration() { return memory; }
  bool remembers() const { return any_step; }

  Matrix x, v, memory;
  Eigen::Matrix<S, 5, 1> damping;
  Matrix unused[8];
  bool any_step = false;
};

/// Impulse response of m x″ + d x′ + k x = 0, x(0) = 0, x′(0) = 0.5, ω = 4.
double impulse_response(double ratio, double t) {
  double const decay = std::exp(-ratio * 4.0 * t);
  if (ratio > 1) return 0.5 / (4 * std::sqrt(ratio * ratio - 1)) * decay * std::sinh(4 * std::sqrt(ratio * ratio - 1) * t);
  if (ratio == 1) return 0.5 * t * decay;
  return 0.5 / (4 * std::sqrt(1 - ratio * ratio)) * decay * std::sin(4 * std::sqrt(1 - ratio * ratio) * t);
}

}  // namespace

TEMPLATE_TEST_CASE("every integrator obeys the laws of its family", "", ExplicitEuler, SymplecticEuler, LeapfrogVerlet, VelocityVerlet,
                   RungeKutta4, Midpoint) {
  CHECK(testing::to_text(testing::check_integrator(TestType{})) == "");
}

TEMPLATE_TEST_CASE("the measured order is the stated one, damped and from the first step on", "", ExplicitEuler, SymplecticEuler,
                   LeapfrogVerlet, VelocityVerlet, RungeKutta4) {
  double const order = testing::measured_order(TestType{});
  CHECK(order > TestType::order - 0.1);
  CHECK(order < TestType::order + 0.1);
}

TEST_CASE("the laws catch integrators that break them") {
  CHECK_THAT(testing::to_text(testing::check_integrator(PlainLeapfrog{})), Catch::Contains("the order is 2 but the error shrinks as h^1.0"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Restless{})), Catch::Contains("a step of zero moves the particles"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Boastful{})), Catch::Contains("stable_step({1, 0, 0}) is 4 s, but the mode"));
}

TEMPLATE_PRODUCT_TEST_CASE("one particle on its home spring follows the closed forms, from overdamped to undamped", "", std::pair,
                           ((ExplicitEuler, double), (SymplecticEuler, double), (LeapfrogVerlet, double), (VelocityVerlet, double),
                            (RungeKutta4, double), (LeapfrogVerlet, float), (VelocityVerlet, float), (RungeKutta4, float))) {
  using I = typename TestType::first_type;
  using S = typename TestType::second_type;
  std::array<double, 5> const ratios{2.0, 1.0, 0.5, 0.1, 0.0};
  double const h = std::same_as<S, float> ? 1.0 / 128 : 1.0 / 1024;
  HomeSprings<S> particles(ratios);
  // Global error C h^order with C ≈ ω^order t/2 or less for these motions of amplitude 1/8.
  double const tolerance = std::max(std::same_as<S, float> ? 1e-6 : 1e-13, 0.5 * std::pow(4 * h, I::order));
  int const steps = static_cast<int>(2.0 / h);
  for (int n = 1; n <= steps; ++n) {
    I{}.step(particles, S(h));
    particles.any_step = true;
    if (n % (steps / 16) != 0) continue;
    for (int i = 0; i < 5; ++i) {
      CAPTURE(n * h, ratios[static_cast<std::size_t>(i)]);
      CHECK(double(particles.x(2, i)) == Approx(impulse_response(ratios[static_cast<std::size_t>(i)], n * h)).margin(tolerance));
    }
  }
}
