// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/training/comparison.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace palpate {

/// How one part of a score is counted: `weight` in the whole, and the error `half` at which half of the points are left.
struct ScoreScale {
  double weight = 1.0;
  double half = 1.0;
};

/// The scales of all parts. The defaults are ours, of the size of a stroke of some centimetres; no study stands behind them.
struct ScoreOptions {
  ScoreScale path{.weight = 2.0, .half = 0.002};       ///< mean deviation [m]
  ScoreScale missed{.weight = 1.0, .half = 0.005};     ///< of the expert's path [m]
  ScoreScale force{.weight = 1.0, .half = 0.2};        ///< rms difference [N]
  ScoreScale smoothness{.weight = 1.0, .half = 3.0};   ///< excess jerk [1]: twenty times the expert's
  ScoreScale time{.weight = 1.0, .half = 0.5};         ///< excess time [1]
  ScoreScale depth{.weight = 1.0, .half = 0.002};      ///< mean depth error [m]
  ScoreScale overshoot{.weight = 1.0, .half = 0.001};  ///< [m]
  ScoreScale contacts{.weight = 1.0, .half = 1.0};     ///< unintended contacts [1]
};

enum class ScorePart : std::size_t { path, missed, force, smoothness, time, depth, overshoot, contacts };
inline constexpr std::size_t score_parts = 8;

constexpr char const* to_string(ScorePart part) noexcept {
  constexpr std::array<char const*, score_parts> names{"path", "missed", "force", "smoothness", "time", "depth", "overshoot", "contacts"};
  auto const k = static_cast<std::size_t>(part);
  return k < names.size() ? names[k] : "unknown";
}

/// Points from 0 to 100, and what they are made of.
struct Score {
  struct Line {
    ScorePart part = ScorePart::path;
    double error = 0.0;    ///< in the unit of `ScoreOptions`
    double points = 0.0;   ///< 0 to 100
    double weight = 0.0;
  };

  double total = 0.0;
  std::array<Line, score_parts> lines{};

  Line const& operator[](ScorePart part) const noexcept { return lines[static_cast<std::size_t>(part)]; }
};

/// The score of a comparison.
///   points = 100 · 2^(−error / half), total = 100 − Σ weight · (100 − points) / Σ weight; an error below zero (smoother, faster) counts as zero
/// A trainee who never touched what the expert touched, within `ComparisonOptions::region`, has no points.
/// Invariant  a session and itself: 100 in all. No part and not the total grows when an error does.
/// Errors     `InvalidArgument` for a weight below zero, a half that is not positive, or no weight at all.
inline Score score(Comparison const& comparison, ScoreOptions const& options = {}) {
  std::array<std::pair<ScoreScale, double>, score_parts> const parts{{{options.path, comparison.mean_deviation},
                                                                      {options.missed, comparison.missed},
                                                                      {options.force, comparison.rms_force_difference},
                                                                      {options.smoothness, comparison.excess_jerk},
                                                                      {options.time, comparison.excess_time},
                                                                      {options.depth, comparison.mean_depth_error},
                                                                      {options.overshoot, comparison.overshoot},
                                                                      {options.contacts, static_cast<double>(comparison.unintended_contacts)}}};
  Score result;
  bool const did_nothing = comparison.did_nothing || (comparison.expert.contacts > 0 && comparison.trainee.contacts == 0);   // smooth, quick and never too deep
  double weights = 0.0;
  for (std::size_t k = 0; k < score_parts; ++k) {
    auto const part = static_cast<ScorePart>(k);
    auto const& [scale, error] = parts[k];
    if (!(scale.weight >= 0.0) || !std::isfinite(scale.weight))
      throw InvalidArgument(detail::message("score: the weight of ", to_string(part), " is ", scale.weight, "; give a finite number, zero or more"));
    if (!(scale.half > 0.0) || !std::isfinite(scale.half))
      throw InvalidArgument(
          detail::message("score: .half of ", to_string(part), " is ", scale.half, "; give the error that costs half of the points"));
    result.lines[k] = {part, error, did_nothing ? 0.0 : 100.0 * std::exp2(-std::max(0.0, error) / scale.half), scale.weight};
    weights += scale.weight;
  }
  if (!(weights > 0.0)) throw InvalidArgument("score: all weights are 0; give one part a weight");
  result.total = 100.0;
  for (Score::Line const& line : result.lines) result.total -= line.weight / weights * (100.0 - line.points);
  result.total = did_nothing ? 0.0 : std::max(0.0, result.total);   // shares of 100 that are rounded add up to more
  return result;
}

}  // namespace palpate
