// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/wrapped_device.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

namespace palpate {

struct HandTremorOptions {
  double frequency = 10.0;    ///< Hz, the middle of the band; a hand at rest trembles at 8 to 12
  double bandwidth = 4.0;     ///< Hz, between the half-power points
  double amplitude = 5e-5;    ///< m, root mean square along each axis
  double rate = 1000.0;       ///< Hz, of the servo: one step a tick
  std::uint64_t seed = 0;     ///< the same seed gives the same run
};

/// Physiological tremor: a displacement of the tip, on each axis an independent narrow-band Gaussian process (autoregressive of order 2).
///   x[k] = 2 r cos θ x[k−1] − r² x[k−2] + g ξ[k],   r = e^(−π bandwidth/rate),   θ = 2π frequency/rate
/// with g such that x has the stated root mean square. It begins in its stationary state, drawn from the seed.
/// Units      Hz, m.
/// Source     Band: \cite elble1976, physiological tremor of 8 to 12 Hz. Amplitude: not of a person, choose it.
/// Invariant  0 < frequency < rate/2, bandwidth > 0, amplitude ≥ 0, all finite; checked at set-up.
/// Cost       About 30 ns; noexcept, no allocation: allowed in the servo tick.
template <RealScalar S>
class HandTremor {
 public:
  using Scalar = S;

  explicit HandTremor(HandTremorOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"HandTremor", true};
    require(options.rate > 0.0, ".rate", options.rate, " Hz", "give the rate of the servo, 1000 for most");
    require(options.frequency > 0.0 && options.frequency < options.rate / 2.0, ".frequency", options.frequency, " Hz",
            "give one above 0 and below half the rate, 8 to 12 for a hand");
    require(options.bandwidth > 0.0, ".bandwidth", options.bandwidth, " Hz", "give a finite one above 0");
    require(options.amplitude >= 0.0, ".amplitude", options.amplitude, " m", "give a finite one, zero or more");
    double const r = std::exp(-std::numbers::pi * options.bandwidth / options.rate), cosine = std::cos(2.0 * std::numbers::pi * options.frequency / options.rate);
    one_ = 2.0 * r * cosine, two_ = -r * r;
    correlation_ = one_ / (1.0 - two_);   // of two samples that follow each other
    gain_ = options.amplitude * std::sqrt((1.0 + two_) * ((1.0 - two_) * (1.0 - two_) - one_ * one_) / (1.0 - two_));
    reset();
  }

  /// The displacement in the next tick [m].
  Vector3<S> step() noexcept {
    Vector3<double> next;
    for (int axis = 0; axis < 3; ++axis) next[axis] = one_ * now_[axis] + two_ * before_[axis] + gain_ * random_.normal<double>();
    before_ = now_;
    now_ = next;
    return now_.cast<S>();
  }
  /// How fast it moves [m/s]: the difference of the last two displacements.
  Vector3<S> velocity() const noexcept { return ((now_ - before_) * options_.rate).cast<S>(); }

  void reset() noexcept {
    random_ = Random(Seed{options_.seed});
    for (int axis = 0; axis < 3; ++axis) {
      double const one = random_.normal<double>(), two = random_.normal<double>();
      before_[axis] = options_.amplitude * one;
      now_[axis] = options_.amplitude * (correlation_ * one + std::sqrt(1.0 - correlation_ * correlation_) * two);
    }
  }

  HandTremorOptions const& options() const noexcept { return options_; }

 private:
  HandTremorOptions options_;
  Random random_;
  double one_ = 0, two_ = 0, gain_ = 0, correlation_ = 0;
  Vector3<double> now_ = Vector3<double>::Zero(), before_ = Vector3<double>::Zero();
};

/// A device with tremor: its positions are displaced, its forces are passed on unchanged.
///   TremblingDevice device(ScriptedDevice<double>(path), HandTremor<double>({.amplitude = 1e-4, .seed = 3}));
/// Errors     InvalidArgument where the tremor is of another rate than the device states, by more than a tenth: its band and speed would be as wrong. A device
///            that has to be opened to know its rate is not asked.
/// Cost       As the device's and the tremor's; noexcept, no allocation.
/// Limits     The tremor does not yield to the force, and pauses in ticks in which the device has no new sample.
template <class Device, RealScalar S>
  requires HapticDevice<Device, S>
class TremblingDevice : public detail::WrappedDevice<Device, S> {
  using Wrapped = detail::WrappedDevice<Device, S>;
  using Wrapped::device_;

 public:
  TremblingDevice(Device device, HandTremor<S> tremor) : Wrapped(std::move(device)), tremor_(std::move(tremor)) {
    if constexpr (!OpensAndCloses<Device>) {
      double const rate = device_.capabilities().rate, of_tremor = tremor_.options().rate;
      if (rate > 0 && !(std::abs(of_tremor - rate) <= rate / 10))
        throw InvalidArgument(detail::message("TremblingDevice: the tremor's rate is ", of_tremor, " Hz, and the device's servo has ", rate, " Hz; give the tremor .rate = ", rate));
    }
  }

  DeviceStatus read(DeviceState<S>& state) noexcept {
    if (!knows_) knows_ = true, moves_ = device_.capabilities().reports_velocity;
    DeviceState<S> steady = state;
    steady.position = position_;   // as the device left it, whatever it leaves
    if (moves_) steady.velocity = velocity_;
    DeviceStatus const status = device_.read(steady);
    if (!is_usable(status)) return status;
    position_ = steady.position, velocity_ = steady.velocity;
    if (status == DeviceStatus::ok) shift_ = tremor_.step();
    state = steady;
    state.position += shift_;
    if (moves_) state.velocity += tremor_.velocity();
    return status;
  }
  DeviceStatus write(Wrench<S> const& wrench) noexcept { return device_.write(wrench); }

 private:
  HandTremor<S> tremor_;
  bool knows_ = false, moves_ = false;   // whether the device reports velocities, asked in the first read
  Vector3<S> position_ = Vector3<S>::Zero(), velocity_ = Vector3<S>::Zero(), shift_ = Vector3<S>::Zero();   // of the steady hand; of the last tick
};

}  // namespace palpate
