// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <cmath>
#include <utility>

namespace palpate {

/// Polynomial contact law of third order: the force grows faster than depth.
///   F = (k₁ d + k₂ d² + k₃ d³) n   while indenting and d > 0, zero otherwise
/// In `CuttingForce` it replaces the default `IndentationSpring`.
/// Units      k₁ [N/m], k₂ [N/m²], k₃ [N/m³], d [m]; force [N] on the hand.
/// Invariant  No coefficient is negative: then the force grows with depth, and a spring without loss is passive. Checked by `validate`.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     The coefficients are yours, or of a fit; none are published for the liver.
template <RealScalar S>
struct PolynomialContact {
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  S linear = S(0);      ///< [N/m]
  S quadratic = S(0);   ///< [N/m²]
  S cubic = S(0);       ///< [N/m³]

  void validate() const {
    for (auto const& [name, value] : {std::pair("linear", linear), std::pair("quadratic", quadratic), std::pair("cubic", cubic)})
      if (!std::isfinite(value) || value < S(0))
        throw InvalidArgument(detail::message("PolynomialContact: .", name, " is ", value, "; give a finite number, zero or more"));
  }

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    S const d = contact.depth;
    if (contact.phase != CuttingPhase::indenting || !(d > S(0))) return Vector3<S>::Zero();
    return d * (linear + d * (quadratic + d * cubic)) * contact.normal;
  }
};

}  // namespace palpate
