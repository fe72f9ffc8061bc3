// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/karnopp_friction.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

struct NeedleForceOptions {
  double linear = 0.0;                   ///< a₁ [N/m]
  double quadratic = 0.0;                ///< a₂ [N/m²]
  double cutting = 0.0;                  ///< f_c [N]
  double tip_depth = 0.001;              ///< m, distance over which the tip's force builds up and decays
  KarnoppFrictionOptions friction = {};  ///< of the shaft
};

/// The force of a needle in three parts: stiffness of the tissue before the puncture, then friction along the shaft and a constant
/// cutting force at the tip.
///   indenting   F = a₁ d + a₂ d²
///   moving      F = friction(d, ḋ) + f_c c;   c = clamp(1 − (d_max − d)/tip_depth, 0, 1), d_max the largest depth so far
/// The cutting force acts while the needle goes deeper than before and vanishes tip_depth further back, so it has no step at a reversal.
/// Units      d [m]; force [N] on the hand, along the normal. Coefficients see `NeedleForceOptions`.
/// Source     \cite okamura2004. There the cutting force depends on the direction of motion; here on the distance.
/// Invariant  a₁, a₂, f_c ≥ 0, tip_depth > 0, all finite, and those of `KarnoppFriction`; checked at set-up. Every closed path
///            after the puncture takes energy from the hand, or none; one from the surface and back where ∫(a₁ d + a₂ d²) up to the puncture is f_c tip_depth/2 or
///            more, which the tip's force gives back.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     The force is along the normal, as for a needle inserted along it, without bending or the side force of a bevel. One object
///            serves one needle: it keeps state, `reset()` restarts it. In `CuttingForce` it replaces the default spring.
template <RealScalar S>
class NeedleForce {
 public:
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  explicit NeedleForce(NeedleForceOptions const& options = {})
      : linear_(S(options.linear)), quadratic_(S(options.quadratic)), cutting_(S(options.cutting)), tip_depth_(S(options.tip_depth)),
        friction_(options.friction) {
    auto const require = [](double value, char const* what, char const* unit) {
      if (!(value >= 0.0) || !std::isfinite(S(value)))
        throw InvalidArgument(detail::message("NeedleForce: ", what, " is ", value, unit, "; give a finite number, zero or more"));
    };
    require(options.linear, ".linear", " N/m");
    require(options.quadratic, ".quadratic", " N/m²");
    require(options.cutting, ".cutting", " N");
    if (!std::isfinite(tip_depth_) || !(tip_depth_ > S(0)))
      throw InvalidArgument(detail::message("NeedleForce: .tip_depth is ", options.tip_depth, " m; give a finite number above zero"));
  }

  Vector3<S> operator()(ToolContact<S> const& contact) noexcept {
    Vector3<S> force = friction_(contact);
    S const d = contact.depth;
    if (contact.phase != CuttingPhase::moving) deepest_ = S(0);
    if (!(d > S(0)) || !std::isfinite(d)) return force;
    if (contact.phase == CuttingPhase::indenting) {
      force += (linear_ + quadratic_ * d) * d * contact.normal;
    } else if (contact.phase == CuttingPhase::moving) {
      deepest_ = std::max(deepest_, d);
      force += cutting_ * std::clamp(S(1) - (deepest_ - d) / tip_depth_, S(0), S(1)) * contact.normal;
    }
    return force;
  }

  void reset() noexcept {
    deepest_ = S(0);
    friction_.reset();
  }

 private:
  S linear_, quadratic_, cutting_, tip_depth_;
  KarnoppFriction<S> friction_;
  S deepest_ = S(0);   // m, of this insertion
};

}  // namespace palpate
