// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <string_view>

namespace palpate {

/// Where a tool is, how it is turned, how fast it goes and how wide its jaws are open.
/// Units      position [m] and velocity [m/s] of the tip; world frame.
/// Invariant  orientation is a unit quaternion, world ← tool; the identity where nobody knows. opening is from 0, closed, to 1, as open as the tool can be.
template <RealScalar Scalar>
struct ToolPose {
  Vector3<Scalar> position = Vector3<Scalar>::Zero();
  Eigen::Quaternion<Scalar> orientation = Eigen::Quaternion<Scalar>::Identity();
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();
  Scalar opening = 1;   ///< of what has jaws
};

namespace detail {

/// Throws InvalidArgument for a pose that no blade can have.
template <RealScalar Scalar>
void require_pose(std::string_view owner, ToolPose<Scalar> const& tool) {
  if (!is_finite(tool.position)) require_finite(message(owner, ": the tip"), tool.position, "m");
  if (!(std::abs(tool.orientation.norm() - 1) < Scalar(1e-3)))
    throw InvalidArgument(message(owner, ": the tool's orientation has the length ", tool.orientation.norm(), "; it must be a unit quaternion"));
}

/// A position alone, out of any 3 × 1 expression or {x, y, z}: what a cutter takes for a tool that is not turned. A vector would do, but for gcc 12,
/// which takes {.position = p, .orientation = q} for one as well.
template <RealScalar Scalar>
struct TipPosition {
  template <class Derived>
  TipPosition(Eigen::MatrixBase<Derived> const& point) : position(point.template cast<Scalar>()) {}
  TipPosition(Scalar x, Scalar y, Scalar z) : position(x, y, z) {}

  ToolPose<Scalar> pose() const { return {.position = position}; }

  Vector3<Scalar> position;
};

}  // namespace detail

}  // namespace palpate
