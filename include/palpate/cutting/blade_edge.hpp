// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <cmath>
#include <numbers>

namespace palpate {

/// The edge of a blade: it cuts along itself, to and fro. What moves it more than `angle` off deforms the tissue, which hangs on to the blade,
/// and does not cut. A tool without it is a point that cuts whichever way it goes.
/// Units      rad, N. The axis is in the tool's frame, which is the world's for a tool that is not turned.
template <RealScalar Scalar>
struct BladeEdge {
  Vector3<Scalar> axis = Vector3<Scalar>::UnitX();         ///< direction of the edge, of any length; its part along the surface counts
  Scalar angle = std::numbers::pi_v<Scalar> / 6;           ///< rad, between 0 and a right angle
  Scalar slip_force = 3;                                   ///< N, where the tissue slips along a blade that is held across

  void validate() const {
    if (!is_finite(axis) || !(axis.norm() > 0)) throw InvalidArgument("the axis of the blade's edge must be finite and not zero");
    if (!(angle > 0 && angle < std::numbers::pi_v<Scalar> / 2))
      throw InvalidArgument(detail::message("the angle of the blade's edge is ", angle, " rad; it must be between 0 and pi/2"));
    if (!(slip_force >= 0)) throw InvalidArgument(detail::message("the slip force of the blade's edge is ", slip_force, " N; it must not be negative"));
  }

  /// Whether a way [m] along a surface with this normal is one that the edge cuts.
  bool cuts(Vector3<Scalar> const& way, Vector3<Scalar> const& normal) const noexcept {
    Vector3<Scalar> const along = way - way.dot(normal) * normal, edge = axis - axis.dot(normal) * normal;
    Scalar const length = edge.norm();
    return length > Scalar(1e-3) * axis.norm() && std::abs(along.dot(edge)) >= std::cos(angle) * along.norm() * length;
  }
};

/// What a blade that is held across its edge drags along.
template <RealScalar Scalar>
struct BladeHold {
  int triangle;                  ///< of the surface, at the blade
  Vector3<Scalar> barycentric;   ///< of the point of it that hangs on to the blade
  Scalar slip_force;             ///< N
};

}  // namespace palpate
