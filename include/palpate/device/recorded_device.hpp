// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/hand_sample.hpp>

#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

/// Any device, with a log of what it said: one `HandSample` a tick. A `Recording` holds where the tip was; what it lacks, and a replay to the
/// byte needs, is the velocity that the device reported, and which reads and writes failed.
///
///   Simulator simulator(RecordedDevice(MyDevice{}, 60 * 1000), std::move(body), cutter, force);
///   Recording const recording = simulator.run(60.0);
///   ReplayDevice<double> again(simulator.device().samples(), simulator.device().capabilities());
///
/// Cost       what the device costs, and a copy; noexcept, no allocation: ticks beyond the room asked for are counted, not logged.
/// Limits     buttons and orientation are passed on and not logged; no simulation here depends on them.
template <class Device, RealScalar Scalar = double>
  requires HapticDevice<Device, Scalar>
class RecordedDevice {
 public:
  /// Room for that many ticks.
  RecordedDevice(Device device, std::size_t room) : device_(std::move(device)) { samples_.reserve(room); }

  Capabilities capabilities() const { return device_.capabilities(); }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    DeviceStatus const status = device_.read(state);
    logs_ = samples_.size() < samples_.capacity();
    if (!logs_)
      ++dropped_;
    else if (is_usable(status))
      samples_.push_back({.position = state.position.template cast<double>(), .velocity = state.velocity.template cast<double>(), .read = status});
    else
      samples_.push_back({.read = status});
    return status;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    DeviceStatus const status = device_.write(wrench);
    if (logs_) samples_.back().written = status;
    logs_ = false;   // what is written at the end of a session belongs to no tick
    return status;
  }

  void open()
    requires OpensAndCloses<Device>
  {
    device_.open();
  }
  void close() noexcept
    requires OpensAndCloses<Device>
  {
    device_.close();
  }
  void arm()
    requires Armable<Device>
  {
    device_.arm();
  }
  void disarm() noexcept
    requires Armable<Device>
  {
    device_.disarm();
  }

  std::vector<HandSample> const& samples() const noexcept { return samples_; }
  /// How many ticks found no room.
  std::size_t dropped() const noexcept { return dropped_; }
  Device& device() noexcept { return device_; }
  Device const& device() const noexcept { return device_; }

 private:
  Device device_;
  std::vector<HandSample> samples_;
  std::size_t dropped_ = 0;
  bool logs_ = false;   // this tick has a sample
};

}  // namespace palpate
