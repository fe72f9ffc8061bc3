// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/contact.hpp>

#include <concepts>
#include <utility>

namespace palpate {

/// What an overlay knows of the hand in one servo tick: also in free space, where a force model is not asked.
/// Units      tip [m], velocity [m/s], seconds [s]; world frame.
template <RealScalar S>
struct ToolMotion {
  using Scalar = S;

  Vector3<S> tip = Vector3<S>::Zero();
  Vector3<S> velocity = Vector3<S>::Zero();
  S seconds = S(0.001);     ///< since the last servo tick
  bool continues = false;   ///< it was asked in the tick before; false at first, and after a tick in which nothing was to be felt
};

/// A force on the hand [N] that does not come from the tissue: guidance along a path, a wall that must not be passed. Beyond the syntax: called
/// once a servo tick, so no allocation, lock, or input and output; a finite motion gives a finite force; where `continues` is false the force
/// begins at zero.
template <class T, class Scalar>
concept ForceOverlay = RealScalar<Scalar> && requires(T& overlay, ToolMotion<Scalar> const& motion) {
  { overlay(motion) } noexcept -> detail::Vector3Of<Scalar>;
};

/// A force model that brings an overlay with it: the simulator adds `overlay(motion)` to the force in every tick in which the hand may feel
/// anything, after the fading of a restoration and before the safety chain. On a device that moves a hand the passivity controller damps an overlay that gives more than
/// it took; one that stores energy says how much: `energy()` [J].
template <class T, class Scalar>
concept HasOverlay = RealScalar<Scalar> && requires(T& model, ToolMotion<Scalar> const& motion) {
  { model.overlay(motion) } noexcept -> detail::Vector3Of<Scalar>;
};

/// A force model and an overlay, for a simulator: `Simulator(device, body, cutter, Overlaid(CuttingForce(…), PathGuidance(…)))`. Where the force
/// model has an overlay itself, both are added.
template <class Force, class Overlay>
class Overlaid {
 public:
  Overlaid(Force force, Overlay overlay) : force_(std::move(force)), over_(std::move(overlay)) {}

  /// The tissue's part.
  template <RealScalar Scalar>
    requires ForceModel<Force, Scalar>
  Vector3<Scalar> operator()(ToolContact<Scalar> const& contact) noexcept {
    return force_(contact);
  }
  template <RealScalar Scalar>
    requires ForceOverlay<Overlay, Scalar>
  Vector3<Scalar> overlay(ToolMotion<Scalar> const& motion) noexcept {
    if constexpr (HasOverlay<Force, Scalar>)
      return force_.overlay(motion) + over_(motion);
    else
      return over_(motion);
  }

  /// J, that the overlays hold elastically, where they say so with `energy()`: what they may give back without being active.
  double overlay_energy() const noexcept {
    double held = 0.0;
    if constexpr (requires { over_.energy(); }) held += static_cast<double>(over_.energy());
    if constexpr (requires { force_.overlay_energy(); }) held += force_.overlay_energy();
    return held;
  }

  /// Where the force answers to the surface: see proxy_force.hpp.
  template <class Local, RealScalar Scalar>
    requires requires(Force& force, Local const& local, ToolMotion<Scalar> const& motion) { force.on_surface(local, motion); }
  Vector3<Scalar> on_surface(Local const& local, ToolMotion<Scalar> const& motion) noexcept {
    return force_.on_surface(local, motion);
  }
  auto surface_kind() const noexcept
    requires requires(Force const& force) { force.surface_kind(); }
  {
    return force_.surface_kind();
  }
  void begin_session(double servo_rate, double model_rate)
    requires requires(Force& force) { force.begin_session(servo_rate, model_rate); }
  {
    force_.begin_session(servo_rate, model_rate);
  }
  double most_stiffness() const noexcept
    requires requires(Force const& force) { force.most_stiffness(); }
  {
    return force_.most_stiffness();
  }
  void limit_stiffness(double most) noexcept
    requires requires(Force& force) { force.limit_stiffness(most); }
  {
    force_.limit_stiffness(most);
  }
  /// Where the force wants to know the device: see coupled_force.hpp.
  template <class Capabilities, class Mapping>
    requires requires(Force& force, Capabilities const& device, Mapping const& mapping) { force.begin_session(device, mapping, 500.0); }
  void begin_session(Capabilities const& device, Mapping const& mapping, double model_rate) {
    force_.begin_session(device, mapping, model_rate);
  }

  void validate() const {
    if constexpr (requires { force_.validate(); }) force_.validate();
    if constexpr (requires { over_.validate(); }) over_.validate();
  }
  void reset() noexcept {
    if constexpr (requires { force_.reset(); }) force_.reset();
    if constexpr (requires { over_.reset(); }) over_.reset();
  }

  Force& force() noexcept { return force_; }
  Force const& force() const noexcept { return force_; }
  Overlay& over() noexcept { return over_; }
  Overlay const& over() const noexcept { return over_; }

 private:
  Force force_;
  Overlay over_;
};

}  // namespace palpate
