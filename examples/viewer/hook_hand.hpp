// SPDX-License-Identifier: MIT
#pragma once

#include "hand.hpp"

#include <palpate/tool/built_in_shapes.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace viewer {

constexpr palpate::HookShape hook_shape{.radius = 0.0015, .point = 0.012, .shaft = 0.11, .bend = std::numbers::pi / 4};   // m, rad

/// Where the window wants the hook to be.
struct HookTarget {
  Vector place = Vector::Zero(), normal = Vector::UnitZ();   // m, of the undisturbed skin, and its way out
  Vector side = -Vector::UnitX();                            // where its shaft leads
  Vector drawn = Vector::Zero();                             // m, aside, from there
  bool is_held = false;
  unsigned number = 0;   // of the times that it was put in, from 1 on
};
using HookTargets = palpate::TripleBuffer<HookTarget>;

/// What the window wants of both hands.
struct Targets {
  std::shared_ptr<HandTargets> mouse = std::make_shared<HandTargets>(HandTarget{});
  std::shared_ptr<HookTargets> hook = std::make_shared<HookTargets>(HookTarget{});
};

/// A second hand, which puts the hook in where it is told, draws it aside and holds it there, until it is to take it away: it goes back to where it
/// went in, lifts it and waits high above the organ. It moves as MouseHand does, and the shaft turns to the side that it draws to, about the normal.
/// Limits     nothing yields, as with MouseHand: it holds its place, not a force.
class HookHand {
 public:
  explicit HookHand(std::shared_ptr<HookTargets> targets) : targets_(std::move(targets)) { turn(side_, 2.0 * full_turn); }

  /// Where it waits [m].
  static Vector parked_at() noexcept { return HandTarget{}.position + Vector(0.0, 0.0, 0.25); }

  palpate::Capabilities capabilities() const noexcept {
    return {.max_force = 3.3, .rate = 1000.0, .reports_velocity = true, .reports_orientation = true, .moves_a_hand = false};
  }
  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    follow(targets_->read());
    Vector way = goal() - position_;
    double const farthest = 2.0 * speed() / frequency;
    if (double const length = way.norm(); length > farthest) way *= farthest / length;
    mass_.step(position_, velocity_, Vector::Zero(), position_ + way);
    if (stage_ == Stage::parked || (stage_ == Stage::going && (position_ - parked_at()).norm() < 1e-4)) park();
    turn(stage_ == Stage::held && drawn_.norm() > 1e-4 ? drawn_ : side_, turning_speed / 1000.0);
    state.position = position_;
    state.velocity = velocity_;
    state.orientation = orientation_;
    return palpate::DeviceStatus::ok;
  }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }

  // --- between runs -----------------------------------------------------------------------------------------------------
  /// Takes the hook away, straight up, and does not put it in again before it is told to anew. Returns whether it held it, or was to.
  bool lift() noexcept {
    HookTarget const& target = targets_->read();
    bool const was_to_come = target.is_held && target.number != lifted_ && target.number != number_;
    lifted_ = target.number;
    if (stage_ == Stage::parked || stage_ == Stage::going || stage_ == Stage::raising) return was_to_come;
    stage_ = stage_ == Stage::coming ? Stage::going : Stage::raising;
    return true;
  }
  /// The number of the target that it was taken away from.
  unsigned lifted() const noexcept { return lifted_; }
  /// Finds the hook somewhere, at rest, and takes it away.
  void place(Vector const& position, Eigen::Quaterniond const& orientation) noexcept {
    stage_ = Stage::raising;   // lift() leaves it
    lift();
    position_ = position;
    velocity_.setZero();
    orientation_ = orientation;
    normal_ = orientation * (Eigen::AngleAxisd(-tilt, Vector::UnitX()) * Vector::UnitZ());
    side_ = leads_ = (orientation * Vector::UnitX()).cross(-normal_);
    place_ = position + depth * normal_;
    drawn_.setZero();
    if (is_parked(position)) park();
  }
  /// Where it is.
  palpate::HandSample sample() const noexcept {
    palpate::HandSample sample;
    sample.position = position_;
    sample.orientation = orientation_;
    return sample;
  }
  static bool is_parked(Vector const& position) noexcept { return (position - parked_at()).norm() < 1e-9; }

 private:
  enum class Stage { parked, coming, lowering, held, relaxing, raising, going };

  static constexpr double mass = 0.1, frequency = 35.0;                                     // kg, 1/s
  static constexpr double free_speed = 0.5, near_speed = 0.08, drawing_speed = 0.05;        // m/s
  static constexpr double touching_speed = 0.010;   // m/s: in long steps a solid gives way slowly, and the point is not to go through its skin
  static constexpr double turning_speed = 3.0, full_turn = 3.2, tilt = 0.25;                // rad/s, rad; it looks a little to the side that it draws to
  static constexpr double above = 0.020, touching = 0.003, depth = 0.003, near_enough = 0.001;   // m

  /// Where it is to be now.
  Vector goal() const noexcept {
    switch (stage_) {
      case Stage::coming: return place_ + above * normal_;
      case Stage::lowering:
      case Stage::relaxing: return place_ - depth * normal_;
      case Stage::held: return place_ - depth * normal_ + drawn_;
      case Stage::raising: return place_ + above * normal_ + drawn_;
      default: return parked_at();
    }
  }
  double speed() const noexcept {
    switch (stage_) {
      case Stage::lowering: return (position_ - place_).dot(normal_) > touching ? near_speed : touching_speed;
      case Stage::raising: return near_speed;
      case Stage::held:
      case Stage::relaxing: return drawing_speed;
      default: return free_speed;
    }
  }
  void follow(HookTarget const& target) noexcept {
    bool const wanted = target.is_held && target.number != lifted_, same = wanted && target.number == number_;
    bool const is_there = (position_ - goal()).norm() < near_enough;
    switch (stage_) {
      case Stage::parked:
      case Stage::going:
        if (!wanted) break;
        place_ = target.place, normal_ = target.normal, side_ = target.side, number_ = target.number;
        drawn_.setZero();
        leads_ = (side_ - side_.dot(normal_) * normal_).normalized();
        stage_ = Stage::coming;
        break;
      case Stage::coming:
        if (!same) stage_ = Stage::going;
        else if (is_there) stage_ = Stage::lowering;
        break;
      case Stage::lowering:
        if (!same) stage_ = Stage::raising;
        else if (is_there) stage_ = Stage::held;
        break;
      case Stage::held:
        if (same) drawn_ = target.drawn;
        else stage_ = Stage::relaxing;
        break;
      case Stage::relaxing:
        if (is_there) stage_ = Stage::raising, drawn_.setZero();
        break;
      case Stage::raising:
        if (is_there) stage_ = Stage::going;
        break;
    }
  }
  void park() noexcept {
    stage_ = Stage::parked;
    position_ = parked_at();
    velocity_.setZero();
  }
  /// Turns the shaft towards a side, by so much at most [rad].
  void turn(Vector const& side, double most) noexcept {
    double const angle = std::atan2(normal_.dot(leads_.cross(side)), leads_.dot(side));
    leads_ = Eigen::AngleAxisd(std::clamp(angle, -most, most), normal_) * leads_;
    Eigen::Matrix3d frame;
    frame.col(2) = normal_;
    frame.col(1) = (leads_ - leads_.dot(normal_) * normal_).normalized();
    frame.col(0) = frame.col(1).cross(frame.col(2));
    orientation_ = Eigen::Quaterniond(frame) * Eigen::AngleAxisd(tilt, Vector::UnitX());
  }

  std::shared_ptr<HookTargets> targets_;
  palpate::SampledMass<double> mass_{{.mass = mass, .damping = 2.0 * mass * frequency, .stiffness = mass * frequency * frequency, .rate = 1000.0}};
  Stage stage_ = Stage::parked;
  Vector position_ = parked_at(), velocity_ = Vector::Zero();
  Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
  Vector place_ = Vector::Zero(), normal_ = Vector::UnitZ(), side_ = -Vector::UnitX(), leads_ = side_, drawn_ = Vector::Zero();   // as in HookTarget
  unsigned number_ = 0, lifted_ = 0;
};

using ViewerHook = LoggedHand<HookHand>;
static_assert(palpate::HapticDevice<ViewerHook>);

}  // namespace viewer
