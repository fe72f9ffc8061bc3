// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/nearest_rotation.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cstdint>

namespace palpate::detail::force_dimension {

/// What the library gives for one tick: SI units, x towards the user, y to the right, z up.
struct NativeState {
  std::array<double, 3> position{}, velocity{}, angular_velocity{};
  double rotation[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};   // rows; its columns are the tool's axes
  unsigned buttons = 0;
};

constexpr int button_bits = 16;

/// (towards the user, right, up) → (right, up, towards the user): a cyclic permutation, so a proper rotation.
///   v = P v_dhd,   R = P R_dhd Pᵀ,   P = [0 1 0; 0 0 1; 1 0 0]
inline Vector3<double> from_native(std::array<double, 3> const& v) noexcept { return {v[1], v[2], v[0]}; }
inline std::array<double, 3> to_native(Vector3<double> const& v) noexcept { return {v.z(), v.x(), v.y()}; }

/// False, and nothing changed, when position or velocity are not finite. A rotation that is none leaves the orientation as it was.
inline bool convert(NativeState const& native, bool has_wrist, DeviceState<double>& state) noexcept {
  Vector3<double> const position = from_native(native.position), velocity = from_native(native.velocity);
  if (!is_finite(position) || !is_finite(velocity)) return false;
  state.position = position;
  state.velocity = velocity;
  state.buttons = static_cast<std::uint32_t>(native.buttons) & ((1u << button_bits) - 1u);
  if (!has_wrist) return true;
  if (Vector3<double> const turning = from_native(native.angular_velocity); is_finite(turning)) state.angular_velocity = turning;
  constexpr int from[3] = {1, 2, 0};
  Matrix<double, 3, 3> rotation;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rotation(row, column) = native.rotation[from[row]][from[column]];
  if (auto const nearest = nearest_rotation<double>(rotation)) state.orientation = Eigen::Quaternion<double>(*nearest).normalized();
  return true;
}

}  // namespace palpate::detail::force_dimension
