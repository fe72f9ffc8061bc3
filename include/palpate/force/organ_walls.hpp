// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/organ_force.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate {

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
