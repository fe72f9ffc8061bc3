// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/statics/detail/net_forces.hpp>

#include <cmath>
#include <limits>

namespace palpate {

/// Dynamic relaxation with kinetic damping: integrates the free particles with fictitious masses until they are in balance. The masses
/// are the row bounds of the stiffness, so a step of 1 is stable. Velocities are set to zero after each peak of the kinetic energy. There
/// the masses are evaluated again, for tissue that hardens and states its bounds at x; a step in which it hardens by more is taken back, with larger
/// masses.
///   v ← v + F/k,   x ← x + v
/// It needs forces and row bounds alone, so it serves every tissue. The default of settle().
/// Source     the dynamic relaxation of form-finding; the masses are Gershgorin's bound, see HasStiffnessRowBounds.
/// Cost       O(iterations · elements); iterations grow with the square root of the condition number. Allocates.
/// Limits     a law that hardens much beyond its slope at rest, in tissue that does not state its bounds at x, may oscillate without end.
struct DynamicRelaxation {
  int iterations = 100000;   ///< at most

  template <TissueModel Tissue, RealScalar Scalar = typename Tissue::Scalar>
  Equilibrium<Scalar> solve(StaticProblem<Tissue> const& problem, Matrix3X<Scalar>& positions) const {
    detail::NetForces<Tissue> net(problem);
    int const n = net.count();
    Matrix3X<Scalar> x = positions, v = Matrix3X<Scalar>::Zero(3, n);
    Matrix<Scalar, 1, Dynamic> mass(n);
    auto const weigh = [&] {
      for (int k = 0; k < n; ++k) mass[k] = detail::stiffness_at(problem.tissue, net.particle(k), x);
    };
    weigh();
    Equilibrium<Scalar> result;
    Scalar energy = 0;
    Matrix3X<Scalar> last_force;
    for (;; ++result.iterations) {
      auto const force = net.at(x);
      if constexpr (HasStiffnessRowBoundsAt<Tissue>) {
        if (energy > 0 && !((last_force - force).cwiseProduct(v).sum() <= Scalar(1.01) * energy) && result.iterations < iterations) {   // it has hardened on the way: go back
          bool heavier = false;
          for (int k = 0; k < n; ++k) {
            Scalar const bound = detail::stiffness_at(problem.tissue, net.particle(k), x);
            if (bound > mass[k]) heavier = true, mass[k] = bound;
            x.col(net.particle(k)) -= v.col(k);
          }
          if (!heavier) mass *= 2;   // it is stiffer between the two, or turned over: shorter steps
          if (!mass.allFinite()) {
            result.imbalance = std::numeric_limits<Scalar>::infinity();
            return result;
          }
          v.setZero(), energy = 0;
          continue;
        }
        last_force = force;
      }
      net.measure(force, result);
      if (!std::isfinite(result.imbalance)) return result;
      if (result.converged || result.iterations >= iterations) break;
      Scalar const last_energy = energy;
      energy = 0;
      for (int k = 0; k < n; ++k) {
        if (!(mass[k] > 0)) continue;   // nothing holds it, and nothing is to move it
        v.col(k) += force.col(k) / mass[k];
        energy += mass[k] * v.col(k).squaredNorm();
      }
      if (energy < last_energy) {
        v.setZero();
        energy = 0;
        weigh();
      } else {
        for (int k = 0; k < n; ++k) x.col(net.particle(k)) += v.col(k);
      }
    }
    positions = x;
    return result;
  }
};

}  // namespace palpate
