// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace palpate::detail {

/// A point of the undeformed surface where the blade is or was, with the smooth normal there.
template <RealScalar Scalar>
struct BladePoint {
  Vector3<Scalar> point = Vector3<Scalar>::Zero();
  Vector3<Scalar> normal = Vector3<Scalar>::UnitZ();
};

/// The blade's straight way between two of its points, seen along their mean normal.
template <RealScalar Scalar>
struct BladeStretch {
  using Vector = Vector3<Scalar>;

  BladeStretch(BladePoint<Scalar> const& start, BladePoint<Scalar> const& end) : from(start.point) {
    Vector const way = end.point - start.point, across = way.cross(start.normal + end.normal);
    Scalar const distance = way.norm(), width = across.norm();
    if (!(distance > 0) || !(width > Scalar(0.1) * distance)) return;
    length = distance;
    along = way / distance;
    side = across / width;
  }

  /// Squared distance from the way and its ends, the height above the surface not counted [m²].
  Scalar squared_distance(Vector const& point) const {
    Vector const d = point - from;
    if (!(length > 0)) return d.squaredNorm();
    Scalar const across = side.dot(d), progress = along.dot(d);
    Scalar const beyond = std::max({Scalar(0), -progress, progress - length});
    return across * across + beyond * beyond;
  }

  Vector from;
  Vector along = Vector::Zero(), side = Vector::Zero();
  Scalar length = 0;
};

/// Where the blade went lately: a polyline on the undeformed surface that ends where the blade is. Its stretches, the last one too, are at
/// least `spacing` long unless the blade turns back, so that a hand that trembles does not turn them.
template <RealScalar Scalar>
class BladeWay {
 public:
  using Vector = Vector3<Scalar>;

  void start(BladePoint<Scalar> const& point, Scalar spacing) {
    spacing_ = spacing;
    corners_.assign(1, point);
    stretches_.clear();
    blade_ = next_ = point;
  }

  void go_to(BladePoint<Scalar> const& point) {
    blade_ = point;
    if (!stretches_.empty() && is_far(next_, corners_.back()) && is_far(blade_, next_)) {   // the next corner
      stretches_.back() = {corners_.back(), next_};
      corners_.push_back(next_);
    } else if (!stretches_.empty()) {
      stretches_.pop_back();
    }
    stretches_.push_back({corners_.back(), blade_});
    if (!is_far(next_, corners_.back())) next_ = blade_;
    if (corners_.size() > max_corners) drop(1);
  }

  /// Forgets what lies before the place nearest to a point.
  void forget_before(Vector const& point) {
    if (!stretches_.empty()) drop(nearest(point));
  }

  BladePoint<Scalar> const& blade() const noexcept { return blade_; }

  Scalar squared_distance(Vector const& point) const {
    return stretches_.empty() ? (point - blade_.point).squaredNorm() : stretches_[nearest(point)].squared_distance(point);
  }

  /// From a point to the nearest one of the way, which goes straight on beyond its ends; zero where the blade has not yet gone far
  /// enough to tell a direction.
  Vector onto(Vector const& point) const {
    if (stretches_.empty()) return Vector::Zero();
    std::size_t const k = nearest(point);
    BladeStretch<Scalar> const& stretch = stretches_[k];
    if (!(stretch.length > spacing_ / 2)) return Vector::Zero();
    Vector const d = point - stretch.from;
    Scalar const progress = stretch.along.dot(d);
    Scalar const before = k > 0 ? std::min(progress, Scalar(0)) : Scalar(0);
    Scalar const behind = k + 1 < stretches_.size() ? std::max(progress - stretch.length, Scalar(0)) : Scalar(0);
    return -stretch.side.dot(d) * stretch.side - (before + behind) * stretch.along;
  }

 private:
  static constexpr std::size_t max_corners = 32;

  bool is_far(BladePoint<Scalar> const& a, BladePoint<Scalar> const& b) const { return (a.point - b.point).norm() >= spacing_; }

  std::size_t nearest(Vector const& point) const {
    std::size_t best = 0;
    Scalar least = std::numeric_limits<Scalar>::infinity();
    for (std::size_t k = 0; k < stretches_.size(); ++k)
      if (Scalar const squared = stretches_[k].squared_distance(point); squared < least) least = squared, best = k;
    return best;
  }

  void drop(std::size_t count) {
    corners_.erase(corners_.begin(), corners_.begin() + static_cast<std::ptrdiff_t>(count));
    stretches_.erase(stretches_.begin(), stretches_.begin() + static_cast<std::ptrdiff_t>(count));
  }

  std::vector<BladePoint<Scalar>> corners_;
  std::vector<BladeStretch<Scalar>> stretches_;   // from each corner to the next, and to the blade
  BladePoint<Scalar> blade_, next_;               // next_: the blade when it was first far from the last corner
  Scalar spacing_ = 0;                            // m
};

}  // namespace palpate::detail
