// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/trajectory.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
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
///   m x″ = k (y − x) + b (y′ − x′) + F,  y the path with the flaws, F the force of the device
/// The tremor is a sum of sines, of frequencies from 8 to 12 Hz and phases out of the seed.
class Hand {
 public:
  // A firm grip; engineering values, not measurements.
  static constexpr double mass = 0.25, damping = 8.0, stiffness = 500.0;   // kg, N s/m, N/m

  Hand(Path path, Flaws const& flaws) : path_(std::move(path)), offset_(flaws.offset) {
    palpate::Random random(flaws.seed);
    for (Sine& sine : tremor_) {
      sine.omega = 2.0 * std::numbers::pi * random.uniform(8.0, 12.0);
      for (int axis = 0; axis < 3; ++axis) sine.phase(axis) = random.uniform(0.0, 2.0 * std::numbers::pi);
    }
    amplitude_ = flaws.tremor * std::sqrt(2.0 / static_cast<double>(tremor_.size()));
    position_ = wanted(0.0).position;
  }

  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .reports_velocity = true}; }   // N, Hz

  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    constexpr int steps = 10;
    constexpr double h = 1e-3 / steps;
    for (int k = 0; tick_ > 0 && k < steps; ++k) {   // since the last tick, under the force written then
      auto const want = wanted((static_cast<double>(tick_) - 1.0) * 1e-3 + k * h);
      velocity_ += h / mass * (stiffness * (want.position - position_) + damping * (want.velocity - velocity_) + force_);
      position_ += h * velocity_;
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

  struct Sine {
    double omega = 0.0;
    Vector phase = Vector::Zero();
  };

  palpate::Motion<double> wanted(double time) const noexcept {
    palpate::Motion<double> want = path_.at(time);
    double const t = std::min(1.0, time / drift_time);
    want.position += t * t * (3.0 - 2.0 * t) * offset_;
    want.velocity += 6.0 * t * (1.0 - t) / drift_time * offset_;
    for (Sine const& sine : tremor_)
      for (int axis = 0; axis < 3; ++axis) {
        want.position(axis) += amplitude_ * std::sin(sine.omega * time + sine.phase(axis));
        want.velocity(axis) += amplitude_ * sine.omega * std::cos(sine.omega * time + sine.phase(axis));
      }
    return want;
  }

  Path path_;
  Vector offset_;
  std::array<Sine, 5> tremor_;
  double amplitude_ = 0.0;
  std::uint64_t tick_ = 0;
  Vector position_, velocity_ = Vector::Zero(), force_ = Vector::Zero();
};

static_assert(palpate::HapticDevice<Hand>);

}  // namespace training
