// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/event_ring.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/driver.hpp>
#include <palpate/device/force_dimension/library.hpp>
#include <palpate/device/force_dimension/options.hpp>
#include <palpate/device/limit.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace palpate {

/// What happened since the device was opened.
struct ForceDimensionCounts {
  std::uint64_t ticks = 0;            ///< reads
  std::uint64_t repeated = 0;         ///< reads that the library answered with the sample before
  std::uint64_t unreadable = 0;       ///< reads whose sample was not complete or not finite
  std::uint64_t saturated = 0;        ///< forces that the motors could not give in full
  std::uint64_t switched_off = 0;     ///< times that the device has switched its force off
  std::uint64_t jumps = 0, gaps = 0;  ///< of the position and of the host's clock: the force began at zero again
};

namespace detail::force_dimension {

/// What the library gives for one tick: SI units, x towards the user, y to the right, z up.
struct NativeState {
  std::array<double, 3> position{}, velocity{}, angular_velocity{};
  double rotation[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};   // rows; its columns are the tool's axes
  unsigned buttons = 0;
};

constexpr int button_bits = 16;

/// (towards the user, right, up) → (right, up, towards the user): a cyclic permutation, so a proper rotation.
///   v = P v_dhd,   R = P R_dhd Pᵀ,   P = [0 1 0; 0 0 1; 1 0 0]
inline Vector3<double> from_native(std::array<double, 3> const& v) noexcept { return {v[1], v[2], v[0]}; }
inline std::array<double, 3> to_native(Vector3<double> const& v) noexcept { return {v.z(), v.x(), v.y()}; }

/// False, and nothing changed, when position or velocity are not finite. A rotation that is none leaves the orientation as it was.
inline bool convert(NativeState const& native, bool has_wrist, DeviceState<double>& state) noexcept {
  Vector3<double> const position = from_native(native.position), velocity = from_native(native.velocity);
  if (!is_finite(position) || !is_finite(velocity)) return false;
  state.position = position;
  state.velocity = velocity;
  state.buttons = static_cast<std::uint32_t>(native.buttons) & ((1u << button_bits) - 1u);
  if (!has_wrist) return true;
  if (Vector3<double> const turning = from_native(native.angular_velocity); is_finite(turning)) state.angular_velocity = turning;
  constexpr int from[3] = {1, 2, 0};
  Matrix<double, 3, 3> rotation;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rotation(row, column) = native.rotation[from[row]][from[column]];
  take_orientation(rotation, state);
  return true;
}

/// One open device: each tick takes its state and sends the force.
/// The force rises within options.ramp (see ForceRamp) while nothing speaks against one.
/// Cost       three or four calls of the library for a read and one for a write, some of which wait for the USB; ten times a second one more. Nothing
///            else waits, locks or allocates.
class Servo {
 public:
  Servo(Functions const& functions, Id id, ForceDimensionOptions const& options, Capabilities const& capabilities) noexcept
      : dhd_(functions), id_(id), ramp_(options.ramp, options.rate, capabilities), jump_(options.jump), gap_(options.gap),
        silence_(std::max(1.0, std::ceil(options.silence * options.rate))),
        checked_every_(std::max(1u, static_cast<unsigned>(0.1 * options.rate))), calibrated_only_(options.calibrated_only),
        has_wrist_(capabilities.reports_orientation) {}

  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (!is_usable(status_)) return status_;
    ++counts_.ticks;
    notice_gap();
    if (--until_check_ == 0) check();
    bool const fresh = is_usable(status_) && sample();
    if (!is_usable(status_)) return status_;
    state.position = state_.position;
    state.velocity = state_.velocity;
    state.buttons = state_.buttons;
    if (has_wrist_) {
      state.orientation = state_.orientation;
      state.angular_velocity = state_.angular_velocity;
    }
    return fresh ? DeviceStatus::ok : DeviceStatus::stale;
  }

  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    if (!is_usable(status_)) return status_;
    if (!armed_) return DeviceStatus::ok;
    Wrench<double> out;
    if (sound_ && !switched_off_ && repeated_ < silence_ && (calibration_ == Calibration::good || !calibrated_only_)) {
      out = ramp_.next(wrench);
    } else {
      ramp_.begin_again();
    }
    int const came = send(out);
    if (came == result::saturated) ++counts_.saturated;
    if (came < 0) fail_by_library();
    return status_;
  }

  /// Motors on, at zero. False: the library refused; its error is told by `last_code`.
  bool arm() noexcept {
    if (dhd_.enable_force(1, id_) < 0) return refuse();
    armed_ = true;
    if (send({}) < 0) {
      refuse();
      disarm();
      return false;
    }
    switched_off_ = false;
    ramp_.begin_again();
    last_ = {};
    until_check_ = checked_every_;
    return true;
  }
  void disarm() noexcept {
    if (!armed_) return;
    static_cast<void>(send({}));
    static_cast<void>(dhd_.enable_force(0, id_));
    armed_ = false;
    ramp_.begin_again();
  }

  /// Asks the device how it is.
  void check() noexcept {
    until_check_ = checked_every_;
    std::array<int, status::room> is{};
    if (dhd_.status(is.data(), id_) < 0) return fail_by_library();
    if (is[status::connected] == 0) return fail(DeviceStatus::disconnected, 0, "the device is no longer connected");
    if (is[status::error] != 0) return fail(DeviceStatus::fault, 0, "the device says that it is in an error: switch it off and on");
    calibration_ = is[status::needs_reset] != 0 ? Calibration::needs_hand : Calibration::good;
    int const cause = is[status::force_off_cause];
    bool const off = armed_ && is[status::force] == 0;
    if (off && cause == force_off::unplugged) return fail(DeviceStatus::disconnected, cause, "the device was unplugged");
    if (off && !switched_off_) {
      ++counts_.switched_off;
      faults_.push({.status = DeviceStatus::ok, .native_code = cause, .what = force_off_words(cause)});
    }
    switched_off_ = off;
  }

  /// False: nothing new. A failure is in `status`.
  bool sample() noexcept {
    NativeState native;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    native.position.fill(nan), native.velocity.fill(nan), native.angular_velocity.fill(nan);
    auto& [px, py, pz] = native.position;
    int const came = dhd_.pose(&px, &py, &pz, native.rotation, id_);
    if (came < 0) {
      fail_by_library();
      return false;
    }
    if (came == result::repeated) {
      ++counts_.repeated;
      if (++repeated_ == silence_)
        faults_.push({.status = DeviceStatus::ok,
                      .native_code = came,
                      .what = "the library gives the same sample over and over: no force until a new one comes"});
      return false;
    }
    auto& [vx, vy, vz] = native.velocity;
    bool const moves = dhd_.velocity(&vx, &vy, &vz, id_) >= 0;
    if (has_wrist_ && dhd_.angular_velocity != nullptr) {
      auto& [wx, wy, wz] = native.angular_velocity;
      static_cast<void>(dhd_.angular_velocity(&wx, &wy, &wz, id_));   // without it the last one stands
    }
    native.buttons = dhd_.buttons(id_);
    Vector3<double> const before = state_.position;
    sound_ = moves && convert(native, has_wrist_, state_);
    if (!sound_) {
      ++counts_.unreadable;
      if (known_ && ++unsound_ == max_unsound) fail(DeviceStatus::fault, 0, "ten reads without a sound state");
      return false;
    }
    if (known_ && (state_.position - before).norm() > jump_ * (1.0 + repeated_)) begin_again(counts_.jumps);
    known_ = true;
    unsound_ = 0;
    repeated_ = 0.0;
    return true;
  }

  DeviceStatus status() const noexcept { return status_; }
  Calibration calibration() const noexcept { return calibration_; }
  int last_code() const noexcept { return last_code_; }
  ForceDimensionCounts const& counts() const noexcept { return counts_; }
  std::optional<DeviceFault> pop_fault() noexcept {
    if (auto fault = faults_.pop()) return fault;
    return std::exchange(ending_, std::nullopt);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr unsigned max_unsound = 10;

  int send(Wrench<double> const& wrench) noexcept {
    auto const f = to_native(wrench.force), t = to_native(wrench.torque);
    return dhd_.set_forces(f[0], f[1], f[2], t[0], t[1], t[2], 0.0, id_);
  }

  bool refuse() noexcept {
    last_code_ = dhd_.last_error();
    return false;
  }
  void begin_again(std::uint64_t& counter) noexcept {
    ++counter;
    ramp_.begin_again();
  }
  void notice_gap() noexcept {
    auto const now = Clock::now();
    if (last_ != Clock::time_point{} && std::chrono::duration<double>(now - last_).count() > gap_) begin_again(counts_.gaps);
    last_ = now;
  }

  /// Motors off for good. The words are static or the library's, which is never unloaded.
  void fail(DeviceStatus severity, int code, char const* words) noexcept {
    status_ = severity;
    last_code_ = code;
    ending_ = DeviceFault{.status = severity, .native_code = code, .what = words != nullptr ? words : ""};
    disarm();
  }
  void fail_by_library() noexcept {
    int const code = dhd_.last_error();
    fail(severity_of(code), code, dhd_.error_text(code));
  }

  Functions const dhd_;
  Id const id_;
  ForceRamp ramp_;
  double const jump_, gap_;
  double const silence_;    // ticks
  unsigned const checked_every_;   // ticks
  bool const calibrated_only_, has_wrist_;

  DeviceState<double> state_;
  DeviceStatus status_ = DeviceStatus::ok;   // never ok again once it is not
  Calibration calibration_ = Calibration::needs_hand;
  ForceDimensionCounts counts_;
  EventRing<DeviceFault, 16> faults_;   // that the session goes on after
  std::optional<DeviceFault> ending_;
  Clock::time_point last_;      // read
  double repeated_ = 0.0;   // ticks
  unsigned until_check_ = 1, unsound_ = 0;
  int last_code_ = 0;
  bool armed_ = false, sound_ = false, known_ = false, switched_off_ = false;
};

}  // namespace detail::force_dimension

}  // namespace palpate
