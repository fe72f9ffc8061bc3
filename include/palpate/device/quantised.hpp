// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <cmath>

namespace palpate {

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
