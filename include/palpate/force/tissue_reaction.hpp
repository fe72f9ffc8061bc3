// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <cmath>

namespace palpate {

/// Tight coupling: the hand feels the reaction of the deformation model.
///   F = scale · F_tissue   while in contact, zero otherwise
/// The loose coupling, a measured force curve beside the deformation, is `CuttingForce`.
/// Units      force [N], world frame.
/// Source     \cite zheng2006 ch. 2, fig. 2.1 (tightly coupled framework)
/// Invariant  The scale is finite; checked by `validate`.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     Coupled are a tool that indents, a blade held across its edge, and one that a solid resists (VolumeCutter with a toughness or friction). While
///            another tool cuts, F is 0: springs hold a tip on the surface and do not resist a blade that has entered. Fracture and friction are forces of
///            CuttingForce then. The body's step rate is audible in the force unless the body runs at the servo rate.
struct TissueReaction {
  double scale = 1.0;

  void validate() const {
    detail::OptionCheck{"TissueReaction"}(std::isfinite(scale), ".scale", scale, "give a finite number");
  }

  template <RealScalar S>
  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    if (contact.phase == CuttingPhase::no_contact) return Vector3<S>::Zero();
    return S(scale) * contact.tissue_force;
  }
};

/// No force: for pictures alone, and for tests of other modules.
struct NoForce {
  template <RealScalar S>
  Vector3<S> operator()(ToolContact<S> const&) const noexcept {
    return Vector3<S>::Zero();
  }
};

}  // namespace palpate
