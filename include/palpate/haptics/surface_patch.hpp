// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// Second-order local model of a surface: a plane or a ball around a point, which the servo uses between two steps of the body.
///   distance(p) = (|n + κ q| − 1) / κ = (2 q·n + κ |q|²) / (1 + |n + κ q|),   q = p − point;   the second form holds for κ = 0 too
///   normal(p) = (n + κ q) / |n + κ q|,   force(p) = −K min(0, distance) normal
/// The tissue is behind the surface. κ > 0 is a ball of tissue of radius 1/κ, κ < 0 a hollow one, 0 a plane.
/// Units      m, 1/m, N/m, m/s, rad/s; world frame.
/// Invariant  of a valid one: all finite, the normal has length one, K ≥ 0 (0: no surface), reach ≥ 0.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     At the centre of the ball there is no direction: the normal is that at `point`. Behind the centre the surface is its far
///            side.
template <RealScalar S>
struct SurfacePatch {
  Vector3<S> point = Vector3<S>::Zero();              ///< on the surface
  Vector3<S> normal = Vector3<S>::UnitZ();            ///< there, of length one, away from the tissue
  S curvature = S(0);                                 ///< κ [1/m]
  S stiffness = S(0);                                 ///< K [N/m]
  Vector3<S> velocity = Vector3<S>::Zero();           ///< of the surface at `point`
  Vector3<S> angular_velocity = Vector3<S>::Zero();   ///< of the surface about `point`
  S reach = std::numeric_limits<S>::infinity();       ///< so far from `point` it stands for the surface

  bool operator==(SurfacePatch const& other) const noexcept {
    return point == other.point && normal == other.normal && curvature == other.curvature && stiffness == other.stiffness &&
           velocity == other.velocity && angular_velocity == other.angular_velocity && reach == other.reach;
  }

  /// The same in another scalar.
  template <RealScalar T>
  SurfacePatch<T> cast() const noexcept {
    return {.point = point.template cast<T>(),
            .normal = normal.template cast<T>().normalized(),
            .curvature = static_cast<T>(curvature),
            .stiffness = static_cast<T>(stiffness),
            .velocity = velocity.template cast<T>(),
            .angular_velocity = angular_velocity.template cast<T>(),
            .reach = static_cast<T>(reach)};
  }

  bool valid() const noexcept {
    return is_finite(point) && is_finite(normal) && std::abs(normal.norm() - S(1)) < S(1e-4) && std::isfinite(curvature) && stiffness >= S(0) &&
           std::isfinite(stiffness) && is_finite(velocity) && is_finite(angular_velocity) && reach >= S(0);
  }
  bool covers(Vector3<S> const& p) const noexcept { return (p - point).norm() <= reach; }
  bool moves() const noexcept { return !is_zero(velocity) || !is_zero(angular_velocity); }

  /// Height over the surface [m], negative in the tissue.
  S distance(Vector3<S> const& p) const noexcept {
    Vector3<S> const q = p - point;
    return (S(2) * q.dot(normal) + curvature * q.squaredNorm()) / (S(1) + (normal + curvature * q).norm());
  }

  Vector3<S> normal_at(Vector3<S> const& p) const noexcept {
    if (curvature == S(0)) return normal;
    Vector3<S> const m = normal + curvature * (p - point);
    S const length = m.norm();
    return length > std::numeric_limits<S>::epsilon() ? Vector3<S>(m / length) : normal;
  }

  /// The same surface with its point nearest to p. Its reach is what is left of it there.
  SurfacePatch anchored_at(Vector3<S> const& p) const noexcept {
    SurfacePatch there = *this;
    there.normal = normal_at(p);
    there.point = p - distance(p) * there.normal;
    there.velocity = velocity_at(there.point);
    there.reach = std::max(S(0), reach - (there.point - point).norm());
    return there;
  }

  /// What a ball of this radius meets with its centre: the surface moved out by so much. In a hollow less than twice as wide as the ball, where κ/(1 + κ r) goes
  /// beyond all bounds, it becomes flatter instead, and a plane where the ball does not fit.
  SurfacePatch offset_by(S radius) const noexcept {
    SurfacePatch out = *this;
    out.point += radius * normal;
    out.velocity = velocity_at(out.point);
    S const share = S(1) + curvature * radius;
    out.curvature = share >= S(0.5) ? curvature / share : S(4) * curvature * std::max(S(0), share);
    return out;
  }
  /// The same for a ball that a contact presses against the surface at `point`, against a direction `pressed` of length one, which stays while the surface gives way
  /// and turns: its centre is a radius from `point` that way. Zero: nothing is pressed.
  SurfacePatch offset_by(S radius, Vector3<S> const& pressed) const noexcept {
    if (is_zero(pressed)) return offset_by(radius);
    SurfacePatch out = *this;
    out.point += radius * pressed;
    return out;
  }

  /// Of the surface at p, as of a rigid piece [m/s].
  Vector3<S> velocity_at(Vector3<S> const& p) const noexcept { return velocity + angular_velocity.cross(p - point); }

  /// Where it is so many seconds later if it goes on as it does.
  SurfacePatch moved(S seconds) const noexcept {
    SurfacePatch later = *this;
    later.point += seconds * velocity;
    S const angle = seconds * angular_velocity.norm();
    if (angle != S(0)) later.normal = (Eigen::AngleAxis<S>(angle, angular_velocity / (angle / seconds)) * normal).normalized();
    return later;
  }

  /// On the hand [N], for a tip at p. Nothing where p is no number.
  Vector3<S> force(Vector3<S> const& p) const noexcept {
    S const height = distance(p);
    return height < S(0) ? Vector3<S>(-stiffness * height * normal_at(p)) : Vector3<S>(Vector3<S>::Zero());
  }
};

}  // namespace palpate
