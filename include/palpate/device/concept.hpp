// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <concepts>
#include <cstdint>

namespace palpate {

/// What a device can do. The first two have to be given; zero in the others means "does not have it".
struct Capabilities {
  double max_force = 0.0;        ///< N; no larger force is ever written. Infinity: not limited. 0: a tracker, the hand feels nothing
  double rate = 0.0;             ///< Hz, servo ticks per second: one `read` and one `write` each
  double max_torque = 0.0;       ///< N·m; 0: torques are ignored
  bool reports_velocity = false; ///< `read` fills `velocity`; otherwise the host differentiates positions
  bool reports_orientation = false;
  int buttons = 0;               ///< how many bits of `DeviceState::buttons` mean something
};

/// What one `read` or `write` came to. Anything but `ok` and `stale` means: write no force until the device is opened again.
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
/// Units      position [m], velocity [m/s], angular_velocity [rad/s]: the tool's tip, world frame.
/// Invariant  orientation is a unit quaternion, world ← tool. A device that does not measure a field leaves it as it is.
template <RealScalar Scalar>
struct DeviceState {
  Vector3<Scalar> position = Vector3<Scalar>::Zero();
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();
  Eigen::Quaternion<Scalar> orientation = Eigen::Quaternion<Scalar>::Identity();
  Vector3<Scalar> angular_velocity = Vector3<Scalar>::Zero();
  std::uint32_t buttons = 0;   ///< bit i is set while button i is pressed
};

/// What the hand feels: force [N] and torque about the tip [N·m], world frame.
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

/// Throws `InvalidArgument` for capabilities that no servo loop can run with.
inline void require_valid(Capabilities const& capabilities) {
  if (!(capabilities.rate > 0.0) || !std::isfinite(capabilities.rate))
    throw InvalidArgument(detail::message("device rate is ", capabilities.rate,
                                          " Hz; capabilities() must report a positive rate, for example .rate = 1000.0"));
  if (!(capabilities.max_force >= 0.0))
    throw InvalidArgument(detail::message("device maximum force is ", capabilities.max_force,
                                          " N; capabilities() must report zero or more, for example .max_force = 3.3"));
  if (!(capabilities.max_torque >= 0.0))
    throw InvalidArgument(detail::message("device maximum torque is ", capabilities.max_torque,
                                          " N m; capabilities() must report zero or more"));
}

}  // namespace palpate
