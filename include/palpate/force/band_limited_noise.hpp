// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/noise.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace palpate {

struct BandLimitedNoiseOptions {
  double snr_db = 30.0;      ///< signal-to-noise ratio [dB]
  std::uint64_t seed = 0;    ///< the same seed gives the same run
  double reference = 0.0;    ///< N, as for `NoiseOptions`
  double bandwidth = 100.0;  ///< Hz, where the power is down to half
  double rate = 1000.0;      ///< Hz, of the servo: one draw a tick
};

/// Band-limited Gaussian noise along the force: white noise through a second-order Butterworth low-pass, rescaled to the signal-to-noise
/// ratio. It has no power above what a device can render.
///   |H(f)|² = 1 / (1 + (tan(π f/rate) / tan(π bandwidth/rate))⁴)
/// From about 1.8 bandwidths on its density is below a tenth, from 3.2 on below a hundredth of that at low frequencies.
/// Units      Hz; snr in dB of power ratio; force [N].
/// Source     \cite oppenheim2010 ch. 7, bilinear transform. The filter begins in its stationary state, drawn from the seed: no start-up.
/// Invariant  As for `WhiteGaussianNoise`; rate/10,000 ≤ bandwidth < rate/2, checked at set-up.
/// Cost       About 10 ns; noexcept, no allocation: allowed in the servo tick.
/// Limits     It counts ticks, not time: draw once a tick, at the stated rate.
template <RealScalar S>
class BandLimitedNoise {
 public:
  using Scalar = S;

  explicit BandLimitedNoise(BandLimitedNoiseOptions options = {})
      : options_(options), level_("BandLimitedNoise", {options.snr_db, options.seed, options.reference}) {
    if (!(options.rate > 0.0) || !std::isfinite(options.rate))
      throw InvalidArgument(detail::message("BandLimitedNoise: .rate is ", options.rate, " Hz; give the rate of the servo, 1000 for most"));
    if (!(options.bandwidth >= 1e-4 * options.rate) || !(options.bandwidth < options.rate / 2.0))   // lower, the filter's numbers cancel
      throw InvalidArgument(detail::message("BandLimitedNoise: .bandwidth is ", options.bandwidth, " Hz; give a frequency from ", 1e-4 * options.rate,
                                            " Hz on and below half the rate, ", options.rate / 2.0, " Hz"));
    design();
    reset();
  }

  /// What to add to the noiseless force in this tick.
  Vector3<S> draw(Vector3<S> const& force) noexcept {
    double const in = random_.normal<double>();
    double const out = gain_ * in + first_;
    first_ = 2.0 * gain_ * in - a1_ * out + second_;
    second_ = gain_ * in - a2_ * out;
    return level_.along(force, S(out));
  }

  /// Starts the sequence of its seed anew.
  void reset() noexcept {
    random_ = Random(Seed{options_.seed});
    double const one = random_.normal<double>(), two = random_.normal<double>();
    first_ = start_first_ * one;
    second_ = start_shared_ * one + start_second_ * two;
  }

  BandLimitedNoiseOptions const& options() const noexcept { return options_; }

 private:
  /// y = g (1 + z⁻¹)² / (1 + a₁ z⁻¹ + a₂ z⁻²) x, with g such that y has variance 1, and the covariance of its two states.
  void design() {
    double const k = std::tan(std::numbers::pi * options_.bandwidth / options_.rate);
    double const scale = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
    a1_ = 2.0 * (k * k - 1.0) * scale;
    a2_ = (1.0 - std::numbers::sqrt2 * k + k * k) * scale;
    // Covariance P = A P Aᵀ + B Bᵀ of the states without gain, A = (−a₁ 1; −a₂ 0), B = (2 − a₁, 1 − a₂): three linear equations,
    // of which the second and third are p₁₂ = a₁ a₂ p₁₁ − a₂ p₁₂ + b₁ b₂ and p₂₂ = a₂² p₁₁ + b₂².
    double const b1 = 2.0 - a1_, b2 = 1.0 - a2_;
    double const free = b1 * b1 + b2 * b2 - 2.0 * a1_ * b1 * b2 / (1.0 + a2_);
    double const p11 = free / (1.0 - a1_ * a1_ - a2_ * a2_ + 2.0 * a1_ * a1_ * a2_ / (1.0 + a2_));
    double const p12 = (a1_ * a2_ * p11 + b1 * b2) / (1.0 + a2_), p22 = a2_ * a2_ * p11 + b2 * b2;
    gain_ = 1.0 / std::sqrt(1.0 + p11);   // y = x + first state: variance 1 + p₁₁ before the gain
    start_first_ = gain_ * std::sqrt(p11);
    start_shared_ = gain_ * p12 / std::sqrt(p11);
    start_second_ = gain_ * std::sqrt(std::fmax(0.0, p22 - p12 * p12 / p11));
  }

  BandLimitedNoiseOptions options_;
  detail::NoiseLevel<S> level_;
  Random random_;
  double a1_ = 0, a2_ = 0, gain_ = 1;
  double start_first_ = 0, start_shared_ = 0, start_second_ = 0;   // Cholesky factor of the covariance
  double first_ = 0, second_ = 0;                                  // the filter's state
};

}  // namespace palpate
