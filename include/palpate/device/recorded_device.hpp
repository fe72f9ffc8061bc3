// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/detail/wrapped_device.hpp>
#include <palpate/device/hand_sample.hpp>

#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

/// A device with a log of its input and output: one `HandSample` a tick. A `Recording` holds where the tip was. A replay to the byte also needs the
/// velocity and orientation that the device reported, and which reads and writes failed.
///
///   Simulator simulator(RecordedDevice(MyDevice{}, 60 * 1000), std::move(body), cutter, force);
///   Recording const recording = simulator.run(60.0);
///   ReplayDevice<double> again(simulator.device().samples(), simulator.device().capabilities());
///
/// Invariant  a copy has the log so far and the same capacity.
/// Cost       what the device costs, and a copy; noexcept, no allocation: ticks beyond the capacity are counted, not logged.
/// Limits     the angular velocity is passed on and not logged; no simulation here depends on it.
template <class Device, RealScalar Scalar = double>
  requires HapticDevice<Device, Scalar>
class RecordedDevice : public detail::WrappedDevice<Device, Scalar> {
  using Wrapped = detail::WrappedDevice<Device, Scalar>;
  using Wrapped::device_;

 public:
  /// Room for that many ticks.
  RecordedDevice(Device device, std::size_t room) : Wrapped(std::move(device)), log_(room) {}

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    if (!knows_) {
      Capabilities const capabilities = device_.capabilities();
      knows_ = true, moves_ = capabilities.reports_velocity, turns_ = capabilities.reports_orientation, grips_ = capabilities.reports_gripper;
    }
    DeviceStatus const status = device_.read(state);
    logs_ = log_.samples.size() < log_.room;
    if (!logs_)
      ++dropped_;
    else if (is_usable(status))
      log_.samples.push_back({.position = state.position.template cast<double>(),
                              .velocity = moves_ ? state.velocity.template cast<double>().eval() : Vector3<double>(Vector3<double>::Zero()),
                              .orientation = turns_ ? state.orientation.template cast<double>() : Eigen::Quaternion<double>::Identity(),
                              .buttons = state.buttons,
                              .gripper = grips_ ? static_cast<double>(state.gripper) : 1.0,
                              .read = status});
    else
      log_.samples.push_back({.read = status});
    return status;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    DeviceStatus const status = device_.write(wrench);
    if (logs_) log_.samples.back().written = status;
    logs_ = false;   // what is written at the end of a session belongs to no tick
    return status;
  }

  std::vector<HandSample> const& samples() const noexcept { return log_.samples; }
  /// How many ticks found no room.
  std::size_t dropped() const noexcept { return dropped_; }

 private:
  struct Log {
    explicit Log(std::size_t ticks) : room(ticks) { samples.reserve(room); }
    Log(Log const& other) : Log(other.room) { samples.insert(samples.end(), other.samples.begin(), other.samples.end()); }   // a copied vector keeps no room
    Log(Log&& other) noexcept : samples(std::move(other.samples)), room(std::exchange(other.room, 0)) {}
    Log& operator=(Log other) noexcept {
      samples.swap(other.samples);
      room = other.room;
      return *this;
    }

    std::vector<HandSample> samples;
    std::size_t room;
  };

  Log log_;
  std::size_t dropped_ = 0;
  bool logs_ = false;   // this tick has a sample
  bool knows_ = false, moves_ = false, turns_ = false, grips_ = false;   // whether it reports velocity, orientation and gripper, asked in the first read; else the state has the host's
};

}  // namespace palpate
