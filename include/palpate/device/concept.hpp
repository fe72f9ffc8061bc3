// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/capabilities.hpp>

#include <Eigen/Geometry>

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>

namespace palpate {

/// Status of a `read` or `write`. Anything but `ok` and `stale` means: write no force until the device is opened again.
enum class DeviceStatus {
  ok,
  stale,         ///< no new sample since the last tick: the state holds the last one
  disconnected,  ///< the device is gone
  fault          ///< the device reported an error of its own (overheated, over force, not calibrated)
};

constexpr char const* to_string(DeviceStatus status) noexcept {
  switch (status) {
    case DeviceStatus::ok: return "ok";
    case DeviceStatus::stale: return "stale";
    case DeviceStatus::disconnected: return "disconnected";
    case DeviceStatus::fault: return "fault";
  }
  return "unknown";
}

/// May the tick go on with this state?
constexpr bool is_usable(DeviceStatus status) noexcept {
  return status == DeviceStatus::ok || status == DeviceStatus::stale;
}

/// One sample of the hand.
/// Units      position [m], velocity [m/s], angular_velocity [rad/s]: the tool's tip, in the device's frame, which is the world's unless the host says
///            otherwise. A device on a desk has x to the right, y up, z towards the user.
/// Invariant  orientation is a unit quaternion, device frame ← tool. A device that does not measure a field leaves it as it is.
template <RealScalar Scalar>
struct DeviceState {
  Vector3<Scalar> position = Vector3<Scalar>::Zero();
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();
  Eigen::Quaternion<Scalar> orientation = Eigen::Quaternion<Scalar>::Identity();
  Vector3<Scalar> angular_velocity = Vector3<Scalar>::Zero();
  std::uint32_t buttons = 0;   ///< bit i is set while button i is pressed
  Scalar gripper = 1;          ///< how far the fingers have opened it: 0 closed, 1 open
};

/// What the hand feels: force [N] and torque about the tip [N·m], in the device's frame.
template <RealScalar Scalar>
struct Wrench {
  Vector3<Scalar> force = Vector3<Scalar>::Zero();
  Vector3<Scalar> torque = Vector3<Scalar>::Zero();
};

template <class Device>
concept ReportsCapabilities = requires(Device const& device) {
  { device.capabilities() } -> std::convertible_to<Capabilities>;
};

template <class Device, class Scalar>
concept ReadsState = requires(Device& device, DeviceState<Scalar>& state) {
  { device.read(state) } -> std::same_as<DeviceStatus>;
};

template <class Device, class Scalar>
concept WritesWrench = requires(Device& device, Wrench<Scalar> const& wrench) {
  { device.write(wrench) } -> std::same_as<DeviceStatus>;
};

/// `read` and `write` run inside the servo tick, where an exception has nowhere to go: both are declared `noexcept`.
template <class Device, class Scalar>
concept ServesWithoutThrowing = requires(Device& device, DeviceState<Scalar>& state, Wrench<Scalar> const& wrench) {
  { device.read(state) } noexcept;
  { device.write(wrench) } noexcept;
};

/// A device that a hand holds: three members are enough.
///   Capabilities capabilities() const;
///   DeviceStatus read(DeviceState<Scalar>& state) noexcept;          // where is the hand
///   DeviceStatus write(Wrench<Scalar> const& wrench) noexcept;       // what it feels, until the next write
/// What syntax can not say: capabilities stay the same while a simulator runs; each tick calls `read` once, then `write` once,
/// from one thread; neither allocates, locks or waits longer than a small part of the tick; a failed `read` leaves the state
/// as it was.
template <class Device, class Scalar = double>
concept HapticDevice = ReportsCapabilities<Device> && ReadsState<Device, Scalar> && WritesWrench<Device, Scalar> &&
                       ServesWithoutThrowing<Device, Scalar>;

namespace detail {

/// Says, where it is instantiated, what keeps Device from being a HapticDevice of this scalar.
template <class Device, class Scalar>
struct DeviceSentences {
  static_assert(ReportsCapabilities<Device>, "palpate: the device has no capabilities(); declare: Capabilities capabilities() const, at least its largest force and its rate.");
  static_assert(ReadsState<Device, Scalar>,
                "palpate: the device has no read(state) that answers a DeviceStatus; declare: DeviceStatus read(DeviceState<double>& state) noexcept, DeviceStatus::ok "
                "where it has filled the state.");
  static_assert(WritesWrench<Device, Scalar>,
                "palpate: the device has no write(wrench) that answers a DeviceStatus; declare: DeviceStatus write(Wrench<double> const& wrench) noexcept, DeviceStatus::ok "
                "where the hand feels it.");
  static_assert(!ReadsState<Device, Scalar> || !WritesWrench<Device, Scalar> || ServesWithoutThrowing<Device, Scalar>,
                "palpate: the device's read and write run in the servo tick, where nobody catches; declare both noexcept: DeviceStatus read(DeviceState<double>& state) "
                "noexcept, DeviceStatus write(Wrench<double> const& wrench) noexcept.");
};

}  // namespace detail

/// Refinement: a device that is opened before its first tick and closed after its last. `open` may take time and throws when
/// it fails; `close` may be called twice. `DeviceSession` calls both.
template <class Device>
concept OpensAndCloses = requires(Device& device) {
  device.open();
  { device.close() } noexcept;
};

/// Refinement: a device whose motors are switched on and off. `arm` throws when it fails. `DeviceSession` calls both.
template <class Device>
concept Armable = requires(Device& device) {
  device.arm();
  { device.disarm() } noexcept;
};

/// Who the device is, in words; any of them may be empty.
struct DeviceDescription {
  std::string vendor{}, model{}, serial{}, driver{};
};

/// Refinement: a device that says who it is. Not in the servo tick.
template <class Device>
concept DescribesItself = requires(Device const& device) {
  { device.description() } -> std::convertible_to<DeviceDescription>;
};

/// Is the device's zero where it should be?
enum class Calibration {
  good,
  needs_update,   ///< `calibrate()` can do it by itself, while the force is off
  needs_hand      ///< the user has to bring the tool to a place first: `calibration_advice()` says which, if it has that
};

constexpr char const* to_string(Calibration calibration) noexcept {
  switch (calibration) {
    case Calibration::good: return "good";
    case Calibration::needs_update: return "needs an update";
    case Calibration::needs_hand: return "needs the user's hand";
  }
  return "unknown";
}

/// Refinement: a device that has to be calibrated. While it is not `good` no force is written. `calibrate` is called with the motors off; positions may
/// jump then. Both may be called in the servo tick.
template <class Device>
concept Calibratable = requires(Device& device) {
  { device.calibration() } noexcept -> std::same_as<Calibration>;
  { device.calibrate() } noexcept;
};

/// Refinement: a device that says, for the user to read, what brings its calibration back; the words are static or belong to the device.
template <class Device>
concept AdvisesCalibration = requires(Device const& device) {
  { device.calibration_advice() } noexcept -> std::convertible_to<char const*>;
};

/// What went wrong in a device, with the device's own number and words; the words are static or belong to the device.
struct DeviceFault {
  DeviceStatus status = DeviceStatus::fault;
  int native_code = 0;
  char const* what = "";
};

/// Refinement: a device with a queue of faults, taken oldest first; null when there is none. May be called in the servo tick.
template <class Device>
concept ReportsFaults = requires(Device& device) {
  { device.pop_fault() } noexcept -> std::same_as<std::optional<DeviceFault>>;
};

/// Refinement: a device whose driver keeps the time: it calls `tick(context)` once a period from its own thread, between `start` and
/// `stop`. `read` and `write` are then for that thread alone. `stop` returns when no call is under way. Otherwise the host keeps the
/// time.
template <class Device>
concept SelfClocked = requires(Device& device, void (*tick)(void*) noexcept, void* context) {
  device.start(tick, context);
  { device.stop() } noexcept;
};

/// The clock of a device that has one: see `SelfClocked`.
class DeviceClock {
 public:
  virtual void start(void (*tick)(void*) noexcept, void* context) = 0;
  virtual void stop() noexcept = 0;

 protected:
  ~DeviceClock() = default;
};

/// Refinement: a device with a clock that is known only at run time: `clock()` is that clock, or null.
template <class Device>
concept HasOptionalClock = requires(Device& device) {
  { device.clock() } noexcept -> std::same_as<DeviceClock*>;
};

namespace detail {

// Members that have the names of refinements, whether they are them or not.
template <class Device>
concept NamesOpen = requires(Device& device) { device.open(); };
template <class Device>
concept NamesArm = requires(Device& device) { device.arm(); };
template <class Device>
concept NamesDisarm = requires(Device& device) { device.disarm(); };
template <class Device>
concept NamesCalibrate = requires(Device& device) { device.calibrate(); };
template <class Device>
concept TellsCalibration = requires(Device& device) {
  { device.calibration() } -> std::same_as<Calibration>;
};
template <class Device>
concept NamesStart = requires(Device& device, void (*tick)(void*) noexcept, void* context) {   // void: a data member of this name, a vector say, may be called, too
  { device.start(tick, context) } -> std::same_as<void>;
};
template <class Device>
concept NamesOpenAndClose = requires(Device& device) { device.open(), device.close(); };
template <class Device>
concept NamesArmAndDisarm = requires(Device& device) { device.arm(), device.disarm(); };
template <class Device>
concept NamesCalibration = requires(Device& device) {
  { device.calibration() } -> std::same_as<Calibration>;
  device.calibrate();
};
template <class Device>
concept NamesCalibrationAdvice = requires(Device& device) { device.calibration_advice(); };
template <class Device>
concept NamesPopFault = requires(Device& device) { device.pop_fault(); };
template <class Device>
concept NamesStartAndStop = requires(Device& device, void (*tick)(void*) noexcept, void* context) { device.start(tick, context), device.stop(); };
template <class Device>
concept NamesClock = requires(Device& device) {
  { device.clock() } -> std::same_as<DeviceClock*>;
};

/// Says, where it is instantiated, which members of Device would not be called, because they are not quite those of a refinement.
template <class Device>
struct DeviceRefinements {
  static_assert(!NamesOpen<Device> || NamesOpenAndClose<Device>, "palpate: the device has open() and no close(), so that it would never be opened; declare: void open(); void close() noexcept.");
  static_assert(!NamesArm<Device> || NamesArmAndDisarm<Device>, "palpate: the device has arm() and no disarm(), so that it would never be armed; declare: void arm(); void disarm() noexcept.");
  static_assert(!NamesDisarm<Device> || NamesArmAndDisarm<Device>, "palpate: the device has disarm() and no arm(), so that it would never be disarmed; declare: void arm(); void disarm() noexcept.");
  static_assert(!NamesCalibrate<Device> || NamesCalibration<Device>,
                "palpate: the device has calibrate() and no calibration(), so that it would never be calibrated; declare: Calibration calibration() noexcept; void calibrate() noexcept.");
  static_assert(!TellsCalibration<Device> || NamesCalibration<Device>,
                "palpate: the device has calibration() and no calibrate(), so that it would count as calibrated; declare: Calibration calibration() noexcept; void calibrate() noexcept, which may do nothing.");
  static_assert(!NamesStart<Device> || NamesStartAndStop<Device>,
                "palpate: the device has start() and no stop(), so that its clock would not be used; declare: void start(void (*tick)(void*) noexcept, void* context); void stop() noexcept.");
  static_assert(!NamesOpenAndClose<Device> || OpensAndCloses<Device>,
                "palpate: the device's close() may throw, so that neither it nor open() would be called; declare: void open(); void close() noexcept.");
  static_assert(!NamesArmAndDisarm<Device> || Armable<Device>,
                "palpate: the device's disarm() may throw, so that neither it nor arm() would be called; declare: void arm(); void disarm() noexcept.");
  static_assert(!NamesCalibration<Device> || Calibratable<Device>,
                "palpate: the device's calibration() or calibrate() may throw, so that it would count as calibrated; declare: Calibration calibration() noexcept; void calibrate() noexcept.");
  static_assert(!NamesCalibrationAdvice<Device> || AdvisesCalibration<Device>,
                "palpate: the device's calibration_advice() would not be called; declare: char const* calibration_advice() const noexcept.");
  static_assert(!NamesPopFault<Device> || ReportsFaults<Device>,
                "palpate: the device's pop_fault() would not be called; declare: std::optional<DeviceFault> pop_fault() noexcept.");
  static_assert(!NamesStartAndStop<Device> || SelfClocked<Device>,
                "palpate: the device's stop() may throw, so that its clock would not be used; declare: void start(void (*tick)(void*) noexcept, void* context); void stop() noexcept.");
  static_assert(!NamesClock<Device> || HasOptionalClock<Device>, "palpate: the device's clock() may throw, so that it would not be called; declare: DeviceClock* clock() noexcept.");
};

}  // namespace detail

}  // namespace palpate
