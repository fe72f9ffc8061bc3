// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/trajectory.hpp>
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

/// How the amplitude of a mass on a wall to both sides grows from 0.2 s to the last seconds, at 1 kHz 20.6 s.
double growth(double mass, double damping, double rate, double wall, int until = 20600) {
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
  swing(until - 600);
  return swing(400) / early;
}

/// How far the tip of a device still moves in a wall, half a second [m], 2 s after a hand has begun to press with so many newtons.
double buzz(double mass, double friction, double quantum, double wall, double newtons) {
  HandOptions const hand{.mass = 0.1, .damping = 2.0, .stiffness = 100.0};
  auto const path = Trajectory<double>::start({0, 0, 0}).line({0, 0, -newtons / hand.stiffness}, 0.5).hold(3.0);
  SimulatedHand<double> device(path, {.hand = hand, .max_force = 1e9, .mass = mass, .damping = 0.1, .friction = friction, .quantum = quantum});
  DeviceState<double> state;
  double low = 1, high = -1;
  for (int k = 0; k < 2500; ++k) {
    device.read(state);
    if (k >= 2000) low = std::min(low, device.position().z()), high = std::max(high, device.position().z());
    device.write({.force = {0, 0, std::max(-wall * state.position.z(), 0.0)}});
  }
  return high - low;
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
TEST_CASE("C1-W1: a sampled wall is stable below the closed form and unstable above it") {
  CHECK(stable_wall(0.045, 0.10, 0.001) == Approx(200.07).epsilon(1e-4));
  CHECK(stable_wall(0.045, 0.25, 0.001) == Approx(500.46).epsilon(1e-4));
  CHECK(stable_wall(0.075, 0.50, 0.001) == Approx(1001.11).epsilon(1e-5));
  CHECK(stable_wall(0.075, 0.50, 0.0005) == Approx(2001.11).epsilon(1e-5));
  CHECK(stable_wall(0.075, 0.50, 0.002) == Approx(501.11).epsilon(1e-4));
  CHECK(stable_wall(0.100, 5.0, 0.001) == Approx(10084.0).epsilon(1e-4));
  CHECK(stable_wall(0.1, 1e-5, 0.001) == Approx(0.02).epsilon(1e-6));
  CHECK(stable_wall(0.1, 0.1 * 0.999999, 0.001) == Approx(stable_wall(0.1, 0.1 * 1.000001, 0.001)).epsilon(1e-5));   // where the series begins
  CHECK(stable_wall(0.1, 0.0, 0.001) == 0.0);
  for (auto const& [wall, ratio] : {std::pair{995.0, 0.795}, std::pair{1001.0, 0.996}, std::pair{1002.0, 1.034}, std::pair{1010.0, 1.394}}) {
    CAPTURE(wall);
    CHECK(growth(0.075, 0.5, 1000.0, wall, 11500) == Approx(ratio).epsilon(0).margin(2e-3));
  }
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

// Yardstick: a mass of 75 g at 0.2 m/s, damping 0.1 N·s/m, contact beginning at a sample: rebounds computed with an independent program.
TEST_CASE("C1-W3: a mass that is thrown at a wall comes back faster than it came where the wall is too stiff") {
  struct Row {
    double stiffness, restitution, half_a_digit;   // of the last one printed
  };
  for (auto const& [stiffness, restitution, half_a_digit] :
       {Row{190.0, 0.9975, 5e-5}, Row{200.0, 0.99996, 5e-6}, Row{220.0, 1.0026, 5e-5}, Row{500.0, 1.039, 5e-4}, Row{1000.0, 1.075, 5e-4},
        Row{2000.0, 1.124, 5e-4}, Row{5000.0, 1.219, 5e-4}}) {
    SampledMass<double> const plant({.mass = 0.075, .damping = 0.1});
    Vector x = Vector::Zero(), v(-0.2, 0, 0);
    do plant.step(x, v, wall_force(stiffness, x.x()));
    while (x.x() < 0);
    CAPTURE(stiffness);
    CHECK(v.x() / 0.2 == Approx(restitution).epsilon(0).margin(half_a_digit));
  }
}

// Yardstick: the energy that a held force leaks at constant speed, in and out again, −K Σ (Δx)²/2 and what the last tick in the wall gives. With n = d/(v T),
// the first sample in the wall p v T deep, the last q v T and the one before the turn a v T short of it:
//   E = −K v T d (1 − (p (1 − p) − q (1 − q) + 4 a (1 − a))/(2 n)),   −K v T d where samples meet the surface, and within 0.63/n of it at any phase.
// One tick of delay leaks three times as much, −3 K v T d + 2 K (v T)².
TEST_CASE("C1-W2 C8-O1: the observer finds what a sampled wall gives at constant speed, at any phase") {
  struct Case {
    double stiffness, speed, depth, joule;
  };
  constexpr double period = 1e-3;
  Random random(Seed{14});
  for (Case const c : {Case{1000, 0.1, 0.010, -1e-3}, Case{500, 0.05, 0.005, -0.125e-3}, Case{2000, 0.2, 0.010, -4e-3}}) {
    double const way = c.speed * period;
    auto const leak = [&](double depth, double phase, int delay) {   // the tip passes `depth` between two samples, or at one
      PassivityController<double> observer({.max_damping = 0.0, .reservoir = 1.0});
      std::vector<Vector> forces(static_cast<std::size_t>(delay), Vector::Zero());
      int const ticks = static_cast<int>(depth / way) + 4;
      for (int k = -ticks; k <= ticks; ++k) {
        double const x = std::abs(way * (k + phase)) - depth;
        forces.push_back(wall_force(c.stiffness, x));
        Vector const force = forces[forces.size() - 1 - static_cast<std::size_t>(delay)];
        CHECK(observer({x, 0, 0}, force) == force);   // it observes alone
        observer.sent(force);
      }
      CHECK(observer.min_energy() <= observer.energy());
      CHECK(observer.damped() == 0);
      return observer.energy();
    };
    double const aligned = -c.stiffness * way * c.depth;
    CAPTURE(c.stiffness);
    CHECK(aligned == Approx(c.joule).epsilon(1e-12));
    CHECK(leak(c.depth, 0.0, 0) == Approx(c.joule).epsilon(1e-9));
    CHECK(leak(c.depth, 0.0, 1) == Approx(3 * c.joule + 2 * c.stiffness * way * way).epsilon(1e-9));
    for (int k = 0; k < 100; ++k) {
      double const phase = random.uniform(0.0, 1.0), n = c.depth / way + random.uniform(0.0, 1.0);
      double const p = n + phase - std::floor(n + phase), q = n - phase - std::floor(n - phase);
      double const off = (p * (1 - p) - q * (1 - q) + 4 * phase * (1 - phase)) / (2 * n);
      CAPTURE(phase, n);
      double const ratio = leak(way * n, phase, 0) / (-c.stiffness * way * way * n);
      CHECK(ratio == Approx(1 - off).epsilon(1e-9));
      CHECK(std::abs(ratio - 1) <= (n < 100 ? 0.0125 : 0.01));
    }
  }
}

// Yardstick: a wall whose force goes in steps of K Δ is held still by friction where no step is larger than 2 f_c; beyond, of all the forces that a hand
// may press with, a share of 1 − 2 f_c/(K Δ) has no place to rest. Three devices; the amplitude of an Omni at 12 kN/m is 9 µm in a cruder simulation.
TEST_CASE("C1-W4: a wall of quantised positions buzzes where its steps exceed what friction holds, and is quiet below") {
  struct Device {
    double mass, friction, quantum, bound;
  };
  for (Device const d : {Device{0.045, 0.26, 55e-6, 9455}, Device{0.045, 0.06, 23e-6, 5217}, Device{0.075, 0.04, 30e-6, 2667}}) {
    CHECK(2 * d.friction / d.quantum == Approx(d.bound).epsilon(1e-3));
    for (double const share : {0.25, 0.5, 0.9, 0.97, 1.1, 1.25, 1.5, 2.0}) {
      double const wall = share * 2 * d.friction / d.quantum;
      constexpr int presses = 40;
      int buzzing = 0;
      double largest = 0;
      for (int k = 0; k < presses; ++k) {
        double const swing = buzz(d.mass, d.friction, d.quantum, wall, 1.0 + wall * d.quantum * k / presses);
        if (swing > 1e-7) ++buzzing;
        largest = std::max(largest, swing);
      }
      CAPTURE(d.bound, share, largest);
      CHECK(buzzing == Approx(presses * std::max(0.0, 1 - 1 / share)).epsilon(0).margin(1.0));
      if (d.bound == 9455 && share == 1.25) CHECK((largest > 2e-6 && largest < 20e-6));
    }
  }
}

// Yardstick: a rebound slower than the impact, at every wall up to 20 kN/m.
TEST_CASE("C8-O3: with the controller no wall throws a mass back faster than it came") {
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
    CHECK(controller.min_energy() > -1e-3);
  }
}

TEST_CASE("C8-O2 C8-O4 C8-O6: the controller leaves alone what dissipates, free space, and a tip that stands still") {
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
TEST_CASE("C8-O5: a full reservoir does not hide a wall that gives energy") {
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
  CHECK_THROWS_WITH(PassivityController<double>({.period = 0.0}), says(".period is 0 s", "0.001"));
  CHECK_THROWS_AS(PassivityController<double>({.max_damping = nan}), InvalidArgument);
  CHECK_THROWS_WITH(PassivityController<double>({.device_damping = -1.0}), says(".device_damping is -1 N·s/m", "zero or more"));
  CHECK_THROWS_AS(PassivityController<double>({.reservoir = 0.0}), InvalidArgument);
  CHECK_THROWS_WITH(SampledMass<double>({.mass = -1.0}), says(".mass is -1 kg", "above zero"));
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
