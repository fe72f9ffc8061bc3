// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/device/trajectory.hpp>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace training {

using Vector = palpate::Vector3<double>;
using Path = palpate::Trajectory<double>;

/// What a novice does otherwise than wanted.
struct Flaws {
  Vector offset = Vector::Zero();   // m, into which it drifts over the first second
  double tremor = 0.0;              // m, rms in each direction; 8 to 12 Hz
  palpate::Seed seed{1};
};

/// A hand that follows a path as well as a mass on a spring and a damper does, and yields to what it feels:
///   m x″ = k (y − x) + b (y′ − x′) + F,  y the path with the flaws, F the force of the device, both held for a tick
class Hand {
 public:
  // A firm grip; engineering values, not measurements.
  static constexpr double mass = 0.25, damping = 8.0, stiffness = 500.0;   // kg, N s/m, N/m

  Hand(Path path, Flaws const& flaws)
      : path_(std::move(path)), offset_(flaws.offset), tremor_({.amplitude = flaws.tremor, .seed = flaws.seed.value}), position_(path_.at(0.0).position) {}

  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .reports_velocity = true, .moves_a_hand = false}; }   // N, Hz

  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    if (tick_ > 0) {   // since the last tick, under the force written then
      auto const want = wanted((static_cast<double>(tick_) - 1.0) * 1e-3);
      body_.step(position_, velocity_, damping * want.velocity + force_, want.position);
    }
    ++tick_;
    state.position = position_;
    state.velocity = velocity_;
    return palpate::DeviceStatus::ok;
  }
  palpate::DeviceStatus write(palpate::Wrench<double> const& wrench) noexcept {
    force_ = wrench.force;
    return palpate::DeviceStatus::ok;
  }

 private:
  static constexpr double drift_time = 1.0;   // s

  palpate::Motion<double> wanted(double time) noexcept {
    palpate::Motion<double> want = path_.at(time);
    double const t = std::min(1.0, time / drift_time);
    want.position += t * t * (3.0 - 2.0 * t) * offset_ + tremor_.step();
    want.velocity += 6.0 * t * (1.0 - t) / drift_time * offset_ + tremor_.velocity();
    return want;
  }

  Path path_;
  Vector offset_;
  palpate::HandTremor<double> tremor_;
  palpate::SampledMass<double> body_{{.mass = mass, .damping = damping, .stiffness = stiffness}};
  std::uint64_t tick_ = 0;
  Vector position_, velocity_ = Vector::Zero(), force_ = Vector::Zero();
};

static_assert(palpate::HapticDevice<Hand>);

}  // namespace training
