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
};

/// White Gaussian noise along the force, as strong as a signal-to-noise ratio says.
///   ΔF = F 10^(−snr/20) ξ,   ξ normal with mean 0 and variance 1, new in every tick
/// so its standard deviation is |F| 10^(−snr/20), relative to the noiseless force of the same tick.
/// Units      snr in dB of power ratio; force [N].
/// Source     \cite zheng2006 ch. 6.5
/// Invariant  The SNR is finite; checked at set-up. A zero force has no noise.
/// Cost       About 10 ns; noexcept, no allocation: allowed in the servo tick.
template <RealScalar S>
class WhiteGaussianNoise {
 public:
  using Scalar = S;

  explicit WhiteGaussianNoise(NoiseOptions options = {})
      : options_(options), ratio_(S(std::pow(10.0, -options.snr_db / 20.0))), random_(Seed{options.seed}) {
    if (!std::isfinite(options.snr_db) || !std::isfinite(ratio_))
      throw InvalidArgument(detail::message("WhiteGaussianNoise: .snr_db is ", options.snr_db,
                                            "; give a finite number of decibels, 30 for noise of 3 % of the force"));
  }

  /// What to add to the noiseless force in this tick.
  Vector3<S> draw(Vector3<S> const& force) noexcept { return ratio_ * random_.normal<S>() * force; }

  /// Starts the sequence of its seed anew.
  void reset() noexcept { random_ = Random(Seed{options_.seed}); }

  NoiseOptions const& options() const noexcept { return options_; }

 private:
  NoiseOptions options_;
  S ratio_;
  Random random_;
};

static_assert(ForceNoise<WhiteGaussianNoise<double>, double>);

}  // namespace palpate
