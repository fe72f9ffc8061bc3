// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/spring_law.hpp>

#include <algorithm>

namespace palpate {

/// A polynomial through rest: T = k₁ δ + k₂ δ² + k₃ δ³. What a least-squares fit to a measured curve gives.
/// Units      k₁ `stiffness` [N/m], k₂ `quadratic` [N/m²], k₃ `cubic` [N/m³], c [N·s/m].
/// Source     the usual third-order fit to tissue curves; \cite deformable_survey for springs that are not linear.
/// Invariant  k₁ > 0, and monotone(L): dT/dδ = k₁ + 2 k₂ δ + 3 k₃ δ² > 0 from δ = −L on, where a link can be. That is so for every
///            link when k₃ > 0 and k₂² < 3 k₁ k₃, or k₂ = k₃ = 0; a short one allows more. MassSpring refuses what gives way.
/// Limits     δ is in metres, not a strain: links of different length feel another part of the curve. A hardening spring raises the
///            body's stiffness as it deforms, so the stable step shrinks.
template <RealScalar Scalar>
struct CubicSpring {
  Scalar stiffness = 1;
  Scalar quadratic = 0;
  Scalar cubic = 0;
  Scalar damping = 0;

  Scalar tension(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    return elongation * (stiffness + elongation * (quadratic + elongation * cubic));
  }
  Scalar tangent_stiffness(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    return stiffness + elongation * (2 * quadratic + elongation * 3 * cubic);
  }
  Scalar energy(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    return elongation * elongation * (stiffness / 2 + elongation * (quadratic / 3 + elongation * cubic / 4));
  }
  /// Whether the tension grows everywhere from δ = −L on: the slope is a parabola, least at −k₂/(3k₃) or at −L.
  bool monotone(Scalar rest_length) const noexcept {
    if (!(stiffness > 0) || cubic < 0 || (cubic == 0 && quadratic < 0)) return false;
    Scalar least = -rest_length;
    if (cubic > 0) least = std::max(least, -quadratic / (3 * cubic));
    return tangent_stiffness(least, rest_length) > 0;
  }
};

}  // namespace palpate
