// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/simulator/recording.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate {

/// A path to be followed, without its pace: straight pieces, measured by their length along the path.
/// From points 3 × n [m], of which those nearer than `spacing` to the last one kept are left out, so that rests vanish and no piece is
/// short: the points left out are at most `spacing` off the pieces.
/// Errors     `InvalidArgument` for a point that is not finite, a spacing that is not positive, a path shorter than the spacing, and one of
///            more than 20 000 pieces, which a servo tick could not search.
template <RealScalar S>
class GuidePath {
 public:
  using Vector = Vector3<S>;
  static constexpr std::size_t max_pieces = 20'000;

  explicit GuidePath(Matrix3X<double> const& points, double spacing = 5e-4) {
    if (!(spacing > 0.0) || !std::isfinite(spacing))
      throw InvalidArgument(detail::message("GuidePath: the spacing is ", spacing, " m; give a positive length, for example 0.0005"));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (!is_finite(points.col(i))) throw InvalidArgument(detail::message("GuidePath: point ", i, " is not finite; leave it out"));
      Vector const point = points.col(i).template cast<S>();
      bool const last = i + 1 == points.cols();
      if (corners_.empty() || (point - corners_.back()).norm() >= static_cast<S>(spacing) || (last && point != corners_.back())) add(point);
    }
    if (corners_.size() < 2 || length() < static_cast<S>(spacing))
      throw InvalidArgument(detail::message("GuidePath: the path is ", corners_.size() < 2 ? S(0) : length(), " m long with ", points.cols(),
                                            " points; give one longer than its spacing, ", spacing, " m"));
    if (pieces() > max_pieces)
      throw InvalidArgument(detail::message("GuidePath: there are ", pieces(), " pieces; give a larger spacing than ", spacing, " m, so that ",
                                            max_pieces, " are enough"));
  }
  /// Where the tip of a recording went.
  explicit GuidePath(Recording const& recording, double spacing = 5e-4) : GuidePath(tips(recording), spacing) {}

  std::size_t pieces() const noexcept { return corners_.size() - 1; }
  /// m, of the whole.
  S length() const noexcept { return begins_.back(); }
  S length_of(std::size_t piece) const noexcept { return begins_[piece + 1] - begins_[piece]; }
  Vector const& corner(std::size_t k) const noexcept { return corners_[k]; }

  /// Where on the path: a piece, and how far along it [m].
  struct Place {
    std::size_t piece = 0;
    S along = S(0);
  };
  Vector point(Place const& place) const noexcept {
    S const whole = length_of(place.piece);
    return place.along >= whole ? corners_[place.piece + 1]
                                : Vector(corners_[place.piece] + (place.along / whole) * (corners_[place.piece + 1] - corners_[place.piece]));
  }
  S arc(Place const& place) const noexcept { return begins_[place.piece] + place.along; }

  /// The nearest place to a point of all that are not farther along the path from `here` than `back` and `ahead`; `here` itself where none is
  /// nearer. O(pieces within that way), noexcept.
  Place nearest(Vector const& point, Place const& here, S back, S ahead) const noexcept {
    Place best = here;
    S least = (point - this->point(here)).squaredNorm();
    S const from = arc(here) - back, to = arc(here) + ahead;
    auto const look = [&](std::size_t piece) {
      S const begin = begins_[piece], whole = length_of(piece);
      S const low = std::max(S(0), from - begin), high = std::min(whole, to - begin);
      if (!(low <= high)) return;
      Vector const way = corners_[piece + 1] - corners_[piece];
      S const foot = (point - corners_[piece]).dot(way) / whole;   // whole is |way|
      Place const place{piece, std::clamp(foot, low, high)};
      S const square = (point - this->point(place)).squaredNorm();
      if (square < least) {
        least = square;
        best = place;
      }
    };
    for (std::size_t piece = here.piece;; --piece) {
      look(piece);
      if (piece == 0 || begins_[piece] < from) break;
    }
    for (std::size_t piece = here.piece + 1; piece < pieces() && begins_[piece] <= to; ++piece) look(piece);
    return best;
  }
  /// The nearest place of the whole path; the first of those equally near.
  Place nearest(Vector const& point) const noexcept { return nearest(point, Place{}, S(0), length()); }

 private:
  void add(Vector const& point) {
    begins_.push_back(corners_.empty() ? S(0) : begins_.back() + (point - corners_.back()).norm());
    corners_.push_back(point);
  }
  static Matrix3X<double> tips(Recording const& recording) {
    Matrix3X<double> points(3, static_cast<Eigen::Index>(recording.ticks().size()));
    for (Eigen::Index i = 0; i < points.cols(); ++i) points.col(i) = recording.ticks()[static_cast<std::size_t>(i)].tip;
    return points;
  }

  std::vector<Vector> corners_;
  std::vector<S> begins_;   // m, one a corner
};

}  // namespace palpate
