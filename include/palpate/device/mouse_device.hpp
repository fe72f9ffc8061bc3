// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/sampled_mass.hpp>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

namespace palpate {

/// Mapping from screen to world; set it again whenever the camera turns.
struct MouseMapping {
  Vector3<double> right = {1, 0, 0};    ///< where the mouse goes to the right; any length but zero
  Vector3<double> up = {0, 1, 0};       ///< where it goes up the screen
  Vector3<double> depth = {0, 0, -1};   ///< where the wheel turns forward, away from the user
  double per_pixel = 2e-4;              ///< m
  double per_step = 1e-3;               ///< m, of the wheel
};

struct MouseOptions {
  MouseMapping mapping = {};
  Vector3<double> start = Vector3<double>::Zero();   ///< m, where the tip begins
  DeviceWorkspace workspace = {};   ///< the tip stays inside, if it is known
  double smoothing = 4.0;           ///< Hz; a step of the mouse arrives within about a second over this
  double max_force = 3.3;           ///< N, shown and written to nobody
  double rate = 1000.0;             ///< Hz
  int buttons = 3;
};

namespace detail {

/// Shared between user interface and servo: the newest value each way.
struct MouseChannel {
  struct Input {
    Vector3<double> moved = Vector3<double>::Zero();   // m, in all
    Vector3<double> speed = Vector3<double>::Zero();   // m/s, while keys are held
    std::uint32_t buttons = 0;
  };
  struct Felt {
    Vector3<double> position = Vector3<double>::Zero(), force = Vector3<double>::Zero();
  };
  TripleBuffer<Input> input{Input{}};
  TripleBuffer<Felt> felt{Felt{}};
  bool taken = false;
};

}  // namespace detail

/// The side of the user's interface: tell it what mouse, wheel and keys do, ask it for the arrow to draw.
///
///   Mouse mouse({.start = {0, 0, 0.02}});
///   Simulator simulator(MouseDevice<double>(mouse), …);      // its own thread, if it likes
///   mouse.move(dx, dy);  mouse.turn_wheel(1);  mouse.set_buttons(left ? 1 : 0);      // from the window's callbacks
///
/// Invariant  one that was moved away is false: what it is told is lost, its arrow is zero.
/// Threads    one for all of these calls, another one for the device; they do not wait for each other.
/// Limits     a click shorter than a servo tick may not be seen.
class Mouse {
 public:
  explicit Mouse(MouseOptions const& options = {}) : options_(options), channel_(std::make_shared<detail::MouseChannel>()) {
    set_mapping(options.mapping);
  }
  Mouse(Mouse&&) noexcept = default;
  Mouse& operator=(Mouse&&) noexcept = default;
  explicit operator bool() const noexcept { return channel_ != nullptr; }

  /// By so many pixels to the right and down, as windows count them.
  void move(double right, double down) noexcept { shift((right * mapping_.right - down * mapping_.up) * mapping_.per_pixel); }
  void turn_wheel(double steps) noexcept { shift(steps * mapping_.per_step * mapping_.depth); }
  /// While keys are held: m/s to the right, up and into the screen. Zeros when they are let go.
  void set_speed(double right, double up, double depth) noexcept {
    input_.speed = right * mapping_.right + up * mapping_.up + depth * mapping_.depth;
    if (!is_finite(input_.speed)) input_.speed.setZero();
    tell();
  }
  /// Bit i: button i is pressed.
  void set_buttons(std::uint32_t pressed) noexcept {
    input_.buttons = pressed;
    tell();
  }

  /// For what is moved from now on. Throws `InvalidArgument` for directions that do not span space, or scales that are not finite.
  void set_mapping(MouseMapping const& mapping) {
    Vector3<double> const right = mapping.right.stableNormalized(), up = mapping.up.stableNormalized(), depth = mapping.depth.stableNormalized();
    if (!(std::abs(right.cross(up).dot(depth)) > 1e-6))   // NaN too
      throw InvalidArgument("MouseMapping: right, up and depth do not span space; give three that differ, for example the camera's");
    if (!std::isfinite(mapping.per_pixel) || !std::isfinite(mapping.per_step))
      throw InvalidArgument(
          detail::message("MouseMapping: .per_pixel is ", mapping.per_pixel, " m and .per_step ", mapping.per_step, " m; give finite ones"));
    mapping_ = {.right = right, .up = up, .depth = depth, .per_pixel = mapping.per_pixel, .per_step = mapping.per_step};
  }

  /// The tip [m] and the force [N] there in a tick just past: an arrow.
  struct Arrow {
    Vector3<double> position, force;
  };
  Arrow arrow() noexcept {
    if (!channel_) return {Vector3<double>::Zero(), Vector3<double>::Zero()};
    detail::MouseChannel::Felt const& felt = channel_->felt.read();
    return {felt.position, felt.force};
  }

  MouseOptions const& options() const noexcept { return options_; }

 private:
  template <RealScalar Scalar>
  friend class MouseDevice;

  void shift(Vector3<double> const& by) noexcept {
    if (!is_finite(by)) return;
    input_.moved += by;
    tell();
  }
  void tell() noexcept {
    if (channel_) channel_->input.write(input_);
  }

  MouseOptions options_;
  MouseMapping mapping_;   // with unit vectors
  detail::MouseChannel::Input input_;
  std::shared_ptr<detail::MouseChannel> channel_;
};

/// A mouse and a keyboard as a device: a critically damped second-order filter makes a smooth pose of input that arrives sixty times a
/// second in steps. Its force is displayed.
///   ẍ = ω² (r − x) − 2 ω ẋ,   ω = 2π smoothing,   r the sum of mouse, wheel and keys, within the workspace
/// The solution is exact for a target that rests for a tick, so the velocity is continuous and no step of the mouse overshoots. At the
/// edge of the workspace the target stops, and it returns at once.
/// Units      SI; the world's frame, or whatever frame the mapping's directions are in.
/// Invariant  one that was moved from says `disconnected`.
/// Cost       noexcept, no allocation, no lock.
/// Limits     no orientation. A user who sees a force and does not feel it presses far too hard.
template <RealScalar Scalar>
class MouseDevice {
 public:
  /// One device a mouse; it may outlive the mouse.
  explicit MouseDevice(Mouse& mouse) : options_(mouse.options_), channel_(mouse.channel_), follows_(filter(options_)) {
    detail::OptionCheck{"MouseOptions"}(options_.buttons >= 0 && options_.buttons <= 32, ".buttons", options_.buttons, "give 0 to 32");
    require_valid(capabilities());
    if (!is_finite(options_.start)) throw InvalidArgument("MouseOptions: .start is not finite; give metres");
    if (!channel_) throw InvalidArgument("MouseDevice: this mouse was moved away; use the one that it was moved to");
    if (channel_->taken) throw InvalidArgument("MouseDevice: this mouse has a device already; make a Mouse for each");
    channel_->taken = true;
    offset_ = options_.start;
    position_ = target().template cast<Scalar>();
  }

  Capabilities capabilities() const noexcept {
    return {.max_force = options_.max_force,
            .rate = options_.rate,
            .reports_velocity = true,
            .buttons = options_.buttons,
            .moves_a_hand = false,
            .workspace = options_.workspace};
  }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    if (!channel_) return DeviceStatus::disconnected;
    channel_->input.fetch();
    auto const& input = channel_->input.front();
    if (begun_) {
      offset_ += input.speed / options_.rate;
      follows_.step(position_, velocity_, Vector3<Scalar>::Zero(), target().template cast<Scalar>());
    }
    begun_ = true;
    state.position = position_;
    state.velocity = velocity_;
    state.buttons = options_.buttons >= 32 ? input.buttons : input.buttons & ((std::uint32_t{1} << options_.buttons) - 1u);
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    if (!channel_) return DeviceStatus::disconnected;
    channel_->felt.write({position_.template cast<double>(), limited(wrench, capabilities()).force.template cast<double>()});
    return DeviceStatus::ok;
  }

 private:
  static SampledMass<Scalar> filter(MouseOptions const& options) {
    detail::OptionCheck const require{"MouseOptions"};
    require(options.smoothing > 0.0 && options.smoothing < 1e4, ".smoothing", options.smoothing, " Hz", "give more than 0, for example 4");
    double const omega = 2.0 * std::numbers::pi * options.smoothing;
    return SampledMass<Scalar>({.mass = 1.0, .damping = 2.0 * omega, .stiffness = omega * omega, .rate = options.rate});
  }
  /// Where the tip is to be; beyond the edge the offset gives way.
  Vector3<double> target() noexcept {
    Vector3<double> const& moved = channel_->input.front().moved;
    if (options_.workspace.known()) offset_ = (moved + offset_).cwiseMax(options_.workspace.lower).cwiseMin(options_.workspace.upper) - moved;
    return moved + offset_;
  }

  MouseOptions options_;
  std::shared_ptr<detail::MouseChannel> channel_;
  SampledMass<Scalar> follows_;
  Vector3<double> offset_ = Vector3<double>::Zero();
  Vector3<Scalar> position_ = Vector3<Scalar>::Zero(), velocity_ = Vector3<Scalar>::Zero();
  bool begun_ = false;
};

}  // namespace palpate
