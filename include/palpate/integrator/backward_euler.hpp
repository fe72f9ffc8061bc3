// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/theta_scheme.hpp>

#include <limits>

namespace palpate {

/// The θ-scheme with θ = 1: (M + hC + h²K) Δv = h (f(x, v) − h K v),   v⁺ = v + Δv,   x⁺ = x + h v⁺.
/// Order      1. Numerical damping: a mode loses a factor 1/√(1 + (hω)²) a step, also without damping of its own, so fast modes vanish at
///            once.
/// Stability  any step of the linearised body; measured on a stiff sheet at 100 times the explicit limit.
///            Units, budget, cost and limits: see ThetaScheme.
/// Source     \cite baraff1998.
struct BackwardEuler {
  static constexpr int order = 1;
  static constexpr bool steps_of_any_size = true;

  double tolerance = 1e-3;      ///< relative
  int max_iterations = 100;    ///< of conjugate gradients in a step: the real-time budget
  int newton_iterations = 1;    ///< 1: linearised
  int halvings = 12;            ///< of a step that raises the incremental potential

  template <LinearisedSystem S>
  void step(S& system, typename S::Scalar h) const {
    ThetaScheme{1.0, tolerance, max_iterations, newton_iterations, halvings}.step(system, h);
  }

  void validate() const { detail::require_solver("BackwardEuler", tolerance, max_iterations, newton_iterations, halvings); }
  static constexpr double end_weight() noexcept { return 1; }
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const&) const {
    return std::numeric_limits<Scalar>::infinity();
  }
};

}  // namespace palpate
