// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/nearest_rotation.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace palpate::detail::phantom {

/// What the library gives for one tick, in its own units.
struct NativeState {
  std::array<double, 3> position{};           // mm
  std::array<double, 3> velocity{};           // mm/s
  std::array<double, 3> angular_velocity{};   // rad/s
  std::array<double, 16> transform{};         // 4 × 4, translation in mm
  int buttons = 0;
};

/// How the sixteen numbers lie: papers and libraries do not agree.
enum class TransformOrder { by_columns, by_rows };

/// The order in which the translation is the position; nothing when the position is too near to the origin to tell, or neither fits.
inline std::optional<TransformOrder> order_of(NativeState const& native) noexcept {
  auto const fits = [&](std::size_t x, std::size_t y, std::size_t z) {
    return std::abs(native.transform[x] - native.position[0]) <= 1e-3 && std::abs(native.transform[y] - native.position[1]) <= 1e-3 &&
           std::abs(native.transform[z] - native.position[2]) <= 1e-3;
  };
  bool const columns = fits(12, 13, 14), rows = fits(3, 7, 11);
  if (columns == rows) return std::nullopt;
  return columns ? TransformOrder::by_columns : TransformOrder::by_rows;
}

/// In SI units; false, and nothing changed, when position or velocity are not finite. A rotation that is none leaves the orientation as it was.
/// The frame is the device's: x to the right, y up, z towards the user.
inline bool convert(NativeState const& native, TransformOrder order, DeviceState<double>& state) noexcept {
  auto const vector = [](std::array<double, 3> const& from, double unit) { return Vector3<double>(unit * from[0], unit * from[1], unit * from[2]); };
  Vector3<double> const position = vector(native.position, 1e-3), velocity = vector(native.velocity, 1e-3),
                        turning = vector(native.angular_velocity, 1.0);
  if (!is_finite(position) || !is_finite(velocity)) return false;
  state.position = position;
  state.velocity = velocity;
  if (is_finite(turning)) state.angular_velocity = turning;
  state.buttons = static_cast<std::uint32_t>(native.buttons);
  Eigen::Map<Matrix<double, 4, 4> const> const columns(native.transform.data());
  Matrix<double, 3, 3> const linear = columns.topLeftCorner<3, 3>();
  if (auto const rotation = nearest_rotation<double>(order == TransformOrder::by_columns ? linear : linear.transpose())) {
    Eigen::Quaternion<double> const orientation(*rotation);
    state.orientation = orientation.normalized();
  }
  return true;
}

inline std::array<double, 3> force_to_native(Vector3<double> const& force) noexcept { return {force.x(), force.y(), force.z()}; }   // N
inline std::array<double, 3> torque_to_native(Vector3<double> const& torque) noexcept {   // N·m → mN·m
  return {1e3 * torque.x(), 1e3 * torque.y(), 1e3 * torque.z()};
}

}  // namespace palpate::detail::phantom
