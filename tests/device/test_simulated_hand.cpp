// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"

#include <palpate/device/simulated_hand.hpp>
#include <palpate/testing/device_laws.hpp>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

using namespace palpate;

namespace {

template <class Scalar = double>
Trajectory<Scalar> resting(Scalar z = 0) { return Trajectory<Scalar>::start({0, 0, z}); }

HandOptions no_hand() { return {.mass = 0.0, .damping = 0.0, .stiffness = 0.0, .lets_go_at = 0.0}; }

/// Ticks of the hand under a force that depends on the sample, with the last sample.
template <class Scalar, class Force>
DeviceState<Scalar> run_hand(SimulatedHand<Scalar>& hand, int ticks, Force const& force) {
  DeviceState<Scalar> state;
  for (int tick = 0; tick < ticks; ++tick) {
    hand.read(state);
    hand.write({.force = force(state)});
  }
  return state;
}

/// Largest |x| of a device alone against a spring wall, both ways, in the last second over that in the first.
double growth_at_wall(double stiffness, int force_delay) {
  SimulatedHand<double> device(resting(), {.hand = no_hand(), .max_force = 1e9, .mass = 0.075, .damping = 0.5, .force_delay = force_delay});
  device.place({0, 0, 0}, {0.002, 0, 0});
  DeviceState<double> state;
  double first = 0.0, last = 0.0;
  for (int tick = 0; tick < 12000; ++tick) {
    device.read(state);
    device.write({.force = -stiffness * state.position});
    if (tick < 1000) first = std::max(first, std::abs(state.position.x()));
    if (tick >= 11000) last = std::max(last, std::abs(state.position.x()));
  }
  return last / first;
}

}  // namespace

TEST_CASE("C1-W1: a held wall loses its stability where the exact zero-order hold says", "[device]") {
  // Yardstick: det of the closed loop is 1 at K = (1−e)/(φ²/m − e (T−φ)/(a m)): 1001.11 N/m for 75 g, 0.5 N·s/m, 1 ms; with one tick of delay 333.95.
  CHECK(growth_at_wall(0.995 * 1001.11, 0) < 0.9);
  CHECK(growth_at_wall(1.005 * 1001.11, 0) > 1.1);
  CHECK(growth_at_wall(0.98 * 333.95, 1) < 0.9);
  CHECK(growth_at_wall(1.02 * 333.95, 1) > 1.1);
}

TEMPLATE_TEST_CASE("a held hand gives way by F/k and comes back", "[device]", PALPATE_TEST_SCALARS) {
  // Yardstick: Hooke.
  using Scalar = TestType;
  for (HandOptions const& preset : {light_hand(), normal_hand(), firm_hand()}) {
    SimulatedHand<Scalar> hand(resting<Scalar>(Scalar(0.01)), {.hand = preset});
    auto const pushed = run_hand(hand, 6000, [](auto const&) { return Vector3<Scalar>(0, Scalar(0.6), Scalar(-0.8)); });
    Vector3<double> const expected(0, 0.6 / preset.stiffness, 0.01 - 0.8 / preset.stiffness);
    double const tolerance = 2e-9 + 2e4 * double(std::numeric_limits<Scalar>::epsilon()) * 1e-5;
    CHECK((pushed.position.template cast<double>() - expected).norm() <= tolerance);
    auto const back = run_hand(hand, 6000, [](auto const&) { return Vector3<Scalar>(0, 0, 0); });
    CHECK((back.position.template cast<double>() - Vector3<double>(0, 0, 0.01)).norm() <= tolerance);
  }
}

TEST_CASE("the presets are those of the manual", "[device]") {
  auto const is = [](HandOptions const& hand, double mass, double damping, double stiffness) {
    return hand.mass == mass && hand.damping == damping && hand.stiffness == stiffness && hand.reaction_share == 0.0;
  };
  CHECK(is(light_hand(), 0.10, 2.0, 50.0));
  CHECK(is(normal_hand(), 0.15, 4.0, 150.0));
  CHECK(is(firm_hand(), 0.25, 8.0, 500.0));
}

TEST_CASE("a hand follows a sine with the gain of its mass, spring and damper", "[device]") {
  // Yardstick: H(iω) = (k + iωb_h) / (k − mω² + iω(b + b_h)); the motion within a tick is exact, the path is held at its middle: errors of (ωT)²/24.
  for (double const frequency : {0.5, 2.0, 5.0, 12.0}) {
    HandOptions const holds = normal_hand();
    double const amplitude = 0.002, omega = 2.0 * std::numbers::pi * frequency, mass = holds.mass + 0.045, damping = holds.damping + 0.1;
    SimulatedHand<double> hand(resting().sine({amplitude, 0, 0}, frequency, 20.0), {.hand = holds});
    std::complex<double> sum = 0.0;
    DeviceState<double> state;
    for (int tick = 0; tick < 12000; ++tick) {   // by then the start has died away; then whole periods
      hand.read(state);
      hand.write({});
      if (tick >= 4000) sum += state.position.x() * std::exp(std::complex<double>(0, -omega * tick / 1000.0));
    }
    std::complex<double> const measured = sum * 2.0 / 8000.0 * std::complex<double>(0, 1) / amplitude;
    std::complex<double> const expected = (holds.stiffness + std::complex<double>(0, omega * holds.damping)) /
                                          (holds.stiffness - mass * omega * omega + std::complex<double>(0, omega * damping));
    INFO(frequency);
    CHECK(std::abs(measured - expected) <= 1e-3 * std::abs(expected));
  }
}

TEST_CASE("friction stops a thrown tip after m v²/2f and holds it up to f", "[device]") {
  // Yardstick: constant deceleration, v m/f of time and m v²/2f of way; the last tick may differ by its own way.
  double const mass = 0.05, friction = 0.26, speed = 0.4;
  SimulatedHand<double> device(resting(), {.hand = no_hand(), .mass = mass, .damping = 0.0, .friction = friction});
  Vector3<double> const direction = Vector3<double>(1, 2, -2) / 3;
  device.place({0, 0, 0}, speed * direction);
  DeviceState<double> state;
  device.read(state);
  int stopped = 0;
  for (int tick = 1; tick < 300; ++tick) {
    device.write({});
    device.read(state);
    if (state.velocity.norm() == 0.0 && stopped == 0) stopped = tick;
    if (stopped == 0) {
      double const t = tick / 1000.0;
      REQUIRE((state.position - direction * (speed * t - friction / mass * t * t / 2)).norm() <= 1e-12);
    }
  }
  CHECK(std::abs(stopped - 1000.0 * speed * mass / friction) <= 1.0);
  CHECK(state.position.dot(direction) == Approx(mass * speed * speed / 2 / friction).epsilon(1e-4));

  Vector3<double> const rests = state.position;
  auto const held = run_hand(device, 500, [&](auto const&) { return Vector3<double>(0.99 * friction * direction); });
  CHECK(held.position == rests);
  auto const slips = run_hand(device, 501, [&](auto const&) { return Vector3<double>(1.01 * friction * direction); });
  CHECK((slips.position - rests).norm() == Approx(0.01 * friction / mass * 0.125).epsilon(0.01));   // a t²/2 of what is left
}

TEST_CASE("friction takes energy and never gives any", "[device]") {
  // Yardstick: kinetic energy and that of the hand's spring, about a path at rest.
  SimulatedHand<double> device(resting(), {.hand = {.mass = 0.1, .damping = 0.0, .stiffness = 400.0}, .damping = 0.0, .friction = 0.1});
  device.place({0.01, -0.004, 0.002}, {0, 0.2, 0.1});
  auto const energy = [&] { return 0.5 * 0.145 * device.velocity().squaredNorm() + 0.5 * 400.0 * device.position().squaredNorm(); };
  double before = energy();
  DeviceState<double> state;
  device.read(state);
  for (int tick = 0; tick < 2000; ++tick) {
    device.write({});
    device.read(state);
    REQUIRE(energy() <= before * (1 + 1e-12));
    before = energy();
  }
  CHECK(device.velocity().isZero(0.0));
  CHECK(device.position().norm() <= 0.1 / 400.0);   // where friction holds the spring
}

TEST_CASE("a hand that lets go leaves the device alone with its momentum", "[device]") {
  // Yardstick: m ẍ + b ẋ = 0 from then on: v e^(−bt/m).
  double const rate = 1000.0, mass = 0.045, damping = 0.1;
  SimulatedHand<double> hand(resting().line({0.4, 0, 0}, 4.0), {.hand = [] { HandOptions o = firm_hand(); o.lets_go_at = 2.0; return o; }()});
  DeviceState<double> state;
  double left_with = 0.0, left_at = 0.0;
  for (int tick = 0; tick < 4000; ++tick) {
    hand.read(state);
    hand.write({});
    REQUIRE(hand.holds() == (tick < 2000));
    if (tick == 2000) left_with = state.velocity.x(), left_at = state.position.x();
    if (tick >= 2000) {
      double const t = (tick - 2000) / rate, decay = std::exp(-damping / mass * t);
      REQUIRE(std::abs(state.velocity.x() - left_with * decay) <= 1e-12);
      REQUIRE(std::abs(state.position.x() - left_at - left_with * mass / damping * (1 - decay)) <= 1e-12);
    }
  }
  CHECK(left_with == Approx(0.1 * 8.0 / 8.1).epsilon(0.02));   // it went with the path, but for the device's damping
  hand.take_hold();
  auto const back = run_hand(hand, 5000, [](auto const&) { return Vector3<double>(0, 0, 0); });
  CHECK((back.position - Vector3<double>(0.4, 0, 0)).norm() <= 1e-6);
  hand.let_go();
  CHECK_FALSE(hand.holds());
}

TEST_CASE("a hand that reacts late moves as its delay equation says", "[device]") {
  // Yardstick: m ẍ + b ẋ + k (1 − r) x + k r x(t − τ) = F by steps of 2 µs; the servo holds what was seen for a tick, half a tick later on average.
  HandOptions late = normal_hand();
  late.reaction_share = 0.5, late.reaction_delay = 0.040;
  SimulatedHand<double> hand(resting(), {.hand = late});
  DeviceState<double> state;
  double const h = 2e-6, mass = 0.195, damping = 4.1, k = 150.0, force = 0.5;
  int const per_tick = 500, delay = 20250;   // 40 ms and half a tick
  std::vector<double> path(1, 0.0);
  double x = 0.0, v = 0.0, worst = 0.0, largest = 0.0;
  hand.read(state);
  for (int tick = 1; tick <= 400; ++tick) {
    hand.write({.force = {force, 0, 0}});
    hand.read(state);
    for (int step = 0; step < per_tick; ++step) {
      double const seen = path.size() > static_cast<std::size_t>(delay) ? path[path.size() - 1 - static_cast<std::size_t>(delay)] : 0.0;
      v += h / mass * (force - damping * v - 0.5 * k * x - 0.5 * k * seen);
      x += h * v;
      path.push_back(x);
    }
    worst = std::max(worst, std::abs(state.position.x() - x));
    largest = std::max(largest, x);
  }
  CHECK(worst <= 1e-3 * largest);
  CHECK(largest > 1.05 * force / k);   // it overshoots where the same hand without delay does not
}

TEST_CASE("tremor shakes the tip by what the hand passes on", "[device]") {
  // Yardstick: the band's spectrum 1/|1 − 2r cos θ z + r² z²|², z = e^(−iωT), through |k + iωb_h|² / |k − mω² + iω(b + b_h)|², summed up.
  double const amplitude = 1e-3;
  SimulatedHand<double> hand(resting(), {.hand = normal_hand(), .tremor = {.bandwidth = 0.5, .amplitude = amplitude, .seed = 4}});
  DeviceState<double> state;
  double squares = 0.0;
  int const ticks = 200000;
  for (int tick = 0; tick < ticks; ++tick) {
    hand.read(state);
    hand.write({});
    squares += state.position.squaredNorm() / 3.0;
  }
  double through = 0.0, band = 0.0;
  double const r = std::exp(-std::numbers::pi * 0.5 / 1000.0), cosine = std::cos(2.0 * std::numbers::pi * 10.0 / 1000.0);
  for (double frequency = 0.005; frequency < 100.0; frequency += 0.01) {
    double const omega = 2.0 * std::numbers::pi * frequency;
    std::complex<double> const z = std::exp(std::complex<double>(0, -omega / 1000.0));
    double const density = 1.0 / std::norm(1.0 - 2.0 * r * cosine * z + r * r * z * z);
    band += density;
    std::complex<double> const passed(150.0, omega * 4.0), held(150.0 - 0.195 * omega * omega, omega * 4.1);
    through += density * std::norm(passed) / std::norm(held);
  }
  CHECK(std::sqrt(squares / ticks) == Approx(std::sqrt(through / band) * amplitude).epsilon(0.05));
  auto const first = state.position;
  hand.rewind();
  CHECK(run_hand(hand, ticks, [](auto const&) { return Vector3<double>(0, 0, 0); }).position == first);
}

TEST_CASE("what is written is limited, late by its ticks, and quantised where it is read", "[device]") {
  SimulatedHand<double> hand(resting(), {.hand = no_hand(), .max_force = 2.0, .mass = 0.1, .damping = 0.0, .quantum = 1e-4, .force_delay = 3});
  CHECK(hand.capabilities().resolution == 1e-4);
  CHECK(hand.capabilities().mass == 0.1);
  DeviceState<double> state;
  for (int tick = 0; tick <= 100; ++tick) {
    hand.read(state);
    hand.write({.force = {30.0, 40.0, 0}});
    if (tick <= 3) CHECK(hand.position().isZero(0.0));
  }
  CHECK((hand.last_wrench().force - Vector3<double>(1.2, 1.6, 0)).norm() <= 1e-15);
  CHECK(hand.position().norm() == Approx(0.5 * 2.0 / 0.1 * 0.097 * 0.097));   // 97 ticks of 20 m/s²
  CHECK(std::abs(state.position.x() - hand.position().x()) <= 0.5e-4);
  CHECK(std::abs(state.position.x() / 1e-4 - std::round(state.position.x() / 1e-4)) <= 1e-9);
  hand.write({.force = {std::numeric_limits<double>::quiet_NaN(), 0, 0}});
  CHECK(hand.last_wrench().force.isZero(0.0));
}

// Yardstick: where p − x = d for long, every share of the spring gives k d, late or not; dampers give b ẋ of device alone.
TEST_CASE("a hand that reacts late is no farther along its path", "[device]") {
  for (double const share : {0.0, 0.5, 1.0}) {
    HandOptions late = light_hand();
    late.reaction_share = share, late.reaction_delay = 0.03;
    SimulatedHand<double> hand(resting().line({2, 0, 0}, 20.0, Pace::constant), {.hand = late});
    DeviceState<double> state;
    for (int k = 0; k <= 19000; ++k) hand.read(state);
    double const lag = hand.path().at(19.0).position.x() - state.position.x();
    CHECK(lag == Approx(0.1 * 0.1 / 50.0).margin(2e-6));   // 0.1 N·s/m of the device's, at 0.1 m/s, on 50 N/m
  }
}

TEMPLATE_TEST_CASE("simulated hands keep the laws of a device and do not allocate", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  HandOptions late = light_hand();
  late.reaction_share = 0.5, late.reaction_delay = 0.03, late.lets_go_at = 0.8;
  SimulatedHand<Scalar> hand(resting<Scalar>().sine({Scalar(0.01), 0, 0}, 2.0, 0.5),
                             {.hand = late, .tremor = {.amplitude = 1e-4}, .friction = 0.1, .quantum = 1e-5, .force_delay = 2, .buttons = 2});
  CHECK(testing::to_text(testing::check_device<Scalar>(hand, {.force = 1.0})) == "");
  DeviceState<Scalar> state;
  hand.rewind();
  hand.set_buttons(2);
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  testing::serve(hand, state, 2000);
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(state.buttons == 2);
}

TEST_CASE("hands that can not be are refused with advice", "[device]") {
  using palpate_test::message_of;
  using palpate_test::unsaid;
  auto const refusal = [](SimulatedHandOptions const& options) { return message_of([&] { SimulatedHand<double>(resting(), options); }); };
  CHECK(unsaid(refusal({.mass = 0.0}), "SimulatedHand", ".mass is 0") == "");
  CHECK(unsaid(refusal({.friction = -1.0}), ".friction is -1") == "");
  CHECK(unsaid(refusal({.rate = 0.0}), ".rate is 0") == "");
  CHECK(unsaid(refusal({.force_delay = -1}), ".force_delay is -1") == "");
  CHECK(unsaid(refusal({.buttons = 33}), ".buttons is 33") == "");
  CHECK(unsaid(refusal({.hand = {.stiffness = std::numeric_limits<double>::infinity()}}), ".hand.stiffness is inf") == "");
  CHECK(unsaid(refusal({.hand = {.reaction_share = 2.0}}), ".hand.reaction_share is 2") == "");
  CHECK(unsaid(refusal({.hand = {.reaction_share = 1.0, .reaction_delay = 0.1}}), "0.1 s", "shakes by itself", "reaction_share") == "");
  CHECK(refusal({.hand = {.reaction_share = 1.0, .reaction_delay = 0.02}}) == "(no exception)");
}
