// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/trajectory.hpp>

#include <cstdint>
#include <utility>

namespace palpate {

struct ScriptedDeviceOptions {
  double max_force = 3.3;   ///< N; the Touch's value
  double rate = 1000.0;     ///< Hz
};

/// A hand that follows a trajectory, whatever it feels; for tests, examples and repeated experiments.
///   tick n reads the trajectory at n / rate, n = 0, 1, 2, …; after the end the hand rests at the last point.
/// Invariant  Time counts in reads, not on a clock: the same script gives the same samples on every machine, and a real-time
///            loop that skips ticks makes the script later, not different.
/// Cost       `read` is O(log pieces), `write` O(1); noexcept, no allocation.
template <RealScalar Scalar>
class ScriptedDevice {
 public:
  explicit ScriptedDevice(Trajectory<Scalar> trajectory, ScriptedDeviceOptions const& options = {})
      : trajectory_(std::move(trajectory)),
        capabilities_{.max_force = options.max_force, .rate = options.rate, .reports_velocity = true} {
    require_valid(capabilities_);
  }

  Capabilities capabilities() const noexcept { return capabilities_; }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    Motion<Scalar> const now = trajectory_.at(time());
    ++tick_;
    state.position = now.position;
    state.velocity = now.velocity;
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    last_wrench_ = wrench;
    return DeviceStatus::ok;
  }

  /// How many samples were read.
  std::uint64_t tick() const noexcept { return tick_; }
  /// s, where in the trajectory the next read will be.
  double time() const noexcept { return static_cast<double>(tick_) / capabilities_.rate; }
  bool finished() const noexcept { return time() >= trajectory_.duration(); }
  /// Starts over; the last wrench is forgotten.
  void rewind() noexcept {
    tick_ = 0;
    last_wrench_ = {};
  }

  Wrench<Scalar> const& last_wrench() const noexcept { return last_wrench_; }
  Trajectory<Scalar> const& trajectory() const noexcept { return trajectory_; }

 private:
  Trajectory<Scalar> trajectory_;
  Capabilities capabilities_;
  std::uint64_t tick_ = 0;
  Wrench<Scalar> last_wrench_;
};

static_assert(HapticDevice<ScriptedDevice<double>> && HapticDevice<ScriptedDevice<float>, float>);

}  // namespace palpate
