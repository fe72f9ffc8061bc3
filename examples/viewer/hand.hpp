// SPDX-License-Identifier: MIT
#pragma once

#include "setup.hpp"

#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/hand_sample.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/device/sampled_mass.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace viewer {

/// Where the window wants the tip to be. This is all that the window and the device know of each other.
struct HandTarget {
  Vector position{0.0, 0.0, 0.08};   // m
  bool pressed = false;
};
using HandTargets = palpate::TripleBuffer<HandTarget>;

/// A tip that follows the pointer smoothly: a mass on a critically damped spring to the target, held back to a hand's speed.
///   m ẍ = m ω² (r − x) − 2 m ω ẋ,   |r − x| ≤ 2 v_max / ω, which keeps the speed below v_max
/// Limits     the pointer leads and nothing yields: a mouse has no motors.
class MouseHand {
 public:
  MouseHand(std::shared_ptr<HandTargets> targets, Vector const& start) : targets_(std::move(targets)), position_(start) {}

  palpate::Capabilities capabilities() const noexcept {
    return {.max_force = 3.3, .rate = 1000.0, .reports_velocity = true, .buttons = 1, .moves_a_hand = false};
  }
  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    HandTarget const& target = targets_->read();
    double const farthest = 2.0 * (target.pressed ? pressed_speed : free_speed) / frequency;
    Vector way = target.position - position_;
    if (double const length = way.norm(); length > farthest) way *= farthest / length;
    mass_.step(position_, velocity_, Vector::Zero(), position_ + way);
    state.position = position_;
    state.velocity = velocity_;
    state.buttons = target.pressed ? 1u : 0u;
    return palpate::DeviceStatus::ok;
  }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }

  /// Puts the hand down somewhere, at rest.
  void place(Vector const& position) noexcept {
    position_ = position;
    velocity_.setZero();
  }
  Vector const& position() const noexcept { return position_; }
  std::shared_ptr<HandTargets> const& targets() const noexcept { return targets_; }

 private:
  static constexpr double mass = 0.1, frequency = 35.0;                // kg, 1/s
  static constexpr double free_speed = 0.5, pressed_speed = 0.12;      // m/s

  std::shared_ptr<HandTargets> targets_;
  palpate::SampledMass<double> mass_{{.mass = mass, .damping = 2.0 * mass * frequency, .stiffness = mass * frequency * frequency, .rate = 1000.0}};
  Vector position_, velocity_ = Vector::Zero();
};

/// A device of the simulator: a hand, or a recorded one in its place; and a log of either.
template <class Hand>
class LoggedHand {
 public:
  explicit LoggedHand(Hand hand) : hand_(std::move(hand)), turns_(hand_.capabilities().reports_orientation) {}

  palpate::Capabilities capabilities() const noexcept {
    palpate::Capabilities all = replay_ ? replay_->capabilities() : hand_.capabilities();
    all.moves_a_hand = false;   // whoever was recorded
    return all;
  }
  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    palpate::DeviceStatus const status = replay_ ? replay_->read(state) : hand_.read(state);
    last_.position = state.position;
    last_.velocity = state.velocity;
    if (turns_) last_.orientation = state.orientation;
    last_.read = status;
    if (log_.size() < log_.capacity()) log_.push_back(last_);
    return status;
  }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }

  Hand& hand() noexcept { return hand_; }
  Hand const& hand() const noexcept { return hand_; }

  /// The last sample, and so many of them from now on. Between runs, as all that follows.
  palpate::HandSample const& last() const noexcept { return last_; }
  void begin_log(std::size_t room) { log_.reserve(room); }
  std::vector<palpate::HandSample> take_log() noexcept { return std::exchange(log_, {}); }

  void begin_replay(palpate::ReplayDevice<double> replay) { replay_.emplace(std::move(replay)); }
  bool replays() const noexcept { return replay_.has_value(); }
  bool replay_is_over() const noexcept { return replay_ && replay_->finished(); }
  /// The hand takes over; it is to be placed where the recorded one is.
  void end_replay() noexcept { replay_.reset(); }

 private:
  Hand hand_;
  bool turns_;   // it says how it is turned
  palpate::HandSample last_;
  std::optional<palpate::ReplayDevice<double>> replay_;
  std::vector<palpate::HandSample> log_;   // nothing is kept while it has no room
};

using ViewerHand = LoggedHand<MouseHand>;
static_assert(palpate::HapticDevice<ViewerHand>);

}  // namespace viewer
