// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"

#include <palpate/device/limit.hpp>
#include <palpate/device/scripted_device.hpp>

#include <limits>
#include <utility>

using namespace palpate;

namespace {

template <class Scalar>
Trajectory<Scalar> descent() {
  return Trajectory<Scalar>::start({0, 0, Scalar(0.01)}).line({0, 0, Scalar(-0.01)}, 1.0).hold(0.25);
}

template <class Device, class Scalar>
constexpr bool serves_without_throwing = noexcept(std::declval<Device&>().read(std::declval<DeviceState<Scalar>&>())) &&
                                         noexcept(std::declval<Device&>().write(std::declval<Wrench<Scalar> const&>()));
static_assert(serves_without_throwing<ScriptedDevice<double>, double> && serves_without_throwing<ScriptedDevice<float>, float>);
static_assert(HapticDevice<ScriptedDevice<float>, float> && !HapticDevice<ScriptedDevice<float>, double>);

}  // namespace

TEMPLATE_TEST_CASE("tick n of a script is the trajectory at n / rate", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  ScriptedDevice device(descent<Scalar>(), {.max_force = 7.9, .rate = 500.0});
  static_assert(std::is_same_v<decltype(device), ScriptedDevice<Scalar>>);
  CHECK(device.capabilities().max_force == 7.9);
  CHECK(device.capabilities().rate == 500.0);
  CHECK(device.capabilities().reports_velocity);
  DeviceState<Scalar> state;
  for (int tick = 0; tick < 1000; ++tick) {
    CHECK(device.finished() == (tick >= 625));   // 1.25 s at 500 Hz
    REQUIRE(device.read(state) == DeviceStatus::ok);
    // Yardstick: the same line by hand.
    double const t = tick / 500.0;
    double const z = t < 1.0 ? 0.01 - 0.02 * t : -0.01;
    REQUIRE(std::abs(double(state.position.z()) - z) <= 0.02 * 4 * std::numeric_limits<Scalar>::epsilon());
    REQUIRE(std::abs(double(state.velocity.z()) - (t < 1.0 ? -0.02 : 0.0)) <= 0.02 * std::numeric_limits<Scalar>::epsilon());
  }
  CHECK(device.tick() == 1000);
}

TEST_CASE("a script remembers the last wrench and starts over when asked", "[device]") {
  ScriptedDevice device(descent<double>());
  DeviceState<double> first, again;
  device.read(first);
  device.read(again);
  CHECK(device.write({.force = {1.0, 2.0, 3.0}, .torque = {4.0, 5.0, 6.0}}) == DeviceStatus::ok);
  CHECK(device.last_wrench().force == Vector3<double>(1.0, 2.0, 3.0));
  CHECK(device.last_wrench().torque == Vector3<double>(4.0, 5.0, 6.0));
  device.rewind();
  CHECK(device.last_wrench().force.isZero(0.0));
  device.read(again);
  CHECK(again.position == first.position);
  CHECK(device.trajectory().duration() == 1.25);
}

TEST_CASE("a script without a rate or with a negative force is refused", "[device]") {
  CHECK_THROWS_AS(ScriptedDevice(descent<double>(), {.max_force = 3.3, .rate = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(ScriptedDevice(descent<double>(), {.max_force = -1.0, .rate = 1000.0}), InvalidArgument);
}

TEST_CASE("an hour of ticks does not drift", "[device]") {
  // Yardstick: after 3.6e6 ticks of 1 ms the script is at 3600 s, not at 3.6e6 roundings of 0.001.
  ScriptedDevice device(Trajectory<double>::start({0, 0, 0}).line({7200, 0, 0}, 7200.0));
  DeviceState<double> state;
  for (int tick = 0; tick <= 3'600'000; ++tick) device.read(state);
  CHECK(state.position.x() == 3600.0);
}

TEST_CASE("reading, limiting and writing do not allocate", "[device][realtime]") {
  ScriptedDevice device(descent<double>().arc({0, 0, 0}, {0, 0, 1}, 1.0, 1.0).tap({0, 0, 0.01}, 1.0));
  Capabilities const capabilities = device.capabilities();
  DeviceState<double> state;
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  for (int tick = 0; tick < 10000; ++tick) {
    device.read(state);
    device.write(limited(Wrench<double>{.force = 1000.0 * state.position}, capabilities));
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(device.tick() == 10000);
}
