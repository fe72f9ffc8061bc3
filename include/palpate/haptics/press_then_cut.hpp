// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/force/concept.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/proxy_force.hpp>

#include <utility>

namespace palpate {

/// The surface force as a contact law of `CuttingForce`: `tissue_force`, before the puncture.
template <RealScalar S>
struct PressedReaction {
  using Scalar = S;
  static constexpr bool resists_before_puncture = true;

  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    return contact.phase == CuttingPhase::indenting ? contact.tissue_force : Vector3<S>(Vector3<S>::Zero());
  }
};

/// A surface force while the tool presses, cutting forces from the puncture on, blended without a step. A proxy suits a tool that has not
/// entered, cutting forces a blade that has.
///   PressThenCut force(ProxyForce<double>({.static_friction = 0.3, .dynamic_friction = 0.2}), liver_hysteresis<double>());
///   no contact, indenting   F = press, which exists before the body reports a touch
///   moving                  F = p F_p g(d) + (1 − p) (Σ parts), as of `CuttingForce`; F_p the last force while indenting
/// Units      N, m; force on the hand, world frame.
/// Invariant  At the puncture the force changes by at most 1.5 F_p Δt/puncture_time a tick, beside what the parts do: 0.3 F_p with the
///            default 5 ms. That is within a slew limit of 500 N/s up to 1.7 N; give `CurveJoin` a longer time above. The parts have
///            faded to zero where the tool leaves.
/// Cost       The sum of both; noexcept, no allocation: allowed in the servo tick.
/// Limits     Flanks of the wound push and rub as the parts say (`OrganForce`, friction of a needle), not by contact. A contact law among
///            the parts is added to the press.
template <class Press, class... Parts>
class PressThenCut {
 public:
  using Scalar = typename Press::Scalar;

 private:
  using S = Scalar;
  static_assert(SurfaceForce<Press, S>, "palpate::PressThenCut: the first part has to answer to the surface, as ProxyForce does; what follows are parts of CuttingForce.");
  static_assert(!detail::NamesOverlay<Press>, "palpate::PressThenCut: the first part has an overlay, which would not be felt here; lay it over the whole: Overlaid(PressThenCut(press, parts), overlay).");
  static_assert(sizeof(detail::ForceRefinements<Press, S>) > 0);

 public:
  explicit PressThenCut(Press press, Parts... parts) : press_(std::move(press)), cut_(std::move(parts)..., PressedReaction<S>{}) {}

  SurfaceKind surface_kind() const noexcept { return press_.surface_kind(); }
  double max_stiffness() const noexcept
    requires LimitsStiffness<Press>
  {
    return press_.max_stiffness();
  }
  /// Of the part that presses.
  void limit_stiffness(double most) noexcept
    requires LimitsStiffness<Press>
  {
    press_.limit_stiffness(most);
  }
  void begin_session(double servo_rate, double model_rate) { press_.begin_session(servo_rate, model_rate); }

  Vector3<S> on_surface(LocalModel<S> const& local, ToolMotion<S> const& motion) noexcept {
    Vector3<S> const pressed = press_.on_surface(local, motion);
    contact_.phase = local.phase;
    contact_.previous_depth = std::exchange(contact_.depth, local.depth(motion.tip));
    contact_.normal = local.normal;
    contact_.velocity = motion.velocity;
    contact_.tissue_force = pressed;
    contact_.seconds = motion.seconds;
    Vector3<S> const cut = cut_(contact_);
    cuts_ = local.phase == CuttingPhase::moving;
    cut_stiffness_ = secant_stiffness(cut, contact_);
    return local.phase == CuttingPhase::no_contact ? pressed : cut;
  }

  /// Stiffness of the last tick [N/m]: by how much the force falls as the tip yields.
  Matrix<S, 3, 3> load_stiffness() const noexcept
    requires KnowsLoadStiffness<Press, S>
  {
    return cuts_ ? cut_stiffness_ : Matrix<S, 3, 3>(press_.load_stiffness());
  }

  Press& press() noexcept { return press_; }
  Press const& press() const noexcept { return press_; }

  void reset() noexcept {
    if constexpr (Resettable<Press>) press_.reset();
    cut_.reset();
    contact_ = {};
    cuts_ = false;
  }

 private:
  Press press_;
  CuttingForce<Parts..., PressedReaction<S>> cut_;
  ToolContact<S> contact_{};   // of the last tick
  Matrix<S, 3, 3> cut_stiffness_ = Matrix<S, 3, 3>::Zero();
  bool cuts_ = false;
};

}  // namespace palpate
