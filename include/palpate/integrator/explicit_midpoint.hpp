// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// The explicit midpoint rule (Runge–Kutta of second order):
///   x½ = x + (h/2) v,   v½ = v + (h/2) a(x, v),   x⁺ = x + h v½,   v⁺ = v + h a(x½, v½)
/// Order      2. Two evaluations of the forces, the second at the middle of the step.
/// Stability  |1 + z + z²/2| ≤ 1 for both roots z = hλ of λ² + γλ + κ: (h²κ − hγ)² + (hγ − 2)² ≤ 4 where they oscillate, hγ ≤ 2 where
///            they do not. Without damping |1 + iy − y²/2|² = 1 + y⁴/4 > 1: no step is stable. With little damping the step is about
///            (4γ/κ²)^⅓, far below leapfrog's 2/√κ.
/// Source     \cite hairer2006 ch. II.1.
struct ExplicitMidpoint {
  static constexpr int order = 2;

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    auto&& a = padded_view(system.scratch(0));
    auto&& v = padded_view(system.scratch(1));         // at the start of the step
    auto&& middle_v = padded_view(system.scratch(2));
    auto&& middle_x = padded_view(system.scratch(3));
    v = padded_view(system.velocities());
    system.acceleration(padded_view(system.positions()), v, a);
    middle_v = v + h / 2 * a;
    middle_x = padded_view(system.positions()) + h / 2 * v;
    system.acceleration(middle_x, middle_v, a);
    padded_view(system.positions()) += h * middle_v;
    padded_view(system.velocities()) = v + h * a;
  }

  /// Where hγ ≤ 2 every mode with less stiffness or more damping is stable as well, so the stiffest with the least damping decides:
  /// u³ − 2u² + 2u = 4κ/γ², u = hκ/γ. The left side grows with u, and is above the right at u = 1 + ∛(4κ/γ²).
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    Scalar const overdamped = modes.decay_rate > 0 ? 2 / modes.decay_rate : std::numeric_limits<Scalar>::infinity();
    if (!(modes.squared_frequency > 0)) return overdamped;
    if (!(modes.min_decay_rate > 0)) return 0;
    double const stiffness = static_cast<double>(modes.squared_frequency), damping = static_cast<double>(modes.min_decay_rate);
    double const right = 4 * stiffness / (damping * damping);
    double u = 1 + std::cbrt(right);
    for (int k = 0; k < 60; ++k) {   // Newton's method, from above
      double const next = u - (((u - 2) * u + 2) * u - right) / ((3 * u - 4) * u + 2);
      if (!(std::abs(next - u) > 1e-14 * u)) break;
      u = next;
    }
    return std::min(overdamped, static_cast<Scalar>(u * damping / stiffness));
  }
};

}  // namespace palpate
