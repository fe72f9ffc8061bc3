// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/statics/concept.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// max(a, b) that keeps a NaN of either.
template <RealScalar Scalar>
Scalar larger(Scalar a, Scalar b) noexcept {
  return !(b <= a) ? b : a;
}

/// Stiffness bound of a particle at positions x, where the tissue states it, and never below the one at rest.
template <class Tissue, class X>
typename Tissue::Scalar stiffness_at(Tissue const& tissue, int i, X const& x) {
  if constexpr (HasStiffnessRowBoundsAt<Tissue>)
    return std::max(tissue.stiffness_bound(i), tissue.stiffness_bound(i, x));
  else
    return tissue.stiffness_bound(i);
}

/// The net force on each free particle of a static problem, and its imbalance.
template <TissueModel Tissue>
class NetForces {
 public:
  using Scalar = typename Tissue::Scalar;
  using Matrix = Matrix3X<Scalar>;

  explicit NetForces(StaticProblem<Tissue> const& problem) : problem_(problem), free_(problem.free) {
    problem.tissue.assemble(free_, assembly_);
    auto const all = static_cast<Eigen::Index>(assembly_.particles().size());
    x_.resize(3, all);
    still_ = force_ = Matrix::Zero(3, all);
    load_.resize(3, count());
    stiffness_.resize(free_.size());
    for (int k = 0; k < count(); ++k) {
      load_.col(k) = problem.load(particle(k));
      stiffness_[static_cast<std::size_t>(k)] = problem.tissue.stiffness_bound(particle(k));
    }
  }

  int count() const noexcept { return static_cast<int>(free_.size()); }
  int particle(int k) const noexcept { return free_[static_cast<std::size_t>(k)]; }
  Scalar stiffness(int k) const noexcept { return stiffness_[static_cast<std::size_t>(k)]; }   // at rest [N/m]

  /// From now on so much of the loads acts, 0 … 1.
  void set_share(Scalar share) {
    for (int k = 0; k < count(); ++k) load_.col(k) = share * problem_.load(particle(k));
  }

  /// Net forces at `positions`, 3 × free particles [N].
  auto at(Matrix const& positions) {
    auto const particles = assembly_.particles();
    for (std::size_t k = 0; k < particles.size(); ++k) x_.col(static_cast<Eigen::Index>(k)) = positions.col(particles[k]);
    force_.setZero();
    assembly_.add_forces(x_, still_, force_);
    force_.leftCols(count()) += load_;
    return force_.leftCols(count());
  }

  /// Measures net forces: imbalance, residual and whether that is balance.
  template <class F>
  void measure(F const& forces, Equilibrium<Scalar>& result) const {
    result.imbalance = result.residual = 0;
    for (int k = 0; k < count(); ++k) {
      Scalar const force = forces.col(k).norm();
      result.residual = larger(result.residual, force);
      if (force > 0 || !(force == force)) result.imbalance = larger(result.imbalance, force / stiffness(k));
    }
    result.converged = result.imbalance <= problem_.tolerance;
  }

  /// Σ |F_k|²/k_k [J]
  template <class F>
  Scalar squared_imbalance(F const& forces) const {
    Scalar sum = 0;
    for (int k = 0; k < count(); ++k)
      if (stiffness(k) > 0) sum += forces.col(k).squaredNorm() / stiffness(k);
    return sum;
  }

  /// −Σ f·x of the loads [J]
  Scalar potential_of_loads(Matrix const& positions) const {
    Scalar sum = 0;
    for (int k = 0; k < count(); ++k) sum -= load_.col(k).dot(positions.col(particle(k)));
    return sum;
  }

 private:
  StaticProblem<Tissue> const& problem_;
  std::span<int const> free_;
  typename Tissue::Assembly assembly_;
  Matrix x_, still_, force_, load_;
  std::vector<Scalar> stiffness_;
};

}  // namespace palpate::detail
