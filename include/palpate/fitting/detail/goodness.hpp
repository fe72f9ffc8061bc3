// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/fitting/measurements.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace palpate::detail {

/// How well a model meets the forces of measurements.
struct Goodness {
  double rms = 0.0;         ///< N, √(Σ r²/n)
  double r_squared = 0.0;   ///< 1 − Σ r²/Σ (F − mean F)²; −∞ where all forces are equal and the model misses them
};

inline Goodness goodness(std::span<Measurement const> used, std::span<double const> residuals) {
  double mean = 0.0, squares = 0.0, spread = 0.0;
  auto const count = static_cast<double>(used.size());
  for (Measurement const& m : used) mean += m.force / count;
  for (Measurement const& m : used) spread += (m.force - mean) * (m.force - mean);
  for (double const r : residuals) squares += r * r;
  bool const varies = spread > 1e-24 * mean * mean * count;
  return {std::sqrt(squares / count), varies ? 1.0 - squares / spread : squares > 0.0 ? -std::numeric_limits<double>::infinity() : 1.0};
}

/// Root mean square of the errors on measurements that were left out: each is once, with those of its fold, drawn by the seed. `fit_others(kept)` fits
/// the others and answers a function from a measurement to its error [N].
template <class FitOthers>
double leave_out(std::span<Measurement const> used, int folds, Seed seed, FitOthers const& fit_others) {
  std::vector<std::size_t> order(used.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Random random(seed);
  shuffle(std::span(order), random);
  double sum = 0.0;
  for (std::size_t fold = 0; fold < static_cast<std::size_t>(folds); ++fold) {
    std::vector<Measurement> kept, left_out;
    for (std::size_t k = 0; k < order.size(); ++k) (k % static_cast<std::size_t>(folds) == fold ? left_out : kept).push_back(used[order[k]]);
    auto const error = fit_others(std::span<Measurement const>(kept));
    for (Measurement const& m : left_out) sum += std::pow(error(m), 2);
  }
  return std::sqrt(sum / static_cast<double>(used.size()));
}

}  // namespace palpate::detail
