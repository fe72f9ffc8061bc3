// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"

#include <palpate/device/limit.hpp>
#include <palpate/device/scripted_device.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

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

TEMPLATE_TEST_CASE("quantised positions are the nearest steps of the encoder", "[device]", PALPATE_TEST_SCALARS) {
  // Yardstick: within half a quantum of the exact script, and a whole number of quanta.
  using Scalar = TestType;
  double const quantum = 5.5e-5;
  ScriptedDevice<Scalar> exact(descent<Scalar>()), coarse(descent<Scalar>(), {.quantum = quantum});
  CHECK(coarse.capabilities().resolution == quantum);
  CHECK_FALSE(exact.capabilities().resolution.known());
  DeviceState<Scalar> a, b;
  double worst = 0.0;
  for (int tick = 0; tick < 1300; ++tick) {
    exact.read(a), coarse.read(b);
    double const steps = double(b.position.z()) / quantum;
    REQUIRE(std::abs(steps - std::round(steps)) <= 400 * std::numeric_limits<Scalar>::epsilon());
    worst = std::max(worst, double(std::abs(a.position.z() - b.position.z())));
    REQUIRE(a.velocity == b.velocity);
  }
  CHECK(worst <= 0.5 * quantum * 1.001);
  CHECK(worst >= 0.45 * quantum);
}

TEST_CASE("jitter moves samples along the path, evenly and not on average", "[device]") {
  // Yardstick: at 0.02 m/s a sample that is t late lies 0.02 t further; t is uniform in ±0.3 ms: mean 0, variance 0.3²/3 ms².
  double const jitter = 3e-4;
  int const ticks = 20000;
  auto const path = Trajectory<double>::start({0, 0, 0}).line({0.02 * 30, 0, 0}, 30.0);
  ScriptedDevice<double> device(path, {.jitter = jitter, .seed = 7});
  DeviceState<double> state;
  device.read(state);
  double sum = 0.0, squares = 0.0, largest = 0.0;
  for (int tick = 1; tick < ticks; ++tick) {
    device.read(state);
    double const late = state.position.x() / 0.02 - tick / 1000.0;
    sum += late, squares += late * late, largest = std::max(largest, std::abs(late));
  }
  CHECK(largest <= jitter * (1 + 1e-9));
  CHECK(largest >= 0.99 * jitter);
  CHECK(std::abs(sum / ticks) <= 4 * jitter / std::sqrt(3.0 * ticks));
  CHECK(squares / ticks == Approx(jitter * jitter / 3).epsilon(0.03));
}

TEST_CASE("dropouts hold the last sample, are as frequent as asked for, and as long", "[device]") {
  int const ticks = 40000;
  auto const path = Trajectory<double>::start({0, 0, 0}).line({1, 0, 0}, 50.0);
  ScriptedDevice<double> exact(path), device(path, {.dropouts = 0.02, .dropout_ticks = 5, .seed = 3});
  DeviceState<double> state, truth;
  double held = 0.0;
  int stale = 0, longest = 0, run = 0, begun = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    DeviceStatus const status = device.read(state);
    exact.read(truth);
    if (status == DeviceStatus::stale) {
      REQUIRE((tick == 0 || state.position.x() == held));
      begun += run == 0 ? 1 : 0;
      ++stale, ++run;
    } else {
      REQUIRE(status == DeviceStatus::ok);
      REQUIRE(state.position == truth.position);   // afterwards the hand is where it would have been
      REQUIRE(run % 5 == 0);
      longest = std::max(longest, run), run = 0;
    }
    held = state.position.x();
  }
  // A tick in which none is under way begins one with 2 %: on average 1/0.02 − 1 good ticks between runs that begin, and 5 stale ones.
  CHECK(double(stale) / ticks == Approx(5.0 / (5.0 + 49.0)).epsilon(0.1));
  CHECK(begun > 500);
  CHECK(longest >= 10);   // one may follow on another
}

TEST_CASE("the same seed gives the same faults, jitter does not move dropouts, and a rewind repeats all", "[device]") {
  auto const run = [](ScriptedDevice<double>& device) {
    std::vector<double> seen;
    DeviceState<double> state;
    for (int tick = 0; tick < 500; ++tick) {
      DeviceStatus const status = device.read(state);
      seen.push_back(state.position.z()), seen.push_back(static_cast<double>(status));
    }
    return seen;
  };
  ScriptedDeviceOptions const options{.quantum = 1e-7, .jitter = 1e-4, .dropouts = 0.05, .seed = 11};
  ScriptedDevice<double> one(descent<double>(), options), two(descent<double>(), options);
  auto const first = run(one);
  CHECK((first == run(two)));
  one.rewind();
  CHECK((first == run(one)));
  ScriptedDeviceOptions calm = options, other = options;
  calm.jitter = 0.0, other.seed = 12;
  ScriptedDevice<double> without(descent<double>(), calm), reseeded(descent<double>(), other);
  auto const second = run(without);
  CHECK((first != run(reseeded)));
  bool same = true;
  for (std::size_t i = 1; i < first.size(); i += 2) same = same && first[i] == second[i];
  CHECK(same);
  CHECK((first != second));
}

TEST_CASE("a script that reports no velocity leaves the one of the state", "[device]") {
  ScriptedDevice<double> device(descent<double>(), {.reports_velocity = false});
  CHECK_FALSE(device.capabilities().reports_velocity);
  DeviceState<double> state;
  state.velocity = {1, 2, 3};
  device.read(state);
  CHECK(state.velocity == Vector3<double>(1, 2, 3));
}

TEST_CASE("options of a script outside their range are refused", "[device]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  for (ScriptedDeviceOptions const& options : {ScriptedDeviceOptions{.quantum = -1e-5}, ScriptedDeviceOptions{.quantum = nan},
                                               ScriptedDeviceOptions{.jitter = 5e-4}, ScriptedDeviceOptions{.jitter = -1e-5},
                                               ScriptedDeviceOptions{.dropouts = 1.5},
                                               ScriptedDeviceOptions{.dropouts = nan}, ScriptedDeviceOptions{.dropout_ticks = 0}})
    CHECK_THROWS_AS(ScriptedDevice<double>(descent<double>(), options), InvalidArgument);
}

TEST_CASE("an hour of ticks does not drift", "[device]") {
  // Yardstick: after 3.6e6 ticks of 1 ms the script is at 3600 s, not at 3.6e6 roundings of 0.001.
  ScriptedDevice device(Trajectory<double>::start({0, 0, 0}).line({7200, 0, 0}, 7200.0));
  DeviceState<double> state;
  for (int tick = 0; tick <= 3'600'000; ++tick) device.read(state);
  CHECK(state.position.x() == 3600.0);
}

TEST_CASE("reading, limiting and writing do not allocate", "[device][realtime]") {
  ScriptedDevice device(descent<double>().arc({0, 0, 0}, {0, 0, 1}, 1.0, 1.0).tap({0, 0, 0.01}, 1.0).chirp({0.01, 0, 0}, 1.0, 9.0, 1.0),
                        {.quantum = 1e-5, .jitter = 1e-4, .dropouts = 0.1});
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

TEMPLATE_TEST_CASE("a script turns its tool the short way from one orientation to the next, and before and after them not at all", "[device]", PALPATE_TEST_SCALARS) {
  // Yardstick: the angle about the axis, by hand.
  using Scalar = TestType;
  auto const about_x = [](double degrees) { return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3<double>::UnitX())); };
  Eigen::Quaterniond const minus(-about_x(80).coeffs());   // the same rotation, the long way off
  ScriptedDevice<Scalar> device(descent<Scalar>(), {.rate = 100.0, .orientation = {{0.2, about_x(20)}, {0.5, minus}, {0.7, about_x(50)}}});
  CHECK(device.capabilities().reports_orientation);
  CHECK_FALSE(ScriptedDevice<Scalar>(descent<Scalar>()).capabilities().reports_orientation);
  DeviceState<Scalar> state;
  for (int tick = 0; tick < 100; ++tick) {
    REQUIRE(device.read(state) == DeviceStatus::ok);
    double const t = tick / 100.0;
    double const degrees = t < 0.2 ? 20 : t < 0.5 ? 20 + 200 * (t - 0.2) : t < 0.7 ? 80 - 150 * (t - 0.5) : 50;
    Eigen::Quaterniond const read = state.orientation.template cast<double>();
    REQUIRE(read.angularDistance(about_x(degrees)) < 1e-2 * std::sqrt(static_cast<double>(std::numeric_limits<Scalar>::epsilon())) + 1e-6);
    REQUIRE(std::abs(read.norm() - 1) < 1e-6);
  }
}

TEST_CASE("one orientation of a script holds always; a dropout holds the last; what is no rotation, or not in time, is refused by name", "[device]") {
  Eigen::Quaterniond const turned(Eigen::AngleAxisd(0.7, Vector3<double>(0.6, 0.0, 0.8)));
  ScriptedDevice<double> always(descent<double>(), {.orientation = {{0.9, turned}}});
  DeviceState<double> state;
  always.read(state);
  CHECK(state.orientation.coeffs() == turned.coeffs());

  ScriptedDevice<double> drops(descent<double>(), {.dropouts = 1.0, .orientation = {{0.0, turned}, {1.0, Eigen::Quaterniond::Identity()}}});
  for (int tick = 0; tick < 5; ++tick) {
    state = {};   // whatever was in there
    CHECK(drops.read(state) == DeviceStatus::stale);
    CHECK(state.orientation.coeffs() == turned.coeffs());   // the first sample
  }

  CHECK_THROWS_WITH(ScriptedDevice<double>(descent<double>(), {.orientation = {{0.0, Eigen::Quaterniond(2, 0, 0, 0)}}}),
                    says(".orientation's norm is 2", "unit quaternions"));
  CHECK_THROWS_WITH(ScriptedDevice<double>(descent<double>(), {.orientation = {{0.5, turned}, {0.5, turned}}}), says(".orientation's time is 0.5", "times that rise"));
  CHECK_THROWS_WITH(ScriptedDevice<double>(descent<double>(), {.gripper = {{0.0, 0.3}, {0.1, 1.5}}}), says(".gripper is 1.5", "from 0 to 1"));
}

TEST_CASE("a script that turns and grips allocates nothing as it is read", "[device][allocation]") {
  ScriptedDevice<double> device(descent<double>(), {.gripper = {{0.0, 1.0}, {1.0, 0.0}}, .orientation = {{0.0, Eigen::Quaterniond::Identity()}, {1.0, Eigen::Quaterniond(0, 1, 0, 0)}}});
  DeviceState<double> state;
  palpate_test::AllocationCount const allocations;
  for (int tick = 0; tick < 1200; ++tick) device.read(state);
  long const count = allocations.count();
  REQUIRE(palpate_test::trap_works());
  CHECK(count == 0);
  CHECK(state.gripper == 0.0);
}
