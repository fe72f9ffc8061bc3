// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

namespace palpate {

/// Leapfrog, written drift–kick–drift so that positions and velocities are known at the same time:
///   x½ = x + (h/2) v,   a = a(x½, v + (h/2) a₋),   v⁺ = v + h a,   x⁺ = x½ + (h/2) v⁺
/// a₋ is the acceleration of the step before: it carries the velocity to the middle of the step, where damping belongs.
/// The first step makes its own a₋ = a(x½, v) (the half-step start).
/// Order      2, also with velocity-dependent forces. One evaluation of the forces a step, two in the first.
/// Stability  h²κ/4 + hγ ≤ 1 (without damping: hω ≤ 2).
/// Source     \cite zheng2006. Errata: the thesis calls it implicit, and its table says h³; it is explicit and global h².
struct LeapfrogVerlet {
  static constexpr int order = 2;
  static constexpr double force_time = 0.5;   // of the step: see HasForceTime
  static constexpr bool fused_step = true;

  /// What happens to one particle; see step_by_parts.
  template <RealScalar Scalar>
  struct Parts {
    Scalar h;
    template <class Column>
    void before(Column& x, Column const& v, Column& a) const noexcept {
      x += h / 2 * v;
      a = v + h / 2 * a;
    }
    template <class Column>
    void after(Column& x, Column& v, Column& a) const noexcept {
      v += h * a;
      x += h / 2 * v;
    }
    template <class Column>
    void undo(Column& x, Column& v, Column const& a) const noexcept {
      x -= h / 2 * v;
      v -= h * a;
      x -= h / 2 * v;
    }
  };

  template <System S>
  void step(S& system, typename S::Scalar h) const {
    if (!system.remembers()) {
      auto&& x = padded_view(system.positions());
      auto&& v = padded_view(system.velocities());
      auto&& middle_x = padded_view(system.scratch(0));
      middle_x = x + h / 2 * v;
      system.acceleration(middle_x, v, padded_view(system.previous_acceleration()));
    }
    step_by_parts(system, Parts<typename S::Scalar>{h});
  }

  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return largest_step(modes, Scalar(1));
  }
};

}  // namespace palpate
