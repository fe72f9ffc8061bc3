// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/complete_device.hpp"

#include <palpate/device/any_device.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/session.hpp>
#include <palpate/device/simulated_touch.hpp>
#include <palpate/testing/device_laws.hpp>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>

using namespace palpate;
using palpate_test::ClockedDevice;
using palpate_test::CompleteDevice;

namespace {

/// Neither copied nor moved: what a driver with threads is.
class Rooted {
 public:
  explicit Rooted(double rate) : rate_(rate) {}
  Rooted(Rooted const&) = delete;
  Rooted& operator=(Rooted const&) = delete;
  Capabilities capabilities() const noexcept { return {.max_force = 1.0, .rate = rate_}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    state.position.setZero();
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }

 private:
  double rate_;
};

static_assert(std::is_nothrow_move_constructible_v<AnyDevice<double>> && !std::is_copy_constructible_v<AnyDevice<double>>);
static_assert(!std::is_constructible_v<AnyDevice<float>, NullDevice<double>>, "the scalar is that of the device");
static_assert(!std::is_constructible_v<AnyDevice<double>, int>);
static_assert(!std::is_constructible_v<AnyDevice<double>, Rooted&> && !std::is_constructible_v<AnyDevice<double>, Rooted>);
static_assert(std::is_constructible_v<AnyDevice<double>, std::in_place_type_t<Rooted>, double> &&
              !std::is_constructible_v<AnyDevice<double>, std::in_place_type_t<Rooted>>);
static_assert(std::is_constructible_v<AnyDevice<double>, NullDevice<double>&> && !std::is_constructible_v<AnyDevice<double>, AnyDevice<double>&>);

}  // namespace

TEST_CASE("any device passes on all that its device has", "[device]") {
  auto const diary = std::make_shared<CompleteDevice::Diary>();
  AnyDevice<double> any = CompleteDevice(diary);
  CHECK(any.description().model == "complete");
  CHECK(any.calibration() == Calibration::needs_update);
  any.calibrate();
  CHECK(any.calibration() == Calibration::good);
  REQUIRE(any.pop_fault().has_value());
  CHECK_FALSE(any.pop_fault().has_value());
  CHECK(any.clock() == nullptr);
  CHECK(any.capabilities().max_force.provenance == Provenance::datasheet);
  {
    DeviceSession session(any);
    DeviceState<double> state;
    CHECK(any.read(state) == DeviceStatus::ok);
    CHECK(state.position.x() == 0.25);
    any.write({.force = {1, 2, 3}});
    CHECK(any.get_if<CompleteDevice>()->last_wrench().force == Vector3<double>(1, 2, 3));
  }
  CHECK((*diary == CompleteDevice::Diary{"open", "arm", "disarm", "close"}));
  CHECK(any.get_if<NullDevice<double>>() == nullptr);
}

TEST_CASE("what the device lacks does nothing", "[device]") {
  AnyDevice<double> any = NullDevice<double>({1, 2, 3});
  any.open();
  any.arm();
  any.calibrate();
  CHECK(any.calibration() == Calibration::good);
  CHECK_FALSE(any.pop_fault().has_value());
  CHECK(any.description().model.empty());
  CHECK(any.clock() == nullptr);
  any.disarm();
  any.close();
  AnyDevice<double> moved = std::move(any);
  DeviceState<double> state;
  moved.read(state);
  CHECK(state.position == Vector3<double>(1, 2, 3));
  CHECK(moved.get_if<NullDevice<double>>() != nullptr);
}

TEST_CASE("the advice for a calibration comes through, and is empty where there is none", "[device]") {
  AnyDevice<double> touch = RecordedDevice<SimulatedTouch<double>>(SimulatedTouch<double>({.calibrated = false}), 1);
  CHECK(touch.calibration() == Calibration::needs_hand);
  CHECK(std::string(touch.calibration_advice()).find("inkwell") != std::string::npos);
  AnyDevice<double> null = NullDevice<double>();
  CHECK(std::string(null.calibration_advice()).empty());
  static_assert(!AdvisesCalibration<RecordedDevice<NullDevice<double>>> && AdvisesCalibration<RecordedDevice<AnyDevice<double>>>);
  null = std::move(touch);
  CHECK(std::string(touch.calibration_advice()).empty());   // NOLINT: what is left of it is what is tested
}

TEST_CASE("a device that was moved away says so, and does no harm", "[device]") {
  AnyDevice<double> any = NullDevice<double>({1, 2, 3});
  CHECK(static_cast<bool>(any));
  AnyDevice<double> const moved = std::move(any);
  CHECK(static_cast<bool>(moved));
  CHECK_FALSE(static_cast<bool>(any));   // NOLINT: what is left of it is what is tested
  DeviceState<double> state;
  state.position = {7, 8, 9};
  CHECK(any.read(state) == DeviceStatus::disconnected);
  CHECK(state.position == Vector3<double>(7, 8, 9));
  CHECK(any.write({}) == DeviceStatus::disconnected);
  CHECK_THROWS_AS(any.open(), InvalidArgument);
  CHECK_THROWS_AS(any.arm(), InvalidArgument);
  CHECK_THROWS_AS(require_valid(any.capabilities()), InvalidArgument);
  any.disarm();
  any.close();
  any.calibrate();
  CHECK(any.calibration() == Calibration::good);
  CHECK_FALSE(any.pop_fault().has_value());
  CHECK(any.clock() == nullptr);
  CHECK(any.description().model.empty());
  CHECK(any.get_if<NullDevice<double>>() == nullptr);
  any = NullDevice<double>({4, 5, 6});
  CHECK(any.read(state) == DeviceStatus::ok);
}

TEST_CASE("a device that can not be moved is made in place", "[device]") {
  AnyDevice<double> any(std::in_place_type<Rooted>, 500.0);
  CHECK(any.capabilities().rate == 500.0);
  CHECK(testing::to_text(testing::check_device(any)) == "");
}

TEST_CASE("any device hands over the clock of its device", "[device][threads]") {
  AnyDevice<double> any(std::in_place_type<ClockedDevice>, std::make_shared<CompleteDevice::Diary>());
  DeviceClock* const clock = any.clock();
  REQUIRE(clock != nullptr);
  std::atomic<int> ticks = 0;
  clock->start([](void* count) noexcept { ++*static_cast<std::atomic<int>*>(count); }, &ticks);
  while (ticks < 3) std::this_thread::yield();
  clock->stop();
  int const at_end = ticks;
  std::this_thread::yield();
  CHECK(ticks == at_end);
}

TEMPLATE_TEST_CASE("any device keeps the laws, gives its device's samples and does not allocate", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  auto const path = Trajectory<Scalar>::start({0, 0, 0}).sine({Scalar(0.01), 0, 0}, 1.0, 10.0);
  ScriptedDevice<Scalar> bare(path);
  AnyDevice<Scalar> any = ScriptedDevice<Scalar>(path);
  CHECK(testing::to_text(testing::check_device<Scalar>(any, {.force = 1.0})) == "");
  any.template get_if<ScriptedDevice<Scalar>>()->rewind();
  DeviceState<Scalar> one, two;
  bool same = true;
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  for (int tick = 0; tick < 1000; ++tick) {
    bare.read(one), any.read(two);
    any.write({});
    same = same && one.position == two.position && one.velocity == two.velocity;
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(same);
}
