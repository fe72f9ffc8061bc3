// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// Hunt and Crossley's contact law: a power-law spring with damping that grows with depth, so the force starts without a step and never
/// pulls.
///   F = max(0, k dⁿ (1 + μ ḋ)) n   while indenting and d > 0, zero otherwise;  ḋ = −v·n
/// In `CuttingForce` it replaces the default `IndentationSpring`.
/// Units      k [N/mⁿ], μ [s/m], d [m], v [m/s]; force [N] on the hand.
/// Source     \cite hunt1975: F = k dⁿ + λ dⁿ ḋ with λ = μ k. A mass m that meets it at v₀ comes as deep as k dⁿ⁺¹/(n + 1) = m (v₀/μ −
///            ln(1 + μ v₀)/μ²), and leaves slower.
/// Invariant  k ≥ 0, μ ≥ 0, n ≥ 1, all finite; checked by `validate`. Every closed path takes energy from the hand, or none.
/// Cost       One power; noexcept, no allocation: allowed in the servo tick.
/// Limits     A device adds the delay of a tick, which bounds the damping that it can render.
template <RealScalar S>
struct HuntCrossleyContact {
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  S stiffness = S(0);       ///< k [N/mⁿ]
  S exponent = S(1.5);      ///< n; 3/2 for a sphere on an elastic half-space
  S damping = S(0);         ///< μ [s/m]

  void validate() const {
    detail::OptionCheck const require{"HuntCrossleyContact", true};
    require.not_negative(".stiffness", stiffness);
    require(exponent >= S(1), ".exponent", exponent, "give a finite number, one or more");
    require.not_negative(".damping", damping, " s/m");
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    if (contact.phase != CuttingPhase::indenting || !(contact.depth > S(0))) return Vector3<S>::Zero();
    S const inward = -contact.velocity.dot(contact.normal);
    return std::max(S(0), stiffness * std::pow(contact.depth, exponent) * (S(1) + damping * inward)) * contact.normal;
  }
};

}  // namespace palpate
