// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "catch.hpp"

#include "device/message.hpp"
#include "fake_libhd/device.hpp"
#include "phantom/fake.hpp"

#include <palpate/device/phantom.hpp>
#include <palpate/device/session.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace palpate;
using palpate_test::advance_fake;
using palpate_test::force_on;
using palpate_test::fresh_fake;
using palpate_test::message_of;
using palpate_test::unsaid;
using Force = Vector3<double>;

namespace {

/// Ticks of the host: reads, and writes the same force, until the last status that is not good.
DeviceStatus press_phantom(PhantomDevice& device, Force const& force, int ticks) {
  DeviceState<double> state;
  DeviceStatus status = DeviceStatus::ok;
  for (int k = 0; k < ticks && status == DeviceStatus::ok; ++k) {
    status = device.read(state);
    if (status == DeviceStatus::ok) status = device.write({.force = force});
  }
  return status;
}

long allocations_in_callback = 0;
void watch_callback(bool before) {
  static long at_beginning = 0;
  static palpate_test::AllocationCount const count;   // of the scheduler's thread
  if (before)
    at_beginning = count.count();
  else
    allocations_in_callback += count.count() - at_beginning;
}

}  // namespace

TEST_CASE("what is read is the stand-in's hand, in metres, with a rotation", "[phantom]") {
  // Yardstick: the true position in the stand-in, to a step of its encoders; the tilt of the pen, 0.5 rad about x.
  auto& fake = fresh_fake();
  bool const rows = GENERATE(false, true);
  fake.plan.transform_by_rows = rows;
  PhantomDevice device;
  device.open();
  DeviceState<double> state;
  REQUIRE(device.read(state) == DeviceStatus::ok);
  auto const& true_place = fake.seen[0].position;
  Force const place(true_place[0], true_place[1], true_place[2]);
  CHECK((state.position - 1e-3 * place).norm() <= 1e-4);
  double const turn = std::atan2(place.x(), place.z() + 133.35 + 35.0);
  Eigen::Quaternion<double> const expected = Eigen::AngleAxisd(turn, Force::UnitY()) * Eigen::AngleAxisd(0.5, Force::UnitX());
  CHECK(state.orientation.angularDistance(expected) <= 1e-3);
  CHECK(std::abs(state.orientation.norm() - 1.0) <= 1e-15);
  CHECK(device.counts().misuses == 0);
  CHECK(fake.violations == 0);
}

TEST_CASE("the force rises evenly after arming, keeps to the limit and its direction, and ends with the session", "[phantom]") {
  // Yardstick: F k / (0.5 s · 1000 Hz) in the k-th tick with motors on.
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  Force const wanted(0.3, 0.0, -0.4);
  {
    PhantomDevice device;
    DeviceSession const session(device);
    CHECK(fake.seen[0].motors);
    DeviceState<double> state;
    std::vector<double> felt;
    for (int k = 0; k < 600; ++k) {
      REQUIRE(device.read(state) == DeviceStatus::ok);
      felt.push_back(force_on(fake).norm());
      REQUIRE(device.write({.force = wanted}) == DeviceStatus::ok);
    }
    CHECK(felt[0] == 0.0);
    double const first = felt[1];   // the read before it took the first force
    CHECK(first <= 0.5 * 5 / 500);
    for (int k = 2; k < 490; ++k) REQUIRE(felt[std::size_t(k)] - felt[std::size_t(k - 1)] == Approx(0.5 / 500).epsilon(1e-9));
    CHECK((force_on(fake) - wanted).norm() <= 1e-15);

    press_phantom(device, Force(0.0, 40.0, 30.0), 3);
    CHECK((force_on(fake) - Force(0.0, 2.64, 1.98)).norm() <= 1e-12);   // 3.3 N along (4, 3)/5
    double const nan = std::numeric_limits<double>::quiet_NaN();
    press_phantom(device, Force(nan, 0.0, 0.0), 2);
    CHECK(force_on(fake).isZero(0.0));
    press_phantom(device, wanted, 3);
    CHECK((force_on(fake) - wanted).norm() <= 1e-15);
  }
  CHECK(force_on(fake).isZero(0.0));
  CHECK_FALSE(fake.seen[0].motors);
  CHECK(fake.violations == 0);
  CHECK(fake.starts == fake.stops);
}

TEST_CASE("a limit of one's own, and torques", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  fake.plan.output_degrees = 6;
  PhantomDevice device({.max_force = 1.0, .ramp = 0.0});
  DeviceSession const session(device);
  CHECK(device.capabilities().max_force == 1.0);
  DeviceState<double> state;
  for (int k = 0; k < 200; ++k) {
    device.read(state);
    device.write({.force = {0.0, 2.0, 0.0}, .torque = {0.1, 0.0, 0.0}});
  }
  CHECK((force_on(fake) - Force(0.0, 1.0, 0.0)).norm() <= 1e-15);
  CHECK(fake.seen[0].torque[0] == Approx(0.1).epsilon(1e-12));
  device.disarm();
  CHECK_FALSE(fake.seen[0].motors);
  CHECK(press_phantom(device, Force(0.0, 2.0, 0.0), 50) == DeviceStatus::ok);
  CHECK(force_on(fake).isZero(0.0));
  CHECK(fake.violations == 0);
}

TEST_CASE("a force that nobody renews becomes zero, and rises anew", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  PhantomDevice device({.ramp = 0.1});
  DeviceSession const session(device);
  Force const wanted(0.0, 0.5, 0.0);
  press_phantom(device, wanted, 300);
  CHECK(force_on(fake).y() == 0.5);
  DeviceState<double> state;
  int held = 0;
  while (force_on(fake).y() > 0.0 && held < 100) {
    device.read(state);
    ++held;
  }
  CHECK(held == 1 + 20 + 1);   // the tick that takes the last force, 20 ms more, and the first without
  CHECK(device.counts().unattended > 0);
  press_phantom(device, wanted, 3);
  CHECK(force_on(fake).y() > 0.0);
  CHECK(force_on(fake).y() < 0.02);
}

TEST_CASE("errors of force cost the force for a moment, and are told in order", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  fake.plan.mishaps[0] = {.tick = 400, .code = 0x200};
  fake.plan.mishaps[1] = {.tick = 400, .code = 0x203};
  fake.plan.mishaps[2] = {.tick = 500, .code = 0x402};   // a call of ours that it did not like
  PhantomDevice device({.ramp = 0.1});
  DeviceSession const session(device);
  Force const wanted(0.0, 0.5, 0.0);
  while (fake.ticks < 400) REQUIRE(press_phantom(device, wanted, 1) == DeviceStatus::ok);
  CHECK(force_on(fake).y() == 0.5);
  press_phantom(device, wanted, 2);
  CHECK(force_on(fake).y() < 0.02);
  REQUIRE(press_phantom(device, wanted, 150) == DeviceStatus::ok);
  CHECK(force_on(fake).y() == 0.5);
  for (auto const& [code, words] : {std::pair{0x200, "the motors are warm"}, {0x203, "too fast"}, {0x402, "not in a frame"}}) {
    auto const fault = device.pop_fault();
    REQUIRE(fault.has_value());
    CHECK(fault->native_code == code);
    CHECK(std::string(fault->what) == words);
    CHECK(fault->status == DeviceStatus::ok);
  }
  CHECK_FALSE(device.pop_fault().has_value());
  CHECK(device.counts().force_errors == 2);
  CHECK(device.counts().misuses == 1);
}

TEST_CASE("a device at fault is silent until it is opened again", "[phantom]") {
  auto& fake = fresh_fake();
  unsigned const code = GENERATE(0x300u, 0x302u, 0x303u, 0x304u);
  bool const gone = code == 0x302 || code == 0x303;
  fake.plan.hand_is_held = true;
  fake.plan.mishaps[0] = {.tick = 300, .code = code};
  PhantomDevice device({.ramp = 0.1});
  DeviceStatus const expected = gone ? DeviceStatus::disconnected : DeviceStatus::fault;
  {
    DeviceSession const session(device);
    Force const wanted(0.0, 0.5, 0.0);
    CHECK(press_phantom(device, wanted, 1000) == expected);
    CHECK(fake.ticks <= 302);
    advance_fake(1);
    CHECK(force_on(fake).isZero(0.0));
    auto const frames = fake.seen[0].frames.load();
    advance_fake(5);
    CHECK(fake.seen[0].frames == frames);
    CHECK(device.write({.force = wanted}) == expected);
    auto const fault = device.pop_fault();
    REQUIRE(fault.has_value());
    CHECK(fault->native_code == static_cast<int>(code));
    CHECK(fault->status == expected);
    CHECK(unsaid(message_of([&] { device.arm(); }), "at fault", "open it again") == "");
  }
  fake.plan.mishaps[0] = {};
  DeviceSession const again(device);
  CHECK(press_phantom(device, Force::Zero(), 20) == DeviceStatus::ok);
  CHECK(fake.violations == 0);
}

TEST_CASE("the fault that ends a session is told after however many before it", "[phantom]") {
  auto& fake = fresh_fake();
  bool const by_driver = GENERATE(true, false);
  fake.plan.mishaps[0] = {.tick = 50, .code = 0x203, .ticks = 200};   // more than anybody keeps
  if (by_driver)
    fake.plan.mishaps[1] = {.tick = 250, .code = 0x302};
  else
    fake.plan.not_a_number_from = 250, fake.plan.not_a_number_ticks = 100;
  PhantomDevice device;
  DeviceSession const session(device);
  advance_fake(400);
  DeviceFault last{.status = DeviceStatus::ok};
  int count = 0;
  while (auto const fault = device.pop_fault()) {
    CHECK(is_usable(last.status));   // it is the last
    last = *fault;
    ++count;
  }
  CHECK(count == 65);
  CHECK(last.native_code == (by_driver ? 0x302 : 0));
  CHECK(last.status == (by_driver ? DeviceStatus::disconnected : DeviceStatus::fault));
  CHECK(device.counts().force_errors == 200);
  CHECK(fake.violations == 0);
}

TEST_CASE("positions that are not numbers are stale, and for long a fault", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.not_a_number_from = 300;
  int const ticks = GENERATE(3, 20);
  fake.plan.not_a_number_ticks = static_cast<std::uint64_t>(ticks);
  PhantomDevice device;
  DeviceSession const session(device);
  DeviceState<double> state;
  int stale = 0, faults = 0;
  for (int k = 0; k < 500; ++k) {
    DeviceStatus const status = device.read(state);
    REQUIRE(state.position.allFinite());
    stale += status == DeviceStatus::stale ? 1 : 0;
    faults += status == DeviceStatus::fault ? 1 : 0;
    device.write({});
  }
  if (ticks == 3) {
    CHECK(stale == 3);
    CHECK(faults == 0);
  } else {
    CHECK(faults > 100);
    auto const fault = device.pop_fault();
    REQUIRE(fault.has_value());
    CHECK(std::string(fault->what) == "ten ticks without a sound state");
  }
  CHECK(force_on(fake).isZero(0.0));
  CHECK(fake.violations == 0);
}

TEST_CASE("a device without angular velocity is asked for it once", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.turns = false;
  PhantomDevice device;
  DeviceSession const session(device);
  CHECK(press_phantom(device, Force::Zero(), 50) == DeviceStatus::ok);
  CHECK(device.counts().misuses == 1);
}

TEST_CASE("orientation and angular velocity that are missed in one tick are there again in the next", "[phantom]") {
  // Yardstick: the turret follows the true position of the stand-in's hand, which moves on; the turning that it was told to report.
  auto& fake = fresh_fake();
  fake.plan.turning = 0.25;
  fake.plan.misses_at = 700;
  PhantomDevice device;
  DeviceSession const session(device);
  DeviceState<double> state;
  Eigen::Quaternion<double> at_miss;
  while (fake.ticks < 3000) {
    REQUIRE(device.read(state) == DeviceStatus::ok);
    device.write({});
    if (fake.ticks == 701) at_miss = state.orientation;
  }
  auto const& place = fake.seen[0].position;
  double const turn = std::atan2(place[0], place[2] + 133.35 + 35.0);
  for (int k = 0; k < 2000; ++k) device.read(state);
  Eigen::Quaternion<double> const expected =
      Eigen::AngleAxisd(std::atan2(place[0], place[2] + 133.35 + 35.0), Force::UnitY()) * Eigen::AngleAxisd(0.5, Force::UnitX());
  CHECK(std::abs(std::atan2(place[0], place[2] + 133.35 + 35.0) - turn) > 0.05);   // it did turn
  CHECK(state.orientation.angularDistance(expected) <= 1e-3);
  CHECK(state.orientation.angularDistance(at_miss) > 0.05);
  CHECK(state.angular_velocity.y() == 0.25);
  CHECK(device.counts().misuses == 2);
}

TEST_CASE("two devices in one callback, each with its own force and its own faults", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  fake.plan.names[0] = "Left Device", fake.plan.names[1] = "Right Device";
  PhantomDevice left({.device = "Left Device", .ramp = 0.0}), right({.device = "Right Device", .ramp = 0.0});
  DeviceSession const left_session(left);
  CHECK(fake.starts == 1);
  {
    DeviceSession const right_session(right);
    CHECK(fake.starts == 2);
    DeviceState<double> state;
    auto const both = [&](int ticks) {
      for (int k = 0; k < ticks; ++k) {
        REQUIRE(left.read(state) == DeviceStatus::ok);
        left.write({.force = {0.5, 0.0, 0.0}});
        if (is_usable(right.read(state))) right.write({.force = {0.0, -0.25, 0.0}});
      }
    };
    auto const before = fake.ticks.load();
    both(200);
    CHECK(fake.ticks - before <= 202);   // one tick for both of them
    CHECK((force_on(fake, 0) - Force(0.5, 0.0, 0.0)).norm() <= 1e-15);
    CHECK((force_on(fake, 1) - Force(0.0, -0.25, 0.0)).norm() <= 1e-15);
    fake.plan.mishaps[0] = {.tick = fake.ticks + 5, .code = 0x300, .device = 1};
    both(50);
    CHECK(right.read(state) == DeviceStatus::fault);
    CHECK((force_on(fake, 0) - Force(0.5, 0.0, 0.0)).norm() <= 1e-15);
    CHECK(force_on(fake, 1).isZero(0.0));
    CHECK_FALSE(left.pop_fault().has_value());
    CHECK(right.pop_fault().has_value());
  }
  CHECK(press_phantom(left, Force(0.5, 0.0, 0.0), 200) == DeviceStatus::ok);   // the other one's end stopped the clock for a moment
  CHECK((force_on(fake, 0) - Force(0.5, 0.0, 0.0)).norm() <= 1e-15);
  CHECK(fake.violations == 0);
}

TEST_CASE("a hundred thousand ticks of the callback allocate nothing and break no rule", "[phantom][realtime]") {
  REQUIRE(palpate_test::trap_works());
  auto& fake = fresh_fake();
  PhantomDevice device;
  DeviceSession const session(device);
  press_phantom(device, Force(0.0, 0.5, 0.0), 500);
  allocations_in_callback = 0;
  auto const frames = fake.seen[0].frames.load();
  fake.plan.around_callback = &watch_callback;
  advance_fake(100000);
  DeviceState<double> state;
  palpate_test::AllocationCount const host;
  for (int k = 0; k < 1000; ++k) {
    device.read(state);
    device.write({.force = {0.0, 0.5, 0.0}});
  }
  long const in_host = host.count();
  fake.plan.around_callback = nullptr;
  CHECK(in_host == 0);
  CHECK(allocations_in_callback == 0);
  CHECK(fake.seen[0].frames - frames >= 100999);
  CHECK(fake.violations == 0);
  CHECK(device.counts().misuses == 0);
  CHECK_FALSE(device.pop_fault().has_value());
}

TEST_CASE("on a virtual clock two sessions are the same to the bit", "[phantom]") {
  auto const session = [] {
    fresh_fake();
    PhantomDevice device;
    DeviceSession const open(device);
    DeviceState<double> state;
    std::vector<double> seen;
    for (int k = 0; k < 1500; ++k) {
      device.read(state);
      double const depth = std::max(0.0, -state.position.y());   // a soft floor under the hand
      device.write({.force = {0.0, 200.0 * depth, 0.0}});
      seen.insert(seen.end(), {state.position.x(), state.position.y(), state.velocity.y(), state.orientation.w()});
    }
    return seen;
  };
  auto const first = session();
  CHECK(session() == first);
  CHECK(*std::min_element(first.begin(), first.end()) < -0.005);   // it did press
}
