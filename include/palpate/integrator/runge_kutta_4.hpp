// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// The classical Runge–Kutta method.
/// Order      4. Four evaluations of the forces.
/// Stability  |hλ| ≤ 2.6 for every λ in the left half plane (hω ≤ 2√2 without damping, hγ ≤ 2.785 without stiffness).
/// Source     \cite zheng2006. Erratum: local error h⁵, global error h⁴; the thesis prints h⁴ for both.
struct RungeKutta4 {
  static constexpr int order = 4;

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    auto&& x = padded_view(system.scratch(0));       // at the start of the step
    auto&& v = padded_view(system.scratch(1));
    auto&& stage_v = padded_view(system.scratch(2));
    auto&& a = padded_view(system.scratch(3));
    auto&& sum_v = padded_view(system.scratch(4));   // k₁ + 2k₂ + 2k₃ + k₄ of the positions
    auto&& sum_a = padded_view(system.scratch(5));   // the same of the velocities
    x = padded_view(system.positions());
    v = padded_view(system.velocities());

    system.acceleration(x, v, a);
    sum_v = v;
    sum_a = a;
    stage_v = v + h / 2 * a;
    padded_view(system.positions()) = x + h / 2 * v;

    system.acceleration(padded_view(system.positions()), stage_v, a);
    sum_v += 2 * stage_v;
    sum_a += 2 * a;
    padded_view(system.positions()) = x + h / 2 * stage_v;
    stage_v = v + h / 2 * a;

    system.acceleration(padded_view(system.positions()), stage_v, a);
    sum_v += 2 * stage_v;
    sum_a += 2 * a;
    padded_view(system.positions()) = x + h * stage_v;
    stage_v = v + h * a;

    system.acceleration(padded_view(system.positions()), stage_v, a);
    sum_v += stage_v;
    sum_a += a;
    padded_view(system.positions()) = x + h / 6 * sum_v;
    padded_view(system.velocities()) = v + h / 6 * sum_a;
  }

  /// |λ| ≤ max(√κ, γ) for the roots of λ² + γλ + κ.
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    Scalar const radius = std::max(std::sqrt(modes.squared_frequency), modes.decay_rate);
    return radius > 0 ? Scalar(2.6) / radius : std::numeric_limits<Scalar>::infinity();
  }
};

}  // namespace palpate
