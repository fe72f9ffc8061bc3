// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>

#include <Eigen/Geometry>

#include <concepts>
#include <cstdint>
#include <vector>

namespace palpate {

/// Input and output of a device in one servo tick, as far as a simulation depends on it: enough to replay the tick.
/// Invariant  after a failed read all are as at the start; they are not used then.
/// Units      position [m], velocity [m/s]; the device's frame; in double for every scalar, which represents a float exactly.
struct HandSample {
  Vector3<double> position = Vector3<double>::Zero();
  Vector3<double> velocity = Vector3<double>::Zero();   ///< as the device reported it; zero where it reports none
  Eigen::Quaternion<double> orientation = Eigen::Quaternion<double>::Identity();   ///< device ← tool, the same
  std::uint32_t buttons = 0;
  double gripper = 1;   ///< from 0, closed, to 1, open; 1 where the device reports none
  DeviceStatus read = DeviceStatus::ok;
  DeviceStatus written = DeviceStatus::ok;
};

/// Refinement: a device with a log of its input and output, one sample a tick; see `RecordedDevice`.
template <class Device>
concept RecordsSamples = requires(Device const& device) {
  { device.samples() } -> std::convertible_to<std::vector<HandSample> const&>;
};

}  // namespace palpate
