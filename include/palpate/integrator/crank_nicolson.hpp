// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/theta_scheme.hpp>

#include <limits>

namespace palpate {

/// The θ-scheme with θ = ½, the trapezoidal rule: M Δv = h/2 (f(x, v) + f(x⁺, v⁺)),   x⁺ = x + h/2 (v + v⁺).
/// Order      2, also with velocity-dependent forces, for two Newton iterations and a tolerance below the truncation error; 1 for one
///            iteration.
/// Stability  any step of the linearised body (A-stable, no numerical damping): modes faster than the step keep ringing. A stiff body
///            under sudden forces may leave the linear range. Keep within some 10 times the explicit limit, or take ThetaScheme{.theta =
///            0.6}.
///            Units, budget, cost and limits: see ThetaScheme.
/// Source     \cite crank1947; the step and its solution after \cite baraff1998.
struct CrankNicolson {
  static constexpr int order = 2;

  double tolerance = 1e-6;      ///< relative
  int max_iterations = 100;    ///< of conjugate gradients in a step: the real-time budget
  int newton_iterations = 2;

  template <LinearisedSystem S>
  void step(S& system, typename S::Scalar h) const {
    ThetaScheme{0.5, tolerance, max_iterations, newton_iterations}.step(system, h);
  }

  void validate() const { detail::require_solver("CrankNicolson", tolerance, max_iterations, newton_iterations); }
  static constexpr double end_weight() noexcept { return 0.5; }
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const&) const {
    return std::numeric_limits<Scalar>::infinity();
  }
};

}  // namespace palpate
