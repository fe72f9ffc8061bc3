// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate {

namespace detail {

template <RealScalar S>
void require_wall_normal(char const* who, Vector3<S> const& normal) {
  if (!std::isfinite(normal.squaredNorm()) || !std::isfinite(S(1) / normal.squaredNorm()))
    throw InvalidArgument(message(who, ": .wall_normal is (", normal.x(), ", ", normal.y(), ", ", normal.z(),
                                  "); give a finite direction other than zero"));
}

}  // namespace detail

/// Viscous drag of the organ's inner walls on a tool that cuts: a damper across the wall, proportional to depth.
///   F = −β |d| (v·n_v) n_v   after the puncture, zero before;   n_v = wall_normal / |wall_normal|
/// Units      β [N·s/m²], d [m], v [m/s], max_damping [N·s/m]; force [N] on the hand, world frame.
/// Source     \cite zheng2006 eq. 6-13 in velocity form. The thesis's −18000 N/cm² at 1 ms would be β = 1.8e5 N·s/m², a damper of 3240
///            N·s/m at 18 mm: no 1 kHz loop renders that.
/// Invariant  Dissipative: F·v ≤ 0. β ≥ 0, max_damping > 0, wall normal not zero; checked by `validate`, which `CuttingForce` calls.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     `.max_damping` is what the device can render, about mass / (4 · servo period): by default that of a 45 g stylus at 1 kHz.
///            Without it a large β makes the hand vibrate. For a force that does not depend on speed see `OrganFriction`.
template <RealScalar S>
struct OrganForce {
  using Scalar = S;

  S coefficient = S(0);                                  ///< β
  Vector3<S> wall_normal = Vector3<S>::UnitX();          ///< n_v, of any length
  S max_damping = S(11);                                 ///< upper limit of β |d|; infinite: none

  void validate() const {
    detail::OptionCheck const require{"OrganForce"};
    require(std::isfinite(coefficient) && coefficient >= S(0), ".coefficient", coefficient, " N·s/m²",
            "give a finite number, zero or more (a negative one would push the hand on)");
    require(max_damping > S(0), ".max_damping", max_damping, " N·s/m", "give a number above zero");
    detail::require_wall_normal("OrganForce", wall_normal);
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    S const square = wall_normal.squaredNorm();
    if (contact.phase != CuttingPhase::moving || !(square > S(0))) return Vector3<S>::Zero();
    S const damping = std::min(coefficient * std::abs(contact.depth), max_damping);
    return -damping * (contact.velocity.dot(wall_normal) / square) * wall_normal;
  }
};

/// Friction of the organ's inner walls: grows with depth, hardly depends on speed.
///   F = −f₀ |d| s(v·n_v / v₀) n_v   after the puncture, zero before;   s(x) = x / √(1 + x²)
/// Units      f₀ [N/m], d [m], v₀ [m/s]; force [N] on the hand, world frame.
/// Source     A rate-independent reading of \cite zheng2006 eq. 6-13: its liver data were taken at one speed,
///            1 mm/s, where they ask for 180 N/m · depth. Read as a damper they give 36 N at 10 mm and 20
///            mm/s, read as friction at most 1.8 N.
/// Invariant  |F| < f₀ |d|; F·v ≤ 0. f₀ ≥ 0, v₀ > 0, wall normal not zero; checked by `validate`, which
///            `CuttingForce` calls.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     Well below v₀ it is a damper f₀ |d| / v₀, well above it friction: choose v₀ ≥ f₀ |d| / α_max
///            for a device that holds α_max [N·s/m]. The default keeps the damper below 11 N·s/m down to 30
///            mm.
template <RealScalar S>
struct OrganFriction {
  using Scalar = S;

  S stiffness = S(180);                            ///< f₀
  S speed = S(0.5);                                ///< v₀
  Vector3<S> wall_normal = Vector3<S>::UnitX();    ///< n_v, of any length

  void validate() const {
    detail::OptionCheck const require{"OrganFriction"};
    require.not_negative(".stiffness", stiffness, " N/m");
    require.positive(".speed", speed, " m/s");
    detail::require_wall_normal("OrganFriction", wall_normal);
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    S const length = wall_normal.norm();
    if (contact.phase != CuttingPhase::moving || !(length > S(0)) || !(speed > S(0))) return Vector3<S>::Zero();
    S const x = contact.velocity.dot(wall_normal) / (length * speed);
    return -stiffness * std::abs(contact.depth) * (x / std::hypot(S(1), x)) / length * wall_normal;
  }
};

/// One inner wall of an organ, for `OrganWalls`.
template <RealScalar S>
struct OrganWall {
  S coefficient = S(0);                              ///< β [N·s/m²]
  Vector3<S> wall_normal = Vector3<S>::UnitX();      ///< n_v, of any length
};

/// Drag of several inner walls, of vessels for example, on a tool that cuts: the sum of their dampers, limited together.
///   F = −c |d| D v   after the puncture, zero before;   D = Σ β n_v n_vᵀ / |n_v|²,   c = min(1, max_damping / (λ |d|))
/// with λ the largest eigenvalue of D: no direction of motion is damped more than max_damping. With one wall it is `OrganForce`; several
/// `OrganForce` parts are limited one by one, and what they add up to is not.
/// Units      β [N·s/m²], d [m], v [m/s], max_damping [N·s/m]; force [N] on the hand, world frame.
/// Source     \cite zheng2006 eq. 6-13 in velocity form; see `OrganForce` for its coefficient.
/// Invariant  Never gives energy: F·v ≤ 0. Every β ≥ 0, max_damping > 0, no wall normal zero; checked at set-up.
/// Cost       One product with a 3 × 3 matrix, however many walls; noexcept, no allocation: allowed in the servo tick.
/// Limits     As for `OrganForce`: max_damping is to be what the device holds, about mass / (4 · servo period).
template <RealScalar S>
class OrganWalls {
 public:
  using Scalar = S;

  explicit OrganWalls(std::vector<OrganWall<S>> const& walls, S max_damping = S(11)) : max_damping_(max_damping) {
    for (std::size_t k = 0; k < walls.size(); ++k) {
      OrganForce<S>{.coefficient = walls[k].coefficient, .wall_normal = walls[k].wall_normal, .max_damping = max_damping}.validate();
      Vector3<S> const n = walls[k].wall_normal.normalized();
      damping_per_depth_ += walls[k].coefficient * n * n.transpose();
    }
    if (!is_finite(damping_per_depth_)) throw InvalidArgument("OrganWalls: the coefficients of the walls add up to more than the scalar holds; give smaller ones");
    largest_ = std::max(S(0), Eigen::SelfAdjointEigenSolver<Matrix<S, 3, 3>>(damping_per_depth_, Eigen::EigenvaluesOnly).eigenvalues()[2]);
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    if (contact.phase != CuttingPhase::moving || !(largest_ > S(0))) return Vector3<S>::Zero();
    return -std::min(std::abs(contact.depth), max_damping_ / largest_) * (damping_per_depth_ * contact.velocity);
  }

  /// The damping that the walls offer at a depth [N·s/m], in the direction that they damp most.
  S largest_damping(S depth) const noexcept { return std::min(largest_ * std::abs(depth), max_damping_); }

 private:
  Matrix<S, 3, 3> damping_per_depth_ = Matrix<S, 3, 3>::Zero();   // D, N·s/m²
  S largest_ = S(0);                                              // λ
  S max_damping_;
};

}  // namespace palpate
