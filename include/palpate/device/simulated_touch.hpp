// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/trajectory.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

namespace palpate {

/// The arm of a Touch (formerly Phantom Omni): a waist and two links, from joint angles to the tip and back.
///   x = −sin θ1 r + o_x,   y = L1 sin θ2 − L2 cos θ3 + L2 + o_y,   z = cos θ1 r − L1 + o_z,   r = L1 cos θ2 + L2 sin θ3
/// θ2 and θ3 are both against the horizontal plane of the base: the second link is driven from the base and does not turn with the first. At
/// θ = 0 the first link points to the user, the second one down.
/// Units      rad, m; the device's frame: x to the right, y up, z to the user.
/// Source     plane two-link arm on a waist, \cite spong2020 ch. 3; lengths from the maker's drawings, offsets from poses that a device reported.
/// Invariant  forward(inverse(p)) = p where the arm reaches; elbow up, tip in front of the waist.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     without the gimbal. Joint limits are estimates, good to some degrees. With the tip on the waist's axis, the arm straight or folded the
///            Jacobian can not be inverted; within the limits none of it happens.
template <RealScalar Scalar = double>
struct TouchKinematics {
  using Joints = Vector3<Scalar>;   ///< θ1, θ2, θ3 [rad]
  using Point = Vector3<Scalar>;

  Scalar first = Scalar(0.13335);    ///< L1 [m]
  Scalar second = Scalar(0.13335);   ///< L2 [m]
  Point offset = {0, Scalar(-0.110), Scalar(-0.035)};   ///< o [m]
  Joints lower = {Scalar(-0.98), Scalar(0.0), Scalar(-0.81)};   ///< rad
  Joints upper = {Scalar(0.98), Scalar(1.75), Scalar(1.25)};    ///< rad
  Scalar max_fold = Scalar(1.2);                               ///< rad, of θ2 − θ3: at π/2 the links lie on each other

  /// With the pen in its holder, which the device is calibrated by.
  static Joints inkwell() noexcept { return {0, Scalar(0.26889), Scalar(-0.370813)}; }

  Point forward(Joints const& joints) const noexcept {
    Scalar const r = first * std::cos(joints[1]) + second * std::sin(joints[2]);
    Scalar const up = first * std::sin(joints[1]) - second * std::cos(joints[2]) + second;
    return offset + Point(-std::sin(joints[0]) * r, up, std::cos(joints[0]) * r - first);
  }

  /// ∂(x, y, z)/∂(θ1, θ2, θ3) [m/rad].
  Matrix<Scalar, 3, 3> jacobian(Joints const& joints) const noexcept {
    Scalar const s1 = std::sin(joints[0]), c1 = std::cos(joints[0]);
    Scalar const r = first * std::cos(joints[1]) + second * std::sin(joints[2]);
    Scalar const r2 = -first * std::sin(joints[1]), r3 = second * std::cos(joints[2]);   // ∂r/∂θ2, ∂r/∂θ3
    Matrix<Scalar, 3, 3> result;
    result << -c1 * r, -s1 * r2, -s1 * r3,
        0, first * std::cos(joints[1]), second * std::sin(joints[2]),
        -s1 * r, c1 * r2, c1 * r3;
    return result;
  }

  /// The joints with the tip there, whatever their limits; none where the arm is too short, or the tip on the waist's axis or the shoulder.
  std::optional<Joints> inverse(Point const& position) const noexcept {
    Plane const plane = in_plane(position);
    bool const reached = plane.distance <= first + second && plane.distance >= std::abs(first - second);
    if (!reached || !(plane.distance > Scalar(0)) || !(plane.out > Scalar(0))) return std::nullopt;
    return joints_of(plane);
  }

  /// The joints within their limits whose tip is near the position: where a hand that goes on is stopped. Exact where the arm reaches. A position
  /// that is not finite gives the inkwell.
  Joints nearest(Point const& position) const noexcept {
    if (!is_finite(position)) return inkwell();
    Plane plane = in_plane(position);
    plane.distance = std::clamp(plane.distance, std::abs(first - second), first + second);
    if (!(plane.distance > Scalar(0))) return inkwell();
    Joints joints = joints_of(plane).cwiseMax(lower).cwiseMin(upper);
    if (Scalar const excess = joints[1] - joints[2] - max_fold; excess > Scalar(0)) {
      joints[1] -= excess / 2;
      joints[2] += excess / 2;
    }
    return joints;
  }

  /// To within a tolerance [rad].
  bool within_limits(Joints const& joints, Scalar tolerance = 0) const noexcept {
    return (joints.array() >= lower.array() - tolerance).all() && (joints.array() <= upper.array() + tolerance).all() &&
           joints[1] - joints[2] <= max_fold + tolerance;
  }

  /// The motors' torques [N·m] that press with `force` [N] at the tip: Jᵀ F.
  Joints torques(Joints const& joints, Point const& force) const noexcept { return jacobian(joints).transpose() * force; }

 private:
  /// The plane of both links: out from the waist, up from the shoulder, and how far from there.
  struct Plane {
    Scalar waist, out, up, distance;
  };
  Plane in_plane(Point const& position) const noexcept {
    Scalar const x = position.x() - offset.x(), z = position.z() - offset.z() + first, up = position.y() - offset.y() - second;
    Scalar const out = std::hypot(x, z);
    return {std::atan2(-x, z), out, up, std::hypot(out, up)};
  }
  Joints joints_of(Plane const& plane) const noexcept {
    auto const corner = [](Scalar cosine) { return std::acos(std::clamp(cosine, Scalar(-1), Scalar(1))); };
    Scalar const d = plane.distance, rises = std::atan2(plane.up, plane.out);
    Scalar const above = corner((d * d + first * first - second * second) / (2 * d * first));
    Scalar const below = corner((d * d + second * second - first * first) / (2 * d * second));
    return {plane.waist, rises + above, rises - below + std::numbers::pi_v<Scalar> / 2};
  }
};

struct SimulatedTouchOptions {
  HandOptions hand = normal_hand();
  HandTremorOptions tremor = {.amplitude = 0.0};
  double rate = 1000.0;            ///< Hz
  bool calibrated = true;          ///< false: joints are off by `encoder_error` until the pen was in the inkwell and `calibrate()` was called
  double encoder_error = 0.1;      ///< rad, of each joint
  double motor_time = 10.0;        ///< s, in which the motors come to 63 % of their temperature
  double motor_trip = 1.2;         ///< of the temperature that 0.88 N come to: the device fails there, to save the motors
};

/// Simulated Touch in a simulated hand: kinematics, joint stops, inkwell, buttons, force limits and thermal model of the motors.
///   force      at most 3.3 N; none while it is not armed, not calibrated or failed
///   motors     τ dΘ/dt = (F/0.88 N)² − Θ; at Θ > motor_trip it says `fault` until it is opened again: 3.3 N take 0.9 s to get there
///   stops      the tip slides along the end of a joint's range
///   calibrate  only at the inkwell, within 5 mm; `calibration()` says `needs_hand` elsewhere
/// Units      SI, the device's frame. Time counts in reads; a closed or failed device goes on cooling while it is read.
/// Source     3.3 N, 0.88 N, 0.055 mm, 0.26 N, 45 g, 160 × 120 × 70 mm: the maker's data sheet. Damping, motor time and trip are guesses;
///            so is a centred workspace.
/// Cost       About 0.2 µs a tick; noexcept, no allocation.
/// Limits     no gimbal and no orientation; one apparent mass and friction in all directions, whatever the arm's posture.
template <RealScalar Scalar>
class SimulatedTouch {
 public:
  explicit SimulatedTouch(Trajectory<Scalar> path, SimulatedTouchOptions const& options = {})
      : options_(options),
        hand_(std::move(path),
              {.hand = options.hand,
               .tremor = options.tremor,
               .max_force = max_force,
               .rate = options.rate,
               .mass = 0.045,
               .damping = 0.1,
               .friction = 0.26,
               .buttons = 2}),
        calibrated_(options.calibrated) {
    detail::OptionCheck const require{"SimulatedTouch", true};
    require(options.motor_time > 0.0, ".motor_time", options.motor_time, "give seconds, above zero");
    require(options.motor_trip > 1.0, ".motor_trip", options.motor_trip, "give more than 1, which the continuous force comes to");
    require(std::abs(options.encoder_error) < 1.0, ".encoder_error", options.encoder_error, "give radians, below 1");
    cools_ = -std::expm1(-1.0 / (options.motor_time * options.rate));
  }
  /// The hand rests in the middle of the workspace.
  explicit SimulatedTouch(SimulatedTouchOptions const& options = {}) : SimulatedTouch(Trajectory<Scalar>::start(Vector3<Scalar>::Zero()), options) {}

  Capabilities capabilities() const noexcept {
    return {.max_force = datasheet(max_force),
            .rate = options_.rate,
            .reports_velocity = true,
            .buttons = 2,
            .moves_a_hand = false,
            .continuous_force = datasheet(continuous_force),
            .mass = datasheet(0.045),
            .damping = guessed(0.1),
            .friction = datasheet(0.26),
            .resolution = datasheet(quantum),
            .workspace = {.lower = {-0.08, -0.06, -0.035}, .upper = {0.08, 0.06, 0.035}, .provenance = Provenance::guessed}};
  }
  DeviceDescription description() const { return {.vendor = "palpate", .model = "simulated Touch", .serial = {}, .driver = "palpate"}; }

  void open() noexcept { open_ = true, failed_ = false; }
  void close() noexcept { open_ = armed_ = false; }
  void arm() noexcept { armed_ = true; }
  void disarm() noexcept { armed_ = false; }

  Calibration calibration() noexcept {
    if (calibrated_) return Calibration::good;
    return in_inkwell() ? Calibration::needs_update : Calibration::needs_hand;
  }
  void calibrate() noexcept { calibrated_ = calibrated_ || in_inkwell(); }

  char const* calibration_advice() const noexcept { return "put the pen into the inkwell and leave it there for a moment"; }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    if (!open_ || failed_ || !armed_ || !calibrated_) hand_.write({});
    warm_ += cools_ * (hand_.last_wrench().force.template cast<double>().squaredNorm() / (continuous_force * continuous_force) - warm_);
    if (open_ && !failed_ && warm_ > options_.motor_trip) {
      failed_ = untold_ = true;
      hand_.write({});
    }
    DeviceState<Scalar> now;
    static_cast<void>(hand_.read(now));
    stop_at_limits();
    if (!open_) return DeviceStatus::disconnected;
    if (failed_) return DeviceStatus::fault;
    Motion<Scalar> const seen = as_encoded();
    state.position = quantised(seen.position, quantum);
    state.velocity = seen.velocity;
    state.buttons = now.buttons;
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    bool const moves = open_ && armed_ && calibrated_ && !failed_;
    static_cast<void>(hand_.write(moves ? wrench : Wrench<Scalar>{}));
    return !open_ ? DeviceStatus::disconnected : failed_ ? DeviceStatus::fault : DeviceStatus::ok;
  }
  std::optional<DeviceFault> pop_fault() noexcept {
    if (!std::exchange(untold_, false)) return std::nullopt;
    return DeviceFault{.status = DeviceStatus::fault, .native_code = 0, .what = "the motors are too warm"};
  }

  void set_buttons(std::uint32_t pressed) noexcept { hand_.set_buttons(pressed & 3u); }
  /// Where the joints are [rad], without the encoders' error.
  Vector3<Scalar> joints() const noexcept { return kinematics_.nearest(hand_.position()); }
  /// Of the motors, 1 where the continuous force takes them.
  double temperature() const noexcept { return warm_; }
  TouchKinematics<Scalar> const& kinematics() const noexcept { return kinematics_; }
  SimulatedHand<Scalar>& hand() noexcept { return hand_; }
  SimulatedHand<Scalar> const& hand() const noexcept { return hand_; }

  static constexpr double max_force = 3.3;         ///< N
  static constexpr double continuous_force = 0.88;  ///< N
  static constexpr double quantum = 5.5e-5;         ///< m

 private:
  bool in_inkwell() const noexcept { return (hand_.position() - kinematics_.forward(kinematics_.inkwell())).norm() <= Scalar(0.005); }

  /// Where a joint is at its end the tip stays there, and slides on.
  void stop_at_limits() noexcept {
    Vector3<Scalar> const joints = this->joints(), reached = kinematics_.forward(joints);
    if ((reached - hand_.position()).norm() <= Scalar(1e-6)) return;   // well above the rounding of a float
    Vector3<Scalar> rates = rates_at(joints);
    for (int joint = 0; joint < 3; ++joint) {
      if (joints[joint] <= kinematics_.lower[joint]) rates[joint] = std::max(rates[joint], Scalar(0));
      if (joints[joint] >= kinematics_.upper[joint]) rates[joint] = std::min(rates[joint], Scalar(0));
    }
    constexpr Scalar near = Scalar(1e-5);   // rad
    if (joints[1] - joints[2] >= kinematics_.max_fold - near) {
      Scalar const folds = std::max(rates[1] - rates[2], Scalar(0));
      rates[1] -= folds / 2, rates[2] += folds / 2;
    }
    Vector3<Scalar> const velocity = kinematics_.jacobian(joints) * rates;
    hand_.place(reached, is_finite(velocity) ? velocity : Vector3<Scalar>::Zero());
  }
  Vector3<Scalar> rates_at(Vector3<Scalar> const& joints) const noexcept {
    Matrix<Scalar, 3, 3> const inverse = kinematics_.jacobian(joints).inverse();
    return inverse * hand_.velocity();
  }
  /// Where the tip is for encoders that are off.
  Motion<Scalar> as_encoded() const noexcept {
    if (calibrated_) return {hand_.position(), hand_.velocity()};
    Vector3<Scalar> const joints = this->joints(), seen = joints + Vector3<Scalar>::Constant(static_cast<Scalar>(options_.encoder_error));
    return {kinematics_.forward(seen), kinematics_.jacobian(seen) * rates_at(joints)};
  }

  SimulatedTouchOptions options_;
  TouchKinematics<Scalar> kinematics_;
  SimulatedHand<Scalar> hand_;
  bool open_ = false, armed_ = false, calibrated_ = true, failed_ = false, untold_ = false;
  double cools_ = 0.0;   // share of the way to the final temperature in a tick
  double warm_ = 0.0;
};

}  // namespace palpate
