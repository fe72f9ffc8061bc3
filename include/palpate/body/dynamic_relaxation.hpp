// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// How a search for balance ended.
template <RealScalar Scalar>
struct Relaxation {
  Scalar imbalance = 0;   ///< m: the largest force on a free particle over its stiffness bound
  int iterations = 0;
  bool balanced = false;
};

/// Moves the free particles of a tissue to where springs and gravity balance: until no force over its particle's stiffness bound is above
/// `tolerance`. `positions` is 3 × tissue.size(); it changes only when that succeeds.
/// Dynamic relaxation with kinetic damping: fictitious masses equal to the row bounds of the stiffness, so that a step of 1 is stable;
/// velocities are dropped whenever the kinetic energy has passed a peak.
/// Units      m, m/s².
/// Source     the relaxation of form-finding; the masses are Gershgorin's bound, see BoundsItsRows.
/// Cost       O(iterations · elements); allocates.
template <TissueModel Tissue, class Positions, RealScalar Scalar = typename Tissue::Scalar>
Relaxation<Scalar> relax(Tissue const& tissue, std::span<int const> free, Vector3<Scalar> const& gravity, Scalar tolerance,
                         Positions&& positions, int most_iterations = 100000) {
  typename Tissue::Assembly assembly;
  tissue.assemble(free, assembly);
  auto const particles = assembly.particles();
  int const n = static_cast<int>(free.size());
  Matrix3X<Scalar> x(3, static_cast<Eigen::Index>(particles.size()));
  for (std::size_t k = 0; k < particles.size(); ++k) x.col(static_cast<Eigen::Index>(k)) = positions.col(particles[k]);
  Matrix3X<Scalar> v = Matrix3X<Scalar>::Zero(3, x.cols()), still = v, force = v;
  std::vector<Scalar> stiffness(free.size());
  for (std::size_t k = 0; k < free.size(); ++k) stiffness[k] = tissue.stiffness_bound(free[k]);
  Relaxation<Scalar> result;
  Scalar energy = 0;
  for (; result.iterations < most_iterations; ++result.iterations) {
    force.setZero();
    assembly.add_forces(x, still, force);
    Scalar const last_energy = energy;
    energy = result.imbalance = 0;
    for (int i = 0; i < n; ++i) {
      auto const k = static_cast<std::size_t>(i);
      Vector3<Scalar> const a = (force.col(i) + tissue.mass(free[k]) * gravity) / stiffness[k];
      if (Scalar const distance = a.norm(); !(distance <= result.imbalance)) result.imbalance = distance;   // NaN shows
      v.col(i) += a;
      energy += stiffness[k] * v.col(i).squaredNorm();
    }
    if (!std::isfinite(result.imbalance)) return result;
    if (result.imbalance <= tolerance) {
      for (int i = 0; i < n; ++i) positions.col(free[static_cast<std::size_t>(i)]) = x.col(i);
      result.balanced = true;
      return result;
    }
    if (energy < last_energy) {
      v.setZero();
      energy = 0;
    } else {
      x.leftCols(n) += v.leftCols(n);
    }
  }
  return result;
}

}  // namespace palpate
