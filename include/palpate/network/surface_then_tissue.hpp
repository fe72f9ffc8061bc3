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

namespace palpate {

struct SurfaceThenTissueOptions {
  ProxyForceOptions surface{};         ///< plane or ball, its stiffness and friction; facets have no depth here
  SpringThenTissueOptions overlay{};   ///< how the spring fades and the tissue comes in; its stiffness is that of the surface
};

/// The force of the haptic hierarchy: a plane or ball with friction and a spring at the servo's rate, on which the tissue's reaction is laid as it arrives.
///   F = K e n + w F_t + T
///   d   how deep the tip is behind the surface as it is now, n its normal there; K d n the spring of a ProxyForce
///   e, w   see SpringThenTissue: on first contact e = d and w = 0; w → 1 once there is F_t; at rest e fades
///   T   the friction of the proxy, across n
/// F_t changes evenly over as many ticks as lie between two answers. On first contact only the spring acts; a tool that rests feels the tissue alone.
/// Units      m, N; force on the hand, world frame.
/// Invariant  as of ProxyForce and SpringThenTissue. `proxy()` is never behind the surface: that is the tip to draw.
/// Cost       those of the two; noexcept, no allocation: allowed in the servo tick.
/// Limits     F_t is late by the way there and back, and gives the hand energy meanwhile: at most F_t times the way gone in that time. A passivity controller
///            takes that back.
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
    between_ = std::clamp(std::ceil(servo_rate / model_rate), 1.0, 1e6);
    forget();
  }

  Vector3<S> on_surface(LocalModel<S> const& local, ToolMotion<S> const& motion) noexcept {
    Vector3<S> const spring = surface_.on_surface(local, motion);
    Vector3<S> const n = surface_.surface().normal;
    S const push = std::max(spring.dot(n), S(0));
    approach(local.phase == CuttingPhase::no_contact ? Vector3<S>(Vector3<S>::Zero()) : local.tissue_force);
    ToolContact<S> contact;
    bool const touches = push > S(0) || local.phase != CuttingPhase::no_contact || !is_zero(tissue_);
    contact.phase = touches ? CuttingPhase::indenting : CuttingPhase::no_contact;
    contact.depth = push / std::max(stiffness(), S(1e-9));
    contact.normal = n;
    contact.velocity = motion.velocity;
    contact.tissue_force = tissue_;
    contact.seconds = motion.seconds;
    return overlay_(contact) + (spring - spring.dot(n) * n);
  }

  /// Where the tool would be if the tissue could not be entered; the tip itself in free space.
  SurfaceProxy<S> const& proxy() const noexcept { return surface_.proxy(); }
  SpringThenTissue<S> const& overlay() const noexcept { return overlay_; }
  /// The surface of the last tick, with its point nearest to the tip.
  SurfacePatch<S> const& surface() const noexcept { return surface_.surface(); }

  void reset() noexcept {
    surface_.reset();
    forget();
  }

 private:
  void forget() noexcept {
    overlay_.reset();
    tissue_.setZero(), goal_.setZero();
    left_ = 0.0;
  }
  S stiffness() const noexcept { return S(overlay_stiffness_); }
  /// The tissue's force on its way to the one told last.
  void approach(Vector3<S> const& told) noexcept {
    if (told != goal_) goal_ = told, left_ = between_;
    if (!is_finite(goal_)) goal_.setZero(), left_ = 0.0;
    if (left_ > 1.0)
      tissue_ += (goal_ - tissue_) / S(left_), left_ -= 1.0;
    else
      tissue_ = goal_, left_ = 0.0;
  }

  static ProxyForceOptions const& checked(SurfaceThenTissueOptions const& options) {
    if (options.surface.surface == SurfaceKind::facets) throw InvalidArgument("SurfaceThenTissue: .surface.surface is facets; give plane or ball");
    return options.surface;
  }
  SpringThenTissueOptions overlay_of(SurfaceThenTissueOptions const& options) {
    SpringThenTissueOptions overlay = options.overlay;
    overlay.stiffness = overlay_stiffness_ = options.surface.max_stiffness;
    return overlay;
  }

  double overlay_stiffness_ = 0.0;
  ProxyForce<S> surface_;
  SpringThenTissue<S> overlay_;
  SurfaceThenTissueOptions options_;
  double between_ = 1.0, left_ = 0.0;   // ticks between two answers; to the goal
  Vector3<S> tissue_ = Vector3<S>::Zero(), goal_ = Vector3<S>::Zero();
};

}  // namespace palpate
