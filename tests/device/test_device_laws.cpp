// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/complete_device.hpp"
#include "device/message.hpp"

#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/testing/device_laws.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate::testing;
using palpate_test::unsaid;

namespace {

/// Right in everything, with one switch for each law that it can break.
struct Wrong {
  bool unmeasured_velocity = false, not_finite = false, scaled = false, changes_capabilities = false, extra_button = false, long_quaternion = false,
       touches_failed = false, no_status = false, throws = false, mute_fault = false, endless_faults = false, write_fails = false, dies = false,
       bad_rate = false, needs_hand = false, one_open = false, turns = false;
};

class WrongDevice {
 public:
  explicit WrongDevice(Wrong wrong) : wrong_(wrong) {}

  Capabilities capabilities() const {
    return {.max_force = wrong_.changes_capabilities && tick_ > 5 ? 1.0 : 3.3,
            .rate = wrong_.bad_rate ? 0.0 : 1000.0,
            .reports_velocity = !wrong_.unmeasured_velocity,
            .reports_orientation = !wrong_.turns,
            .buttons = 2,
            .moves_a_hand = false};
  }
  void open() {
    if (wrong_.throws) throw std::runtime_error("nobody at home");
    ++opened_;
  }
  void close() noexcept {}
  DeviceStatus read(DeviceState<double>& state) noexcept {
    ++tick_;
    if (wrong_.no_status) return static_cast<DeviceStatus>(77);
    if (wrong_.touches_failed && tick_ > 50) state.position.setConstant(tick_);
    if (wrong_.one_open && opened_ > 1) return DeviceStatus::disconnected;
    if ((wrong_.dies || wrong_.touches_failed) && tick_ > 50) return DeviceStatus::fault;
    state.position.setConstant(1e-4 * tick_);
    state.velocity.setConstant(wrong_.scaled ? 100.0 : 0.1);   // mm/s
    if (wrong_.not_finite && tick_ == 100) state.position.x() = std::numeric_limits<double>::quiet_NaN();
    state.orientation = Eigen::Quaterniond(wrong_.long_quaternion ? 1.1 : 1.0, 0, 0, 0);
    state.angular_velocity.setZero();
    state.buttons = wrong_.extra_button ? 4 : 3;
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return wrong_.write_fails ? DeviceStatus::disconnected : DeviceStatus::ok; }
  Calibration calibration() noexcept { return wrong_.needs_hand ? Calibration::needs_hand : Calibration::good; }
  void calibrate() noexcept {}
  std::optional<DeviceFault> pop_fault() noexcept {
    if (wrong_.endless_faults) return DeviceFault{};
    if (wrong_.mute_fault) return wrong_.mute_fault = false, DeviceFault{.what = nullptr};
    return std::nullopt;
  }

 private:
  Wrong wrong_;
  int tick_ = 0, opened_ = 0;
};

std::string verdict(Wrong wrong, DeviceLawOptions const& options = {}) {
  WrongDevice device(wrong);
  return to_text(check_device(device, options));
}

/// Keeps what is written to it, and throws in its n-th capabilities() or when it is armed.
struct PushedDevice {
  int throws_at = -1;
  bool throws_armed = false;
  std::vector<Vector3<double>> forces{};
  bool opened = false, armed = false;
  mutable int asked = 0;

  Capabilities capabilities() const {
    if (++asked == throws_at) throw std::runtime_error("lost its papers");
    return {.max_force = 2.0, .rate = 1000.0, .moves_a_hand = false};
  }
  void open() { opened = true; }
  void close() noexcept { opened = false; }
  void arm() {
    armed = true;
    if (throws_armed) throw std::runtime_error("one motor of three");
  }
  void disarm() noexcept { armed = false; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    state.position.setZero();
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    forces.push_back(wrench.force);
    return DeviceStatus::ok;
  }
};

template <class Scalar>
Trajectory<Scalar> law_path() {
  return Trajectory<Scalar>::start({0, 0, Scalar(0.01)}).line({0, Scalar(0.02), 0}, 0.4).sine({Scalar(0.002), 0, 0}, 4.0, 0.3).hold(0.1);
}

}  // namespace

TEST_CASE("the device laws find each mistake", "[device]") {
  CHECK(verdict({}) == "");
  CHECK(unsaid(verdict({.unmeasured_velocity = true}), "velocity was written", "not reported") == "");
  CHECK(unsaid(verdict({.not_finite = true}), "tick 99", "position is not finite") == "");
  CHECK(unsaid(verdict({.scaled = true}), "velocities do not fit positions", "m/s") == "");
  CHECK(unsaid(verdict({.changes_capabilities = true}), "capabilities() changed") == "");
  CHECK(unsaid(verdict({.extra_button = true}), "button bits 4", "2 buttons") == "");
  CHECK(unsaid(verdict({.long_quaternion = true}), "length 1.1", "unit quaternion") == "");
  CHECK(unsaid(verdict({.touches_failed = true}), "changed the state", "tick 50") == "");
  CHECK(unsaid(verdict({.no_status = true}), "status that does not exist", "no read gave a sample") == "");
  CHECK(unsaid(verdict({.throws = true}), "nobody at home") == "");
  CHECK(unsaid(verdict({.mute_fault = true}), "has no words") == "");
  CHECK(unsaid(verdict({.endless_faults = true}), "never comes to an end") == "");
  CHECK(unsaid(verdict({.write_fails = true}), "write() says \"disconnected\"") == "");
  CHECK(unsaid(verdict({.dies = true}), "tick 50", "read() says \"fault\"") == "");
  CHECK(unsaid(verdict({.bad_rate = true}), "rate is 0 Hz") == "");
  CHECK(unsaid(verdict({.needs_hand = true}), "needs the user's hand") == "");
  CHECK(unsaid(verdict({.one_open = true}), "after closing and opening again") == "");
  CHECK(unsaid(verdict({.turns = true}), "orientation or angular velocity was written") == "");
}

TEST_CASE("the force of the laws comes and goes on six sides", "[device]") {
  // Yardstick: F sin²(π t/T) changes by at most F π/T a second; T is a tenth of a second at least.
  PushedDevice device;
  CHECK(to_text(check_device(device, {.ticks = 1200, .force = 2.0})) == "");
  Vector3<double> before = Vector3<double>::Zero(), highest = before, lowest = before;
  double fastest = 0.0, largest = 0.0;
  for (Vector3<double> const& force : device.forces) {
    fastest = std::max(fastest, (force - before).norm()), largest = std::max(largest, force.norm());
    highest = highest.cwiseMax(force), lowest = lowest.cwiseMin(force);
    before = force;
  }
  CHECK(largest <= 2.0);
  CHECK(fastest <= 2.0 * 3.1416 / 200);
  CHECK((highest - Vector3<double>::Constant(2.0)).norm() <= 1e-12);
  CHECK((lowest + Vector3<double>::Constant(2.0)).norm() <= 1e-12);
  CHECK(before.isZero(0.0));
  PushedDevice brief;
  CHECK(to_text(check_device(brief, {.ticks = 50, .force = 2.0})) == "");
  double steepest = 0.0;
  for (std::size_t k = 1; k < 51; ++k) steepest = std::max(steepest, (brief.forces[k] - brief.forces[k - 1]).norm());
  CHECK(steepest > 0.0);
  CHECK(steepest <= 2.0 * 3.1416 / 100);
}

TEST_CASE("forces that no device should feel are refused before one does", "[device]") {
  using palpate_test::message_of;
  double const infinity = std::numeric_limits<double>::infinity();
  for (double const force : {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity, -1.0, 2.1}) {
    PushedDevice device;
    CHECK(unsaid(message_of([&] { check_device(device, {.force = force}); }), "DeviceLawOptions: .force is", "N") == "");
    for (Vector3<double> const& written : device.forces) CHECK(written.isZero(0.0));
    CHECK_FALSE((device.opened || device.armed));
  }
  PushedDevice device;
  CHECK(unsaid(message_of([&] { check_device(device, {.force = 2.1}); }), "2.1 N", "max_force 2 N") == "");
}

TEST_CASE("a device that throws is left without force, motors off and closed", "[device]") {
  for (int const at : {1, 2, 3}) {
    PushedDevice device{.throws_at = at};
    CHECK(unsaid(to_text(check_device(device, {.ticks = 50, .force = 2.0})), "the device threw: lost its papers") == "");
    REQUIRE_FALSE(device.forces.empty());
    CHECK(device.forces.back().isZero(0.0));
    CHECK_FALSE((device.opened || device.armed));
  }
  PushedDevice half{.throws_armed = true};
  CHECK(unsaid(to_text(check_device(half, {.force = 2.0})), "one motor of three") == "");
  CHECK_FALSE((half.opened || half.armed));
}

TEST_CASE("failures that are allowed are no violation, what a failed read touches is", "[device]") {
  CHECK(unsaid(verdict({.dies = true}, {.may_fail = true}), "after closing") == "");   // alone: it stays dead
  CHECK(verdict({.dies = true}, {.may_fail = true}).find("fault") == std::string::npos);
  CHECK(verdict({.write_fails = true}, {.may_fail = true}) == "");
  CHECK(unsaid(verdict({.touches_failed = true}, {.may_fail = true}), "changed the state") == "");
}

TEMPLATE_TEST_CASE("the plain devices keep the laws", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  NullDevice<Scalar> null({1, 2, 3});
  CHECK(to_text(check_device<Scalar>(null, {.force = 5.0})) == "");
  ScriptedDevice<Scalar> script(law_path<Scalar>());
  CHECK(to_text(check_device<Scalar>(script)) == "");
  ScriptedDevice<Scalar> coarse(law_path<Scalar>(),
                                {.reports_velocity = false, .quantum = 5.5e-5, .jitter = 2e-4, .dropouts = 0.02, .dropout_ticks = 3});
  CHECK(to_text(check_device<Scalar>(coarse)) == "");
  ScriptedDevice<Scalar> noisy(law_path<Scalar>(), {.quantum = 5.5e-5, .jitter = 2e-4, .dropouts = 0.02});
  CHECK(to_text(check_device<Scalar>(noisy)) == "");
  TremblingDevice<ScriptedDevice<Scalar>, Scalar> trembling(ScriptedDevice<Scalar>(law_path<Scalar>()), HandTremor<Scalar>{});
  CHECK(to_text(check_device<Scalar>(trembling)) == "");
  TremblingDevice<ScriptedDevice<Scalar>, Scalar> without(ScriptedDevice<Scalar>(law_path<Scalar>(), {.reports_velocity = false}), HandTremor<Scalar>{});
  CHECK(to_text(check_device<Scalar>(without)) == "");
  RecordedDevice<ScriptedDevice<Scalar>, Scalar> recorded(ScriptedDevice<Scalar>(law_path<Scalar>()), 2000);
  CHECK(to_text(check_device<Scalar>(recorded)) == "");
  for (bool const velocity : {true, false}) {
    Capabilities capabilities = recorded.capabilities();
    capabilities.reports_velocity = velocity;
    ReplayDevice<Scalar> replayed(recorded.samples(), capabilities);
    CHECK(to_text(check_device<Scalar>(replayed, {.ticks = 1500})) == "");
  }
}

TEST_CASE("a device with every refinement keeps the laws but for its fault", "[device]") {
  palpate_test::CompleteDevice device(std::make_shared<palpate_test::CompleteDevice::Diary>());
  CHECK(to_text(check_device(device, {.force = 1.0})) == "pop_fault() tells of \"too warm\", 42\n");
}

TEST_CASE("a device with a clock of its own keeps the laws", "[device][threads]") {
  palpate_test::ClockedDevice device(std::make_shared<palpate_test::CompleteDevice::Diary>());
  CHECK(to_text(check_device(device, {.ticks = 50, .may_fail = true})) == "");
}
