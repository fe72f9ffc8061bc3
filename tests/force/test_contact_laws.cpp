// SPDX-License-Identifier: MIT
// Yardsticks: the formulas' closed forms, their slopes by differences, and for Hunt and Crossley's law the depth at which a mass turns, in closed
// form, and the energy that an impact may not gain, by Runge and Kutta's method on equations written here.
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/polynomial_contact.hpp>

#include "catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

using namespace palpate;

static_assert(ContactLaw<PolynomialContact<float>, float> && ContactLaw<ExponentialContact<float>, float> && ContactLaw<HuntCrossleyContact<float>, float> &&
              ContactLaw<IndentationSpring<double>, double>);

namespace {

/// The force along the normal.
template <class Law>
double at(Law const& law, double depth, double inward = 0, CuttingPhase phase = CuttingPhase::indenting) {
  Vector3<double> const n(0, 0.6, 0.8);
  Vector3<double> const force = law(ToolContact<double>{.phase = phase, .depth = depth, .normal = n, .velocity = -inward * n});
  CHECK((force - force.dot(n) * n).norm() <= 1e-15 * force.norm());
  return force.dot(n);
}

struct Impact {
  double deepest = 0, speed = 0;
};

/// A mass [kg] that meets a law at a speed [m/s]: how deep it comes, and how fast it leaves.
Impact impact(HuntCrossleyContact<double> const& law, double mass, double speed) {
  using State = std::array<double, 2>;   // depth, inward speed
  auto const slope = [&](State const& s) {
    Vector3<double> const force = law(ToolContact<double>{.phase = CuttingPhase::indenting, .depth = s[0], .velocity = {0, 0, -s[1]}});
    return State{s[1], -force.z() / mass};
  };
  auto const moved = [](State const& s, State const& d, double h) { return State{s[0] + h * d[0], s[1] + h * d[1]}; };
  State s{0, speed};
  Impact result;
  for (double const h = 1e-6; s[0] >= 0;) {
    State const a = slope(s), b = slope(moved(s, a, h / 2)), c = slope(moved(s, b, h / 2)), d = slope(moved(s, c, h));
    for (std::size_t k = 0; k < 2; ++k) s[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
    result.deepest = std::max(result.deepest, s[0]);
  }
  result.speed = -s[1];
  return result;
}

}  // namespace

TEST_CASE("contact laws follow their formulas while the tool indents, and are zero elsewhere") {
  PolynomialContact<double> const polynomial{.linear = 50, .quadratic = 3e3, .cubic = 2e5};
  ExponentialContact<double> const exponential{.scale = 0.2, .rate = 120, .largest_depth = 0.02};
  HuntCrossleyContact<double> const crossley{.stiffness = 4000, .exponent = 1.5, .damping = 2};
  for (double const d : {1e-6, 0.003, 0.01, 0.0199}) {
    CHECK(at(polynomial, d) == Approx(50 * d + 3e3 * d * d + 2e5 * d * d * d));
    CHECK(at(exponential, d) == Approx(0.2 * (std::exp(120 * d) - 1)));
    for (double const v : {-0.3, 0.0, 0.2}) CHECK(at(crossley, d, v) == Approx(4000 * d * std::sqrt(d) * (1 + 2 * v)));
    CHECK(at(crossley, d, -0.6) == 0);   // it does not pull
  }
  auto const check_elsewhere = [](auto const& law) {
    for (CuttingPhase const phase : {CuttingPhase::no_contact, CuttingPhase::moving}) CHECK(at(law, 0.01, 0.1, phase) == 0);
    for (double const d : {0.0, -0.01, -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) CHECK(at(law, d, 0.1) == 0);
  };
  check_elsewhere(polynomial), check_elsewhere(exponential), check_elsewhere(crossley);
}

TEST_CASE("the exponential law stiffens in proportion to its force, and goes on straight beyond its largest depth") {
  ExponentialContact<double> const law{.scale = 0.2, .rate = 120, .largest_depth = 0.02};
  double const h = 1e-7;
  auto const stiffness = [&](double d) { return (at(law, d + h) - at(law, d - h)) / (2 * h); };
  for (double const d : {0.001, 0.01, 0.019}) CHECK(stiffness(d) == Approx(120 * (at(law, d) + 0.2)).epsilon(1e-6));
  for (double const d : {0.021, 0.05, 1.0}) {
    CHECK(stiffness(d) == Approx(120 * 0.2 * std::exp(2.4)).epsilon(1e-5));
    CHECK(at(law, d) == Approx(at(law, 0.02) + 120 * 0.2 * std::exp(2.4) * (d - 0.02)));
  }
}

TEST_CASE("a mass that meets Hunt and Crossley's law turns where the closed form says and leaves slower") {
  double const mass = 0.075, speed = 0.4;
  for (double const n : {1.0, 1.5, 2.2})
    for (double const mu : {0.5, 2.0}) {
      HuntCrossleyContact<double> const law{.stiffness = 3000 * std::pow(0.01, 1 - n), .exponent = n, .damping = mu};
      Impact const found = impact(law, mass, speed);
      double const energy = mass * (speed / mu - std::log1p(mu * speed) / (mu * mu));
      CHECK(found.deepest == Approx(std::pow((n + 1) * energy / law.stiffness, 1 / (n + 1))).epsilon(1e-6));
      CHECK(found.speed < speed);
      // The same integral on the way out: v0/mu - ln(1 + mu v0)/mu^2 = -v1/mu - ln(1 - mu v1)/mu^2.
      CHECK(-found.speed / mu - std::log1p(-mu * found.speed) / (mu * mu) == Approx(energy / mass).epsilon(1e-4));
    }
  HuntCrossleyContact<double> const elastic{.stiffness = 3000, .exponent = 1.5, .damping = 0};
  CHECK(impact(elastic, mass, speed).speed == Approx(speed).epsilon(1e-4));
}

TEST_CASE("a contact law takes the place of the default spring in CuttingForce, and several add up") {
  ToolContact<double> const contact{.phase = CuttingPhase::indenting, .depth = 0.01};
  PolynomialContact<double> const polynomial{.cubic = 1e6};
  ExponentialContact<double> const exponential{.scale = 0.1, .rate = 100};
  HuntCrossleyContact<double> const crossley{.stiffness = 300, .exponent = 1};
  CHECK(CuttingForce<>()(contact).z() == Approx(3 * 0.01 / 0.018));
  CHECK(CuttingForce(polynomial)(contact).z() == Approx(1.0));
  CHECK(CuttingForce(crossley)(contact).z() == Approx(3.0));
  CHECK(CuttingForce(polynomial, exponential)(contact).z() == Approx(1.0 + 0.1 * (std::exp(1.0) - 1)));
}

TEST_CASE("contact laws that would pull in or are not finite are refused") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(CuttingForce(PolynomialContact<double>{.quadratic = -2}), says(".quadratic is -2", "zero or more"));
  CHECK_THROWS_AS(CuttingForce(PolynomialContact<double>{.cubic = nan}), InvalidArgument);
  CHECK_THROWS_AS(CuttingForce(ExponentialContact<double>{.scale = -1}), InvalidArgument);
  CHECK_THROWS_AS(CuttingForce(ExponentialContact<double>{.scale = 1, .rate = nan}), InvalidArgument);
  CHECK_THROWS_WITH(CuttingForce(ExponentialContact<double>{.scale = 1, .rate = 1e5}), says("not finite at 0.02 m"));
  CHECK_THROWS_AS(CuttingForce(ExponentialContact<double>{.largest_depth = 0}), InvalidArgument);
  CHECK_THROWS_WITH(CuttingForce(HuntCrossleyContact<double>{.exponent = 0.5}), says(".exponent is 0.5", "one or more"));
  CHECK_THROWS_AS(CuttingForce(HuntCrossleyContact<double>{.stiffness = nan}), InvalidArgument);
  CHECK_THROWS_AS(CuttingForce(HuntCrossleyContact<double>{.damping = -1}), InvalidArgument);
}
