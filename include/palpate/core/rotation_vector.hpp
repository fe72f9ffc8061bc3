// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <cmath>

namespace palpate {

/// The rotation vector [rad] of a unit quaternion, the shortest arc: its length is from 0 to π.
template <RealScalar S>
Vector3<S> rotation_vector(Eigen::Quaternion<S> const& q) noexcept {
  S const sine = q.vec().norm(), sign = q.w() < S(0) ? S(-1) : S(1);
  if (!(sine > S(0))) return Vector3<S>::Zero();
  return (S(2) * std::atan2(sine, sign * q.w()) / sine * sign) * q.vec();
}

/// The unit quaternion of a rotation vector [rad].
template <RealScalar S>
Eigen::Quaternion<S> rotation_of(Vector3<S> const& vector) noexcept {
  S const angle = vector.norm(), share = angle > S(1e-4) ? std::sin(angle / S(2)) / angle : S(0.5) - angle * angle / S(48);
  Eigen::Quaternion<S> q(std::cos(angle / S(2)), share * vector.x(), share * vector.y(), share * vector.z());
  return q.normalized();
}

}  // namespace palpate
