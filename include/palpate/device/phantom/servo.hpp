// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/event_ring.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/driver.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/phantom/control_thread.hpp>
#include <palpate/device/phantom/library.hpp>
#include <palpate/device/phantom/options.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace palpate {

/// What happened in the driver's thread since the device was opened.
struct PhantomCounts {
  std::uint64_t ticks = 0;
  std::uint64_t unreadable = 0;      ///< ticks whose state was not complete or not finite
  std::uint64_t force_errors = 0;    ///< the driver switched the force off for a moment
  std::uint64_t misuses = 0;         ///< the driver took a call as wrong
  std::uint64_t unattended = 0;      ///< ticks without force because nobody had written one for a while
  std::uint64_t jumps = 0, gaps = 0; ///< of the position and of the clock: the force began at zero again
};

namespace detail::phantom {

/// What the library gives for one tick, in its own units.
struct NativeState {
  std::array<double, 3> position{};           // mm
  std::array<double, 3> velocity{};           // mm/s
  std::array<double, 3> angular_velocity{};   // rad/s
  std::array<double, 16> transform{};         // 4 × 4, translation in mm
  int buttons = 0;
};

/// How the sixteen numbers lie: papers and libraries do not agree.
enum class TransformOrder { by_columns, by_rows };

/// The order in which the translation is the position; nothing when the position is too near to the origin to tell, or neither fits.
inline std::optional<TransformOrder> order_of(NativeState const& native) noexcept {
  auto const fits = [&](std::size_t x, std::size_t y, std::size_t z) {
    return std::abs(native.transform[x] - native.position[0]) <= 1e-3 && std::abs(native.transform[y] - native.position[1]) <= 1e-3 &&
           std::abs(native.transform[z] - native.position[2]) <= 1e-3;
  };
  bool const columns = fits(12, 13, 14), rows = fits(3, 7, 11);
  if (columns == rows) return std::nullopt;
  return columns ? TransformOrder::by_columns : TransformOrder::by_rows;
}

/// In SI units; false, and nothing changed, when position or velocity are not finite. A rotation that is none leaves the orientation as it was.
/// The frame is the device's: x to the right, y up, z towards the user.
inline bool convert(NativeState const& native, TransformOrder order, DeviceState<double>& state) noexcept {
  auto const vector = [](std::array<double, 3> const& from, double unit) { return Vector3<double>(unit * from[0], unit * from[1], unit * from[2]); };
  Vector3<double> const position = vector(native.position, 1e-3), velocity = vector(native.velocity, 1e-3),
                        turning = vector(native.angular_velocity, 1.0);
  if (!is_finite(position) || !is_finite(velocity)) return false;
  state.position = position;
  state.velocity = velocity;
  if (is_finite(turning)) state.angular_velocity = turning;
  state.buttons = static_cast<std::uint32_t>(native.buttons);
  Eigen::Map<Matrix<double, 4, 4> const> const columns(native.transform.data());
  Matrix<double, 3, 3> const linear = columns.topLeftCorner<3, 3>();
  take_orientation(order == TransformOrder::by_columns ? linear : linear.transpose(), state);
  return true;
}

inline std::array<double, 3> force_to_native(Vector3<double> const& force) noexcept { return {force.x(), force.y(), force.z()}; }   // N
inline std::array<double, 3> torque_to_native(Vector3<double> const& torque) noexcept {   // N·m → mN·m
  return {1e3 * torque.x(), 1e3 * torque.y(), 1e3 * torque.z()};
}

/// One device in the driver's thread: takes its state, asks for the force or takes the one that waits, and sends it. Everything of the library that
/// is called here is called between begin_frame and end_frame of this device.
/// The force rises within options.ramp (see ForceRamp) while the motors are on.
/// Threads    `tick` and what it calls: the scheduler's. The public atomics: any. `commands` has one writer, `states`, `faults` and `ending` one
///            reader each: the host.
/// Cost       about fifteen calls of the library; noexcept, no allocation, no lock.
class Servo {
 public:
  using Tick = void (*)(void*) noexcept;

  Servo(PhantomOptions const& options, Handle handle, Capabilities const& capabilities, Number styles, Calibration at_first)
      : calibrated(at_first), options_(options), handle_(handle), has_torque_(capabilities.max_torque > 0.0),
        ramp_(options.ramp, options.rate, capabilities), held_(std::max(1.0, std::ceil(options.held * options.rate))),
        checked_every_(std::max(1u, static_cast<unsigned>(options.rate))),
        style_((styles & calibration::automatic) != 0 ? calibration::automatic : (styles & calibration::inkwell) != 0 ? calibration::inkwell : 0) {}

  // Between the host and the driver's thread.
  std::atomic<bool> force_wanted{false}, force_on{false};
  std::atomic<Calibration> calibrated;
  std::atomic<bool> calibration_wanted{false};
  std::atomic<DeviceStatus> status{DeviceStatus::ok};   // never ok again once it is not
  std::atomic<Tick> self_clocked{nullptr};
  void* context = nullptr;   // of self_clocked: set before it
  std::atomic<bool> inside{false};
  std::atomic<bool> leaves{false};   // the host has closed it; the driver lets it go between two ticks
  std::atomic<std::uint64_t> ticks{0}, unreadable{0}, force_errors{0}, misuses{0}, unattended{0}, jumps{0}, gaps{0};
  TripleBuffer<DeviceState<double>> states;
  TripleBuffer<Wrench<double>> commands;
  EventRing<DeviceFault, 64> faults;   // that the session goes on after
  EventRing<DeviceFault, 2> ending;    // the one that ended it: repeats of others leave it its place

  // For a tick of the host's that runs in the driver's thread.
  DeviceStatus latched(DeviceState<double>& state) const noexcept {
    DeviceStatus const now = status.load(std::memory_order_relaxed);
    if (!is_usable(now)) return now;
    state = state_;
    return fresh_ ? DeviceStatus::ok : DeviceStatus::stale;
  }
  void command(Wrench<double> const& wrench) noexcept {
    wanted_ = wrench;
    age_ = 0;
  }

  Handle handle() const noexcept { return handle_; }
  bool calibrates_while_running() const noexcept { return style_ != 0; }

  /// The scheduler was stopped, and the library's motors are off with it.
  void interrupted() noexcept {
    force_on.store(false);
    ramp_.begin_again();
    calibrating_ = false;
    known_ = false;
  }

  /// `passed`: how many periods of the driver's clock since the tick before; not 1 where the driver is late.
  void tick(Functions const& hd, bool gap, double passed) noexcept {
    ticks.fetch_add(1, std::memory_order_relaxed);
    bool const alive = is_usable(status.load(std::memory_order_relaxed));
    if (alive) {
      hd.begin_frame(handle_);
      latch(hd);
      if (gap) begin_again(gaps);
      care(hd);
    }
    obtain_command(passed);
    if (alive) {
      send(hd);
      hd.end_frame(handle_);
    }
  }

  /// Calls visit(entry) for the errors that were taken from the stack within the tick, oldest first; then they are forgotten.
  template <class Visit>
  void take_early(Visit visit) noexcept {
    for (std::size_t k = 0; k < early_count_; ++k) visit(early_[k]);
    early_count_ = 0;
  }

  /// After the errors of the tick have come: the host may see it.
  void publish(Functions const& hd) noexcept {
    if (!bad_tick_) bad_ticks_ = 0;
    if (bad_tick_ && ++bad_ticks_ == max_bad_ticks && is_usable(status.load(std::memory_order_relaxed))) {
      ending.push({.status = DeviceStatus::fault, .native_code = 0, .what = "ten ticks without a sound state"});
      fail(hd, DeviceStatus::fault);
    }
    bad_tick_ = false;
    if (fresh_ && is_usable(status.load(std::memory_order_relaxed))) states.write(state_);
  }

  /// An entry of the library's error stack that is this device's.
  void take(Functions const& hd, NativeError const& entry) noexcept {
    FaultKind const kind = kind_of(entry.code);
    DeviceStatus severity = DeviceStatus::ok;
    switch (kind) {
      case FaultKind::force:
        begin_again(force_errors);
        break;
      case FaultKind::use:
        misuses.fetch_add(1, std::memory_order_relaxed);
        bad_tick_ = bad_tick_ || entry.code == error::bad_handle || entry.code >= error::bad_begin;
        break;
      case FaultKind::device: severity = DeviceStatus::fault; break;
      case FaultKind::connection: severity = DeviceStatus::disconnected; break;
    }
    char const* const words = hd.error_text(entry.code);
    if (!is_usable(status.load(std::memory_order_relaxed))) return;   // what ended the session is told, not what follows from it
    DeviceFault const fault{.status = severity, .native_code = static_cast<int>(entry.code), .what = words != nullptr ? words : ""};
    if (is_usable(severity)) {
      faults.push(fault);
    } else {
      ending.push(fault);
      fail(hd, severity);
    }
  }

 private:
  static constexpr unsigned max_bad_ticks = 10;
  static constexpr unsigned max_attempts = 5;   // of the driver to calibrate, before the user has to help
  static constexpr double long_ago = 1e9;   // periods

  void begin_again(std::atomic<std::uint64_t>& counter) noexcept {
    counter.fetch_add(1, std::memory_order_relaxed);
    ramp_.begin_again();
  }

  /// Motors off, and no frame any more.
  void fail(Functions const& hd, DeviceStatus severity) noexcept {
    if (!is_usable(status.load(std::memory_order_relaxed))) return;
    status.store(severity);
    fresh_ = false;
    hd.make_current(handle_);
    hd.disable(capability::force);
    force_on.store(false);
  }

  /// The last call gave nothing: does the driver not know what was asked for? Else it is asked again in the next tick.
  bool refused(Functions const& hd) noexcept {
    NativeError const entry = hd.next_error();
    if (entry.code == error::none) return false;
    early_[early_count_++] = entry;
    return (entry.device == handle_ || entry.device == no_device) &&
           (entry.code == error::unknown_name || entry.code == error::bad_value || entry.code == error::bad_type);
  }

  void latch(Functions const& hd) noexcept {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    NativeState native;
    native.position.fill(nan), native.velocity.fill(nan), native.angular_velocity.fill(nan), native.transform.fill(nan);
    hd.get_doubles(parameter::position, native.position.data());
    hd.get_doubles(parameter::velocity, native.velocity.data());
    if (has_transform_) {   // a device of three degrees of freedom may not know it
      hd.get_doubles(parameter::transform, native.transform.data());
      if (std::isnan(native.transform[0])) has_transform_ = !refused(hd);
    }
    if (has_turning_) {
      hd.get_doubles(parameter::angular_velocity, native.angular_velocity.data());
      if (std::isnan(native.angular_velocity[0])) has_turning_ = !refused(hd);
    }
    hd.get_integers(parameter::buttons, &native.buttons);
    if (!order_) order_ = order_of(native);
    Vector3<double> const before = state_.position;
    fresh_ = convert(native, order_.value_or(TransformOrder::by_columns), state_);
    if (!fresh_) {
      unreadable.fetch_add(1, std::memory_order_relaxed);
      ramp_.begin_again();
      bad_tick_ = true;
      return;
    }
    if (known_ && (state_.position - before).norm() > options_.jump) begin_again(jumps);
    known_ = true;
  }

  /// Calibration and the motors' switch.
  void care(Functions const& hd) noexcept {
    if (calibrating_) {   // the motors have been off since the last frame
      calibration_wanted.store(false);
      {
        PlainLocale const plain;   // the driver may read and write files here
        hd.update_calibration(style_);
      }
      calibrating_ = false;
      until_check_ = 0;
      until_attempt_ = std::max(1u, checked_every_ / 10);
      ++attempts_;
    }
    if (until_check_ == 0) {
      Number const found = hd.check_calibration();
      if (found != calibration::needs_update) attempts_ = 0;
      Calibration const now = found == calibration::good                                           ? Calibration::good
                              : found == calibration::needs_update && attempts_ < max_attempts ? Calibration::needs_update
                                                                                                : Calibration::needs_hand;
      calibrated.store(now);
      until_check_ = now == Calibration::good ? checked_every_ : std::max(1u, checked_every_ / 10);
    }
    --until_check_;
    Calibration const now = calibrated.load(std::memory_order_relaxed);
    if (until_attempt_ > 0) {
      --until_attempt_;
    } else if (style_ != 0) {
      bool const by_host = calibration_wanted.exchange(false);
      if (by_host) attempts_ = 0;
      calibrating_ = by_host || (options_.calibrates_itself && now == Calibration::needs_update);
    }
    bool const on = force_wanted.load() && !calibrating_ && (now == Calibration::good || !options_.calibrated_only);
    if (on == force_on.load(std::memory_order_relaxed)) return;
    if (on)
      hd.enable(capability::force);
    else
      hd.disable(capability::force);
    ramp_.begin_again();
    force_on.store(on);
  }

  void obtain_command(double passed) noexcept {
    age_ = std::min(age_ + passed, long_ago);
    inside.store(true);   // sequentially consistent, as in `stop`: either it sees us inside or we see that there is no tick
    Tick const hosts = self_clocked.load();
    if (std::exchange(was_self_clocked_, hosts != nullptr) && hosts == nullptr) {   // the tick's last force ends with it
      wanted_ = {};
      age_ = long_ago;
      ramp_.begin_again();
    }
    bool const waits = commands.fetch();
    if (hosts != nullptr) {   // a force from before start() is never given
      wanted_ = {};
      hosts(context);
    } else if (waits) {
      command(commands.front());
    }
    inside.store(false);
  }

  void send(Functions const& hd) noexcept {
    Wrench<double> out;
    if (age_ > held_ + 0.5) {   // no tick comes to the very moment
      unattended.fetch_add(1, std::memory_order_relaxed);
      ramp_.begin_again();
    } else if (force_on.load(std::memory_order_relaxed) && fresh_) {
      out = ramp_.next(wanted_);
    }
    hd.set_doubles(parameter::force, force_to_native(out.force).data());
    if (has_torque_) hd.set_doubles(parameter::torque, torque_to_native(out.torque).data());
  }

  PhantomOptions const options_;
  Handle const handle_;
  bool const has_torque_;
  ForceRamp ramp_;
  double const held_;              // periods of the clock
  unsigned const checked_every_;   // ticks
  Number const style_;        // of the calibration that is possible while the scheduler runs; 0: none

  DeviceState<double> state_;
  std::optional<TransformOrder> order_;
  std::array<NativeError, 2> early_{};   // of transform and angular velocity
  std::size_t early_count_ = 0;
  Wrench<double> wanted_;
  double age_ = long_ago;          // periods since a force was written
  unsigned until_check_ = 0, until_attempt_ = 0;   // ticks
  unsigned attempts_ = 0;     // to calibrate, since the host asked for it or the driver was content
  unsigned bad_ticks_ = 0;
  bool fresh_ = false, known_ = false, calibrating_ = false, bad_tick_ = false, has_transform_ = true, has_turning_ = true, was_self_clocked_ = false;
};

}  // namespace detail::phantom

}  // namespace palpate
