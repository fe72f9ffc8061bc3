// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/training/detail/time_warp.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

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
  if (options.samples < 2 || options.samples > 10'000)
    throw InvalidArgument(detail::message("align: .samples is ", options.samples, "; give 2 to 10000"));
  if (!(options.band > 0.0) || !(options.band <= 1.0))
    throw InvalidArgument(detail::message("align: .band is ", options.band, "; give a share of the whole time above 0, at most 1"));
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
