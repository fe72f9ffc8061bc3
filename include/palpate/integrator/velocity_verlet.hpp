// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

namespace palpate {

/// Velocity Verlet with damping at the right time level:
///   a = a(x, v),   x⁺ = x + h v + (h²/2) a,   a⁺ = a(x⁺, v + h a),   v⁺ = v + (h/2)(a + a⁺)
/// Order      2, also with velocity-dependent forces. Two evaluations of the forces a step and no memory.
/// Stability  h²κ/4 + hγ/2 ≤ 1 (without damping: hω ≤ 2).
/// Source     \cite zheng2006.
struct VelocityVerlet {
  static constexpr int order = 2;

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& a = padded_view(system.scratch(0));
    auto&& later_a = padded_view(system.scratch(1));
    auto&& later_v = padded_view(system.scratch(2));
    system.acceleration(x, v, a);
    x += h * v + h * h / 2 * a;
    later_v = v + h * a;
    system.acceleration(x, later_v, later_a);
    v += h / 2 * (a + later_a);
  }

  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return largest_step(modes, Scalar(0.5));
  }
};

}  // namespace palpate
