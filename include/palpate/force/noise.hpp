// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/force/concept.hpp>

#include <cmath>
#include <cstdint>

namespace palpate {

struct NoiseOptions {
  double snr_db = 30.0;      ///< signal-to-noise ratio [dB]; the thesis uses 30
  std::uint64_t seed = 0;    ///< the same seed gives the same run
  double reference = 0.0;    ///< N, the signal that the ratio is meant for; 0: the noiseless force of the same tick
};

namespace detail {

/// How strong a noise is beside a force, and which way it points.
template <RealScalar S>
class NoiseLevel {
 public:
  NoiseLevel(char const* who, NoiseOptions const& options)
      : ratio_(S(std::pow(10.0, -options.snr_db / 20.0))), sigma_(S(options.reference) * ratio_) {
    if (!std::isfinite(options.snr_db) || !std::isfinite(ratio_))
      throw InvalidArgument(message(who, ": .snr_db is ", options.snr_db, "; give a finite number of decibels, 30 for noise of 3 % of the force"));
    if (!(options.reference >= 0.0) || !std::isfinite(sigma_))
      throw InvalidArgument(message(who, ": .reference is ", options.reference, " N; give a finite force above zero, or 0 for the force of the same tick"));
  }

  /// `unit`, of variance 1, as a force along the noiseless one.
  Vector3<S> along(Vector3<S> const& force, S unit) const noexcept {
    if (!(sigma_ > S(0))) return ratio_ * unit * force;
    S const size = force.norm();
    return size > S(0) ? Vector3<S>(sigma_ * unit / size * force) : Vector3<S>(Vector3<S>::Zero());
  }

 private:
  S ratio_;   // 10^(−snr/20)
  S sigma_;   // N, 0 where the force itself is the reference
};

}  // namespace detail

/// White Gaussian noise along the force, of a given signal-to-noise ratio.
///   ΔF = R 10^(−snr/20) ξ F/|F|,   ξ normal with mean 0 and variance 1, new in every tick;  R = |F|, or `reference` where it is given
/// so its standard deviation is R 10^(−snr/20).
/// Units      snr in dB of power ratio; force [N].
/// Source     \cite zheng2006 ch. 6.5
/// Invariant  The SNR is finite, the reference finite and not negative; checked at set-up. A zero force has no noise.
/// Cost       About 10 ns; noexcept, no allocation: allowed in the servo tick.
/// Limits     Its power is spread evenly up to half the servo rate, above what a device renders: see `BandLimitedNoise`.
template <RealScalar S>
class WhiteGaussianNoise {
 public:
  using Scalar = S;

  explicit WhiteGaussianNoise(NoiseOptions options = {})
      : options_(options), level_("WhiteGaussianNoise", options), random_(Seed{options.seed}) {}

  /// What to add to the noiseless force in this tick.
  Vector3<S> draw(Vector3<S> const& force) noexcept { return level_.along(force, random_.normal<S>()); }

  /// Starts the sequence of its seed anew.
  void reset() noexcept { random_ = Random(Seed{options_.seed}); }

  NoiseOptions const& options() const noexcept { return options_; }

 private:
  NoiseOptions options_;
  detail::NoiseLevel<S> level_;
  Random random_;
};

}  // namespace palpate
