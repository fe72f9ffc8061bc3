// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

namespace palpate {

/// Linear contact law: a spring along the normal that pushes the tool out, before the puncture.
///   F = k d n   while indenting and d > 0, zero otherwise
/// Units      k [N/m], d [m]; force [N] on the hand.
/// Source     \cite zheng2006 eq. 6-8; the default is the liver datum 3 N at 18 mm: 167 N/m.
/// Invariant  k ≥ 0 and finite, checked by `validate`, which `CuttingForce` calls. k = 0 switches the spring off.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     The cutter decides where it ends: the spring has no puncture depth.
template <RealScalar S>
struct IndentationSpring {
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  S stiffness = S(3.0 / 0.018);   ///< [N/m]

  void validate() const {
    detail::OptionCheck{"IndentationSpring"}.not_negative(".stiffness", stiffness, " N/m");
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    if (contact.phase != CuttingPhase::indenting || !(contact.depth > S(0))) return Vector3<S>::Zero();
    return stiffness * contact.depth * contact.normal;
  }
};

}  // namespace palpate
