// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve_join.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/patch_handover.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/surface_proxy.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// Secant stiffness F·n/d along the normal, where that is above zero: for a force model that states no stiffness.
template <RealScalar S>
Matrix<S, 3, 3> secant_stiffness(Vector3<S> const& force, ToolContact<S> const& contact) noexcept {
  S const secant = contact.depth > S(0) ? force.dot(contact.normal) / contact.depth : S(0);
  if (!(secant > S(0)) || !std::isfinite(secant)) return Matrix<S, 3, 3>::Zero();
  return secant * contact.normal * contact.normal.transpose();
}

struct ProxyForceOptions {
  SurfaceKind surface = SurfaceKind::ball;
  double max_stiffness = 500.0;    ///< N/m; at most that of the contact and what the device of a session stands
  double static_friction = 0.0;     ///< μ_s
  double dynamic_friction = 0.0;    ///< μ_d, not above μ_s
  double release = 0.005;           ///< s, in which the force fades when the surface disappears, as when the tool begins to cut; 0: with the hand-over
  int handover = 0;                 ///< ticks over which a new model replaces the last; 0: as many as lie between two, 1: at once
};

/// God-object with friction: a spring holds the hand to a proxy, the tool as it would be if the tissue could not be entered. Tight
/// coupling at the servo's own rate.
///   surface   plane or ball, handed over from model to model by PatchHandover, or up to three facets, by PlaneHandover
///   proxy     SurfaceProxy with its friction cone, moved with the surface under it
///   F = K (proxy − tip),   K = min(contact stiffness, max_stiffness, what the session's device stands)
/// The contact presses the tissue with its own stiffness: where K equals that, the hand feels at rest just what the tissue feels.
/// Units      N, N/m, m.
/// Source     \cite zilles1995, \cite ruspini1997; local models \cite mendoza2001.
/// Invariant  options as of `SurfaceProxy` and the hand-overs; checked at set-up.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     Zero while the tool cuts, since a blade that cuts has entered. The force then fades in `release`, by at most 1.5 F
///            Δt/release a tick, or with the hand-over where that is slower; `PressThenCut` adds a cutting force. A hand-over over N
///            ticks is late by N/2 ticks on average.
template <RealScalar S>
class ProxyForce {
 public:
  using Scalar = S;

  explicit ProxyForce(ProxyForceOptions const& options = {})
      : options_(checked(options)), proxy_(of_proxy(options_)) {
    begin_session(1000.0, 1000.0);
  }

  SurfaceKind surface_kind() const noexcept { return options_.surface; }

  /// N/m, that the options want.
  double max_stiffness() const noexcept { return options_.max_stiffness; }
  /// Limits the stiffness to this [N/m], until called again.
  void limit_stiffness(double most) noexcept { limit_ = S(std::min(most, options_.max_stiffness)); }

  void begin_session(double servo_rate, double model_rate) {
    detail::OptionCheck const require{"ProxyForce::begin_session"};
    require.positive("the servo's rate", servo_rate, " Hz"), require.positive("the rate of models", model_rate, " Hz");
    rate_ = servo_rate;
    model_ticks_ = std::max(1, static_cast<int>(std::ceil(servo_rate / model_rate)));
    between_ = options_.handover > 0 ? options_.handover : std::clamp(static_cast<int>(std::ceil(servo_rate / model_rate - 1e-9)), 1, 1000000);
    patches_ = PatchHandover<S>({.ticks = between_, .period = 1.0 / servo_rate});
    planes_ = PlaneHandover<S>({.ticks = between_});
    proxy_.reset();
    forget();
  }

  Vector3<S> on_surface(LocalModel<S> const& local, ToolMotion<S> const& motion) noexcept {
    Vector3<S> force = at_surface(local, motion);
    bool const there = local.surface.stiffness() > S(0);
    S const seconds = motion.seconds > S(0) ? motion.seconds : S(0.001);   // false for a NaN
    if (was_there_ && !there && static_cast<double>(between_) / rate_ < options_.release) {
      lost_ = force_;
      since_lost_ = S(0);
    }
    was_there_ = there;
    if (!is_zero(lost_)) {
      since_lost_ += seconds;
      S const share = CurveJoin<S>{.puncture_time = S(options_.release)}.puncture_share(since_lost_);
      if (!there) force.setZero();   // the hand-over would be quicker
      force = (S(1) - share) * force + share * lost_;
      if (!(share > S(0))) lost_.setZero();
    }
    return force_ = force;
  }

  /// Where the tool would be; the tip itself in free space.
  SurfaceProxy<S> const& proxy() const noexcept { return proxy_; }
  /// Plane or ball of the last tick, with its point nearest to the tip; a stiffness of 0: none.
  SurfacePatch<S> const& surface() const noexcept { return surface_; }
  /// Stiffness of the last tick [N/m]: by how much the force falls as the tip yields.
  Matrix<S, 3, 3> load_stiffness() const noexcept { return stiffness_ * proxy_.held_ways(); }
  void reset() noexcept {
    patches_.reset();
    planes_.reset();
    proxy_.reset();
    forget();
  }

 private:
  void forget() noexcept {
    sequence_ = 0;
    surface_ = {};
    force_.setZero();
    lost_.setZero();
    was_there_ = false;
  }

  Vector3<S> at_surface(LocalModel<S> const& local, ToolMotion<S> const& motion) noexcept {
    SurfaceModel<S> const& surface = local.surface;
    S const stiffness = std::min(surface.stiffness(), limit_);
    bool const facets = options_.surface == SurfaceKind::facets;
    if (surface.sequence != sequence_) {
      sequence_ = surface.sequence;
      age_ = 0;
      SurfacePatch<S> patch = surface.patch;
      patch.stiffness = stiffness;
      patches_.take(patch, sequence_, motion.tip);
      if (facets) planes_.take(surface.planes, stiffness, sequence_, motion.tip);
    }
    S const late = std::round(motion.seconds * S(rate_));
    int const periods = late > S(1) ? static_cast<int>(std::min(late, S(1e6))) : 1;   // false for a NaN
    SurfacePatch<S> const patch = patches_(motion.tip, periods);
    int const before = age_;
    age_ = std::min(age_ + periods, 2 * model_ticks_);
    if (patch.moves() && before < age_) proxy_.carry(static_cast<S>((age_ - before) / rate_) * patch.velocity_at(proxy_.position()));
    if (facets) {
      PlaneSet<S> const planes = planes_(motion.tip, periods);
      return proxy_(planes, motion.tip, stiffness_ = planes_.stiffness());
    }
    PlaneSet<S> tangent;
    surface_ = patch.anchored_at(motion.tip);
    if (surface_.stiffness > S(0)) tangent.try_add({surface_.normal, surface_.normal.dot(surface_.point)});
    return proxy_(tangent, motion.tip, stiffness_ = surface_.stiffness);
  }

  static SurfaceProxyOptions of_proxy(ProxyForceOptions const& options) {
    SurfaceProxyOptions proxy;
    proxy.stiffness = options.max_stiffness;
    proxy.static_friction = options.static_friction;
    proxy.dynamic_friction = options.dynamic_friction;
    return proxy;
  }
  static ProxyForceOptions const& checked(ProxyForceOptions const& options) {
    if (options.surface == SurfaceKind::none) throw InvalidArgument("ProxyForce: .surface is none; give plane, ball or facets");
    if (options.surface != SurfaceKind::plane && options.surface != SurfaceKind::ball && options.surface != SurfaceKind::facets)
      throw InvalidArgument(detail::message("ProxyForce: .surface is ", static_cast<int>(options.surface), ", which is no kind; give plane, ball or facets"));
    detail::OptionCheck const require{"ProxyForce", true};
    of_proxy(options).validate("ProxyForce", ".max_stiffness");
    require(options.release >= 0.0, ".release", options.release, " s", "give a finite time, zero or more");
    require(options.handover >= 0, ".handover", options.handover, "give a number of ticks, or 0 for as many as lie between two models");
    return options;
  }

  ProxyForceOptions options_;
  PatchHandover<S> patches_{};
  PlaneHandover<S> planes_{};
  SurfaceProxy<S> proxy_;
  SurfacePatch<S> surface_{};
  S limit_ = S(options_.max_stiffness);        // N/m
  S stiffness_ = S(0);                          // of the last tick
  Vector3<S> force_ = Vector3<S>::Zero();       // of the last tick
  Vector3<S> lost_ = Vector3<S>::Zero();        // N, when the surface went
  S since_lost_ = S(0);                         // s
  bool was_there_ = false;
  std::uint64_t sequence_ = 0;
  double rate_ = 1000.0;            // Hz, of the servo
  int between_ = 1;                 // ticks of a hand-over
  int model_ticks_ = 1, age_ = 0;   // between two models; since the last: a model that is late does not move on
};

}  // namespace palpate
