// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/force/concept.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

struct SpringThenTissueOptions {
  double stiffness = 500.0;     ///< K [N/m], of the spring at first contact; not below that of the tissue
  double arrival = 0.05;        ///< τ_a [s], time constant with which the tissue's force comes in
  double fading = 0.2;          ///< τ_f [s], time constant with which the spring fades while the tool rests
  double rest_speed = 0.005;    ///< v₀ [m/s]: below it the tool rests, above twice it it moves
};

/// Blends a spring at first contact into the tissue's reaction, as that arrives and the tool comes to rest: a stiff surface at the
/// servo's rate with a slow body behind it.
///   F = K e n + w F_t
///   w   weight of the tissue: 0 until its force is there, then to 1 with τ_a, for the rest of the contact
///   e   elongation of the spring: follows the depth d; at rest it fades with τ_f to (1 − w) d; always 0 ≤ e ≤ d − w (F_t·n)/K
/// On first contact F = K d n. A tool that moves on feels K again beside the tissue, until both are K d; one that rests feels F_t alone.
/// They never act both in full: F·n ≤ max(K d, F_t·n) for a tissue that pushes.
/// Units      m, N, s; force on the hand, world frame. d and n are those of the undisturbed surface, F_t is `tissue_force`.
/// Invariant  K, τ_a, τ_f, v₀ > 0, finite; checked at set-up. As continuous in time as its input: while indenting, with n at rest,
///            |ΔF·n| ≤ K |Δd| + (Δt/τ_f) K e + w |ΔF_t| + (Δt/τ_a) |F_t|.
///            With an elastic tissue no stiffer than the spring it gave no energy over a contact on any motion tried, beside the leak of
///            sampling: the spring loses energy only by fading, as one with a damper, and the tissue comes in where the spring has been
///            paid for. A stiffer tissue gives, once a contact, the energy by which it exceeds the spring.
/// Cost       Two exponentials; noexcept, no allocation: allowed in the servo tick.
/// Limits     Zero except while indenting; `CuttingForce` joins it at the puncture. A tissue force that drops to zero under the tool is
///            felt as a drop. The steps of a slow body are felt with weight w. It needs a velocity without quantisation noise
///            (`AdaptiveWindowVelocity`), or the spring does not fade. One object serves one tool.
template <RealScalar S>
class SpringThenTissue {
 public:
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  explicit SpringThenTissue(SpringThenTissueOptions const& options = {})
      : stiffness_(S(options.stiffness)), arrival_(S(options.arrival)), fading_(S(options.fading)), rest_speed_(S(options.rest_speed)) {
    auto const require = [](char const* what, double value, char const* unit) {
      if (!(S(value) > S(0)) || !std::isfinite(S(value)))
        throw InvalidArgument(detail::message("SpringThenTissue: ", what, " is ", value, unit, "; give a finite number above zero"));
    };
    require(".stiffness", options.stiffness, " N/m");
    require(".arrival", options.arrival, " s");
    require(".fading", options.fading, " s");
    require(".rest_speed", options.rest_speed, " m/s");
  }

  Vector3<S> operator()(ToolContact<S> const& contact) noexcept {
    if (contact.phase != CuttingPhase::indenting) {
      reset();
      return Vector3<S>::Zero();
    }
    S const speed = contact.velocity.norm(), push = contact.tissue_force.dot(contact.normal);
    if (!std::isfinite(contact.depth + speed + push) || !is_finite(contact.tissue_force)) return Vector3<S>::Zero();
    S const seconds = contact.seconds > S(0) ? contact.seconds : S(0.001);   // false for a NaN
    S const depth = std::max(contact.depth, S(0));
    arrived_ = arrived_ || !is_zero(contact.tissue_force);
    if (arrived_) share_ -= (S(1) - share_) * std::expm1(-seconds / arrival_);
    elongation_ = std::max(elongation_ + depth - depth_, S(0));
    depth_ = depth;
    S const left = (S(1) - share_) * depth;
    if (elongation_ > left) elongation_ += (elongation_ - left) * std::expm1(-seconds / fading_ * rests(speed));
    elongation_ = std::clamp(elongation_, S(0), std::max(depth - share_ * std::max(push, S(0)) / stiffness_, S(0)));
    return stiffness_ * elongation_ * contact.normal + share_ * contact.tissue_force;
  }

  /// w, from 0 to 1.
  S tissue_share() const noexcept { return share_; }
  /// e [m].
  S elongation() const noexcept { return elongation_; }
  /// Elastic energy of the spring [J]; with that of the tissue it is the input of a `PassivityController`.
  S elastic_energy() const noexcept { return stiffness_ * elongation_ * elongation_ / S(2); }

  void reset() noexcept {
    share_ = elongation_ = depth_ = S(0);
    arrived_ = false;
  }

 private:
  /// 1 for a tool that rests, 0 for one that moves, linear between the two speeds.
  S rests(S speed) const noexcept { return std::clamp(S(2) - speed / rest_speed_, S(0), S(1)); }

  S stiffness_, arrival_, fading_, rest_speed_;
  S share_ = S(0), elongation_ = S(0), depth_ = S(0);
  bool arrived_ = false;
};

}  // namespace palpate
