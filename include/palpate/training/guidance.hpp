// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/simulator/recording.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
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
    detail::require_positive("GuidePath: the spacing", spacing, "m");
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

/// How a hand is held on a path. The defaults are ours, for a device of 3.3 N.
struct GuidanceOptions {
  double stiffness = 500.0;    ///< N/m, at most; see `passive_wall`
  double damping = 0.0;        ///< N s/m, of movement from and towards the path, outside the dead-band
  double dead_band = 0.001;    ///< m, so far from the path nothing is felt
  double fade = 0.001;         ///< m outside the dead-band, over which the stiffness grows from nothing
  double max_force = 2.0;      ///< N, never more than that
  double look = 0.02;          ///< m along the path, both ways, in which a nearer place is looked for
  bool backward = true;        ///< false: the place on the path goes on, never back
  double slide_speed = 1.0;    ///< m/s, at which the place moves along the path
  double change_time = 0.05;   ///< s, over which the force passes from one place to another that is no neighbour
  double arm_time = 0.5;       ///< s, over which the force grows when the guidance is armed, and fades when it is disarmed
  bool armed = true;
};

/// A virtual fixture that pulls the hand back to a path, for `Overlaid(force, PathGuidance(path))`.
///   F = −g(d) n,  d = |x − p|,  n = (x − p)/d, x the tip, p its place on the path
///   g = 0 for e ≤ 0, k e²/(2w) for e < w, k (e − w/2) above, e = d − dead-band, w = fade; never above the largest force
///   F is the gradient of the energy U(d) = ∫ g: it depends on nothing but the distance, and is zero, without a step, back inside the dead-band.
/// How p moves  It slides to where it is nearer, at most `slide_speed` along the path. Where a nearer place within `look` is over a hill (the other
///   leg of a corner), the energy V = (1 − w) U(p) + w U(q) passes to that place q over `change_time`; w moves only to the side with less
///   energy. So whatever the path and the hand do, the guidance's own moves never raise V.
/// Passive    work on the hand ≤ V before − V after + ½ k Σ |Δx|², Δx the hand's way in a tick: the last term is what sampling adds, and a hand
///            with damping b swallows it while k ≤ 2 (b − |B|) / T (`passive_wall`), B the guidance's own damping. Arming gives at most the energy U at that place, once;
///            disarming takes. Damping only takes, up to the age of the velocity it is given.
/// Continuous |ΔF| ≤ k (|Δx| + slide_speed T) + F_max T (2 / change_time + 1.5 / arm_time), and with damping B |Δv| and what B v changes over `fade`.
///            It begins at zero in every run and after every tick in which the hand felt nothing.
/// Errors     `InvalidArgument` for options out of their meaning.
/// Cost       O(2 look / spacing of the path) a tick, some 0.3 µs; the whole path once when it is armed; noexcept, no allocation.
/// Limits     The path has no pace: the hand is not pushed along. Nothing is said of delay, and of rounded positions no more than that Δx has them.
///            One object serves one thread: arm and disarm between runs or from `after_tick`.
template <RealScalar S>
class PathGuidance {
 public:
  using Scalar = S;
  using Vector = Vector3<S>;

  explicit PathGuidance(GuidePath<S> path, GuidanceOptions const& options = {}) : path_(std::move(path)), options_(options) {
    validate();
    stiffness_ = static_cast<S>(options.stiffness);
    damping_ = static_cast<S>(options.damping);
    dead_band_ = static_cast<S>(options.dead_band);
    fade_ = static_cast<S>(options.fade);
    max_force_ = static_cast<S>(options.max_force);
    S const knee = stiffness_ * fade_ / 2;   // N, at the end of the fade
    full_ = max_force_ < knee ? std::sqrt(2 * fade_ * max_force_ / stiffness_) : max_force_ / stiffness_ + fade_ / 2;
    armed_ = options.armed;
  }

  /// The force on the hand [N].
  Vector operator()(ToolMotion<S> const& motion) noexcept { return force_ = answer(motion); }

  void arm() noexcept { armed_ = true; }
  void disarm() noexcept { armed_ = false; }
  bool armed() const noexcept { return armed_; }
  /// Starts anew: the force begins at zero, at the nearest place of the whole path.
  void reset() noexcept {
    placed_ = changes_ = false;
    level_ = weight_ = S(0);
    force_.setZero();
  }

  /// N, what it answered last.
  Vector const& force() const noexcept { return force_; }
  /// J, what is stored: V above.
  S energy() const noexcept {
    return placed_ ? gain() * ((S(1) - weight_) * energy_at(distance_to(here_)) + weight_ * energy_at(distance_to(there_))) : S(0);
  }
  /// m, from the tip to its place on the path.
  S deviation() const noexcept { return placed_ ? distance_to(here_) : S(0); }
  /// How far along the path its place is, 0 to 1.
  S progress() const noexcept { return path_.arc(here_) / path_.length(); }
  Vector place() const noexcept { return path_.point(here_); }
  GuidePath<S> const& path() const noexcept { return path_; }
  GuidanceOptions const& options() const noexcept { return options_; }

  void validate() const {
    detail::OptionCheck const require{"PathGuidance", true};
    constexpr char const *positive = "give a positive, finite number", *any = "give a finite number, zero or more";
    require(options_.stiffness > 0, ".stiffness", options_.stiffness, " N/m", positive);
    require(options_.damping >= 0, ".damping", options_.damping, " N s/m", any);
    require(options_.dead_band >= 0, ".dead_band", options_.dead_band, " m", any);
    require(options_.fade > 0, ".fade", options_.fade, " m", positive);
    require(options_.max_force > 0, ".max_force", options_.max_force, " N", positive);
    require(options_.look >= 0, ".look", options_.look, " m", any);
    require(options_.slide_speed > 0, ".slide_speed", options_.slide_speed, " m/s", positive);
    require(options_.change_time > 0, ".change_time", options_.change_time, " s", positive);
    require(options_.arm_time > 0, ".arm_time", options_.arm_time, " s", positive);
  }

 private:
  using Place = typename GuidePath<S>::Place;

  Vector answer(ToolMotion<S> const& motion) noexcept {
    S const seconds = motion.seconds > S(0) ? std::min(motion.seconds, S(0.02)) : S(0);   // after a gap no faster than that
    if (!motion.continues || !placed_) {
      level_ = S(0);
      placed_ = false;
    }
    if (!placed_) {
      if (armed_) begin_at(motion.tip);
      return Vector::Zero();
    }
    S const step = seconds / static_cast<S>(options_.arm_time);
    level_ = armed_ ? std::min(S(1), level_ + step) : std::max(S(0), level_ - step);
    follow(motion.tip, seconds);
    if (!armed_ && level_ == S(0)) placed_ = false;

    Vector force = (S(1) - weight_) * pull(motion, here_);
    if (weight_ > S(0)) force += weight_ * pull(motion, there_);
    return gain() * force;
  }

  void begin_at(Vector const& tip) noexcept {
    tip_ = tip;
    here_ = path_.nearest(tip);
    level_ = weight_ = S(0);
    changes_ = false;
    placed_ = true;
  }

  /// Moves the places for a tip; no step of this raises the energy.
  void follow(Vector const& tip, S seconds) noexcept {
    tip_ = tip;
    S const reach = static_cast<S>(options_.slide_speed) * seconds, look = static_cast<S>(options_.look);
    bool const slides = slide(here_, reach);
    if (weight_ > S(0) || changes_) {
      slide(there_, reach);
      S const step = seconds / static_cast<S>(options_.change_time);
      bool const on = energy_at(distance_to(there_)) <= energy_at(distance_to(here_));
      weight_ = on ? std::min(S(1), weight_ + step) : std::max(S(0), weight_ - step);
      if (weight_ >= S(1)) here_ = there_;
      if (weight_ >= S(1) || weight_ <= S(0)) {
        weight_ = S(0);
        changes_ = false;
      }
    } else if (!slides) {   // in the bottom of a valley: is there a deeper one?
      Place const deeper = path_.nearest(tip, here_, options_.backward ? look : S(0), look);
      if (distance_to(deeper) < distance_to(here_) && std::abs(path_.arc(deeper) - path_.arc(here_)) > reach) {
        there_ = deeper;
        changes_ = true;
      }
    }
  }

  /// To the nearest place within reach; true while it goes as far as it can.
  bool slide(Place& place, S reach) noexcept {
    Place const before = place;
    place = path_.nearest(tip_, place, options_.backward ? reach : S(0), reach);
    return std::abs(path_.arc(place) - path_.arc(before)) > S(0.99) * reach;
  }

  Vector pull(ToolMotion<S> const& motion, Place const& place) const noexcept {
    Vector const away = motion.tip - path_.point(place);
    S const distance = away.norm(), outside = distance - dead_band_;
    if (!(outside > S(0))) return Vector::Zero();
    Vector const direction = away / distance;
    S force = outside >= full_ ? max_force_ : outside < fade_ ? stiffness_ * outside * outside / (2 * fade_) : stiffness_ * (outside - fade_ / 2);
    if (damping_ > S(0))   // limited with the spring: what is left of it still opposes the movement
      force = std::clamp(force + damping_ * std::min(S(1), outside / fade_) * motion.velocity.dot(direction), -max_force_, max_force_);
    return -force * direction;
  }

  S energy_at(S distance) const noexcept {
    S const outside = distance - dead_band_;
    if (!(outside > S(0))) return S(0);
    S const e = std::min(outside, full_);
    S const sprung = e < fade_ ? stiffness_ * e * e * e / (6 * fade_) : stiffness_ * (fade_ * fade_ / 6 + e * (e - fade_) / 2);
    return sprung + max_force_ * (outside - e);
  }
  S distance_to(Place const& place) const noexcept { return (tip_ - path_.point(place)).norm(); }
  S gain() const noexcept { return level_ * level_ * (S(3) - 2 * level_); }

  GuidePath<S> path_;
  GuidanceOptions options_;
  S stiffness_, damping_, dead_band_, fade_, max_force_;
  S full_;   // m outside the dead-band, from where on the force is the largest
  Vector tip_ = Vector::Zero();
  Vector force_ = Vector::Zero();
  Place here_, there_;
  S weight_ = S(0);   // of `there_`
  S level_ = S(0);   // 0 to 1 while it is armed
  bool changes_ = false;
  bool placed_ = false;
  bool armed_;
};

}  // namespace palpate
