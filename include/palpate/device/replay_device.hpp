// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/hand_sample.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate {

/// Replays samples tick by tick: read n gives sample n as it was, failed reads and writes included, without interpolation. After the last
/// sample the hand rests there and says `stale`.
/// A simulator of the same parts, configuration, seeds and scalar then gives the same recording to the byte. `ScriptedDevice` does not:
/// it reads a `Trajectory` made from recorded points, which differ by rounding, and reports the slope of that path as velocity.
/// Errors     `InvalidArgument` when there are no samples, or the capabilities make no sense.
/// Cost       `read` and `write` are O(1), noexcept, no allocation.
/// Limits     open loop: the hand does not yield to a force that differs from the recorded one. A sample does not say whether the device was calibrated: a replay
///            goes on where the recorded session felt nothing because it was not.
template <RealScalar Scalar>
class ReplayDevice {
 public:
  /// `capabilities` are those of the device that was recorded; a `max_force` of another size limits forces elsewhere.
  ReplayDevice(std::vector<HandSample> samples, Capabilities const& capabilities) : samples_(std::move(samples)), capabilities_(capabilities) {
    require_valid(capabilities_);
    if (samples_.empty()) throw InvalidArgument("ReplayDevice: there are 0 samples; give one a tick, from RecordedDevice or a Session");
  }

  Capabilities capabilities() const noexcept { return capabilities_; }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    bool const rests = finished();
    HandSample const& sample = samples_[rests ? samples_.size() - 1 : static_cast<std::size_t>(tick_)];
    ++tick_;
    if (!is_usable(sample.read)) return sample.read;
    state.position = sample.position.template cast<Scalar>();
    state.buttons = sample.buttons;
    if (capabilities_.reports_orientation) state.orientation = sample.orientation.template cast<Scalar>();
    if (capabilities_.reports_gripper) state.gripper = static_cast<Scalar>(sample.gripper);
    if (capabilities_.reports_velocity) state.velocity = rests ? Vector3<Scalar>::Zero() : sample.velocity.template cast<Scalar>().eval();
    return rests ? DeviceStatus::stale : sample.read;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    last_wrench_ = wrench;
    if (tick_ == 0) return DeviceStatus::ok;
    return samples_[std::min(static_cast<std::size_t>(tick_), samples_.size()) - 1].written;
  }

  /// How many samples were read.
  std::uint64_t tick() const noexcept { return tick_; }
  /// s of replay.
  double duration() const noexcept { return static_cast<double>(samples_.size()) / capabilities_.rate; }
  bool finished() const noexcept { return tick_ >= samples_.size(); }
  /// Starts over; the last wrench is forgotten.
  void rewind() noexcept {
    tick_ = 0;
    last_wrench_ = {};
  }
  Wrench<Scalar> const& last_wrench() const noexcept { return last_wrench_; }

 private:
  std::vector<HandSample> samples_;
  Capabilities capabilities_;
  std::uint64_t tick_ = 0;
  Wrench<Scalar> last_wrench_;
};

}  // namespace palpate
