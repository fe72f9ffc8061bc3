// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>

#include <concepts>
#include <span>

namespace palpate {

/// A static problem: which particles are free, and the loads on them. All others keep their place.
/// Units      gravity [m/s²], applied [N], tolerance [m].
/// Shapes     applied: 3 × tissue.size(), or no columns for no forces.
template <TissueModel Tissue>
struct StaticProblem {
  using Scalar = typename Tissue::Scalar;

  Tissue const& tissue;
  std::span<int const> free;                       ///< the particles that may move, in any order
  Vector3<Scalar> gravity = Vector3<Scalar>::Zero();
  Matrix3X<Scalar> applied = Matrix3X<Scalar>(3, 0);
  Scalar tolerance = Scalar(1e-9);                 ///< of the imbalance, see Equilibrium
  std::span<int const> touched = {};               ///< where it is disturbed: a solver may begin there

  /// The weight of a particle and the force applied to it [N].
  Vector3<Scalar> load(int i) const {
    Vector3<Scalar> force = tissue.mass(i) * gravity;
    if (applied.cols() > 0) force += applied.col(i);
    return force;
  }
};

/// Result of a static solver.
/// The imbalance is a length, comparable with the body: max_i |F_i|/stiffness_bound(i), the displacement at the largest stiffness. It
/// does not bound the error: a soft mode of stiffness κ is off by imbalance · stiffness_bound/κ.
template <RealScalar Scalar>
struct Equilibrium {
  Scalar imbalance = 0;   ///< m
  Scalar residual = 0;    ///< N, the largest net force on a free particle
  int iterations = 0;     ///< of the solver's own kind
  int inner_iterations = 0;   ///< of a solver inside it, all together
  bool converged = false; ///< imbalance ≤ tolerance
};

/// A solver for static equilibrium: springs, gravity and applied forces balance on every free particle, F(x) + f = 0.
/// What the syntax can not say, and tests check: only columns of free particles change. `positions` is the start and, when it is finite,
/// the result, converged or not. The result is stable against small perturbations, not a saddle, unless the start is as symmetric as the
/// saddle.
template <class Solver, class Tissue>
concept EquilibriumSolver =
    TissueModel<Tissue> && requires(Solver const& solver, StaticProblem<Tissue> const& problem, Matrix3X<typename Tissue::Scalar>& positions) {
      { solver.solve(problem, positions) } -> std::same_as<Equilibrium<typename Tissue::Scalar>>;
    };

namespace detail {

/// Says, where it is instantiated, that Solver is none of this tissue.
template <class Solver, class Tissue>
struct SolverSentences {
  static_assert(EquilibriumSolver<Solver, Tissue>,
                "palpate: the first argument is no EquilibriumSolver of the body's tissue; DynamicRelaxation{} is one of any, NewtonRaphson{} of tissue with HasStiffnessBlocks; a "
                "tolerance comes behind it. One of yours: see palpate/statics/concept.hpp.");
};

}  // namespace detail

}  // namespace palpate
