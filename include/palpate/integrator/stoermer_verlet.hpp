// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

namespace palpate {

/// Position (Störmer) Verlet, x⁺ − 2x + x₋ = h² a(x, v), written with the velocity in place of the position of the step before:
///   a = a(x, v),   x⁺ = x + h v + h² (a − a₋/2),   v⁺ = v + (h/2) (3a − a₋)
/// a₋ is the acceleration of the step before; the velocity is v = (x − x₋)/h + (h/2) a₋, the difference carried to the end of its step,
/// so that damping acts at the time of the position. The first step takes a₋ = a.
/// Order      2, also with velocity-dependent forces. One evaluation of the forces.
/// Stability  h²κ/4 + hγ ≤ 1 (without damping: hω ≤ 2), from its polynomial on x″ = −κ x − γ x′:
///              2λ³ + (2h²κ + 3hγ − 4) λ² + (2 − 4hγ) λ + hγ
///            It has its roots in the unit disc iff (Jury) it is ≤ 0 at −1, 2h²κ + 8hγ ≤ 8, and 4 − 2hγ − 2(hγ)² − h²κ hγ ≥ 0,
///            which follows from the first.
/// Source     \cite zheng2006. Errata: the thesis calls it implicit, and with v = (x − x₋)/h it is of first order under damping.
/// Limits     where a force sets in suddenly, the motion is as if it had done so half a step earlier: that alone is of first order.
struct StoermerVerlet {
  static constexpr int order = 2;

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& a = padded_view(system.scratch(0));
    auto&& last_a = padded_view(system.previous_acceleration());
    system.acceleration(x, v, a);
    if (!system.remembers()) last_a = a;
    x += h * v + h * h * (a - last_a / 2);
    v += h / 2 * (3 * a - last_a);
    last_a = a;
  }

  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return largest_step(modes, Scalar(1));
  }
};

}  // namespace palpate
