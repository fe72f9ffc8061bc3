// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

struct PassivityOptions {
  double period = 0.001;        ///< T [s], of the servo
  double max_damping = 11.0;    ///< α_max [N·s/m], the most that the controller adds: about mass / (4 T), 11 for a 45 g stylus; 0: observe alone
  double device_damping = 0.0;  ///< b [N·s/m], certain damping of the mechanics, which offsets the leak of a held force; 0: not known
  double lever = 0.0;           ///< ℓ [m], at which a rotation counts as a way: the torque is damped by α ℓ² [N·m·s]; 0: a force alone
  double reservoir = 0.005;     ///< J; energy taken beyond it and the elastic energy is discarded: an earlier loss does not offset a later gain
};

/// Passivity observer and controller: sums the energy that a rendered force takes from the hand, and adds damping where it would give
/// more than it took.
///   E ← min(E − F₋·Δx, reservoir + U)   U elastic energy of the rendered model, Δx displacement since the last tick, F₋ the force held since
///   E ← E + b |Δx|²/T, up to U          the least that the mechanics have dissipated: it offsets a gain and is never stored
///   W = E − F·Δx + b |Δx|²/T            if the force wanted now were held over the same displacement again
///   W < 0:  F ← F − α Δx/T,   α = min(α_max, −W T/|Δx|²)
/// T is the period, or what has passed since the last sample, where that is more: a tick may be late.
/// With a torque τ besides, and Δθ the rotation since the last tick: F·Δx + τ·Δθ for F·Δx, |Δx|² + ℓ² |Δθ|² for the |Δx|² in α, and τ ← τ − α ℓ² Δθ/T.
/// F is the force on the hand, so the hand puts −F·Δx into what it touches. The observer is exact for a force that is held between
/// samples.
/// Units      SI; force [N] on the hand, energy [J].
/// Source     \cite hannaford2002; the exact sum under a hold \cite ryu2004. Without a limit on α the controller diverges at a stiff wall
///            and 1 kHz.
/// Invariant  period, reservoir > 0, both dampings ≥ 0, all finite; checked at set-up. It adds no force where the tip does not move. α
///            never exceeds its limit: what it cannot dissipate in this tick stays as a debt for the next motion, in the air too. With U
///            and b given, a spring of K ≤ 2 b/T is never damped: the mechanics dissipate the leak of a hold, K |Δx|²/2.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     b is of ways alone: nothing is known of what a rotation dissipates.
///            Without U, a soft wall that returns more than the reservoir looks active. Call `sent` after every limiter. Noise counts as
///            energy given; see `CuttingForce::noise_energy`. A sliding tip is damped along its whole path, so energy of the wall across
///            it is taken from the sliding, and the wall may go on vibrating.
template <RealScalar S>
class PassivityController {
 public:
  using Scalar = S;

  explicit PassivityController(PassivityOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"PassivityController", true};
    require(options.period > 0.0, ".period", options.period, " s", "give that of the servo, 0.001 for most");
    require.not_negative(".max_damping", options.max_damping, " N·s/m");
    require.not_negative(".device_damping", options.device_damping, " N·s/m");
    require.not_negative(".lever", options.lever, " m");
    require.positive(".reservoir", options.reservoir, " J");
  }

  /// The passive force for the one wanted at this position, of a model with elastic energy `elastic` [J], ½ k d² for a spring. Books the
  /// displacement since the last tick under the force sent for it.
  Vector3<S> operator()(Vector3<S> const& position, Vector3<S> const& wanted, double elastic = 0.0) noexcept {
    Vector3<S> none = Vector3<S>::Zero();
    return (*this)(position, wanted, elastic, none, none);
  }
  /// The same with a torque, which becomes the passive one, the rotation since the last tick [rad], and what has passed since then [s], where that may be
  /// more than a period.
  Vector3<S> operator()(Vector3<S> const& position, Vector3<S> const& wanted, double elastic, Vector3<S> const& turned, Vector3<S>& torque, double seconds = 0.0) noexcept {
    double const period = std::isfinite(seconds) ? std::max(options_.period, seconds) : options_.period;
    Vector3<double> const way = has_position_ ? Vector3<double>(position.template cast<double>() - position_) : Vector3<double>(Vector3<double>::Zero());
    Vector3<double> const turn = has_position_ ? Vector3<double>(turned.template cast<double>()) : Vector3<double>(Vector3<double>::Zero());
    position_ = position.template cast<double>();
    has_position_ = true;
    damping_ = 0.0;
    double const work = -sent_.dot(way) - sent_torque_.dot(turn), lever = options_.lever * options_.lever;
    if (!std::isfinite(work)) {   // a tick that is no number leaves no trace
      has_position_ = false;
      return wanted;
    }
    total_ += work;
    min_ = std::min(min_, total_);
    double const square = way.squaredNorm(), taken = options_.device_damping / period * square;
    double const held = std::fmax(elastic, 0.0);   // 0 for a NaN
    energy_ = std::min(energy_ + work, options_.reservoir + held);
    if (energy_ < held) energy_ = std::min(energy_ + taken, held);
    double const next = energy_ + taken - wanted.template cast<double>().dot(way) - torque.template cast<double>().dot(turn);
    double const moved = square + lever * turn.squaredNorm();
    if (!(next < 0.0) || !(moved > 0.0) || !(options_.max_damping > 0.0)) return wanted;
    damping_ = std::min(options_.max_damping, -next * period / moved);
    ++damped_;
    torque = (torque.template cast<double>() - damping_ * lever / period * turn).template cast<S>();
    return (wanted.template cast<double>() - damping_ / period * way).template cast<S>();
  }

  /// The force that was written after all limits, and the torque; they act until the next tick.
  void sent(Vector3<S> const& force, Vector3<S> const& torque = Vector3<S>::Zero()) noexcept {
    sent_ = force.template cast<double>(), sent_torque_ = torque.template cast<double>();
  }

  /// J, taken from the hand since the start or reset(), unlimited; negative: given.
  double energy() const noexcept { return total_; }
  /// J, the least it ever was.
  double min_energy() const noexcept { return min_; }
  /// J, what the controller counts with: at most the reservoir.
  double stored() const noexcept { return energy_; }
  /// N·s/m, added in the last tick.
  double damping() const noexcept { return damping_; }
  /// In how many ticks damping was added.
  std::uint64_t damped() const noexcept { return damped_; }

  /// The next displacement is a jump, as after a calibration, and no work.
  void skip_way() noexcept { has_position_ = false; }

  /// Begins anew: no energy, no way, no force.
  void reset() noexcept {
    has_position_ = false;
    sent_.setZero(), sent_torque_.setZero();
    energy_ = total_ = min_ = damping_ = 0.0;
    damped_ = 0;
  }

 private:
  PassivityOptions options_;
  Vector3<double> position_ = Vector3<double>::Zero(), sent_ = Vector3<double>::Zero(), sent_torque_ = Vector3<double>::Zero();
  double energy_ = 0.0, total_ = 0.0, min_ = 0.0, damping_ = 0.0;   // J, J, J, N·s/m
  std::uint64_t damped_ = 0;
  bool has_position_ = false;
};

}  // namespace palpate
