// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

struct KarnoppFrictionOptions {
  double dynamic = 0.0;            ///< C [N/m], while it slides, for each metre in the tissue
  double viscous = 0.0;            ///< b [N·s/m²]
  double holding = 0.0;            ///< D [N/m], the most while it sticks; not below C
  double stick_speed = 0.002;      ///< v₀ [m/s]
  double stick_stiffness = 300.0;  ///< k [N/m]
};

/// Karnopp's stick-slip friction along a shaft in its channel, proportional to the inserted length.
///   slides   |F| = (C + b |ḋ|) d          for |ḋ| ≥ 2 v₀
///   sticks   |F| ≤ max(D, C + b |ḋ|) d, as much as holds it, for |ḋ| ≤ v₀;  between the two speeds the limit is interpolated linearly
///   F = k (d − a) n;  the anchor a follows so that |F| is never above the limit
/// Karnopp's model balances the hand's force while it sticks. A servo loop does not know that force, so a spring holds the shaft to the
/// anchor.
/// Units      d [m] inserted = depth, ḋ = −v·n [m/s]; force [N] on the hand, along the normal n. Coefficients see
///            `KarnoppFrictionOptions`.
/// Source     \cite karnopp1985; \cite okamura2004 for a needle, by depth.
/// Invariant  0 ≤ C ≤ D, b ≥ 0, v₀ > 0, k > 0, all finite; checked at set-up. Every closed path takes energy from the hand, or none: the
///            anchor only ever releases the spring.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     A servo of period T adds the leak of its sampling, so keep k below the wall that the device can render: 2 × its damping /
///            T. One object serves one tool: it keeps state, `reset()` restarts it.
template <RealScalar S>
class KarnoppFriction {
 public:
  using Scalar = S;

  explicit KarnoppFriction(KarnoppFrictionOptions const& options = {})
      : dynamic_(S(options.dynamic)), viscous_(S(options.viscous)), holding_(S(options.holding)), stick_speed_(S(options.stick_speed)),
        stick_stiffness_(S(options.stick_stiffness)) {
    auto const require = [](bool good, char const* what, double value, char const* unit, char const* advice) {
      if (!good || !std::isfinite(S(value))) throw InvalidArgument(detail::message("KarnoppFriction: ", what, " is ", value, unit, "; ", advice));
    };
    require(options.dynamic >= 0.0, ".dynamic", options.dynamic, " N/m", "give a finite number, zero or more");
    require(options.viscous >= 0.0, ".viscous", options.viscous, " N·s/m²", "give a finite number, zero or more");
    require(options.holding >= options.dynamic, ".holding", options.holding, " N/m", "give a finite number, not below .dynamic");
    require(stick_speed_ > S(0), ".stick_speed", options.stick_speed, " m/s", "give a finite number above zero");
    require(stick_stiffness_ > S(0), ".stick_stiffness", options.stick_stiffness, " N/m", "give a finite number above zero");
  }

  /// The largest force [N] at a depth and speed along the way.
  S limit(S depth, S speed) const noexcept {
    S const sliding = dynamic_ + viscous_ * std::abs(speed);
    S const slips = std::clamp(std::abs(speed) / stick_speed_ - S(1), S(0), S(1));
    return depth > S(0) ? depth * (std::max(holding_, sliding) * (S(1) - slips) + sliding * slips) : S(0);
  }

  Vector3<S> operator()(ToolContact<S> const& contact) noexcept {
    if (contact.phase != CuttingPhase::moving) {
      is_in_ = false;
      return Vector3<S>::Zero();
    }
    S const most = limit(contact.depth, -contact.velocity.dot(contact.normal));
    if (!std::isfinite(most) || !std::isfinite(contact.depth)) return Vector3<S>::Zero();
    if (!is_in_) anchor_ = contact.depth;
    is_in_ = true;
    S const pull = std::clamp(stick_stiffness_ * (contact.depth - anchor_), -most, most);
    anchor_ = contact.depth - pull / stick_stiffness_;
    return pull * contact.normal;
  }

  void reset() noexcept { is_in_ = false; }

 private:
  S dynamic_, viscous_, holding_, stick_speed_, stick_stiffness_;
  S anchor_ = S(0);   // m, the depth at which the spring is slack
  bool is_in_ = false;
};

}  // namespace palpate
