// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>

#include <cmath>

namespace palpate {

/// The vector limited to length `maximum`, direction kept; zero when a component or the maximum is not finite.
///   |v| ≤ maximum: v,   |v| > maximum: maximum v/|v|,   v not finite or maximum NaN or negative: 0
/// Cost       noexcept, no allocation: the last stage before a device's `write`.
template <RealScalar Scalar>
Vector3<Scalar> limited(Vector3<Scalar> const& value, Scalar maximum) noexcept {
  if (!is_finite(value) || !(maximum > Scalar(0))) return Vector3<Scalar>::Zero();
  Scalar const largest = value.cwiseAbs().maxCoeff();
  if (largest == Scalar(0)) return value;
  Vector3<Scalar> const scaled = value / largest;   // so that the squares neither overflow nor vanish
  Scalar const norm = scaled.norm();
  if (norm <= maximum / largest) return value;
  return (maximum / norm) * scaled;
}

/// Force and torque limited to what the device can render.
template <RealScalar Scalar>
Wrench<Scalar> limited(Wrench<Scalar> const& wrench, Capabilities const& capabilities) noexcept {
  return {.force = limited(wrench.force, static_cast<Scalar>(capabilities.max_force)),
          .torque = limited(wrench.torque, static_cast<Scalar>(capabilities.max_torque))};
}

/// The finest step that a device may say it has [m]; finer ones, and a position counted in them is no number any more.
inline constexpr double finest_quantum = 1e-12;

/// What an encoder of this resolution says: each component at the nearest multiple of the quantum, halves away from zero. 0 changes nothing.
/// Units      as the value's, m for a position.
/// Cost       noexcept, no allocation: allowed in the servo tick.
template <RealScalar Scalar>
Vector3<Scalar> quantised(Vector3<Scalar> const& value, double quantum) noexcept {
  if (!(quantum > 0.0)) return value;
  Vector3<Scalar> result;
  for (int axis = 0; axis < 3; ++axis) result[axis] = static_cast<Scalar>(std::round(static_cast<double>(value[axis]) / quantum) * quantum);
  return result;
}

}  // namespace palpate
