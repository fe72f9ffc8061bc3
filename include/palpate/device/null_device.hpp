// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>

#include <limits>

namespace palpate {

/// A device at rest: a constant position; every force is accepted and ignored. The device to start with, and a partner for tests.
template <RealScalar Scalar = double>
class NullDevice {
 public:
  explicit NullDevice(Vector3<Scalar> const& position = Vector3<Scalar>::Zero(), double rate = 1000.0)
      : position_(position), rate_(rate) {
    require_valid(capabilities());
  }

  Capabilities capabilities() const noexcept {
    return {.max_force = std::numeric_limits<double>::infinity(), .rate = rate_, .reports_velocity = true, .moves_a_hand = false};
  }
  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    state.position = position_;
    state.velocity.setZero();
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<Scalar> const& /*wrench*/) noexcept { return DeviceStatus::ok; }

 private:
  Vector3<Scalar> position_;
  double rate_;   // Hz
};

}  // namespace palpate
