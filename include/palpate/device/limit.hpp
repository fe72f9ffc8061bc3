// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>

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

}  // namespace palpate
