// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/sampled_wall.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

using Vector = Vector3<double>;

/// How the amplitude of a mass on a wall to both sides grows from the first seconds to the last.
double growth(double mass, double damping, double rate, double wall) {
  SampledMass<double> const plant({.mass = mass, .damping = damping, .rate = rate});
  Vector x = Vector::Zero(), v(0.002, 0, 0);
  auto const swing = [&](int ticks) {
    double largest = 0;
    for (int k = 0; k < ticks; ++k) {
      Vector const force(-wall * x.x(), 0, 0);
      plant.step(x, v, force);
      largest = std::isfinite(x.x()) ? std::max(largest, std::abs(x.x())) : std::numeric_limits<double>::infinity();
    }
    return largest;
  };
  swing(200);
  double const early = swing(400);
  swing(20000);
  return swing(400) / early;
}

/// A wall that pushes out along x, rendered from samples.
Vector wall_force(double stiffness, double x) { return {x < 0 ? -stiffness * x : 0.0, 0, 0}; }

}  // namespace

// Yardstick: the solutions of the textbook, x = F/b t − F m/b² (1 − e^(−b t/m)), v = F/b (1 − e^(−b t/m)), and the damped oscillation.
TEMPLATE_TEST_CASE("a sampled mass moves as its differential equation says, at any tick length", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (double const rate : {10.0, 1000.0}) {
    SampledMass<S> const mass({.mass = 0.075, .damping = 0.5, .rate = rate});
    Vector3<S> x = Vector3<S>::Zero(), v = Vector3<S>::Zero();
    for (int k = 0; k < static_cast<int>(0.5 * rate); ++k) mass.step(x, v, {S(0.3), S(0), S(-0.6)});
    double const gone = std::exp(-0.5 * 0.5 / 0.075);
    CHECK(double(v.x()) == Approx(0.6 * (1 - gone)).epsilon(1e-5));
    CHECK(double(x.z()) == Approx(-1.2 * 0.5 + 1.2 * 0.15 * (1 - gone)).epsilon(2e-5));

    SampledMass<S> const swing({.mass = 0.2, .damping = 1.0, .stiffness = 80.0, .rate = rate});
    x = {S(0.01), S(0), S(0)}, v.setZero();
    for (int k = 0; k < static_cast<int>(0.5 * rate); ++k) swing.step(x, v, {S(0.4), S(0), S(0)}, {S(0.002), S(0), S(0)});
    double const decay = 2.5, omega = std::sqrt(400 - decay * decay), rest = 0.002 + 0.4 / 80, t = 0.5;
    CHECK(double(x.x()) == Approx(rest + (0.01 - rest) * std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t))).epsilon(1e-4));
  }
  SampledMass<S> const free({.mass = 2.0, .damping = 0.0, .rate = 100.0});   // without damping: a parabola
  Vector3<S> x = Vector3<S>::Zero(), v(S(1), S(0), S(0));
  free.step(x, v, {S(4), S(0), S(0)});
  CHECK(double(x.x()) == Approx(0.01 + 2.0 / 2 * 1e-4));
  CHECK(double(v.x()) == Approx(1.02));
}

// Yardstick: the closed form of the stiffest stable wall, on both sides of it, for masses, dampings and rates drawn at random; six printed values.
TEST_CASE("a sampled wall is stable below the closed form and unstable above it") {
  CHECK(stable_wall(0.045, 0.10, 0.001) == Approx(200.07).epsilon(1e-4));
  CHECK(stable_wall(0.045, 0.25, 0.001) == Approx(500.46).epsilon(1e-4));
  CHECK(stable_wall(0.075, 0.50, 0.001) == Approx(1001.11).epsilon(1e-5));
  CHECK(stable_wall(0.075, 0.50, 0.0005) == Approx(2001.11).epsilon(1e-5));
  CHECK(stable_wall(0.075, 0.50, 0.002) == Approx(501.11).epsilon(1e-4));
  CHECK(stable_wall(0.100, 5.0, 0.001) == Approx(10084.0).epsilon(1e-4));
  CHECK(stable_wall(0.1, 1e-5, 0.001) == Approx(0.02).epsilon(1e-6));
  CHECK(stable_wall(0.1, 0.1 * 0.999999, 0.001) == Approx(stable_wall(0.1, 0.1 * 1.000001, 0.001)).epsilon(1e-5));   // where the series begins
  CHECK(stable_wall(0.1, 0.0, 0.001) == 0.0);
  CHECK(growth(0.075, 0.5, 1000.0, 995.0) < 1.0);
  CHECK(growth(0.075, 0.5, 1000.0, 1010.0) > 1.0);
  Random random(Seed{12});
  for (int set = 0; set < 20; ++set) {
    double const mass = random.uniform(0.03, 0.3), damping = random.uniform(0.05, 3.0), rate = random.uniform(300.0, 3000.0);
    double const limit = stable_wall(mass, damping, 1 / rate);
    CAPTURE(mass, damping, rate, limit);
    CHECK(growth(mass, damping, rate, 0.995 * limit) < 1.0);
    CHECK(growth(mass, damping, rate, 1.005 * limit) > 1.0);
  }
  for (double const y : {2.0, 3.0, 4.0, 5.0, 10.0, 50.0}) {   // much damping: the limit is another one
    double const damping = y * 0.02 / 0.001, limit = stable_wall(0.02, damping, 0.001);
    CAPTURE(y, limit);
    CHECK(growth(0.02, damping, 1000.0, 0.98 * limit) < 1.0);
    CHECK(growth(0.02, damping, 1000.0, 1.02 * limit) > 1.0);
  }
  // Colgate and Schenkel's bound, by hand.
  CHECK(passive_wall(0.5, 0.0, 0.001) == Approx(1000.0));
  CHECK(passive_wall(0.5, -0.2, 0.001) == Approx(600.0));
  CHECK(passive_wall(0.5, 0.7, 0.001) == 0.0);
}

// Yardstick: a mass of 75 g at 0.2 m/s, damping 0.1 N·s/m, contact beginning at a sample: rebounds computed with an independent program, printed to
// four digits.
TEST_CASE("a mass that is thrown at a wall comes back faster than it came where the wall is too stiff") {
  for (auto const& [stiffness, restitution] : {std::pair{190.0, 0.9975}, std::pair{200.0, 0.99996}, std::pair{220.0, 1.0026}, std::pair{500.0, 1.039},
                                               std::pair{1000.0, 1.075}, std::pair{2000.0, 1.124}, std::pair{5000.0, 1.219}}) {
    SampledMass<double> const plant({.mass = 0.075, .damping = 0.1});
    Vector x = Vector::Zero(), v(-0.2, 0, 0);
    do plant.step(x, v, wall_force(stiffness, x.x()));
    while (x.x() < 0);
    CAPTURE(stiffness);
    CHECK(v.x() / 0.2 == Approx(restitution).margin(restitution == 0.9975 ? 0.003 : 0.004));
  }
}

// Yardstick: the energy that a held force leaks at constant speed, in and out again: −K v T d exactly where samples meet the surface.
TEST_CASE("the observer finds what a sampled wall gives at constant speed") {
  struct Case {
    double stiffness, speed, depth, joule;
  };
  for (Case const c : {Case{1000, 0.1, 0.010, -1e-3}, Case{500, 0.05, 0.005, -0.125e-3}, Case{2000, 0.2, 0.010, -4e-3}}) {
    PassivityController<double> observer({.max_damping = 0.0, .reservoir = 1.0});
    int const ticks = static_cast<int>(std::lround(c.depth / (c.speed * 1e-3)));
    for (int k = -2; k <= 2 * ticks + 2; ++k) {
      double const x = -c.depth * (1 - std::abs(double(k - ticks)) / ticks);
      Vector const force = wall_force(c.stiffness, x), told = observer({x, 0, 0}, force);
      CHECK(told == force);   // it observes alone
      observer.sent(told);
    }
    CHECK(observer.energy() == Approx(c.joule).epsilon(1e-9));
    CHECK(observer.least_energy() <= observer.energy());
    CHECK(observer.damped() == 0);
  }
  // One tick of delay leaks three times as much: −3 K v T d, up to the ends.
  PassivityController<double> late({.max_damping = 0.0, .reservoir = 1.0});
  Vector before = Vector::Zero();
  for (int k = -2; k <= 210; ++k) {
    Vector const force = wall_force(1000, -0.010 * (1 - std::abs(double(k - 100)) / 100));
    late({-0.010 * (1 - std::abs(double(k - 100)) / 100), 0, 0}, before);
    late.sent(before);
    before = force;
  }
  CHECK(late.energy() == Approx(-2.98e-3).epsilon(0.01));
}

// Yardstick: a rebound slower than the impact, at every wall up to 20 kN/m.
TEST_CASE("with the controller no wall throws a mass back faster than it came") {
  for (double const stiffness : {190.0, 500.0, 2000.0, 5000.0, 10000.0, 20000.0}) {
    SampledMass<double> const plant({.mass = 0.075, .damping = 0.1});
    PassivityController<double> controller({.max_damping = 19.0});
    Vector x = Vector::Zero(), v(-0.2, 0, 0);
    int in_air = 0;
    for (int k = 0; k < 100; ++k) {   // what the last ticks in the wall gave too much is taken back in the first ones outside
      Vector const force = controller(x, wall_force(stiffness, x.x()), stiffness * std::pow(std::min(x.x(), 0.0), 2) / 2);
      controller.sent(force);
      plant.step(x, v, force);
      if (x.x() > 0) ++in_air;
    }
    CAPTURE(stiffness);
    CHECK(v.x() > 0.0);
    CHECK(v.x() < 0.2 * std::exp(-0.1 / 0.075 * 0.001 * (in_air - 1)));   // no more than the device's damping in the air leaves of it
    CHECK(controller.energy() > -1e-6);
    CHECK(controller.least_energy() > -1e-3);
  }
}

TEST_CASE("the controller leaves alone what dissipates, free space, and a tip that stands still") {
  PassivityController<double> controller;
  double x = 0;
  for (int k = 0; k < 4000; ++k) {   // a spring with enough damping for its sampling, K T/2 = 0.5 N·s/m, in and out
    double const next = 0.005 * std::sin(k * 0.004), v = (next - x) / 0.001;
    Vector const wanted(next < 0 ? -1000 * next - 0.6 * v : 0.0, 0, 0);
    x = next;
    CHECK(controller({x, 0, 0}, wanted, 1000 * std::pow(std::min(x, 0.0), 2) / 2) == wanted);
    controller.sent(wanted);
  }
  CHECK(controller.damped() == 0);
  CHECK(controller({x, 0, 0}, {5, 0, 0}) == Vector(5, 0, 0));   // no way, no damping
  controller.reset();
  for (int k = 0; k < 100; ++k) {
    CHECK(controller({0.001 * k, 0.01, -0.002 * k}, Vector::Zero()) == Vector::Zero());
    controller.sent(Vector::Zero());
  }
}

// Yardstick: 5 J taken beforehand, and then a wall that gives: with all of it kept it would vibrate for seconds before the controller acts.
TEST_CASE("a full reservoir does not hide a wall that gives energy") {
  PassivityController<double> controller({.max_damping = 20.0});
  for (int k = 0; k <= 2500; ++k) {   // 2 N against 2.5 m
    controller({1e-3 * k, 0, 0}, {-2, 0, 0});
    controller.sent({-2, 0, 0});
  }
  CHECK(controller.energy() == Approx(5.0).epsilon(1e-9));
  CHECK(controller.stored() == 0.005);
  int ticks = 0;
  double place = 2.5;
  while (controller.damped() == 0 && ticks < 1000) {   // a force along the motion, 1 N at 0.1 m/s: 0.1 W
    place += 1e-4;
    controller({place, 0, 0}, {1, 0, 0});
    controller.sent({1, 0, 0});
    ++ticks;
  }
  CHECK(ticks <= 100);
}

TEST_CASE("what is no number leaves no trace in the energy, malformed options are refused, and a tick allocates nothing") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  PassivityController<double> controller;
  controller({0, 0, 0}, {1, 0, 0});
  controller.sent({1, 0, 0});
  controller({nan, 0, 0}, {1, 0, 0});
  controller.sent({1, 0, 0});
  controller({0.001, 0, 0}, {1, 0, 0});
  CHECK(controller.energy() == 0.0);
  CHECK_THROWS_WITH(PassivityController<double>({.period = 0.0}), "PassivityController: .period is 0 s; give that of the servo, 0.001 for most");
  CHECK_THROWS_AS(PassivityController<double>({.max_damping = nan}), InvalidArgument);
  CHECK_THROWS_WITH(PassivityController<double>({.device_damping = -1.0}), "PassivityController: .device_damping is -1 N·s/m; give a finite number, zero or more");
  CHECK_THROWS_AS(PassivityController<double>({.reservoir = 0.0}), InvalidArgument);
  CHECK_THROWS_WITH(SampledMass<double>({.mass = -1.0}), "SampledMass: .mass is -1 kg; give a finite number above zero");
  CHECK_THROWS_AS(SampledMass<double>({.damping = nan}), InvalidArgument);
  CHECK_THROWS_AS(SampledMass<double>({.stiffness = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(SampledMass<double>({.rate = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(stable_wall(0.0, 1.0, 0.001), InvalidArgument);
  CHECK_THROWS_AS(passive_wall(1.0, nan, 0.001), InvalidArgument);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) controller.sent(controller({0.001 * k, 0, 0}, {1, 0, 0}));
  long const counted = allocations.count();
  CHECK(counted == 0);
}
