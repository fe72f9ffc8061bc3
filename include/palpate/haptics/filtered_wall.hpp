// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/haptics/sampled_wall.hpp>

#include <cmath>
#include <complex>
#include <concepts>
#include <limits>
#include <numbers>

namespace palpate {

/// A linear filter between rendered force and motors, or between sensor and model: its response to a wave of `turn` radians a tick, and
/// its delay at low frequency. Beyond the syntax: response 1 at turn 0; `validate` throws for options without meaning.
template <class T>
concept LoopFilter = requires(T const& filter, double turn, double period) {
  { filter.response(turn, period) } -> std::convertible_to<std::complex<double>>;
  { filter.delay(period) } -> std::convertible_to<double>;
  filter.validate();
};

/// The mean of the last forces.   H = (1 − z⁻ⁿ) / (n (1 − z⁻¹)),   (n − 1) T/2 late
struct MovingAverage {
  int samples = 1;

  void validate() const {
    detail::OptionCheck{"MovingAverage"}(samples >= 1 && samples <= 1000, ".samples", samples, "give a number from 1 to 1000");
  }
  std::complex<double> response(double turn, double) const {
    double const below = samples * std::sin(turn / 2);
    return below == 0.0 ? 1.0 : std::polar(1.0, -turn * (samples - 1) / 2) * (std::sin(samples * turn / 2) / below);
  }
  double delay(double period) const { return (samples - 1) * period / 2; }
};

/// A low-pass of first order.   y = a y₋ + (1 − a) u,   a = e^(−2π f T);   T a/(1 − a) late, less than the 1/(2π f) of one in continuous time
struct OnePole {
  double cutoff = 100.0;   ///< f [Hz]

  void validate() const {
    detail::OptionCheck{"OnePole"}.positive(".cutoff", cutoff, " Hz");
  }
  std::complex<double> response(double turn, double period) const {
    double const a = pole(period);
    return (1.0 - a) / (1.0 - std::polar(a, -turn));
  }
  double delay(double period) const { return period / std::expm1(2 * std::numbers::pi * cutoff * period); }

 private:
  double pole(double period) const { return std::exp(-2 * std::numbers::pi * cutoff * period); }
};

/// A delay by whole ticks, as of a driver or a network.
struct TickDelay {
  int ticks = 1;

  void validate() const {
    detail::OptionCheck{"TickDelay"}(ticks >= 0 && ticks <= 1000, ".ticks", ticks, "give a number from 0 to 1000");
  }
  std::complex<double> response(double turn, double) const { return std::polar(1.0, -turn * ticks); }
  double delay(double period) const { return ticks * period; }
};

/// Rule of thumb for the stiffest stable wall [N/m] of a mass with damping, with a delay t in the loop beside the hold.
///   K ≈ b / (T/2 + t)
/// Units      kg, N·s/m, s. With `filters.delay(period)` for t it is within 2 % of `stable_wall(…, MovingAverage{…})`, 4 % of a OnePole,
///            where b T/m is small.
/// Source     \cite gil2004
/// Errors     InvalidArgument for what is not positive, and for a delay below zero.
inline double stable_wall_estimate(double damping, double period, double delay) {
  detail::require_servo("stable_wall_estimate", 1.0, damping, period);
  detail::require_non_negative("stable_wall_estimate: the delay", delay, "s");
  return damping / (period / 2 + delay);
}

/// The stiffest stable wall [N/m] of a mass with damping, with these filters in series in its loop. Filtering a force delays it, so it
/// costs stiffness: a mean of 15 forces leaves a fifteenth.
///   stable_wall(0.075, 0.5, 0.001)                      1001 N/m
///   stable_wall(0.075, 0.5, 0.001, OnePole{100.0})       307 N/m
/// The least K where 1 + K P(z) H(z) = 0 on the unit circle, P the mass under zero-order hold, H the filters; searched at some 5000
/// frequencies, then by bisection.
/// Units      kg, N·s/m, s.
/// Source     Nyquist's criterion for the sampled loop, \cite franklin1998 ch. 4.
/// Errors     InvalidArgument for what is not positive; 0 for a mass without damping.
/// Cost       Below 1 ms: for set-up.
template <LoopFilter... Filters>
  requires(sizeof...(Filters) > 0)
double stable_wall(double mass, double damping, double period, Filters const&... filters) {
  detail::require_servo("stable_wall", mass, damping, period);
  (filters.validate(), ...);
  using Complex = std::complex<double>;
  double const y = damping / mass * period, loss = -std::expm1(-y);   // 1 − e^(−y)
  if (!(loss > 0.0)) return 0.0;
  // x of x₋, v₋ and the force held:  x = x₋ + φ v₋ + g u,  v = (1 − loss) v₋ + (φ/m) u
  double const phi = loss * mass / damping;
  double const g = (y < 1e-3 ? period * (y / 2 - y * y / 6 + y * y * y / 24) : period - phi) / damping;
  auto const loop = [&](double turn) {
    double const half = std::sin(turn / 2);
    Complex const ahead(-2 * half * half, std::sin(turn)), decay = ahead + loss;   // z − 1, z − e
    Complex value = (g * decay + phi * phi / mass) / (ahead * decay);
    ((value *= Complex(filters.response(turn, period))), ...);
    return value;
  };
  double least = std::numeric_limits<double>::infinity();
  auto const meets = [&](Complex const& at) {
    if (at.real() < 0.0) least = std::fmin(least, -1.0 / at.real());
  };
  auto const between = [&](double low, double high, bool below) {   // the imaginary part is below zero at `low`, or above
    for (int k = 0; k < 60; ++k) {
      double const middle = (low + high) / 2;
      ((loop(middle).imag() < 0.0) == below ? low : high) = middle;
    }
    meets(loop(low));
  };
  double late = period / 2;   // s
  ((late += filters.delay(period)), ...);
  if (damping * late < 1e-12 * mass && late > 0.0) return damping / late;   // the rule of thumb is exact for so little damping
  // The loop turns over near √(b/(m·late)) rad/s, or above.
  double const lowest = std::fmax(1e-100, std::fmin(1e-8, 0.1 * period * std::sqrt(damping / (mass * late))));
  double last = lowest;
  bool below = loop(last).imag() < 0.0;
  auto const look = [&](double turn) {
    bool const now = loop(turn).imag() < 0.0;
    if (now != below) between(last, turn, below);
    last = turn, below = now;
  };
  double const pi = std::numbers::pi;
  constexpr int count = 4096;
  for (double turn = 1.1 * lowest; turn < pi / count; turn *= 1.02) look(turn);
  for (int k = 1; k < count; ++k) look(pi * k / count);
  meets(loop(pi));
  return least;
}

}  // namespace palpate
