// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/spring_then_tissue.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

struct SurfaceThenTissueOptions {
  ProxyForceOptions surface{};         ///< plane or ball, its stiffness and friction; facets have no depth here
  SpringThenTissueOptions overlay{};   ///< how the spring fades and the tissue comes in; its stiffness is that of the surface
  double lost_after = 0.22;            ///< s without an answer, by which a safety chain has faded the force: the contact has ended, and begins anew from outside
  double damping = 11.0;               ///< α [N·s/m], the most that it adds where late answers give energy: about mass / (4 T), 11 for a 45 g stylus; 0: none
  double debt = 1e-3;                  ///< J, given too much, at which it adds all of that
};

/// The force of the haptic hierarchy: a plane or ball with friction and a spring at the servo's rate, on which the tissue's reaction is laid as it arrives.
///   F = K e n + w F_t + T − B v n
///   d   how deep the tip is behind the surface as it is now, n its normal there; K d n the spring of a ProxyForce
///   e, w   see SpringThenTissue: on first contact e = d and w = 0; w → 1 once there is F_t; at rest e fades
///   T   the friction of the proxy, across n
///   B = α (U − E)/debt, from 0 to α; E the energy that the hand has put in, U what the spring and the tissue may hold of it, v along n
/// F_t changes evenly over as many ticks as lie between two answers. On first contact only the spring acts; a tool that rests feels the tissue alone.
/// A contact begins from outside. Where the tip is behind a surface when that appears, or when answers come again after `lost_after`, nothing is felt until it
/// has been in front of it and the tissue tells of no contact: the hand has not paid for what it would get there.
/// Units      m, N; force on the hand, world frame.
/// Invariant  as of ProxyForce and SpringThenTissue; lost_after, debt > 0, damping ≥ 0; checked at set-up. `proxy()` is never behind the surface: that is the tip to draw.
/// Cost       those of the two; noexcept, no allocation: allowed in the servo tick.
/// Limits     F_t is late by the way there and back, and gives the hand energy meanwhile: B takes it back, up to α, and a passivity controller the rest. A
///            tissue of apparent stiffness K_t trembles under a hand of damping b where K_t > (b + α)/(T/2 + T_d). U is that of a linear tissue.
template <RealScalar S>
class SurfaceThenTissue {
 public:
  using Scalar = S;

  explicit SurfaceThenTissue(SurfaceThenTissueOptions const& options = {}) : surface_(checked(options)), overlay_(overlay_of(options)), options_(options) {}

  SurfaceKind surface_kind() const noexcept { return surface_.surface_kind(); }
  double max_stiffness() const noexcept { return surface_.max_stiffness(); }
  void limit_stiffness(double most) noexcept {
    surface_.limit_stiffness(most);
    SurfaceThenTissueOptions limited = options_;
    limited.surface.max_stiffness = std::max(std::min(most, options_.surface.max_stiffness), 1e-9);
    overlay_ = SpringThenTissue<S>(overlay_of(limited));
  }
  void begin_session(double servo_rate, double model_rate) {
    surface_.begin_session(servo_rate, model_rate);
    rate_ = servo_rate;
    between_ = std::clamp(std::ceil(servo_rate / model_rate), 1.0, 1e6);
    forget();
    is_outside_ = false, silent_ = 0.0, heard_ = std::numeric_limits<double>::quiet_NaN();
  }

  Vector3<S> on_surface(LocalModel<S> const& local, ToolMotion<S> const& motion) noexcept {
    S const seconds = motion.seconds > S(0) ? motion.seconds : S(0.001);   // false for a NaN
    if (!is_known(local, motion.tip, seconds)) {
      surface_.reset();
      forget();
      return Vector3<S>::Zero();
    }
    Vector3<S> const spring = surface_.on_surface(local, motion);
    Vector3<S> const n = surface_.surface().normal;
    S const push = std::max(spring.dot(n), S(0));
    approach(local.phase == CuttingPhase::no_contact ? Vector3<S>(Vector3<S>::Zero()) : local.tissue_force, std::max(1.0, std::round(static_cast<double>(seconds) * rate_)));
    ToolContact<S> contact;
    bool const touches = push > S(0) || local.phase != CuttingPhase::no_contact || !is_zero(tissue_);
    contact.phase = touches ? CuttingPhase::indenting : CuttingPhase::no_contact;
    contact.depth = push / std::max(stiffness(), S(1e-9));
    contact.normal = n;
    contact.velocity = motion.velocity;
    contact.tissue_force = tissue_;
    contact.seconds = motion.seconds;
    Vector3<S> const force = overlay_(contact) + (spring - spring.dot(n) * n);
    return damped(force, local.depth(motion.tip), n, motion, touches);
  }

  /// Where the tool would be if the tissue could not be entered; the tip itself in free space.
  SurfaceProxy<S> const& proxy() const noexcept { return surface_.proxy(); }
  SpringThenTissue<S> const& overlay() const noexcept { return overlay_; }
  /// The surface of the last tick, with its point nearest to the tip.
  SurfacePatch<S> const& surface() const noexcept { return surface_.surface(); }

  /// N·s/m, added in the last tick.
  S damping() const noexcept { return damping_; }

  void reset() noexcept {
    surface_.reset();
    forget();
    is_outside_ = false;
  }

 private:
  void forget() noexcept {
    overlay_.reset();
    tissue_.setZero(), goal_.setZero(), sent_.setZero();
    left_ = 0.0;
    taken_ = damping_ = S(0);
  }
  /// May anything be felt? From when the tip has been in front of a surface until that is gone, or nothing was heard for too long.
  bool is_known(LocalModel<S> const& local, Vector3<S> const& tip, S seconds) noexcept {
    silent_ = local.time == heard_ ? silent_ + static_cast<double>(seconds) : 0.0;   // a model without a time is of now
    heard_ = local.time;
    SurfacePatch<S> const& patch = local.surface.patch;
    bool const is_there = patch.stiffness > S(0);
    if (silent_ > options_.lost_after)
      is_outside_ = false;
    else if (is_there && local.phase == CuttingPhase::no_contact && patch.distance(tip) > S(0))
      is_outside_ = true;
    else if (!is_there && local.phase == CuttingPhase::no_contact && is_zero(tissue_) && is_zero(sent_))
      is_outside_ = false;
    return is_outside_;
  }
  /// The force with damping along n, where it has given more than what was put in and may still be held.
  Vector3<S> damped(Vector3<S> const& force, S depth, Vector3<S> const& n, ToolMotion<S> const& motion, bool touches) noexcept {
    taken_ -= (sent_ + force).dot(motion.tip - tip_) / S(2);   // the leak of the hold is not of the delay
    tip_ = motion.tip;
    S const e = overlay_.elongation(), tissue = overlay_.tissue_share() * std::max(tissue_.dot(n), S(0));
    S const held = stiffness() * e * e / S(2) + tissue * std::max(depth - e, S(0)) / S(2);
    taken_ = touches && std::isfinite(taken_) ? std::min(taken_, held) : S(0);
    damping_ = touches ? S(options_.damping) * std::clamp((held - taken_) / S(options_.debt), S(0), S(1)) : S(0);
    S const slows = damping_ * motion.velocity.dot(n);
    if (!std::isfinite(slows)) return sent_ = force;
    return sent_ = force - std::min(slows, std::max(force.dot(n), S(0))) * n;   // it does not hold a hand that goes
  }
  S stiffness() const noexcept { return S(overlay_stiffness_); }
  /// The tissue's force on its way to the one told last.
  void approach(Vector3<S> const& told, double periods) noexcept {
    if (told != goal_) goal_ = told, left_ = between_;
    if (!is_finite(goal_)) goal_.setZero(), left_ = 0.0;
    if (left_ > periods)
      tissue_ += (goal_ - tissue_) * S(periods / left_), left_ -= periods;
    else
      tissue_ = goal_, left_ = 0.0;
  }

  static ProxyForceOptions const& checked(SurfaceThenTissueOptions const& options) {
    if (options.surface.surface == SurfaceKind::facets) throw InvalidArgument("SurfaceThenTissue: .surface.surface is facets; give plane or ball");
    detail::OptionCheck const require{"SurfaceThenTissue", true};
    require.positive(".lost_after", options.lost_after, " s");
    require.not_negative(".damping", options.damping, " N·s/m");
    require.positive(".debt", options.debt, " J");
    return options.surface;
  }
  SpringThenTissueOptions overlay_of(SurfaceThenTissueOptions const& options) {
    SpringThenTissueOptions overlay = options.overlay;
    overlay.stiffness = overlay_stiffness_ = options.surface.max_stiffness;
    return overlay;
  }

  double rate_ = 1000.0;   // Hz, of the servo
  double overlay_stiffness_ = 0.0;
  ProxyForce<S> surface_;
  SpringThenTissue<S> overlay_;
  SurfaceThenTissueOptions options_;
  double between_ = 1.0, left_ = 0.0;   // ticks between two answers; to the goal
  Vector3<S> tissue_ = Vector3<S>::Zero(), goal_ = Vector3<S>::Zero();
  bool is_outside_ = false;                                                   // the tip has been, since there is a surface
  double silent_ = 0.0, heard_ = std::numeric_limits<double>::quiet_NaN();   // s since the last answer; its time
  Vector3<S> sent_ = Vector3<S>::Zero(), tip_ = Vector3<S>::Zero();         // in the last tick
  S taken_ = S(0), damping_ = S(0);                                           // J, from the hand; N·s/m
};

}  // namespace palpate
