// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/simulator/tick.hpp>

#include <Eigen/Core>

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <span>

namespace retraction {

/// N, the root mean square of what a force holds above a frequency [Hz]: the lines of its discrete Fourier transform from there up to half the rate, by Parseval's
/// theorem, of all three directions. A slow drift counts, too: its ends do not meet.
inline double rms_above(std::span<palpate::Tick const> ticks, double hertz, double rate) {
  std::size_t const count = ticks.size();
  double sum = 0;
  for (auto k = static_cast<std::size_t>(std::ceil(hertz * static_cast<double>(count) / rate)); 2 * k <= count; ++k) {
    Eigen::Vector3cd line = Eigen::Vector3cd::Zero();
    for (std::size_t i = 0; i < count; ++i)
      line += std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k * i % count) / static_cast<double>(count)) * ticks[i].force;
    sum += (2 * k == count ? 1 : 2) * line.squaredNorm();
  }
  return std::sqrt(sum) / static_cast<double>(count);
}

/// The ticks from a time on [s].
inline std::span<palpate::Tick const> ticks_from(std::span<palpate::Tick const> ticks, double time) {
  std::size_t first = 0;
  while (first < ticks.size() && ticks[first].time < time) ++first;
  return ticks.subspan(first);
}

}  // namespace retraction
