// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// A spring that gives way in tension and locks in compression: T = δ / (aδ + b), written with a = 1/T_max and b = 1/k.
///   T = k δ / (1 + δ/r),   r = T_max/k;   below δ_g = −g r the tangent at δ_g goes on: T = T(δ_g) + (δ − δ_g) k/(1 − g)²
/// It starts with stiffness k, never pulls with more than T_max, and stiffens towards the pole at δ = −r, which it never reaches: the
/// guard g is the share of the way to the pole where the formula ends. Its slope is at most k/(1 − g)²: 4 k at the default ½.
/// Units      k [N/m], T_max [N], c [N·s/m], g without unit.
/// Source     \cite deformable_survey, the law as printed. Erratum: the source does not say what holds at the pole; the guard, C¹, is ours.
/// Invariant  k > 0, T_max > 0, 0 ≤ g < 1, all finite, checked by MassSpring. g = 0: linear in compression.
/// Limits     the stable step shrinks in compression, at the guard to (1 − g) of what it is at rest.
template <RealScalar Scalar>
struct LockingSpring {
  Scalar stiffness = 1;
  Scalar largest_tension = 1;
  Scalar damping = 0;
  Scalar guard = Scalar(0.5);

  Scalar tension(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    Scalar const reach = largest_tension / stiffness;
    Scalar const inside = std::max(elongation, -guard * reach);
    Scalar const room = 1 + inside / reach;
    return stiffness * (inside / room + (elongation - inside) / (room * room));
  }
  Scalar tangent_stiffness(Scalar elongation, Scalar /*rest_length*/) const noexcept {
    Scalar const room = 1 + std::max(elongation * stiffness / largest_tension, -guard);
    return stiffness / (room * room);
  }
  /// T_max (δ − r ln(1 + δ/r)), and behind the guard the parabola that goes on
  Scalar energy(Scalar elongation, Scalar rest_length) const noexcept {
    Scalar const reach = largest_tension / stiffness;
    Scalar const inside = std::max(elongation, -guard * reach);
    Scalar const beyond = elongation - inside;
    Scalar const room = 1 + inside / reach;
    return largest_tension * reach * detail::less_logarithm(inside / reach) + beyond * (tension(inside, rest_length) + stiffness / (room * room) * beyond / 2);
  }
  bool monotone(Scalar /*rest_length*/) const noexcept {
    return stiffness > 0 && largest_tension > 0 && guard >= 0 && guard < 1;
  }
  void validate() const {
    detail::OptionCheck const check{"LockingSpring"};
    check.positive(".stiffness", static_cast<double>(stiffness), " N/m");
    check.positive(".largest_tension", static_cast<double>(largest_tension), " N");
    check(guard >= 0 && guard < 1, ".guard", static_cast<double>(guard), "give the share of the way to the pole where the formula ends, 0 to below 1");
  }
};

}  // namespace palpate
