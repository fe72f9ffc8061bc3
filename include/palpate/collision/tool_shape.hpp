// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace palpate {

/// A plane with an outside: what a smooth surface is to a tool that touches it.
/// Units      point [m], world frame.
/// Invariant  normal has length 1 and points outwards, away from the tissue.
template <RealScalar Scalar>
struct Plane {
  Vector3<Scalar> point;
  Vector3<Scalar> normal;

  /// Height over the plane, negative below.
  Scalar signed_distance(Vector3<Scalar> const& position) const noexcept { return normal.dot(position - point); }
};

/// The ball at the end of a tool. It has a size and no place: the centre is the tip's position of this moment.
/// Units      radius [m] ≥ 0; 0 is a point.
template <RealScalar Scalar>
struct SphereTip {
  Scalar radius = 0;

  /// From the ball's surface to a point, negative inside the ball.
  Scalar signed_distance(Vector3<Scalar> const& centre, Vector3<Scalar> const& position) const noexcept {
    return (position - centre).norm() - radius;
  }

  /// From the plane to the ball's lowest point, negative when the ball dips below.
  Scalar signed_distance(Vector3<Scalar> const& centre, Plane<Scalar> const& plane) const noexcept {
    return plane.signed_distance(centre) - radius;
  }
};

/// A rounded rod: all points within `radius` of a segment. A blade's edge or a tool's shaft; radius 0 is the segment itself.
/// Units      m; the frame of its ends: the tool's, until `placed`.
template <RealScalar Scalar>
struct Capsule {
  Vector3<Scalar> from = Vector3<Scalar>::Zero();
  Vector3<Scalar> to = Vector3<Scalar>::Zero();
  Scalar radius = 0;

  /// From the rod's surface to a point, negative inside the rod.
  Scalar signed_distance(Vector3<Scalar> const& position) const noexcept {
    return std::sqrt(closest_point_on_segment<Scalar>(position, from, to).squared_distance) - radius;
  }

  /// From the plane to the rod's lowest point, negative when the rod dips below.
  Scalar signed_distance(Plane<Scalar> const& plane) const noexcept {
    return std::min(plane.signed_distance(from), plane.signed_distance(to)) - radius;
  }

  /// The same rod where the tool is: `world_from_tool` maps tool to world coordinates.
  Capsule placed(Eigen::Transform<Scalar, 3, Eigen::Isometry> const& world_from_tool) const noexcept {
    return {world_from_tool * from, world_from_tool * to, radius};
  }
};

}  // namespace palpate
