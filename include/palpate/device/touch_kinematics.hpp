// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace palpate {

/// The arm of a Touch (formerly Phantom Omni): a waist and two links, from joint angles to the tip and back.
///   x = −sin θ1 r + o_x,   y = L1 sin θ2 − L2 cos θ3 + L2 + o_y,   z = cos θ1 r − L1 + o_z,   r = L1 cos θ2 + L2 sin θ3
/// θ2 and θ3 are both against the horizontal plane of the base: the second link is driven from the base and does not turn with the first. At
/// θ = 0 the first link points to the user, the second one down.
/// Units      rad, m; the device's frame: x to the right, y up, z to the user.
/// Source     plane two-link arm on a waist, \cite spong2020 ch. 3; lengths from the maker's drawings, offsets from poses that a device reported.
/// Invariant  forward(inverse(p)) = p where the arm reaches; elbow up, tip in front of the waist.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     without the gimbal. Joint limits are estimates, good to some degrees. With the tip on the waist's axis, the arm straight or folded the
///            Jacobian can not be inverted; within the limits none of it happens.
template <RealScalar Scalar = double>
struct TouchKinematics {
  using Joints = Vector3<Scalar>;   ///< θ1, θ2, θ3 [rad]
  using Point = Vector3<Scalar>;

  Scalar first = Scalar(0.13335);    ///< L1 [m]
  Scalar second = Scalar(0.13335);   ///< L2 [m]
  Point offset = {0, Scalar(-0.110), Scalar(-0.035)};   ///< o [m]
  Joints lower = {Scalar(-0.98), Scalar(0.0), Scalar(-0.81)};   ///< rad
  Joints upper = {Scalar(0.98), Scalar(1.75), Scalar(1.25)};    ///< rad
  Scalar max_fold = Scalar(1.2);                               ///< rad, of θ2 − θ3: at π/2 the links lie on each other

  /// With the pen in its holder, which the device is calibrated by.
  static Joints inkwell() noexcept { return {0, Scalar(0.26889), Scalar(-0.370813)}; }

  Point forward(Joints const& joints) const noexcept {
    Scalar const r = first * std::cos(joints[1]) + second * std::sin(joints[2]);
    Scalar const up = first * std::sin(joints[1]) - second * std::cos(joints[2]) + second;
    return offset + Point(-std::sin(joints[0]) * r, up, std::cos(joints[0]) * r - first);
  }

  /// ∂(x, y, z)/∂(θ1, θ2, θ3) [m/rad].
  Matrix<Scalar, 3, 3> jacobian(Joints const& joints) const noexcept {
    Scalar const s1 = std::sin(joints[0]), c1 = std::cos(joints[0]);
    Scalar const r = first * std::cos(joints[1]) + second * std::sin(joints[2]);
    Scalar const r2 = -first * std::sin(joints[1]), r3 = second * std::cos(joints[2]);   // ∂r/∂θ2, ∂r/∂θ3
    Matrix<Scalar, 3, 3> result;
    result << -c1 * r, -s1 * r2, -s1 * r3,
        0, first * std::cos(joints[1]), second * std::sin(joints[2]),
        -s1 * r, c1 * r2, c1 * r3;
    return result;
  }

  /// The joints with the tip there, whatever their limits; none where the arm is too short, or the tip on the waist's axis or the shoulder.
  std::optional<Joints> inverse(Point const& position) const noexcept {
    Plane const plane = in_plane(position);
    bool const reached = plane.distance <= first + second && plane.distance >= std::abs(first - second);
    if (!reached || !(plane.distance > Scalar(0)) || !(plane.out > Scalar(0))) return std::nullopt;
    return joints_of(plane);
  }

  /// The joints within their limits whose tip is near the position: where a hand that goes on is stopped. Exact where the arm reaches. A position
  /// that is not finite gives the inkwell.
  Joints nearest(Point const& position) const noexcept {
    if (!is_finite(position)) return inkwell();
    Plane plane = in_plane(position);
    plane.distance = std::clamp(plane.distance, std::abs(first - second), first + second);
    if (!(plane.distance > Scalar(0))) return inkwell();
    Joints joints = joints_of(plane).cwiseMax(lower).cwiseMin(upper);
    if (Scalar const excess = joints[1] - joints[2] - max_fold; excess > Scalar(0)) {
      joints[1] -= excess / 2;
      joints[2] += excess / 2;
    }
    return joints;
  }

  /// To within a tolerance [rad].
  bool within_limits(Joints const& joints, Scalar tolerance = 0) const noexcept {
    return (joints.array() >= lower.array() - tolerance).all() && (joints.array() <= upper.array() + tolerance).all() &&
           joints[1] - joints[2] <= max_fold + tolerance;
  }

  /// The motors' torques [N·m] that press with `force` [N] at the tip: Jᵀ F.
  Joints torques(Joints const& joints, Point const& force) const noexcept { return jacobian(joints).transpose() * force; }

 private:
  /// The plane of both links: out from the waist, up from the shoulder, and how far from there.
  struct Plane {
    Scalar waist, out, up, distance;
  };
  Plane in_plane(Point const& position) const noexcept {
    Scalar const x = position.x() - offset.x(), z = position.z() - offset.z() + first, up = position.y() - offset.y() - second;
    Scalar const out = std::hypot(x, z);
    return {std::atan2(-x, z), out, up, std::hypot(out, up)};
  }
  Joints joints_of(Plane const& plane) const noexcept {
    auto const corner = [](Scalar cosine) { return std::acos(std::clamp(cosine, Scalar(-1), Scalar(1))); };
    Scalar const d = plane.distance, rises = std::atan2(plane.up, plane.out);
    Scalar const above = corner((d * d + first * first - second * second) / (2 * d * first));
    Scalar const below = corner((d * d + second * second - first * first) / (2 * d * second));
    return {plane.waist, rises + above, rises - below + std::numbers::pi_v<Scalar> / 2};
  }
};

}  // namespace palpate
