// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/velocity_estimate.hpp>
#include <palpate/haptics/virtual_coupling.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {

/// Upper limits of the coupling, as the hand feels it. The device's capabilities may lower them.
struct CoupledForceOptions {
  double stiffness = std::numeric_limits<double>::infinity();   ///< N/m; required for a device that states neither damping nor largest stiffness
  double damping = std::numeric_limits<double>::infinity();     ///< N·s/m
};

/// A force policy behind a virtual coupling: the tissue meets a simulated tool, and the hand feels the spring and damper that hold this
/// tool to the device. So the coupling's stiffness alone decides what the device has to stand, whatever the tissue's is.
///   CoupledForce force(ProxyForce<double>({.max_stiffness = 5000.0}));
///   CoupledForce force(CuttingForce(…), {.stiffness = 800.0}, WindowedVelocity<double, 8>{});
///   F = K_c (x_t − x_d) + B_c (v_t − v̂_d);   on a plane K_p, at rest: F = d/(1/K_c + 1/K_p)
/// K_c and B_c follow from the device's capabilities when a session begins (`coupling_for`), limited by the options and seen through the
/// mapping: K_c is what the hand feels. v̂_d is estimated by `Velocity` from the tip's positions; a force that depends on velocity gets
/// v̂_d too.
/// Units      SI; force on the hand, world frame.
/// Source     \cite colgate1995, \cite adams1999.
/// Invariant  The first tick, and the first after a pause, starts with the tool at the device: no force in free space. In the tissue the
///            tool is pushed out from there, so nothing arms on it. With a held tool the device's side is passive for b ≥ K_c T/2 + B_c,
///            with `BackwardDifference` of any span and `WindowedVelocity` of any length: their delay asks for more than B_c at no
///            frequency.
/// Errors     InvalidArgument from `begin_session` where neither the device's damping nor a largest stiffness is known.
/// Late       while there is no new sample the force is held; the way to the next one, or of a late tick, is reckoned a period at a time, at most 16.
/// Cost       Those of `VirtualCoupling`, the force and the estimator, as often as periods have passed; noexcept, no allocation: allowed in the servo tick.
/// Limits     The force comes a tick later than without, and the hand feels at most K_c. The load of a force model is taken as a spring
///            of its secant stiffness F·n/d, stable up to twice that and K_c more. For `AdaptiveWindowVelocity`, which varies in time,
///            the bound is tested, not proven. A load is as of a surface at rest: on one that recedes by more than F/K in a tick, as tissue
///            that yields under a quick hand, the tool loses it and meets it again, and the force comes and goes from tick to tick.
template <class Force, class Velocity = AdaptiveWindowVelocity<typename detail::CommonScalar<Force>::type>>
class CoupledForce {
 public:
  using Scalar = typename Velocity::Scalar;

 private:
  using S = Scalar;
  static constexpr bool answers_to_surface_ = SurfaceForce<Force, S>;
  static_assert(answers_to_surface_ || ForceModel<Force, S>,
                "palpate::CoupledForce: the force is neither a force model, palpate::ToolContact -> palpate::Vector3, nor one that answers to the surface, "
                "as ProxyForce does, in the scalar of the velocity estimator.");
  static_assert(VelocityEstimator<Velocity, S>,
                "palpate::CoupledForce: the velocity estimator needs operator()(Vector3 position) noexcept -> Vector3 and reset() noexcept.");
  static_assert(sizeof(detail::ForceRefinements<Force, S>) > 0);

 public:
  explicit CoupledForce(Force force, CoupledForceOptions const& options = {}, Velocity velocity = Velocity{})
      : options_(options), force_(std::move(force)), velocity_(std::move(velocity)) {
    detail::OptionCheck const require{"CoupledForce"};
    require(options.stiffness > 0.0, ".stiffness", options.stiffness, " N/m", "give a number above zero, or none for all that the device stands");
    require(options.damping >= 0.0, ".damping", options.damping, " N·s/m", "give zero or more, or none for all that the device stands");
    if constexpr (Validatable<Force>) force_.validate();
  }

  SurfaceKind surface_kind() const noexcept {
    if constexpr (answers_to_surface_)
      return force_.surface_kind();
    else
      return SurfaceKind::none;
  }

  /// Begins a session with this device, seen through a mapping; local models will come at `model_rate` Hz.
  void begin_session(Capabilities const& device, WorkspaceMapping<S> const& mapping, double model_rate) {
    CouplingLimits limits = coupling_limits(device);
    limits.max_stiffness = std::min(limits.max_stiffness, options_.stiffness);
    limits.max_damping = std::min(limits.max_damping, options_.damping);
    if (!(limits.damping > 0.0) && std::isinf(limits.max_stiffness))
      throw InvalidArgument("CoupledForce: the device says neither its damping, for which a guess does not count, nor the largest stiffness; give CoupledForceOptions::stiffness");
    CouplingLaw const felt = coupling_for(limits);
    double const scene = 1.0 / static_cast<double>(mapping.felt_stiffness(S(1)));
    law_ = {.stiffness = scene * felt.stiffness, .damping = scene * felt.damping, .mass = scene * felt.mass};
    rate_ = limits.rate;
    coupling_ = VirtualCoupling<S>({.position = law_, .period = 1.0 / rate_});
    if constexpr (AdaptsToDevice<Velocity>) velocity_.begin_session(1.0 / limits.rate, static_cast<double>(mapping.world_from_device().scale()) * limits.quantum);
    if constexpr (answers_to_surface_) force_.begin_session(limits.rate, model_rate);
    begin_anew();
  }
  /// The same for a device that says nothing of itself.
  void begin_session(double servo_rate, double model_rate) { begin_session(Capabilities{.rate = servo_rate}, WorkspaceMapping<S>{}, model_rate); }

  /// Needs a session.
  Vector3<S> on_surface(LocalModel<S> const& local, ToolMotion<S> const& motion) noexcept {
    if (!motion.continues || !is_finite(motion.tip)) begin_anew();
    if (!is_finite(motion.tip)) return Vector3<S>::Zero();
    DeviceState<S> device;
    if (motion.seconds > 0) since_sample_ += static_cast<double>(motion.seconds) * rate_;
    if ((!motion.fresh || since_sample_ < 0.999) && coupling_.attached()) return held_;   // the hand has gone on: what it did is known with its next sample
    int const periods = coupling_.attached() ? static_cast<int>(std::clamp(std::round(since_sample_), 1.0, 16.0)) : 1;   // estimator and coupling go by the period
    since_sample_ = coupling_.attached() && since_sample_ < 16.5 ? since_sample_ - periods : 0.0;
    Vector3<S> const before = tip_;
    Vector3<S> force = Vector3<S>::Zero();
    tip_ = motion.tip;
    for (int k = 1; k <= periods; ++k) {
      device.position = k < periods ? Vector3<S>(before + S(k) / S(periods) * (motion.tip - before)) : motion.tip;
      device.velocity = velocity_(device.position);
      if (!coupling_.attached()) {
        coupling_.attach(device);
        depth_ = local.depth(motion.tip);
      }
      ToolLoad<S> const load = load_on(coupling_.tool().position, local, {device.position, device.velocity, S(1.0 / rate_), motion.continues});
      force = coupling_(device, load).force;
    }
    if (!coupling_.attached()) begin_anew();   // what came was no number
    return held_ = force;
  }

  /// The force's own, which acts on the hand itself; see HasOverlay.
  Vector3<S> overlay(ToolMotion<S> const& motion) noexcept
    requires HasOverlay<Force, S>
  {
    return force_.overlay(motion);
  }
  double overlay_energy() const noexcept
    requires HasOverlayEnergy<Force>
  {
    return force_.overlay_energy();
  }

  /// K_c, B_c and the tool's mass in this session, in the scene.
  CouplingLaw const& law() const noexcept { return law_; }
  /// The tool, with its tip where the tissue meets it.
  DeviceState<S> const& tool() const noexcept { return coupling_.tool(); }
  Force& force() noexcept { return force_; }
  Force const& force() const noexcept { return force_; }

  void reset() noexcept {
    begin_anew();
    if constexpr (Resettable<Force>) force_.reset();
  }

 private:
  void begin_anew() noexcept {
    coupling_.reset();
    velocity_.reset();
    since_sample_ = 0.0, held_.setZero();
  }

  /// What the tissue does to a tool that is here.
  ToolLoad<S> load_on(Vector3<S> const& tip, LocalModel<S> const& local, ToolMotion<S> motion) noexcept {
    ToolLoad<S> load;
    motion.tip = tip;
    if constexpr (answers_to_surface_) {
      load.wrench.force = force_.on_surface(local, motion);
      if constexpr (KnowsLoadStiffness<Force, S>)
        load.stiffness = force_.load_stiffness();
      else if (S const size = load.wrench.force.norm(); size > S(0))
        load.stiffness = local.surface.stiffness() / (size * size) * load.wrench.force * load.wrench.force.transpose();
    } else {
      ToolContact<S> contact;
      contact.phase = local.phase;
      contact.depth = local.depth(tip);
      contact.previous_depth = std::exchange(depth_, contact.depth);
      contact.normal = local.normal;
      contact.velocity = motion.velocity;
      contact.tissue_force = local.tissue_force;
      contact.seconds = motion.seconds;
      load.wrench.force = force_(contact);
      load.stiffness = secant_stiffness(load.wrench.force, contact);
    }
    return load;
  }

  CoupledForceOptions options_;
  Force force_;
  Velocity velocity_;
  CouplingLaw law_{};
  VirtualCoupling<S> coupling_{};
  double rate_ = 1000.0;                     // Hz, of the servo
  Vector3<S> tip_ = Vector3<S>::Zero();      // of the last tick
  Vector3<S> held_ = Vector3<S>::Zero();     // N, since the last new sample
  double since_sample_ = 0.0;                // periods that have passed and are not reckoned yet
  S depth_ = S(0);   // m, of the tool, one servo tick ago
};

}  // namespace palpate
