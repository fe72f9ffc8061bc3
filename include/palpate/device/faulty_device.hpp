// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/wrapped_device.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace palpate {

/// What can go wrong with a device.
enum class FaultKind {
  disconnected,            ///< reads and writes say so
  fault,                   ///< likewise
  stale,                   ///< reads say so, and what the hand did meanwhile is lost
  write_fails,             ///< writes alone say `fault`
  position_not_finite,
  velocity_not_finite,
  jump,                    ///< the position is `shift` away, as after a calibration
  button_chatter,          ///< button number `size` is pressed and released in turn
  gap,                     ///< the host misses `size` ticks: the hand is that much further
  stall                    ///< the read takes `size` seconds longer: sleeps, for tests against a clock alone
};

/// One of them, from a tick on.
struct PlannedFault {
  FaultKind kind = FaultKind::fault;
  std::uint64_t tick = 0;     ///< of its first read; 0 is the first
  std::uint64_t ticks = 1;    ///< how many it lasts; 0: until `heal()`
  double size = 0.0;          ///< gap: ticks; stall: s; button_chatter: which button
  Vector3<double> shift = Vector3<double>::Zero();   ///< jump: m
};

/// Fault injection: a device that fails in the ticks of a plan, to test how a host responds.
///   FaultyDevice device(ScriptedDevice<double>(path), {{.kind = FaultKind::stale, .tick = 100, .ticks = 20},
///                                                      {.kind = FaultKind::disconnected, .tick = 500, .ticks = 0}});
/// Ticks count in reads; a write belongs to the read before it. Of several faults at once, disconnected comes before fault, and the
/// others add up. The inner device is read in every tick, whatever is reported: its time continues. A fault that begins is in
/// `pop_fault`, with code −1.
/// Errors     `InvalidArgument` for a size without meaning.
/// Cost       as the device's, and a check of each fault of the plan; noexcept, no allocation.
template <class Device, RealScalar S = double>
  requires HapticDevice<Device, S>
class FaultyDevice : public detail::WrappedDevice<Device, S> {
  using Wrapped = detail::WrappedDevice<Device, S>;
  using Wrapped::device_;

 public:
  FaultyDevice(Device device, std::vector<PlannedFault> plan) : Wrapped(std::move(device)), plan_(std::move(plan)) {
    for (PlannedFault const& planned : plan_) {
      bool const good = planned.kind == FaultKind::gap              ? planned.size >= 1.0 && planned.size <= 1e6
                        : planned.kind == FaultKind::stall          ? planned.size >= 0.0 && planned.size <= 60.0
                        : planned.kind == FaultKind::button_chatter ? planned.size >= 0.0 && planned.size < 32.0
                                                                    : true;
      if (!good)
        throw InvalidArgument(detail::message("FaultyDevice: the fault at tick ", planned.tick, " has .size = ", planned.size,
                                              "; give a gap 1 to 1e6 ticks, a stall 0 to 60 s, a chatter a button from 0 to 31"));
      if (!is_finite(planned.shift))
        throw InvalidArgument(detail::message("FaultyDevice: the fault at tick ", planned.tick, " has a .shift that is not finite; give metres"));
    }
    std::stable_sort(plan_.begin(), plan_.end(), [](PlannedFault const& a, PlannedFault const& b) { return a.tick < b.tick; });
  }

  DeviceStatus read(DeviceState<S>& state) noexcept {
    if (read_any_) ++tick_;
    read_any_ = true;
    DeviceState<S> now = state;
    if (PlannedFault const* const gap = active(FaultKind::gap)) {
      for (int lost = 0; lost < static_cast<int>(gap->size); ++lost) read_inner(now);
    }
    DeviceStatus const status = read_inner(now);
    if (PlannedFault const* const stall = active(FaultKind::stall)) std::this_thread::sleep_for(std::chrono::duration<double>(stall->size));
    if (active(FaultKind::disconnected) != nullptr) return DeviceStatus::disconnected;
    if (active(FaultKind::fault) != nullptr) return DeviceStatus::fault;
    if (!is_usable(status)) return status;
    if (active(FaultKind::stale) != nullptr) return DeviceStatus::stale;
    S const not_a_number = std::numeric_limits<S>::quiet_NaN();
    for (PlannedFault const& planned : plan_) {
      if (!is_active(planned)) continue;
      if (planned.kind == FaultKind::jump) now.position += planned.shift.template cast<S>();
      if (planned.kind == FaultKind::position_not_finite) now.position.x() = not_a_number;
      if (planned.kind == FaultKind::velocity_not_finite) now.velocity.setConstant(not_a_number);
      if (planned.kind == FaultKind::button_chatter && (tick_ - planned.tick) % 2 == 0)
        now.buttons ^= std::uint32_t{1} << static_cast<unsigned>(planned.size);
    }
    state = now;
    return status;
  }

  DeviceStatus write(Wrench<S> const& wrench) noexcept {
    DeviceStatus const status = device_.write(wrench);
    if (active(FaultKind::disconnected) != nullptr) return DeviceStatus::disconnected;
    if (active(FaultKind::fault) != nullptr || active(FaultKind::write_fails) != nullptr) return DeviceStatus::fault;
    return status;
  }

  /// Injected ones first.
  std::optional<DeviceFault> pop_fault() noexcept {
    for (; told_ < plan_.size(); ++told_) {
      PlannedFault const& planned = plan_[told_];
      bool const disconnected = planned.kind == FaultKind::disconnected;
      if (!disconnected && planned.kind != FaultKind::fault && planned.kind != FaultKind::write_fails) continue;
      if (!read_any_ || healed_ || tick_ < planned.tick) break;   // the later ones have not begun either
      ++told_;
      return DeviceFault{.status = disconnected ? DeviceStatus::disconnected : DeviceStatus::fault,
                         .native_code = -1,
                         .what = disconnected ? "injected: the device is gone" : "injected: the device failed"};
    }
    if constexpr (ReportsFaults<Device>) return device_.pop_fault();
    return std::nullopt;
  }

  /// Suspends the plan until `rewind()`.
  void heal() noexcept { healed_ = true; }
  /// The plan starts over; the inner device does not.
  void rewind() noexcept {
    tick_ = 0;
    told_ = 0;
    read_any_ = healed_ = false;
  }
  /// Of the last read.
  std::uint64_t tick() const noexcept { return tick_; }
  std::vector<PlannedFault> const& plan() const noexcept { return plan_; }

 private:
  bool is_active(PlannedFault const& planned) const noexcept {
    return !healed_ && read_any_ && tick_ >= planned.tick && (planned.ticks == 0 || tick_ - planned.tick < planned.ticks);
  }
  PlannedFault const* active(FaultKind kind) const noexcept {
    for (PlannedFault const& planned : plan_)
      if (planned.kind == kind && is_active(planned)) return &planned;
    return nullptr;
  }
  DeviceStatus read_inner(DeviceState<S>& state) noexcept {
    state.position = position_, state.buttons = buttons_;   // as the device left them, whatever it leaves
    if (!is_finite(state.velocity)) state.velocity = velocity_;
    DeviceStatus const status = device_.read(state);
    position_ = state.position, velocity_ = state.velocity, buttons_ = state.buttons;
    return status;
  }

  std::vector<PlannedFault> plan_;
  std::uint64_t tick_ = 0;
  std::size_t told_ = 0;
  bool read_any_ = false, healed_ = false;
  Vector3<S> position_ = Vector3<S>::Zero(), velocity_ = Vector3<S>::Zero();
  std::uint32_t buttons_ = 0;
};

}  // namespace palpate
