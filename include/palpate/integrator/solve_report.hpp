// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <concepts>

namespace palpate {

/// How an implicit integrator solved a step.
template <RealScalar Scalar>
struct SolveReport {
  int iterations = 0;              ///< of conjugate gradients
  int newton_iterations = 0;
  Scalar residual = 0;             ///< relative, of the last linear system
  bool converged = true;           ///< false: the budget was spent before the tolerance
  int halvings = 0;                ///< of steps that would have raised the incremental potential
  int negative_curvatures = 0;     ///< directions that ended a solve: rounding, or a system that is not positive definite
  long long node_steps = 0;        ///< solves times nodes, of an integrator with a step per node
};

/// What became of all steps so far.
template <RealScalar Scalar>
struct SolveStatistics {
  long long steps = 0, iterations = 0, unconverged = 0, halved = 0, negative_curvatures = 0, node_steps = 0;
  Scalar worst_residual = 0;

  void add(SolveReport<Scalar> const& one) noexcept {
    ++steps, iterations += one.iterations, unconverged += one.converged ? 0 : 1, halved += one.halvings > 0 ? 1 : 0;
    negative_curvatures += one.negative_curvatures, node_steps += one.node_steps;
    worst_residual = std::max(worst_residual, one.residual);
  }
};

/// A System that takes an integrator's report.
template <class S>
concept TakesSolveReport = requires(S& system, SolveReport<typename S::Scalar> const& report) { system.take(report); };

namespace detail {

/// Options of an implicit integrator that make no sense.
inline void require_solver(char const* owner, double tolerance, int max_iterations, int newton_iterations, int halvings = 0) {
  OptionCheck const require{owner};
  require.not_negative(".tolerance", tolerance);
  require(max_iterations >= 0, ".max_iterations", max_iterations, "give zero or more: with zero nothing is solved, and the report says so");
  require(newton_iterations >= 1, ".newton_iterations", newton_iterations, "give 1 or more");
  require(halvings >= 0, ".halvings", halvings, "give 0 or more");
}

}  // namespace detail

}  // namespace palpate
