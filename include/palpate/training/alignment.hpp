// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace palpate::detail {

/// Every so many points of a path, its last one included.
class Samples {
 public:
  Samples(std::size_t points, std::size_t most) : points_(points), stride_(1 + (points - 2) / (most - 1)) { count_ = 1 + (points - 2) / stride_ + 1; }
  std::size_t count() const noexcept { return count_; }
  /// The point of a sample.
  std::size_t at(std::size_t sample) const noexcept { return std::min(sample * stride_, points_ - 1); }
  /// The sample at or before a point; never the last one.
  std::size_t before(std::size_t point) const noexcept { return std::min(point / stride_, count_ - 2); }

 private:
  std::size_t points_, stride_, count_;
};

/// Which samples were paired: for each row the columns from first to last, and the other way round.
struct Warp {
  std::vector<std::size_t> first_column, last_column, first_row, last_row;
  bool band_reached = false;
};

inline Warp warp_in_band(Matrix3X<double> const& path, Samples const& rows, Matrix3X<double> const& other, Samples const& columns, double band) {
  enum Step : std::uint8_t { diagonal, down, across };
  std::size_t const n = rows.count(), m = columns.count();
  double const slope = static_cast<double>(m - 1) / static_cast<double>(n - 1);
  double const half = std::max(band * static_cast<double>(m - 1), slope + 1.0);   // so that the rows hang together
  auto const first = [&](std::size_t i) { return static_cast<std::size_t>(std::max(0.0, std::ceil(slope * static_cast<double>(i) - half))); };
  auto const last = [&](std::size_t i) { return std::min(m - 1, static_cast<std::size_t>(std::floor(slope * static_cast<double>(i) + half))); };
  std::size_t const width = std::min(m, static_cast<std::size_t>(2.0 * half) + 2);
  constexpr double never = std::numeric_limits<double>::infinity();

  std::vector<std::uint8_t> steps(n * width, diagonal);
  std::vector<double> cost(m, never), above(m, never);
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t const from = first(i), to = last(i);
    std::fill(cost.begin(), cost.end(), never);
    Vector3<double> const point = path.col(static_cast<Eigen::Index>(rows.at(i)));
    for (std::size_t j = from; j <= to; ++j) {
      double const distance = (point - other.col(static_cast<Eigen::Index>(columns.at(j)))).norm();
      double best = i == 0 && j == 0 ? 2.0 * distance : never;
      Step step = diagonal;
      if (i > 0 && j > 0) best = above[j - 1] + 2.0 * distance;
      if (i > 0 && above[j] + distance < best) best = above[j] + distance, step = down;
      if (j > from && cost[j - 1] + distance < best) best = cost[j - 1] + distance, step = across;
      cost[j] = best;
      steps[i * width + (j - from)] = step;
    }
    std::swap(cost, above);
  }

  Warp warp{.first_column = std::vector<std::size_t>(n, m),
            .last_column = std::vector<std::size_t>(n, 0),
            .first_row = std::vector<std::size_t>(m, n),
            .last_row = std::vector<std::size_t>(m, 0)};
  for (std::size_t i = n - 1, j = m - 1;;) {
    warp.first_column[i] = std::min(warp.first_column[i], j);
    warp.last_column[i] = std::max(warp.last_column[i], j);
    warp.first_row[j] = std::min(warp.first_row[j], i);
    warp.last_row[j] = std::max(warp.last_row[j], i);
    if ((j == first(i) && j > 0) || (j == last(i) && j + 1 < m)) warp.band_reached = true;
    if (i == 0 && j == 0) return warp;
    auto const step = steps[i * width + (j - first(i))];
    if (step != across) --i;
    if (step != down) --j;
  }
}

struct Partner {
  double tick;
  double distance;
};

/// The nearest point of `other` to point i of `path`, within the samples that belong to it and two more on each side. Of points equally near,
/// that which the pairs of samples, drawn on as lines, give.
inline Partner nearest_partner(Matrix3X<double> const& path, Samples const& samples, std::size_t i, Matrix3X<double> const& other,
                               Samples const& others, std::vector<std::size_t> const& first, std::vector<std::size_t> const& last) {
  std::size_t const row = samples.before(i);
  std::size_t const from = others.at(std::max<std::size_t>(first[row], 2) - 2), to = others.at(std::min(last[row + 1] + 2, others.count() - 1));
  auto const middle = [&](std::size_t k) { return 0.5 * (static_cast<double>(others.at(first[k])) + static_cast<double>(others.at(last[k]))); };
  double const begin = static_cast<double>(samples.at(row)), end = static_cast<double>(samples.at(row + 1));
  double const expected = middle(row) + (static_cast<double>(i) - begin) * (middle(row + 1) - middle(row)) / (end - begin);   // exact where both go on alike

  Vector3<double> const point = path.col(static_cast<Eigen::Index>(i));
  Partner best{expected, std::numeric_limits<double>::infinity()};
  double best_square = std::numeric_limits<double>::infinity();
  for (std::size_t k = from; k < to; ++k) {
    Vector3<double> const a = other.col(static_cast<Eigen::Index>(k)), b = other.col(static_cast<Eigen::Index>(k + 1));
    Vector3<double> const way = b - a;
    double const length = way.squaredNorm();
    double const t = length > 0.0 ? std::clamp((point - a).dot(way) / length, 0.0, 1.0)
                                  : std::clamp(expected - static_cast<double>(k), 0.0, 1.0);   // a rest: any time of it
    double const square = t < 1.0 ? (point - a - t * way).squaredNorm() : (point - b).squaredNorm();
    double const tick = static_cast<double>(k) + t;
    if (square < best_square || (square == best_square && std::abs(tick - expected) < std::abs(best.tick - expected))) {
      best_square = square;
      best.tick = tick;
    }
  }
  best.distance = std::sqrt(best_square);
  return best;
}

}  // namespace palpate::detail

namespace palpate {

struct AlignmentOptions {
  std::size_t samples = 2000;   ///< of each path, at most, in the search for the alignment; the distances themselves are taken at every tick
  double band = 0.3;            ///< how far two times that belong together may be apart, as a share of the whole
};

/// Which point of another path belongs to each point of one, in the order of both.
struct Alignment {
  std::vector<double> partner;    ///< ticks of the other path, with a fraction
  std::vector<double> distance;   ///< m, to it
  double missed = 0.0;            ///< m, the largest distance of the other path from this one: what was left out of it
  bool band_reached = false;      ///< a larger band would have given another alignment
};

/// Aligns a path with another one that was gone at another pace: dynamic time warping of the points in time, in a band about the diagonal,
/// then the nearest point of the other path's line within what it allows.
///   minimise Σ w |a(i) − b(j)| over monotone chains of pairs (i, j) from both starts to both ends, |i/(n−1) − j/(m−1)| ≤ band,
///   w = 1 for a step in i or j and 2 for one in both: all chains weigh the same, so that paths with an offset are still free to warp
/// Why not by arc length: a tremor of 1 mm at 10 Hz is 40 mm of path a second and would push everything after it out of place.
/// Units      points 3 × n [m], evenly spaced in time.
/// Source     \cite sakoe1978, its symmetric form
/// Invariant  a path and itself: partner i of tick i, distance exactly 0. A delay costs nothing while it is within the band.
/// Errors     `InvalidArgument` for a path of fewer than two points or a point that is not finite, and for options out of their meaning.
/// Cost       samples² · 2 band steps and bytes, and about as many distances as there are ticks times ticks a sample: two paths of 60 s at
///            1 kHz take 2.4 million steps and bytes.
/// Limits     Both ends belong together: a trainee who stops half-way is, outside the band, as far away as the expert had come by then.
///            Between two samples nothing slower than their spacing is told apart: 30 ms for 60 s.
inline Alignment align(Matrix3X<double> const& path, Matrix3X<double> const& other, AlignmentOptions const& options = {}) {
  detail::OptionCheck const require{"align"};
  require(options.samples >= 2 && options.samples <= 10'000, ".samples", static_cast<double>(options.samples), "give 2 to 10000");
  require(options.band > 0.0 && options.band <= 1.0, ".band", options.band, "give a share of the whole time above 0, at most 1");
  for (auto const* const points : {&path, &other}) {
    if (points->cols() < 2) throw InvalidArgument(detail::message("align: a path has ", points->cols(), " points; give two or more"));
    for (Eigen::Index i = 0; i < points->cols(); ++i)
      if (!is_finite(points->col(i))) throw InvalidArgument(detail::message("align: point ", i, " is not finite; leave such ticks out"));
  }
  detail::Samples const rows(static_cast<std::size_t>(path.cols()), options.samples);
  detail::Samples const columns(static_cast<std::size_t>(other.cols()), options.samples);
  detail::Warp const warp = detail::warp_in_band(path, rows, other, columns, options.band);

  Alignment alignment;
  alignment.band_reached = warp.band_reached;
  alignment.partner.resize(static_cast<std::size_t>(path.cols()));
  alignment.distance.resize(alignment.partner.size());
  for (std::size_t i = 0; i < alignment.partner.size(); ++i) {
    auto const [tick, distance] = detail::nearest_partner(path, rows, i, other, columns, warp.first_column, warp.last_column);
    alignment.partner[i] = tick;
    alignment.distance[i] = distance;
  }
  for (std::size_t j = 0; j < static_cast<std::size_t>(other.cols()); ++j)
    alignment.missed = std::max(alignment.missed, detail::nearest_partner(other, columns, j, path, rows, warp.first_row, warp.last_row).distance);
  return alignment;
}

}  // namespace palpate
