// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/complete_device.hpp"
#include "device/message.hpp"

#include <palpate/device/faulty_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/testing/device_laws.hpp>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

using namespace palpate;

namespace {

static_assert(OpensAndCloses<FaultyDevice<palpate_test::CompleteDevice>> && Armable<FaultyDevice<palpate_test::CompleteDevice>> &&
              DescribesItself<FaultyDevice<palpate_test::CompleteDevice>> && Calibratable<FaultyDevice<palpate_test::CompleteDevice>> &&
              ReportsFaults<FaultyDevice<ScriptedDevice<double>>> && !OpensAndCloses<FaultyDevice<ScriptedDevice<double>>>);

/// Along x with 1 mm a tick: the position says which sample it is.
template <class Scalar = double>
ScriptedDevice<Scalar> counting() {
  return ScriptedDevice<Scalar>(Trajectory<Scalar>::start({0, 0, 0}).line({100, 0, 0}, 100.0));
}

struct FaultyTick {
  DeviceStatus read, written;
  DeviceState<double> state;
  double sample() const { return std::round(state.position.x() * 1000.0); }
};

std::vector<FaultyTick> ticks_of(FaultyDevice<ScriptedDevice<double>>& device, int count) {
  std::vector<FaultyTick> all;
  DeviceState<double> state;
  for (int tick = 0; tick < count; ++tick) {
    DeviceStatus const read = device.read(state), written = device.write({});
    all.push_back({read, written, state});
  }
  return all;
}

std::vector<FaultyTick> ticks_with(PlannedFault const& planned, int count = 12) {
  FaultyDevice<ScriptedDevice<double>> device(counting(), {planned});
  return ticks_of(device, count);
}

}  // namespace

TEST_CASE("reads fail in their ticks, leave the state, and time goes on inside", "[device]") {
  for (auto const& [kind, status] : {std::pair{FaultKind::disconnected, DeviceStatus::disconnected}, std::pair{FaultKind::fault, DeviceStatus::fault},
                                     std::pair{FaultKind::stale, DeviceStatus::stale}}) {
    auto const ticks = ticks_with({.kind = kind, .tick = 3, .ticks = 4});
    for (int tick = 0; tick < 12; ++tick) {
      bool const hit = tick >= 3 && tick < 7;
      INFO(tick);
      auto const& now = ticks[static_cast<std::size_t>(tick)];
      CHECK(now.read == (hit ? status : DeviceStatus::ok));
      CHECK(now.written == (hit && kind != FaultKind::stale ? status : DeviceStatus::ok));
      CHECK(now.sample() == (hit ? 2 : tick));
    }
  }
}

TEST_CASE("writes fail alone", "[device]") {
  auto const ticks = ticks_with({.kind = FaultKind::write_fails, .tick = 5, .ticks = 0});
  for (std::size_t tick = 0; tick < 12; ++tick) {
    CHECK(ticks[tick].read == DeviceStatus::ok);
    CHECK(ticks[tick].written == (tick < 5 ? DeviceStatus::ok : DeviceStatus::fault));
  }
}

TEST_CASE("numbers that are none come once and are gone", "[device]") {
  auto const position = ticks_with({.kind = FaultKind::position_not_finite, .tick = 4, .ticks = 2});
  auto const velocity = ticks_with({.kind = FaultKind::velocity_not_finite, .tick = 4, .ticks = 2});
  for (std::size_t tick = 0; tick < 12; ++tick) {
    bool const hit = tick == 4 || tick == 5;
    CHECK(position[tick].state.position.allFinite() != hit);
    CHECK(position[tick].state.velocity.allFinite());
    CHECK(velocity[tick].state.velocity.allFinite() != hit);
    CHECK(velocity[tick].sample() == double(tick));
  }
}

TEST_CASE("a jump, a chatter and a gap", "[device]") {
  auto const jumped = ticks_with({.kind = FaultKind::jump, .tick = 6, .ticks = 0, .shift = {0, 0.05, 0}});
  auto const chattered = ticks_with({.kind = FaultKind::button_chatter, .tick = 2, .ticks = 6, .size = 1});
  auto const missed = ticks_with({.kind = FaultKind::gap, .tick = 5, .size = 50});
  for (std::size_t tick = 0; tick < 12; ++tick) {
    CHECK(jumped[tick].state.position.y() == (tick < 6 ? 0.0 : 0.05));
    CHECK(chattered[tick].state.buttons == (tick >= 2 && tick < 8 && tick % 2 == 0 ? 2u : 0u));
    CHECK(missed[tick].sample() == double(tick < 5 ? tick : tick + 50));
  }
}

TEST_CASE("a jump of a device that goes stale does not add up", "[device]") {
  FaultyDevice<ScriptedDevice<double>> device(ScriptedDevice<double>(Trajectory<double>::start({0, 0, 0}).line({1, 0, 0}, 1.0), {.dropouts = 1.0}),
                                              {{.kind = FaultKind::jump, .ticks = 0, .shift = {0, 0, 0.1}}});
  for (FaultyTick const& tick : ticks_of(device, 20)) {
    CHECK(tick.read == DeviceStatus::stale);
    CHECK(tick.state.position.z() == 0.1);
  }
}

TEST_CASE("a stall takes its time", "[device]") {
  // A lower bound alone: a sleep may be longer, never shorter.
  FaultyDevice<ScriptedDevice<double>> device(counting(), {{.kind = FaultKind::stall, .tick = 1, .size = 0.01}});
  auto const before = std::chrono::steady_clock::now();
  ticks_of(device, 3);
  CHECK(std::chrono::steady_clock::now() - before >= std::chrono::milliseconds(10));
}

TEST_CASE("what begins to fail is told once, in order, before the device's own", "[device]") {
  FaultyDevice<palpate_test::CompleteDevice> device(
      palpate_test::CompleteDevice(std::make_shared<palpate_test::CompleteDevice::Diary>()),
      {{.kind = FaultKind::disconnected, .tick = 20, .ticks = 0}, {.kind = FaultKind::jump, .tick = 1}, {.kind = FaultKind::write_fails, .tick = 4}});
  DeviceState<double> state;
  std::vector<std::string> told;
  for (int tick = 0; tick < 30; ++tick) {
    device.read(state);
    while (auto const fault = device.pop_fault()) told.push_back(std::to_string(tick) + " " + fault->what);
  }
  CHECK((told == std::vector<std::string>{"0 too warm", "4 injected: the device failed", "20 injected: the device is gone"}));
  CHECK(device.read(state) == DeviceStatus::disconnected);
  device.heal();
  CHECK(device.read(state) == DeviceStatus::ok);
  CHECK_FALSE(device.pop_fault().has_value());
}

TEMPLATE_TEST_CASE("a faulty device keeps the laws but for its faults, and does not allocate", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  std::vector<PlannedFault> const plan{{.kind = FaultKind::stale, .tick = 10, .ticks = 5}, {.kind = FaultKind::disconnected, .tick = 30, .ticks = 5},
                                       {.kind = FaultKind::fault, .tick = 50, .ticks = 5}, {.kind = FaultKind::write_fails, .tick = 70, .ticks = 5}};
  FaultyDevice<ScriptedDevice<Scalar>, Scalar> device(counting<Scalar>(), plan);
  CHECK(testing::to_text(testing::check_device<Scalar>(device, {.may_fail = true})) == "");
  FaultyDevice<ScriptedDevice<Scalar>, Scalar> whole(ScriptedDevice<Scalar>(Trajectory<Scalar>::start({0, 0, 0}), {.reports_velocity = false}), {});
  CHECK(testing::to_text(testing::check_device<Scalar>(whole)) == "");
  device.rewind();
  DeviceState<Scalar> state;
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  testing::serve(device, state, 200);
  while (device.pop_fault()) {
  }
  long const count = allocations.count();
  CHECK(count == 0);
}

TEST_CASE("faults that make no sense are refused", "[device]") {
  using palpate_test::message_of;
  using palpate_test::unsaid;
  auto const refusal = [](PlannedFault const& planned) { return message_of([&] { FaultyDevice<ScriptedDevice<double>>(counting(), {planned}); }); };
  CHECK(unsaid(refusal({.kind = FaultKind::gap, .tick = 7}), "tick 7", ".size = 0", "1 to 1e6") == "");
  CHECK(unsaid(refusal({.kind = FaultKind::stall, .size = -1.0}), "-1", "0 to 60 s") == "");
  CHECK(unsaid(refusal({.kind = FaultKind::button_chatter, .size = 32.0}), "32", "0 to 31") == "");
  CHECK(unsaid(refusal({.kind = FaultKind::jump, .shift = {0, std::numeric_limits<double>::infinity(), 0}}), ".shift", "not finite") == "");
}
