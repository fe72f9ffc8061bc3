// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/complete_device.hpp"

#include <palpate/device/any_device.hpp>
#include <palpate/device/faulty_device.hpp>
#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/session.hpp>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::ClockedDevice;
using palpate_test::CompleteDevice;

namespace {

template <class Device>
constexpr bool has_all_but_a_clock = HapticDevice<Device> && OpensAndCloses<Device> && Armable<Device> && DescribesItself<Device> &&
                                     Calibratable<Device> && ReportsFaults<Device> && !SelfClocked<Device>;
template <class Device>
constexpr bool has_no_refinement = HapticDevice<Device> && !OpensAndCloses<Device> && !Armable<Device> && !DescribesItself<Device> &&
                                   !Calibratable<Device> && !ReportsFaults<Device> && !SelfClocked<Device>;

static_assert(has_all_but_a_clock<CompleteDevice> && SelfClocked<ClockedDevice>);
static_assert(has_all_but_a_clock<RecordedDevice<CompleteDevice>> && has_all_but_a_clock<TremblingDevice<CompleteDevice, double>>);
static_assert(has_no_refinement<NullDevice<double>>);
static_assert(has_no_refinement<RecordedDevice<NullDevice<double>>> && has_no_refinement<TremblingDevice<NullDevice<double>, double>>);
static_assert(SelfClocked<RecordedDevice<ClockedDevice>> && SelfClocked<TremblingDevice<ClockedDevice, double>>);

static_assert(HasOptionalClock<RecordedDevice<AnyDevice<double>>> && HasOptionalClock<FaultyDevice<TremblingDevice<AnyDevice<double>, double>>>);
static_assert(!HasOptionalClock<RecordedDevice<ClockedDevice>> && !HasOptionalClock<RecordedDevice<NullDevice<double>>>);
static_assert(!SelfClocked<RecordedDevice<AnyDevice<double>>>);

using WrapDiary = CompleteDevice::Diary;

/// What a session, a calibration, the name and the faults of a device around another do to the inner one.
template <class Wrapper>
void check_passes_on(Wrapper wrapper, WrapDiary& diary) {
  diary.clear();
  CHECK(wrapper.calibration() == Calibration::needs_update);
  wrapper.calibrate();
  CHECK(wrapper.calibration() == Calibration::good);
  CHECK(wrapper.description().model == "complete");
  CHECK(wrapper.capabilities().max_force.provenance == Provenance::datasheet);
  auto const fault = wrapper.pop_fault();
  REQUIRE(fault.has_value());
  CHECK(fault->native_code == 42);
  CHECK_FALSE(wrapper.pop_fault().has_value());
  {
    DeviceSession session(wrapper);
    DeviceState<double> state;
    CHECK(wrapper.read(state) == DeviceStatus::ok);
    CHECK(state.buttons == 2);
    CHECK(wrapper.write({.force = {1, 2, 3}}) == DeviceStatus::ok);
    CHECK(wrapper.device().last_wrench().force == Vector3<double>(1, 2, 3));
  }
  CHECK((diary == WrapDiary{"open", "arm", "disarm", "close"}));
  CHECK(wrapper.device().last_wrench().force.isZero(0.0));
}

}  // namespace

TEST_CASE("a device around another keeps its refinements", "[device]") {
  auto const diary = std::make_shared<WrapDiary>();
  check_passes_on(RecordedDevice(CompleteDevice(diary), 100), *diary);
  check_passes_on(TremblingDevice(CompleteDevice(diary), HandTremor<double>({.amplitude = 0.0})), *diary);
}

TEST_CASE("a device around another keeps its clock", "[device][threads]") {
  auto const diary = std::make_shared<WrapDiary>();
  RecordedDevice<ClockedDevice> device(ClockedDevice(diary), 10);
  std::atomic<int> ticks = 0;
  device.start([](void* count) noexcept { ++*static_cast<std::atomic<int>*>(count); }, &ticks);
  while (ticks < 5) std::this_thread::yield();
  device.stop();
  int const at_end = ticks;
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  CHECK(ticks == at_end);
  CHECK((*diary == WrapDiary{"start"}));
}

TEST_CASE("a device around any device hands over its clock, as deep as it is", "[device][threads]") {
  auto const diary = std::make_shared<WrapDiary>();
  RecordedDevice<AnyDevice<double>> recorded(AnyDevice<double>(std::in_place_type<ClockedDevice>, diary), 10);
  AnyDevice<double> any(std::in_place_type<FaultyDevice<RecordedDevice<AnyDevice<double>>>>, std::move(recorded), std::vector<PlannedFault>{});
  DeviceClock* const clock = any.clock();
  REQUIRE(clock != nullptr);
  std::atomic<int> ticks = 0;
  clock->start([](void* count) noexcept { ++*static_cast<std::atomic<int>*>(count); }, &ticks);
  while (ticks < 5) std::this_thread::yield();
  clock->stop();
  CHECK((*diary == WrapDiary{"start"}));
  CHECK(RecordedDevice<AnyDevice<double>>(AnyDevice<double>(NullDevice<double>()), 1).clock() == nullptr);
}
