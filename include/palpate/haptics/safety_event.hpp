// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>

namespace palpate {

/// What the safety chain did of its own accord; told once when it begins, not in every tick.
enum class SafetyEvent {
  armed,              ///< the hand feels from now on
  arming_waits,       ///< for longer than `SafetyOptions::tell_waiting`, for what `waits_for()` says; told again when that has changed
  dead_man_released,  ///< no button is held any more
  tick_gap,           ///< two ticks were far apart: the force comes back on a ramp
  long_gap,           ///< they were so far apart that the chain disarmed
  position_jump,      ///< as after a calibration: the force comes back on a ramp
  overspeed,          ///< the chain disarmed
  not_calibrated,     ///< the chain disarmed
  model_stale,        ///< the local model is too old: the force fades
  model_fresh,        ///< it is not any more: the force comes back
  body_diverged,       ///< the body diverged: the chain disarmed
  not_finite,         ///< a force or position that is no number: zero in this tick
  stiffness_clamped,  ///< the force would be felt stiffer than the device stands, as in a scene that is enlarged: it renders less from now on
  fault               ///< no force until the device is opened again
};

constexpr char const* to_string(SafetyEvent event) noexcept {
  switch (event) {
    case SafetyEvent::armed: return "armed";
    case SafetyEvent::arming_waits: return "arming waits";
    case SafetyEvent::dead_man_released: return "dead-man button released";
    case SafetyEvent::tick_gap: return "gap between ticks";
    case SafetyEvent::long_gap: return "long gap between ticks";
    case SafetyEvent::position_jump: return "jump of the position";
    case SafetyEvent::overspeed: return "overspeed";
    case SafetyEvent::not_calibrated: return "not calibrated";
    case SafetyEvent::model_stale: return "local model stale";
    case SafetyEvent::model_fresh: return "local model fresh";
    case SafetyEvent::body_diverged: return "body diverged";
    case SafetyEvent::not_finite: return "not a number";
    case SafetyEvent::stiffness_clamped: return "stiffness clamped";
    case SafetyEvent::fault: return "fault";
  }
  return "unknown";
}

/// What arming waits for: of several missing conditions, the first in this order. While all hold, but not yet for
/// `SafetyOptions::arm_ticks` in a row, it is the last one that was missing.
enum class ArmingWaitsFor {
  nothing,         ///< it is armed
  new_session,     ///< after a fault
  sample,          ///< of the hand, new and finite
  calibration,     ///< of the device
  steady_ticks,    ///< there was a gap between ticks, or a jump of the position
  slower_hand,     ///< it is above the limit of speed
  undiverged_body,   ///< it has diverged
  answer_of_body,  ///< there is none yet
  fresh_model,     ///< the last one is too old, or the device has had no new sample for so long
  tool_outside,    ///< the tip is in the tissue
  button,          ///< none of `SafetyOptions::dead_man` is held
  finite_force,    ///< the wanted one is no number
  small_force      ///< the wanted one is above `SafetyLimits::arm_force`: an overlay, or the weight of a tool. `SafetyOptions::arm_force` can be raised
};

constexpr char const* to_string(ArmingWaitsFor what) noexcept {
  switch (what) {
    case ArmingWaitsFor::nothing: return "nothing";
    case ArmingWaitsFor::new_session: return "a new session, after a fault";
    case ArmingWaitsFor::sample: return "a new sample of the hand";
    case ArmingWaitsFor::calibration: return "a calibrated device";
    case ArmingWaitsFor::steady_ticks: return "ticks without gaps and jumps";
    case ArmingWaitsFor::slower_hand: return "a slower hand";
    case ArmingWaitsFor::undiverged_body: return "a body that has not diverged";
    case ArmingWaitsFor::answer_of_body: return "the first answer of the body";
    case ArmingWaitsFor::fresh_model: return "a fresh local model";
    case ArmingWaitsFor::tool_outside: return "the tool to leave the tissue";
    case ArmingWaitsFor::button: return "a dead-man button to be held";
    case ArmingWaitsFor::finite_force: return "a force that is a number";
    case ArmingWaitsFor::small_force: return "a wanted force below the one that arms";
  }
  return "unknown";
}

/// How often each stage of the chain acted.
struct SafetyCounts {
  std::uint64_t not_finite = 0;   ///< forces that were not finite and became zero
  std::uint64_t damped = 0;       ///< forces that the passivity controller added to
  std::uint64_t limited = 0;      ///< forces shortened to the maximum
  std::uint64_t torques_limited = 0;   ///< torques, likewise
  std::uint64_t slewed = 0;       ///< forces and torques that would have changed too fast
  std::uint64_t cooled = 0;       ///< forces shortened because the motors are warm
  std::uint64_t ramped = 0;       ///< ticks with a share of the force, on a ramp or a fade
  std::uint64_t disarmed = 0;     ///< ticks in which a force was wanted and none was written
};

/// Saturation of a session: how far the limit of force shortened what was wanted. Forces in the device's frame [N]; `to_text` puts it in
/// words.
struct ForceSaturation {
  double max_force = std::numeric_limits<double>::infinity();          ///< the most that is written, `SafetyLimits::max_force`
  double device_max_force = std::numeric_limits<double>::infinity();   ///< the most that the device can
  bool protects_a_hand = false;                                        ///< then max_force is at most 1 N unless the host says otherwise
  std::uint64_t ticks = 0;                                             ///< in which the force was shortened to max_force
  double max_wanted = 0.0;                                             ///< the largest of those before it was shortened
};

}  // namespace palpate
