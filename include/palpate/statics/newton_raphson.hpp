// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/statics/detail/net_forces.hpp>
#include <palpate/statics/linear_solver.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// When Newton's method evaluates its tangent.
enum class Tangent {
  full,       ///< in every iteration
  modified,   ///< kept while its steps are good: halved rarely, and the forces fall to half
};

/// Newton–Raphson with line search: K(x) p = F(x) + f,  x ← x + β p, until the forces balance.
/// The tangent is the tissue's positive semidefinite one, so every p is a descent direction. A step is halved until the energy falls
/// (tissue that states its energy) or the forces shrink. Where K is singular, as across a flat sheet, or many halvings were needed, a
/// multiple μ of the row bounds is added to its diagonal and reduced again with success (Levenberg–Marquardt). So the search leaves a
/// saddle and finds a minimum.
/// Near the minimum, links in tension converge quadratically with the full tangent and β = 1. Where links are compressed the tangent
/// lacks their lateral softening, and convergence is linear. β < 1 leaves a factor 1 − β of the error an iteration, but copes with
/// strongly curved laws.
/// Units      β without unit, 0 < β ≤ 1.
/// Source     \cite deformable_survey: K u = f, full and modified, SOR inside, β.
/// Cost       an iteration: one pass over the elements for a new tangent, then the inner solver. Allocates.
template <class Inner = TangentConjugateGradients>
struct NewtonRaphson {
  Tangent tangent = Tangent::full;
  double damping = 1.0;   ///< β
  int iterations = 200;   ///< at most
  int load_steps = 1;     ///< the loads act in so many parts, one more after each balance: for those that would turn elements over at once
  Inner inner{};

  template <TissueModel Tissue, RealScalar Scalar = typename Tissue::Scalar>
    requires HasStiffnessBlocks<Tissue> && TangentSolver<Inner, Scalar>
  Equilibrium<Scalar> solve(StaticProblem<Tissue> const& problem, Matrix3X<Scalar>& positions) const {
    if (!(damping > 0 && damping <= 1))
      throw InvalidArgument(detail::message("the damping of Newton's step is ", damping, "; it must be above 0 and at most 1"));
    if (load_steps < 1) throw InvalidArgument(detail::message("the loads act in ", load_steps, " steps; give 1 or more"));
    if (load_steps > std::max(1, iterations))
      throw InvalidArgument(detail::message("the loads act in ", load_steps, " steps, each of an iteration or more, and there are ", iterations, "; give fewer steps or more iterations"));
    detail::NetForces<Tissue> net(problem);
    int const n = net.count();
    TangentMatrix<Scalar> matrix(problem.tissue, problem.free);
    Matrix3X<Scalar> x = positions, trial = x, force = net.at(x), p(3, n);
    Equilibrium<Scalar> result;
    int steps_taken = 0;
    Scalar first_residual = 0;
    auto const measure = [&] {
      net.measure(force, result);
      if (steps_taken < load_steps) result.converged = result.converged || result.residual <= Scalar(1e-2) * first_residual;
    };
    auto const load = [&] {   // one part more
      net.set_share(static_cast<Scalar>(++steps_taken) / static_cast<Scalar>(load_steps));
      force = net.at(x);
      first_residual = 0;
      measure();
      first_residual = result.residual;
    };
    load();
    if (!std::isfinite(result.imbalance)) return result;
    Scalar shift = 0;
    bool is_stale = true;   // the matrix is not that of x
    bool is_missing = true;
    while (result.iterations < iterations) {
      if (result.converged) {
        if (steps_taken >= load_steps) break;
        load();
        continue;
      }
      if (is_missing || (is_stale && tangent == Tangent::full)) {
        matrix.update(problem.tissue, x);
        is_stale = is_missing = false;
      }
      matrix.set_shift(shift);
      ++result.iterations;
      int const inner_iterations = inner.solve(matrix, force, p);
      result.inner_iterations += std::max(0, inner_iterations);
      int const halvings = inner_iterations < 0 ? too_many : step(problem, net, force, p, x, trial);
      bool const was_stale = is_stale;
      if (halvings < too_many) {
        Scalar const last = result.residual;
        x = trial;
        force = net.at(x);
        measure();
        is_stale = true;
        is_missing = was_stale && result.residual > last / 2;
      }
      if (halvings <= 2) {
        shift = shift > Scalar(1e-6) ? shift / 100 : Scalar(0);
        continue;
      }
      if (was_stale) {
        is_missing = true;   // first a tangent of its own, then a shift
        continue;
      }
      if (shift >= 1 && halvings == too_many) break;   // as short a step as any relaxation's fails: the digits are spent
      shift = std::clamp(100 * shift, Scalar(1e-6), Scalar(1));
    }
    if (steps_taken < load_steps) {   // the iterations are spent, or none goes on: not all of the loads act
      steps_taken = load_steps;
      net.set_share(Scalar(1));
      force = net.at(x);
      measure();
    }
    positions = x;
    return result;
  }

 private:
  static constexpr int too_many = 24;

  /// Finds the longest x + β p/2ᵏ that is better than x, into `trial`. Returns k.
  template <class Problem, class Net, class Columns>
  int step(Problem const& problem, Net& net, Columns const& force, Columns const& p, Columns const& x, Columns& trial) const {
    using Scalar = typename Problem::Scalar;
    Scalar const slope = force.cwiseProduct(p).sum();
    if (!(slope > 0) || !is_finite(p)) return too_many;
    auto const energy = [&](Columns const& positions) -> Scalar {
      if constexpr (HasPotentialEnergy<std::remove_cvref_t<decltype(problem.tissue)>>)
        return problem.tissue.potential_energy(positions) + net.potential_of_loads(positions);
      else
        return 0;
    };
    constexpr bool knows_energy = HasPotentialEnergy<std::remove_cvref_t<decltype(problem.tissue)>>;
    Scalar const energy_here = energy(x), imbalance_here = net.squared_imbalance(force);
    Scalar length = static_cast<Scalar>(damping);
    for (int k = 0; k < too_many; ++k, length /= 2) {
      trial = x;
      for (int i = 0; i < net.count(); ++i) trial.col(net.particle(i)) += length * p.col(i);
      if (knows_energy && energy(trial) < energy_here - Scalar(1e-4) * length * slope) return k;
      if (net.squared_imbalance(net.at(trial)) < imbalance_here) return k;
    }
    return too_many;
  }
};

}  // namespace palpate
