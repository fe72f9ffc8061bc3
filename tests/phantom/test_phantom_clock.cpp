// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "phantom/fake.hpp"

#include "servo_guard.hpp"

#include <palpate/device/phantom.hpp>
#include <palpate/device/session.hpp>
#include <palpate/testing/device_laws.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

using namespace palpate;
using palpate_test::fresh_fake;
using palpate_test::soon;

namespace {

/// A servo loop in the driver's thread.
struct PhantomLoop {
  explicit PhantomLoop(PhantomDevice& held) : device(held) {}

  static void tick(void* self) noexcept { static_cast<PhantomLoop*>(self)->tick(); }
  void tick() noexcept {
    thread.store(std::this_thread::get_id());
    DeviceState<double> state;
    DeviceStatus const status = device.read(state);
    (status == DeviceStatus::ok ? good : bad).fetch_add(1);
    last.store(status);
    device.write({.force = {0.0, 0.5, 0.0}});
  }

  PhantomDevice& device;
  std::atomic<int> good{0}, bad{0};
  std::atomic<DeviceStatus> last{DeviceStatus::ok};
  std::atomic<std::thread::id> thread{};
};

fake_libhd::Seen* watched_phantom = nullptr;
std::atomic<bool> is_left{false};       // nobody writes any more
std::atomic<int> ticks_of_force{0};     // since then
std::atomic<double> lowest_of_phantom{25.0};

}  // namespace

TEST_CASE("a self-clocked PHANToM calls once a tick from the driver's thread, until it is stopped", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = GENERATE(false, true);
  fake.plan.hand_is_held = true;
  PhantomDevice device({.ramp = 0.0});
  DeviceSession const session(device);
  CHECK(device.has_virtual_clock() == !fake.plan.real_clock);
  PhantomLoop loop(device);
  device.start(&PhantomLoop::tick, &loop);
  DeviceState<double> state;
  CHECK(device.read(state) == DeviceStatus::stale);   // the tick's alone
  CHECK(device.write({}) == DeviceStatus::stale);
  CHECK_THROWS_AS(device.start(&PhantomLoop::tick, &loop), InvalidArgument);
  REQUIRE(soon([&] { return loop.good > 50; }));
  CHECK(palpate_test::force_on(fake).y() > 0.0);
  device.stop();
  int const calls = loop.good + loop.bad;
  CHECK(loop.bad == 0);
  CHECK(loop.thread.load() != std::this_thread::get_id());
  std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(loop.good == calls);
  CHECK(soon([&] { return device.read(state) == DeviceStatus::ok; }));   // the host's again
  device.start(&PhantomLoop::tick, &loop);
  REQUIRE(soon([&] { return loop.good > calls + 5; }));
  device.stop();
  CHECK(fake.violations == 0);
}

TEST_CASE("neither the tick's last force nor one from before start() is given after stop()", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  PhantomDevice device({.ramp = 0.0});
  DeviceSession const session(device);
  DeviceState<double> state;
  auto const read_on = [&](double& most) {
    for (int k = 0; k < 60; ++k) {
      device.read(state);
      most = std::max(most, palpate_test::force_on(fake).norm());
    }
  };
  double most = 0.0;
  device.write({.force = {1.0, 0.0, 0.0}});
  read_on(most);
  CHECK(most > 0.3);   // it is felt
  PhantomLoop loop(device);   // writes 0.5 N
  device.write({.force = {1.0, 0.0, 0.0}});
  device.start(&PhantomLoop::tick, &loop);
  REQUIRE(soon([&] { return loop.good > 50; }));
  device.stop();
  palpate_test::advance_fake(1);
  most = 0.0;
  read_on(most);
  CHECK(most == 0.0);
  device.write({.force = {0.0, 0.2, 0.0}});
  read_on(most);
  CHECK(most > 0.1);   // the host's force is
  CHECK(most <= 0.2);
  CHECK(fake.violations == 0);
}

TEST_CASE("a PHANToM keeps the laws of devices", "[phantom][threads]") {
  // Yardstick: what the concept's comment promises, checked from outside; velocities against differences of the positions.
  auto& fake = fresh_fake();
  fake.plan.encoder = 1e-9;
  fake.plan.script_begins = 0.7;
  watched_phantom = &fake.seen[0];
  fake.plan.around_callback = [](bool) { lowest_of_phantom = std::min(lowest_of_phantom.load(), watched_phantom->position[1].load()); };
  PhantomDevice device;
  CHECK(testing::check_device(device, {.ticks = 200}) == testing::Violations{});
  CHECK(lowest_of_phantom < 24.0);   // mm: it moved
  CHECK(fake.violations == 0);
}

TEST_CASE("a tick of the host's goes on when the device is at fault, and says so", "[phantom][threads]") {
  auto& fake = fresh_fake();
  PhantomDevice device;
  DeviceSession const session(device);
  fake.plan.mishaps[0] = {.tick = fake.ticks + 20, .code = 0x302};
  PhantomLoop loop(device);
  device.start(&PhantomLoop::tick, &loop);
  CHECK(soon([&] { return loop.bad > 5; }));
  CHECK(loop.last.load() == DeviceStatus::disconnected);
  device.stop();
  auto const fault = device.pop_fault();
  REQUIRE(fault.has_value());
  CHECK(fault->native_code == 0x302);
  CHECK(fake.violations == 0);
}

TEST_CASE("a device that is destroyed while it is started is stopped first", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  int calls = 0;
  {
    PhantomDevice device;
    PhantomLoop loop(device);
    device.open();
    device.start(&PhantomLoop::tick, &loop);
    REQUIRE(soon([&] { return loop.good > 5; }));
    device.close();
    calls = loop.good;
  }
  CHECK(calls > 5);
  CHECK(fake.starts == fake.stops);
  CHECK(fake.violations == 0);
}

TEST_CASE("from the host's own thread the newest state and force are exchanged with a clock that runs by itself", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  fake.plan.hand_is_held = true;
  PhantomDevice device({.ramp = 0.0});
  DeviceSession const session(device);
  DeviceState<double> state;
  int fresh = 0;
  bool felt = false;
  CHECK(soon([&] {
    fresh += device.read(state) == DeviceStatus::ok ? 1 : 0;
    device.write({.force = {0.0, 0.5, 0.0}});
    felt = felt || palpate_test::force_on(fake).y() > 0.4;
    return fresh > 50 && felt;
  }));
  CHECK(device.capabilities().moves_a_hand);
  CHECK(fake.violations == 0);
}

TEST_CASE("a force that nobody renews ends by the clock, also when the driver's ticks come late", "[phantom][threads]") {
  // Yardstick: the clock. Ticks are at least 10 ms apart, so 20 ms have passed by the third after the last write.
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  fake.plan.hand_is_held = true;
  watched_phantom = &fake.seen[0];
  is_left = false, ticks_of_force = 0;
  fake.plan.around_callback = [](bool before) {
    if (!before) return;
    if (is_left && watched_phantom->force[1] > 0.0) ++ticks_of_force;   // of the tick before
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  };
  PhantomDevice device({.ramp = 0.0, .held = 0.02});
  DeviceSession const session(device);
  REQUIRE(soon([&] {
    device.write({.force = {0.0, 0.5, 0.0}});
    return palpate_test::force_on(fake).y() > 0.4;
  }));
  std::uint64_t const last = fake.ticks;
  is_left = true;
  REQUIRE(soon([&] { return fake.ticks > last + 30; }));
  CHECK(ticks_of_force <= 4);
  CHECK(palpate_test::force_on(fake).norm() == 0.0);
  CHECK(device.counts().unattended > 20);
  CHECK(device.counts().gaps == 0);
  CHECK(fake.violations == 0);
}

TEST_CASE("a device outlives the opening of another that takes long and fails", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  PhantomDevice device({.device = "Default Device", .silence = 0.1}), other({.device = "Right Device"});
  DeviceSession const session(device);
  fake.plan.init_milliseconds = 400;
  std::atomic<bool> refused{false}, over{false};
  std::thread opening([&] {
    try {
      other.open();
    } catch (PhantomError const&) {
      refused = true;
    }
    over = true;
  });
  DeviceState<double> state;
  int stale = 0;
  DeviceStatus status = DeviceStatus::ok;
  while (!over && is_usable(status)) {
    status = device.read(state);
    stale += status == DeviceStatus::stale ? 1 : 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  opening.join();
  CHECK(refused);
  CHECK(stale > 100);   // the scheduler did stand still
  CHECK(is_usable(status));
  CHECK(soon([&] { return device.read(state) == DeviceStatus::ok; }));
  CHECK_FALSE(device.pop_fault().has_value());
  CHECK(fake.violations == 0);
}

TEST_CASE("a device that is closed from within its tick does not hold the tick up", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  struct Ends {
    static void tick(void* self) noexcept {
      auto& mine = *static_cast<Ends*>(self);
      auto const began = std::chrono::steady_clock::now();
      mine.device.close();
      mine.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    }
    PhantomDevice& device;
    std::atomic<double> seconds{-1.0};
  };
  PhantomDevice device({.timeout = 2.0});
  device.open();
  Ends ends{device};
  device.start(&Ends::tick, &ends);
  REQUIRE(soon([&] { return ends.seconds >= 0.0; }));
  CHECK(ends.seconds < 0.5);   // not the timeout
  CHECK(soon([&] { return fake.disables == 1; }));
  DeviceState<double> state;
  CHECK(device.read(state) == DeviceStatus::disconnected);
  CHECK_NOTHROW(device.open());
  device.close();
  CHECK(fake.disables == 2);
  CHECK(fake.violations == 0);
}

// Yardstick: the guard, which ends the program where a thread that it watches allocates, releases or locks.
TEST_CASE("closing a device from within its tick takes no lock, allocates and releases nothing", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  struct Guarded {
    static void tick(void* self) noexcept {
      auto& mine = *static_cast<Guarded*>(self);
      if (mine.over) return;
      long const before = palpate_test::guard_violations();
      {
        palpate_test::ServoGuard const guard;
        mine.device.close();
      }
      mine.violations = palpate_test::guard_violations() - before;
      mine.over = true;
    }
    PhantomDevice& device;
    std::atomic<long> violations{-1};
    std::atomic<bool> over{false};
  };
  PhantomDevice device, other({.device = "Right Device"});
  fake.plan.names[1] = "Right Device";
  device.open();
  other.open();
  for (int round = 1; round <= 3; ++round) {
    Guarded guarded{device};
    device.start(&Guarded::tick, &guarded);
    REQUIRE(soon([&] { return guarded.over.load(); }));
    CHECK(guarded.violations == 0);
    device.open();   // waits until it is closed
    CHECK(fake.disables == round);
    DeviceState<double> state;
    CHECK(soon([&] { return other.read(state) == DeviceStatus::ok; }));   // the other one goes on
  }
  CHECK(fake.violations == 0);
}

TEST_CASE("a device that is closed while the opening of another hangs is closed when that is over", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  PhantomDevice device({.device = "Default Device", .timeout = 0.05}), other({.device = "Right Device", .timeout = 0.05});
  device.open();
  fake.plan.init_milliseconds = 500;
  CHECK_THROWS_AS(other.open(), PhantomError);
  device.close();
  CHECK(fake.disables == 0);   // the driver still hangs
  REQUIRE(soon([&] { return fake.disables == 1; }));
  fake.plan.init_milliseconds = 0;
  CHECK_NOTHROW(device.open());
  CHECK(fake.violations == 0);
}

TEST_CASE("a driver that stops calling is a device that is gone", "[phantom][threads]") {
  auto& fake = fresh_fake();
  fake.plan.real_clock = true;
  fake.plan.stall_at = 30;
  fake.plan.stall_milliseconds = 600;
  PhantomDevice device({.silence = 0.1});
  DeviceSession const session(device);
  DeviceState<double> state;
  CHECK(soon([&] {
    device.write({});
    return device.read(state) == DeviceStatus::disconnected;
  }));
  CHECK(device.write({}) == DeviceStatus::disconnected);
  auto const fault = device.pop_fault();
  REQUIRE(fault.has_value());
  CHECK(std::string(fault->what) == "the driver has stopped calling");
  CHECK_FALSE(device.pop_fault().has_value());
  std::uint64_t const ticks = device.counts().ticks;
  REQUIRE(soon([&] { return device.counts().ticks > ticks + 2; }));
  CHECK(device.counts().gaps >= 1);   // when it came back the force began at zero
  CHECK(device.read(state) == DeviceStatus::disconnected);   // until it is opened again
  CHECK(fake.violations == 0);
}
