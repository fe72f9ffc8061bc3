// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/rotation_vector.hpp>
#include <palpate/device/lifecycle.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/haptics/force_limits.hpp>
#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/safety_event.hpp>
#include <palpate/haptics/safety_options.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace palpate {

/// What the chain is told of a tick when the device was read.
template <RealScalar S>
struct SafetyReading {
  bool works = true;     ///< the device reported no fault
  bool usable = true;    ///< and gave a finite position
  bool fresh = true;     ///< which is new: a device may say that it has no new sample
  Vector3<S> position = Vector3<S>::Zero();   ///< in the device's frame
  Eigen::Quaternion<S> orientation = Eigen::Quaternion<S>::Identity();   ///< device ← tool; one that is no unit quaternion gives no torque
  double seconds = 0.001;                     ///< since the last tick
  double elapsed = std::numeric_limits<double>::infinity();   ///< s since then on a clock, where a tick may come before its time: speed, ramps, fades, warmth go by it
  std::uint32_t buttons = 0;
  Calibration calibration = Calibration::good;
};

/// What it is told of the force that is wanted.
template <RealScalar S>
struct WantedForce {
  Vector3<S> force = Vector3<S>::Zero();   ///< on the hand, world frame
  Vector3<S> torque = Vector3<S>::Zero();  ///< about the tip; not looked at where the device has none
  double elastic = 0.0;                    ///< J, that the rendered model holds at most
  bool inside = false;                     ///< the tip is in the tissue: nothing arms there
  bool valid = true;                       ///< the tissue has answered once
  bool diverged = false;                   ///< the body has diverged
  double age = 0.0;                        ///< s, of the local model
  bool quiet = false;                      ///< the host wants the hand to feel nothing now: a clutch
};

/// Limits every force before it is written to a device, in this order:
///   finite check → passivity → mapping to the device → magnitude → slew → thermal → ramp
/// A torque goes the same way beside it, but for the thermal limit, which is not known: it arms, fades and becomes zero with the force, and if one of the two
/// is no number both are zero.
/// Arms       when every condition of `ArmingWaitsFor` holds and the wanted force has been small for some ticks in a row. A tool that
///            begins in the tissue stays disarmed until it has left it. `waits_for()` names the missing condition, and an event reports
///            it where it lasts.
/// Disarms    when no dead-man button is held, at overspeed, after a long gap, without calibration, when the body diverges. A fault
///            disarms until the next session.
/// Stages     those of DeviceLifecycle. On leaving a stage that may render, zero is written in the same tick, without slew; every other
///            change is slewed.
/// Units      SI; forces enter in the world frame and leave in the device's frame.
/// Source     order and numbers: practice of haptic libraries; the passivity controller \cite hannaford2002.
/// Invariant  |out| ≤ max_force; |out − the last out| ≤ slew · period, of a tick before its time slew · elapsed, unless out is zero; out is finite. Of the
///            torque likewise, with max_torque and the slew at `SafetyLimits::lever`.
/// Cost       O(1), noexcept, no allocation: allowed in the servo tick.
template <RealScalar S>
class SafetyChain {
 public:
  using Scalar = S;

  /// A session begins: disarmed, with limits for the device that is open now. Throws `InvalidArgument` as `limits_for`. A simulated device goes on where
  /// the last session ended; a hand was let go in between.
  void begin(SafetyOptions const& options, Capabilities const& device, double model_rate, WorkspaceMapping<S> const& mapping = {}) {
    SafetyLimits const before = limits_;
    limits_ = limits_for(options, device, model_rate);
    double const felt = static_cast<double>(mapping.felt_stiffness(S(1)));   // κ s: a damping of the scene is felt so much stronger
    double const work = static_cast<double>(mapping.force_scale() / mapping.world_from_device().scale());   // κ/s: the hand's joules in one of the scene
    if (limits_.protects_a_hand || before.period != limits_.period || before.reservoir != limits_.reservoir || before.damping != limits_.damping ||
        felt != felt_ || work != work_ || (before.max_torque > 0.0) != (limits_.max_torque > 0.0)) {
      earlier_energy_ += work_ * passivity_.energy();
      double const lever = limits_.max_torque > 0.0 ? static_cast<double>(mapping.world_from_device().scale()) * limits_.lever : 0.0;
      passivity_ = PassivityController<S>({.period = limits_.period,
                                           .max_damping = limits_.damping / felt,
                                           .device_damping = limits_.device_damping / felt,
                                           .lever = lever,
                                           .reservoir = limits_.reservoir / work});
    }
    felt_ = felt, work_ = work;
    if (limits_.thermal_time > 0.0 && (before.continuous_force != limits_.continuous_force || before.thermal_time != limits_.thermal_time))   // else they are as warm as they were
      thermal_.emplace(ThermalOptions{.continuous_force = limits_.continuous_force, .time = limits_.thermal_time});
    if (!(limits_.thermal_time > 0.0)) thermal_.reset();
    saturation_ = {.max_force = limits_.max_force, .device_max_force = device.max_force, .protects_a_hand = limits_.protects_a_hand};
    stage_ = {};
    static_cast<void>(stage_.handle(DeviceEvent::opened));
    gain_ = 0.0;
    small_ticks_ = not_finite_in_a_row_ = 0;
    not_finite_in_all_ = 0;
    clock_ = waited_ = 0.0;
    missing_ = waits_for_ = ArmingWaitsFor::sample;
    told_waiting_ = false;
    has_position_ = has_sample_ = held_before_ = stale_ = diverged_ = interrupted_ = too_fast_ = false;
    since_sample_ = since_checked_ = way_seconds_ = 0.0;
    out_.setZero(), torque_.setZero();
    event_count_ = 0;
  }

  /// The largest stiffness [N/m, in the scene] that a force that wants `wanted` may render; an event reports it where that is less. After
  /// `begin`.
  double stiffest(double wanted) noexcept {
    double const most = limits_.max_stiffness / felt_;
    if (!(wanted > most)) return wanted;
    tell(SafetyEvent::stiffness_clamped);
    return most;
  }

  /// The device was read. After it `interrupted()` says whether what was known of the hand's motion still holds.
  void read(SafetyReading<S> const& reading) noexcept {
    seconds_ = reading.seconds >= 0.0 ? reading.seconds : std::numeric_limits<double>::infinity();   // a time that is none is a gap
    elapsed_ = reading.elapsed >= 0.0 ? reading.elapsed : std::numeric_limits<double>::infinity();   // a clock that tells no time keeps no force up
    passed_ = std::isfinite(elapsed_) ? elapsed_ : seconds_;
    if (thermal_ && std::isfinite(passed_)) thermal_->add(static_cast<double>(out_.norm()), passed_);
    interrupted_ = false;
    since_sample_ += passed_, since_checked_ += passed_;
    if (std::isfinite(passed_)) clock_ += passed_;
    usable_ = reading.works && reading.usable;
    missing_ = faulted() ? ArmingWaitsFor::new_session : ArmingWaitsFor::nothing;
    if (!usable_) miss(ArmingWaitsFor::sample);
    if (!reading.works) fault();
    if (reading.works && !reading.usable) count_not_finite();
    check_buttons(reading.buttons);
    if (reading.calibration != Calibration::good) {
      if (stage_.stage() != DeviceStage::calibrating) disarm(DeviceEvent::calibration_lost, SafetyEvent::not_calibrated, ArmingWaitsFor::calibration);
      miss(ArmingWaitsFor::calibration);
    } else if (stage_.stage() == DeviceStage::calibrating) {
      static_cast<void>(stage_.handle(DeviceEvent::calibrated));
    }
    check_gap();
    if (usable_) check_motion(reading.position, reading.fresh);
    turns_ = usable_ && limits_.max_torque > 0.0 && std::abs(reading.orientation.norm() - S(1)) < S(0.01);   // false for what is not finite
    if (turns_) orientation_ = reading.orientation.normalized();
    if (!has_sample_) miss(ArmingWaitsFor::sample);
    if (interrupted_ && limits_.protects_a_hand) passivity_.skip_way();   // nobody pushed the tip there
  }

  /// The force to write, in the device's frame, for the one that is wanted; torque() goes with it.
  Vector3<S> operator()(WantedForce<S> const& wanted, WorkspaceMapping<S> const& mapping) noexcept {
    check_model(wanted);
    Vector3<S> force = Vector3<S>::Zero(), torque = Vector3<S>::Zero();
    if (usable_ && !wanted.diverged && wanted.valid) {
      if (is_finite(wanted.force) && (!turns_ || is_finite(wanted.torque))) {
        force = wanted.force, not_finite_in_a_row_ = 0;
        if (turns_) torque = wanted.torque;
      } else {
        count_not_finite(), ++counts_.not_finite, miss(ArmingWaitsFor::finite_force);
      }
    }
    double const asked = static_cast<double>(stable_norm(mapping.force_to_device(force)));   // damping may not make it look small
    double const asked_torque = static_cast<double>(stable_norm(mapping.torque_to_device(torque)));
    if (usable_) force = made_passive(wanted, force, torque, mapping);
    force = limited_to_maximum(mapping.force_to_device(force));
    torque = mapping.torque_to_device(torque);
    if (stable_norm(torque) > static_cast<S>(limits_.max_torque)) ++counts_.torques_limited;
    torque = limited(torque, static_cast<S>(limits_.max_torque));
    if (wanted.inside && limits_.protects_a_hand) miss(ArmingWaitsFor::tool_outside);
    arm(std::max(asked, asked_torque / limits_.lever));
    wait();
    if (wanted.valid) advance_ramp(wanted.quiet);
    bool const fades = (stale_ || wanted.quiet) && !interrupted_ && !(is_zero(out_) && is_zero(torque_));   // slower than the ramp, where slew says so
    if (usable_ && stage_.may_render() && !wanted.diverged && not_finite_in_a_row_ == 0 && (gain_ > 0.0 || fades)) {
      out_ = ramped(out_, force, thermal_ ? thermal_->limit(limits_.max_force) : limits_.max_force, limits_.slew);
      torque_ = ramped(torque_, torque, limits_.max_torque, limits_.lever * limits_.slew);
      if (gain_ < 1.0) ++counts_.ramped;
    } else {
      if (!is_zero(force) || !is_zero(torque)) ++counts_.disarmed;
      out_.setZero(), torque_.setZero();
    }
    passivity_.sent(mapping.force_to_world(out_), mapping.torque_to_world(torque_));
    return out_;
  }
  /// N·m about the tip, in the device's frame, with the force of this tick.
  Vector3<S> const& torque() const noexcept { return torque_; }

  /// The device could not be written to.
  void write_failed() noexcept { fault(); }

  /// True in a tick after a gap or a jump: positions before and after it give no velocity.
  bool interrupted() const noexcept { return interrupted_; }
  DeviceStage stage() const noexcept { return stage_.stage(); }
  bool faulted() const noexcept { return stage_.stage() == DeviceStage::faulted; }
  /// What arming waits for now, the foremost; `nothing` while the hand may feel.
  ArmingWaitsFor waits_for() const noexcept { return waits_for_; }
  /// 0 to 1, the share of the force that was written.
  double gain() const noexcept { return gain_; }
  SafetyLimits const& limits() const noexcept { return limits_; }
  SafetyCounts const& counts() const noexcept { return counts_; }
  /// Of this session.
  ForceSaturation const& saturation() const noexcept { return saturation_; }
  PassivityController<S> const& passivity() const noexcept { return passivity_; }
  /// J, that the hand gave in all sessions.
  double energy() const noexcept { return earlier_energy_ + work_ * passivity_.energy(); }
  /// 0 cold, 1 as warm as the continuous force makes the motors; 0 where it is not known.
  double warmth() const noexcept { return thermal_ ? thermal_->warmth() : 0.0; }

  /// The oldest event not yet taken; none when there is nothing more. Keeps 16; a tick adds at most 6.
  std::optional<SafetyEvent> pop_event() noexcept {
    if (event_count_ == 0) return std::nullopt;
    SafetyEvent const first = events_[0];
    std::copy(events_.begin() + 1, events_.begin() + static_cast<std::ptrdiff_t>(event_count_), events_.begin());
    --event_count_;
    return first;
  }

 private:
  void tell(SafetyEvent event) noexcept {
    if (event_count_ < events_.size()) events_[event_count_++] = event;
  }

  /// Nothing arms in this tick.
  void miss(ArmingWaitsFor what) noexcept {
    if (missing_ == ArmingWaitsFor::nothing || what < missing_) missing_ = what;
  }

  void fault() noexcept {
    usable_ = false;
    miss(ArmingWaitsFor::new_session);
    waits_for_ = ArmingWaitsFor::new_session;
    if (faulted()) return;
    static_cast<void>(stage_.handle(DeviceEvent::fault));
    gain_ = 0.0;
    tell(SafetyEvent::fault);
  }
  /// Motors off in this tick; `event` is told where they were on.
  void disarm(DeviceEvent why, SafetyEvent event, ArmingWaitsFor what) noexcept {
    bool const rendered = stage_.may_render();
    static_cast<void>(stage_.handle(why));
    miss(what);
    small_ticks_ = 0;
    gain_ = 0.0;
    if (rendered) tell(event);
  }
  /// Begins the force anew, on a ramp.
  void interrupt(SafetyEvent event) noexcept {
    interrupted_ = true, too_fast_ = false;
    miss(ArmingWaitsFor::steady_ticks);
    if (stage_.may_render()) tell(event);
    static_cast<void>(stage_.handle(DeviceEvent::interrupted));
    stale_ = false;
    gain_ = 0.0;
    small_ticks_ = 0;
  }

  void count_not_finite() noexcept {
    if (not_finite_in_a_row_ == 0 && stage_.may_render()) tell(SafetyEvent::not_finite);
    if (not_finite_in_a_row_ >= limits_.max_not_finite || too_many_in_window()) fault();
    if (not_finite_in_a_row_ < std::numeric_limits<int>::max()) ++not_finite_in_a_row_;
  }

  /// Counts a value that is not finite. True if more than the n allowed fall into the window: the one n before it is inside.
  bool too_many_in_window() noexcept {
    auto const most = static_cast<std::uint64_t>(limits_.max_not_finite_in_window);
    std::uint64_t const now = not_finite_in_all_++;
    not_finite_at_[now % not_finite_at_.size()] = clock_;
    return most < not_finite_at_.size() && now >= most && clock_ - not_finite_at_[(now - most) % not_finite_at_.size()] <= limits_.not_finite_window;
  }

  void check_buttons(std::uint32_t buttons) noexcept {
    if (limits_.dead_man == 0 || faulted()) return;
    bool const held = (buttons & limits_.dead_man) != 0;
    if (!held) {
      if (held_before_) disarm(DeviceEvent::disarm, SafetyEvent::dead_man_released, ArmingWaitsFor::button);
      miss(ArmingWaitsFor::button);
    }
    held_before_ = held;
  }

  void check_gap() noexcept {
    if (!has_position_ || faulted()) return;
    if (seconds_ > limits_.long_gap) {
      interrupted_ = true;
      disarm(DeviceEvent::disarm, SafetyEvent::long_gap, ArmingWaitsFor::steady_ticks);
    } else if (seconds_ > limits_.gap) {
      interrupt(SafetyEvent::tick_gap);
    }
  }

  /// Checks jump and speed against the time since the last new sample; a repeated sample is not checked.
  void check_motion(Vector3<S> const& position, bool fresh) noexcept {
    if (!has_position_ || (interrupted_ && fresh)) checked_ = position, since_checked_ = 0.0;
    if (has_position_ && !interrupted_ && fresh) {
      double const way = static_cast<double>(stable_norm(position - checked_)), ticks = std::max(1.0, since_checked_ / limits_.period);
      if (way > limits_.jump * ticks)
        interrupt(SafetyEvent::position_jump);
      else if (way > limits_.overspeed * std::max(since_checked_, limits_.period))
        disarm(DeviceEvent::disarm, SafetyEvent::overspeed, ArmingWaitsFor::slower_hand), too_fast_ = true;
      else if (!(since_checked_ < 0.999 * limits_.period))
        too_fast_ = false;
      if (interrupted_ || !(since_checked_ < 0.999 * limits_.period)) checked_ = position, since_checked_ = 0.0;   // ticks may come before their time
    }
    if (too_fast_) miss(ArmingWaitsFor::slower_hand);   // until a new sample tells of a slower one
    position_ = position;
    has_position_ = true;
    if (fresh) has_sample_ = true, way_seconds_ = std::exchange(since_sample_, 0.0);
  }

  void check_model(WantedForce<S> const& wanted) noexcept {
    if (!wanted.valid) miss(ArmingWaitsFor::answer_of_body);
    if (wanted.diverged) {
      if (!diverged_) disarm(DeviceEvent::disarm, SafetyEvent::body_diverged, ArmingWaitsFor::undiverged_body);
      miss(ArmingWaitsFor::undiverged_body);
    }
    diverged_ = wanted.diverged;
    bool const stale = wanted.age > limits_.stale_after;
    if (stale) miss(ArmingWaitsFor::fresh_model);
    if (stale != stale_ && (stage_.stage() == DeviceStage::running || stage_.stage() == DeviceStage::stale)) {
      static_cast<void>(stage_.handle(stale ? DeviceEvent::data_late : DeviceEvent::data_fresh));
      tell(stale ? SafetyEvent::model_stale : SafetyEvent::model_fresh);
      recovers_ = !stale;
    }
    stale_ = stale;
  }

  Vector3<S> made_passive(WantedForce<S> const& wanted, Vector3<S> const& force, Vector3<S>& torque, WorkspaceMapping<S> const& mapping) noexcept {
    Vector3<S> turned = Vector3<S>::Zero();
    if (turns_) {
      if (has_turn_) turned = mapping.world_from_device().direction(rotation_vector<S>(orientation_ * turned_from_.conjugate()));
      turned_from_ = orientation_, has_turn_ = true;
    }
    auto const damped = passivity_.damped();
    Vector3<S> const place = mapping.velocity_to_world(position_);   // the hand's own way, also while a clutch holds the tip
    Vector3<S> const result = passivity_(place, force, wanted.elastic, turned, torque, way_seconds_);
    counts_.damped += passivity_.damped() - damped;
    return result;
  }

  Vector3<S> limited_to_maximum(Vector3<S> const& force) noexcept {
    S const most = static_cast<S>(limits_.max_force);
    if (S const wanted = stable_norm(force); wanted > most) {
      ++counts_.limited;
      ++saturation_.ticks;
      saturation_.max_wanted = std::fmax(saturation_.max_wanted, static_cast<double>(wanted));
    }
    return limited(force, most);
  }

  void arm(double wanted) noexcept {
    if (!(wanted <= limits_.arm_force)) miss(ArmingWaitsFor::small_force);
    if (stage_.stage() != DeviceStage::open || missing_ != ArmingWaitsFor::nothing) {
      small_ticks_ = 0;
      return;
    }
    if (++small_ticks_ < limits_.arm_ticks) return;
    static_cast<void>(stage_.handle(DeviceEvent::arm));
    static_cast<void>(stage_.handle(DeviceEvent::ramped));   // the force is small: it needs no ramp
    gain_ = 1.0;
    recovers_ = false;
    tell(SafetyEvent::armed);
  }

  /// Updates the reason reported. While the small ticks are counted the last reason stays: a force that oscillates around the limit is
  /// one reason.
  void wait() noexcept {
    ArmingWaitsFor const now = stage_.may_render() ? ArmingWaitsFor::nothing : missing_ != ArmingWaitsFor::nothing ? missing_ : waits_for_;
    if (now != waits_for_) {
      waits_for_ = now;
      waited_ = 0.0;
      told_waiting_ = false;
    } else if (double const passed = std::min(passed_, limits_.gap); std::isfinite(passed)) {   // a program that stands still does not wait
      waited_ += passed;
    }
    if (told_waiting_ || now == ArmingWaitsFor::nothing || faulted() || !(waited_ > limits_.tell_waiting)) return;
    told_waiting_ = true;
    tell(SafetyEvent::arming_waits);
  }

  /// s: a late tick does not bring the force back faster, nor do early ones.
  double tick() const noexcept { return std::min(elapsed_, limits_.period); }

  void advance_ramp(bool quiet) noexcept {
    if (!stage_.may_render() || interrupted_) return;
    bool const down = stale_ || quiet;
    double const time = down ? limits_.fade : recovers_ ? limits_.recover : limits_.ramp;
    double const passed = down ? passed_ : std::min(seconds_, tick()), step = time > passed ? passed / time : 1.0;
    if (down) {
      gain_ = std::max(0.0, gain_ - step);
      return;
    }
    gain_ = std::min(1.0, gain_ + step);
    if (gain_ < 1.0) return;
    recovers_ = false;
    if (stage_.stage() == DeviceStage::arming) static_cast<void>(stage_.handle(DeviceEvent::ramped));
  }

  /// Slew, thermal limit and ramp of a force, or a torque, at most `warm`, after `last`. The slew limit holds for what is written, so it takes into account by
  /// how much thermal limit and ramp are about to shrink the largest one, and they wait where that would be too fast.
  Vector3<S> ramped(Vector3<S> const& last, Vector3<S> const& wanted, double warm, double slew) noexcept {
    double const most = slew * tick(), before = static_cast<double>(last.norm());
    double const reach = std::isfinite(most) ? std::max(gain_ * warm, before - most) : gain_ * warm, outside = before - reach;
    Vector3<S> next = static_cast<S>(gain_) * wanted;
    if (std::isfinite(most)) {
      Vector3<S> const slow = slewed(last, next, static_cast<S>(std::max(0.0, most - std::max(0.0, outside))));
      if (slow != next) ++counts_.slewed;
      next = slow;
    }
    if (!std::isfinite(reach) || !(next.norm() > static_cast<S>(reach))) return next;
    if (gain_ == 1.0) ++counts_.cooled;
    return limited(next, static_cast<S>(reach));
  }

  SafetyLimits limits_{};
  DeviceLifecycle stage_{};
  PassivityController<S> passivity_{};
  std::optional<ThermalLimit> thermal_{};
  SafetyCounts counts_{};
  ForceSaturation saturation_{};
  ArmingWaitsFor missing_ = ArmingWaitsFor::sample, waits_for_ = ArmingWaitsFor::sample;   // in this tick; for arming
  double waited_ = 0.0;   // s
  std::array<double, 65> not_finite_at_{};   // s of the session, of the last ones that were not finite
  std::uint64_t not_finite_in_all_ = 0;
  double clock_ = 0.0;   // s of the session
  double gain_ = 0.0, seconds_ = 0.0, elapsed_ = 0.0, passed_ = 0.0, since_sample_ = 0.0, since_checked_ = 0.0, way_seconds_ = 0.0, earlier_energy_ = 0.0;
  double felt_ = 1.0, work_ = 1.0;   // κ s and κ/s of the mapping
  Vector3<S> out_ = Vector3<S>::Zero(), torque_ = Vector3<S>::Zero(), position_ = Vector3<S>::Zero(), checked_ = Vector3<S>::Zero();
  Eigen::Quaternion<S> orientation_ = Eigen::Quaternion<S>::Identity(), turned_from_ = Eigen::Quaternion<S>::Identity();   // now; when work was counted last
  bool turns_ = false, has_turn_ = false;   // there is an orientation in this tick; there was ever one
  int small_ticks_ = 0, not_finite_in_a_row_ = 0;
  bool usable_ = false, told_waiting_ = false, has_position_ = false, has_sample_ = false, held_before_ = false, stale_ = false, diverged_ = false, interrupted_ = false, recovers_ = false, too_fast_ = false;
  std::array<SafetyEvent, 16> events_{};
  std::size_t event_count_ = 0;
};

}  // namespace palpate
