// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>

namespace palpate {

/// Stage of a device between being switched on and being switched off.
enum class DeviceStage {
  closed,
  open,          ///< positions are read, the motors are off
  calibrating,   ///< the zero of the device is off: positions may jump, no force
  arming,        ///< motors on, the force comes up along a ramp
  running,
  stale,         ///< the slow data are late: the force fades while the device goes on
  faulted        ///< no force until it is closed and opened again
};

/// Events. A request can be refused. A fact can not, even in a stage where it has no effect: it may be reported in every tick.
enum class DeviceEvent {
  opened,             ///< request: the device was opened
  arm,                ///< request: motors on
  ramped,             ///< request: the ramp is at its end
  calibrated,         ///< request: the zero is good again
  disarm,             ///< fact: motors off, by the user, overspeed or a debugger's pause
  calibration_lost,   ///< fact: `Calibration` is not `good`
  interrupted,        ///< fact: a gap between ticks or a jump of the position; the ramp begins again
  data_late,          ///< fact: the watchdog of the slow data
  data_fresh,         ///< fact: they are fresh again
  fault,              ///< fact: a read or a write failed, or a force that is no number
  close               ///< fact: the device was closed
};

inline constexpr std::size_t device_stages = 7;
inline constexpr std::size_t device_events = 11;

constexpr char const* to_string(DeviceStage stage) noexcept {
  switch (stage) {
    case DeviceStage::closed: return "closed";
    case DeviceStage::open: return "open";
    case DeviceStage::calibrating: return "calibrating";
    case DeviceStage::arming: return "arming";
    case DeviceStage::running: return "running";
    case DeviceStage::stale: return "stale";
    case DeviceStage::faulted: return "faulted";
  }
  return "unknown";
}

constexpr char const* to_string(DeviceEvent event) noexcept {
  switch (event) {
    case DeviceEvent::opened: return "opened";
    case DeviceEvent::arm: return "arm";
    case DeviceEvent::ramped: return "ramped";
    case DeviceEvent::calibrated: return "calibrated";
    case DeviceEvent::disarm: return "disarm";
    case DeviceEvent::calibration_lost: return "calibration lost";
    case DeviceEvent::interrupted: return "interrupted";
    case DeviceEvent::data_late: return "data late";
    case DeviceEvent::data_fresh: return "data fresh";
    case DeviceEvent::fault: return "fault";
    case DeviceEvent::close: return "close";
  }
  return "unknown";
}

namespace detail {
/// One row for each stage, one column for each event; empty: refused.
inline constexpr auto device_transitions = [] {
  using enum DeviceStage;
  using To = std::optional<DeviceStage>;
  constexpr To none{};
  return std::array<std::array<To, device_events>, device_stages>{{
      //               opened arm     ramped   calibrated disarm       cal. lost    interrupted  data late    data fresh   fault    close
      /* closed */     {{open, none,   none,    none,      closed,      closed,      closed,      closed,      closed,      faulted, closed}},
      /* open */       {{none, arming, none,    none,      open,        calibrating, open,        open,        open,        faulted, closed}},
      /* calibrating */{{none, none,   none,    open,      calibrating, calibrating, calibrating, calibrating, calibrating, faulted, closed}},
      /* arming */     {{none, none,   running, none,      open,        calibrating, arming,      arming,      arming,      faulted, closed}},
      /* running */    {{none, none,   none,    none,      open,        calibrating, arming,      stale,       running,     faulted, closed}},
      /* stale */      {{none, none,   none,    none,      open,        calibrating, arming,      stale,       running,     faulted, closed}},
      /* faulted */    {{none, none,   none,    none,      faulted,     faulted,     faulted,     faulted,     faulted,     faulted, closed}},
  }};
}();
}  // namespace detail

/// Transition of the state machine: the next stage, or empty when the request is refused and the stage stays.
///   closed → open → [calibrating → open →] arming → running ⇄ stale;   any → faulted → closed;   any → closed
/// `running` is reached only from the end of a ramp, or with fresh data after a running device had gone stale. Late data while arming
/// restart the ramp, in every tick in which they are late. After a calibration the device has to be armed again, since the tip may have
/// moved.
/// Cost       a look-up, constexpr.
constexpr std::optional<DeviceStage> next(DeviceStage stage, DeviceEvent event) noexcept {
  return detail::device_transitions[static_cast<std::size_t>(stage)][static_cast<std::size_t>(event)];
}

/// May a force other than zero be written?
constexpr bool may_render(DeviceStage stage) noexcept {
  return stage == DeviceStage::arming || stage == DeviceStage::running || stage == DeviceStage::stale;
}

/// Do positions come in?
constexpr bool is_open(DeviceStage stage) noexcept { return stage != DeviceStage::closed && stage != DeviceStage::faulted; }

/// State machine: holds the stage and applies the transitions above.
/// Cost       a look-up, noexcept, no allocation: allowed in the servo tick. For one thread.
class DeviceLifecycle {
 public:
  constexpr DeviceStage stage() const noexcept { return stage_; }
  constexpr bool may_render() const noexcept { return palpate::may_render(stage_); }

  /// False: the request was refused.
  constexpr bool handle(DeviceEvent event) noexcept {
    std::optional<DeviceStage> const to = next(stage_, event);
    if (to) stage_ = *to;
    return to.has_value();
  }

 private:
  DeviceStage stage_ = DeviceStage::closed;
};

}  // namespace palpate
