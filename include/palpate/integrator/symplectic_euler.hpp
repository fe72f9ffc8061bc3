// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

namespace palpate {

/// Symplectic (semi-implicit) Euler: v⁺ = v + h a(x, v), x⁺ = x + h v⁺.
/// Order      1. One evaluation of the forces. Without damping the energy stays bounded.
/// Stability  h²κ + 2hγ ≤ 4.
/// Source     \cite hairer2006 ch. I.1.
struct SymplecticEuler {
  static constexpr int order = 1;

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& a = padded_view(system.scratch(0));
    system.acceleration(x, v, a);
    v += h * a;
    x += h * v;
  }

  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return largest_step(modes, Scalar(0.5));
  }
};

}  // namespace palpate
