// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/haptics/sampled_wall.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace palpate {

/// Options of the safety chain. Defaults depend on the device: one that moves a hand gets careful values, a simulated one has none of
/// these limits, so that an experiment shows the force model as it is.
///
///                    moves a hand                                                        simulated
///   max_force        the smaller of its continuous force and 1 N                         the device's maximum
///   max_torque       max_force at 50 mm, and what the device can                         the device's maximum
///   slew             500 N/s: 500 N/m at 1 m/s                                           none
///   thermal_time     10 s, where the continuous force is known                           none
///   arm_force        0.2 N, and half of max_force, for more than three ticks in a row    arms at once
///   overspeed        1 m/s                                                               none
///   jump             5 mm in a tick, and twice what overspeed allows                     none
///   gap, long_gap    5 and 50 ms, and at least 5 and 50 ticks                            none
///   stale_after      100 ms, or three of the body's ticks, up to 150 ms                  never
///   dead_man         any button, where there are buttons                                 none
///   max_not_finite  10 in a row, 20 within 1 s                                          any number
///   damping          a quarter of its mass over a period, 11 N·s/m for 45 g at 1 kHz, not above its largest   none: observed alone
/// A torque counts as a force at a lever of 50 mm: so far slew, arm_force and damping hold for it too.
struct SafetyOptions {
  std::optional<bool> protects_a_hand{};     ///< none: as the device says, `Capabilities::moves_a_hand`
  std::optional<double> max_force{};         ///< N; never above the device's own maximum
  std::optional<double> max_torque{};        ///< N·m, likewise
  std::optional<double> max_stiffness{};     ///< N/m that the hand may feel of a force that states its stiffness; none: what the device says, see `limits_for`. Infinity: not limited
  std::optional<double> slew{};              ///< N/s, the fastest that a force may change; infinity: not limited
  std::optional<double> thermal_time{};      ///< s, in which the motors warm up; 0: not limited
  std::optional<double> arm_force{};         ///< N; the chain arms where the wanted force is below it
  int arm_ticks = 4;                         ///< for so many ticks in a row
  double tell_waiting = 1.0;                 ///< s, after which an event tells that arming waits; infinity: never
  double ramp = 0.1;                         ///< s, in which the force comes back after a gap or a jump
  std::optional<double> overspeed{};         ///< m/s, of the device; infinity: not limited
  std::optional<double> jump{};              ///< m, of the device in one tick; beyond it the tool was placed, not moved. Infinity: not limited
  std::optional<std::uint32_t> dead_man{};   ///< buttons, one of which has to be held; 0: none
  std::optional<double> gap{};               ///< s between two ticks: the force begins anew, on a ramp
  std::optional<double> long_gap{};          ///< s between two ticks: disarmed
  std::optional<double> stale_after{};       ///< s, the age at which a local model is too old. Until then it is frozen
  double fade = 0.1;                         ///< s, in which the force of one that is too old goes to zero
  double recover = 0.2;                      ///< s, in which it comes back
  std::optional<int> max_not_finite{};      ///< forces or positions in a row that are not finite; one more is a fault
  std::optional<int> max_not_finite_in_window{};   ///< the same, in a row or not, within the window; at most 64
  double not_finite_window = 1.0;            ///< s
  std::optional<double> damping{};           ///< N·s/m, the most that the passivity controller adds; 0: it observes
  double reservoir = 0.005;                  ///< J; see PassivityOptions

  /// Throws `InvalidArgument` for an option that makes no sense.
  void validate() const {
    detail::OptionCheck const require{"SafetyOptions"};
    auto const limit = [&](char const* what, std::optional<double> const& value, char const* unit) {
      if (value) require(*value >= 0.0, what, *value, unit, "give zero or more, infinity for no limit");
    };
    auto const bound = [&](char const* what, std::optional<double> const& value, char const* unit) {   // at 0 no force would ever come
      if (value) require(*value > 0.0, what, *value, unit, "give a number above zero, infinity for no limit");
    };
    auto const time = [&](char const* what, double value) { require(value >= 0.0 && std::isfinite(value), what, value, " s", "give a finite time, zero or more"); };
    limit(".max_force", max_force, " N");
    limit(".max_torque", max_torque, " N m");
    bound(".slew", slew, " N/s");
    bound(".max_stiffness", max_stiffness, " N/m");
    limit(".arm_force", arm_force, " N");
    bound(".overspeed", overspeed, " m/s");
    bound(".jump", jump, " m");
    if (thermal_time) time(".thermal_time", *thermal_time);
    if (damping) require.not_negative(".damping", *damping, " N·s/m");
    require(tell_waiting >= 0.0, ".tell_waiting", tell_waiting, " s", "give zero or more, infinity for never");
    time(".ramp", ramp);
    time(".fade", fade);
    time(".recover", recover);
    bound(".gap", gap, " s");
    bound(".long_gap", long_gap, " s");
    bound(".stale_after", stale_after, " s");
    require.positive(".reservoir", reservoir, " J");
    require(arm_ticks >= 1, ".arm_ticks", arm_ticks, "", "give one or more");
    if (max_not_finite) require(*max_not_finite >= 0, ".max_not_finite", *max_not_finite, "", "give zero or more");
    if (max_not_finite_in_window)
      require(*max_not_finite_in_window >= 0 && *max_not_finite_in_window <= 64, ".max_not_finite_in_window", *max_not_finite_in_window, "", "give 0 to 64");
    time(".not_finite_window", not_finite_window);
  }
};

/// Resolved limits for one device: the options, completed from its capabilities. Infinity: no limit.
struct SafetyLimits {
  static constexpr double lever = 0.05;   // m, of a stylus in a hand: a torque counts as a force there

  double period, max_force, max_torque, max_stiffness, slew, continuous_force, thermal_time, arm_force, ramp, overspeed, jump, gap, long_gap, stale_after,
      fade, recover, damping, reservoir, device_damping, not_finite_window, tell_waiting;
  std::uint32_t dead_man;
  int arm_ticks, max_not_finite, max_not_finite_in_window;
  bool protects_a_hand;
};

/// The limits for this device, whose local models come at `model_rate` Hz. The stiffness is the device's largest or, where it says none, 2 b/T of a damping
/// that is more than a guess. A device that does not tell how it is turned gets no torque: its work would not be known.
/// Throws `InvalidArgument` for options or capabilities that make no sense.
inline SafetyLimits limits_for(SafetyOptions const& options, Capabilities const& device, double model_rate) {
  options.validate();
  require_valid(device);
  constexpr double none = std::numeric_limits<double>::infinity();
  constexpr double max_by_default = 1.0, lightest = 0.045;   // N, kg
  bool const careful = options.protects_a_hand.value_or(device.moves_a_hand);
  double const period = 1.0 / device.rate, device_max = device.max_force;
  double const lasting = device.continuous_force.known() ? device.continuous_force.value : none;
  double const mass = device.mass.known() && device.mass.value > 0.0 ? device.mass.value : lightest;
  double const damping = std::min(0.25 * mass / period, device.max_damping.known() && device.max_damping.value > 0.0 ? device.max_damping.value : none);
  std::uint32_t const any_button = device.buttons >= 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << std::max(device.buttons, 0)) - 1u;
  bool const damping_is_known = device.damping.provenance >= Provenance::datasheet;   // a guess does not pay for energy
  double const stiffest = device.max_stiffness.known() && device.max_stiffness.value > 0.0 ? device.max_stiffness.value
                          : damping_is_known && device.damping.value > 0.0                 ? passive_wall(device.damping, 0.0, period)
                                                                                           : none;
  bool const warms_up = careful && std::isfinite(lasting) && lasting > 0.0;
  double const most = std::min(device_max, options.max_force.value_or(careful ? std::min(lasting, max_by_default) : none));
  double const slew = options.slew.value_or(careful ? 500.0 : none), overspeed = options.overspeed.value_or(careful ? 1.0 : none);
  double const most_torque =
      device.reports_orientation ? std::min<double>(device.max_torque, options.max_torque.value_or(careful ? SafetyLimits::lever * most : none)) : 0.0;
  auto const quickest = [slew](double force) { return std::isfinite(force) && slew > 0.0 ? force / slew : 0.0; };   // s: no fade is faster than the slew limit
  return {.period = period,
          .max_force = most,
          .max_torque = most_torque,
          .max_stiffness = options.max_stiffness.value_or(stiffest),
          .slew = slew,
          .continuous_force = lasting,
          .thermal_time = std::isfinite(lasting) && lasting > 0.0 ? options.thermal_time.value_or(warms_up ? 10.0 : 0.0) : 0.0,
          .arm_force = options.arm_force.value_or(careful ? std::min(0.2, 0.5 * most) : none),
          .ramp = options.ramp,
          .overspeed = overspeed,
          .jump = options.jump.value_or(careful ? std::max(0.005, 2.0 * overspeed * period) : none),
          .gap = options.gap.value_or(careful ? std::max(0.005, 5.0 * period) : none),
          .long_gap = options.long_gap.value_or(careful ? std::max(0.05, 50.0 * period) : none),
          .stale_after = options.stale_after.value_or(careful ? std::clamp(3.0 / model_rate, 0.1, 0.15) : none),
          .fade = std::max({options.fade, quickest(most), quickest(most_torque / SafetyLimits::lever)}),
          .recover = options.recover,
          .damping = options.damping.value_or(careful ? damping : 0.0),
          .reservoir = options.reservoir,
          .device_damping = damping_is_known ? device.damping.value : 0.0,
          .not_finite_window = options.not_finite_window,
          .tell_waiting = options.tell_waiting,
          .dead_man = options.dead_man.value_or(careful ? any_button : 0u),
          .arm_ticks = careful || options.arm_force ? options.arm_ticks : 1,
          .max_not_finite = options.max_not_finite.value_or(careful ? 10 : std::numeric_limits<int>::max()),
          .max_not_finite_in_window = options.max_not_finite_in_window.value_or(careful ? 20 : std::numeric_limits<int>::max()),
          .protects_a_hand = careful};
}

}  // namespace palpate
