// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// Exponential contact law, Fung's stiffening: the stiffness grows in proportion to the force.
///   F = a (e^(b d) − 1) n   while indenting and d > 0, zero otherwise;  dF/dd = b (F + a)
/// Beyond `largest_depth` it continues linearly with the slope there. In `CuttingForce` it replaces the default `IndentationSpring`.
/// Units      a [N], b [1/m], d [m]; force [N] on the hand. The stiffness at first touch is a b [N/m].
/// Source     \cite fung1993 ch. 7: stress over stretch; as force over depth it is an empirical curve.
/// Invariant  a ≥ 0, b ≥ 0, largest depth > 0, all finite, and finite force at the largest depth; checked by `validate`.
/// Cost       One exponential; noexcept, no allocation: allowed in the servo tick.
template <RealScalar S>
struct ExponentialContact {
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  S scale = S(0);               ///< a [N]
  S rate = S(0);                ///< b [1/m]
  S largest_depth = S(0.02);    ///< [m]

  void validate() const {
    detail::OptionCheck const require{"ExponentialContact"};
    require.not_negative(".scale", scale, " N");
    require.not_negative(".rate", rate, " 1/m");
    require.positive(".largest_depth", largest_depth, " m");
    if (!std::isfinite(scale * rate * std::exp(rate * largest_depth)))
      throw InvalidArgument(detail::message("ExponentialContact: the force is not finite at ", largest_depth, " m; lower .rate or .largest_depth"));
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    if (contact.phase != CuttingPhase::indenting || !(contact.depth > S(0))) return Vector3<S>::Zero();
    S const d = std::min(contact.depth, largest_depth), growth = std::expm1(rate * d);
    return scale * (growth + rate * (growth + S(1)) * (contact.depth - d)) * contact.normal;
  }
};

}  // namespace palpate
