// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

#include <algorithm>
#include <limits>

namespace palpate {

/// Explicit Euler: x⁺ = x + h v, v⁺ = v + h a(x, v).
/// Order      1. One evaluation of the forces.
/// Stability  a mode is stable while h ≤ γ/κ (it oscillates) and h ≤ 2/γ at most (overdamped: its fast root's limit); without damping never.
/// Source     \cite zheng2006. Erratum: local error h², global error h; the thesis prints h² for both.
struct ExplicitEuler {
  static constexpr int order = 1;

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& a = padded_view(system.scratch(0));
    system.acceleration(x, v, a);
    x += h * v;
    v += h * a;
  }

  /// The amplification polynomial λ² − (2 − hγ)λ + 1 − hγ + h²κ has its roots in the unit disc iff h κ ≤ γ and 4 − 2hγ + h²κ ≥ 0.
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    if (!(modes.squared_frequency > 0)) return modes.decay_rate > 0 ? 2 / modes.decay_rate : std::numeric_limits<Scalar>::infinity();
    Scalar const oscillating = modes.min_decay_rate / modes.squared_frequency;
    Scalar const overdamped = modes.decay_rate > 0 ? 2 / modes.decay_rate : std::numeric_limits<Scalar>::infinity();
    return std::min(oscillating, overdamped);
  }
};

}  // namespace palpate
