// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <cmath>

namespace palpate {

/// A spring that gives way: T = δ / (a|δ| + b), written with a = 1/T_max and b = 1/k.
/// It starts with stiffness k and never pulls, or pushes, with more than T_max.
/// Units      k [N/m], T_max [N], c [N·s/m].
/// Source     \cite deformable_survey, the odd form of δ/(aδ + b). Erratum: as printed, without |δ|, compression stiffens to a pole at δ = −b/a:
///            that is LockingSpring.
template <RealScalar Scalar>
struct SaturatingSpring {
  Scalar stiffness = 1;
  Scalar largest_tension = 1;
  Scalar damping = 0;

  Scalar tension(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    return stiffness * elongation / (1 + stiffness * std::abs(elongation) / largest_tension);
  }
  Scalar tangent_stiffness(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    Scalar const softening = 1 + stiffness * std::abs(elongation) / largest_tension;
    return stiffness / (softening * softening);
  }
  /// T_max (|δ| − (T_max/k) ln(1 + k|δ|/T_max))
  Scalar energy(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    Scalar const reach = largest_tension / stiffness;
    Scalar const length = std::abs(elongation);
    return largest_tension * reach * detail::less_logarithm(length / reach);
  }
  bool monotone(Scalar /*rest_length*/) const noexcept { return stiffness > 0 && largest_tension > 0; }
  void validate() const {
    detail::OptionCheck const check{"SaturatingSpring"};
    check.positive(".stiffness", static_cast<double>(stiffness), " N/m");
    check.positive(".largest_tension", static_cast<double>(largest_tension), " N");
  }
};

}  // namespace palpate
