// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/detail/turned.hpp>
#include <palpate/haptics/plane_set.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace palpate {

struct PlaneHandoverOptions {
  int ticks = 33;   ///< N, over which new planes take over: about as many as lie between two sets; 1: at once
};

/// Interpolates between sets of up to three planes that arrive at the body's rate, for a faster servo: a wall, an edge or a corner that
/// deforms.
/// Each set replaces the one before over N ticks. In the i-th tick, with t = i/N,
///   matched   pairs of planes with the most similar normals, at most 60° apart: height over the plane and normal are interpolated
///   coming    a new plane without a partner: its offset rises from min(d, n·x), x the contact point on the old planes, to d
///   leaving   an old plane without a partner: its offset falls to min(d, n·x), x the tip projected on the new planes
/// so no plane begins or ends to push abruptly. A set that arrives earlier replaces the interpolated one. The stiffness is interpolated
/// too.
/// Order        As of `PatchHandover`: late and repeated sets are dropped. The same planes in the same order change nothing, to the bit;
///              in another order they are matched.
/// Invariant    N ≥ 1, checked at set-up. At most six planes at a time.
/// Cost         One projection on the new planes a tick while planes leave; noexcept, no allocation: allowed in the servo tick.
/// Limits       Planes whose normals reverse give a force that passes through zero. Interpolated planes may have no point in front of
///              all; see `PlaneSet`.
template <RealScalar S>
class PlaneHandover {
 public:
  using Scalar = S;
  static constexpr int max_planes = 3;   // of a set

  explicit PlaneHandover(PlaneHandoverOptions const& options = {}) : ticks_(options.ticks), tick_(options.ticks) {
    detail::OptionCheck{"PlaneHandover"}(options.ticks >= 1, ".ticks", options.ticks, "give 1 or more");
  }

  /// A new set, with its stiffness [N/m], for the present tip; an empty set means no contact. Returns false and changes nothing for a set
  /// that is not newer, has more than three planes or a negative stiffness, and for a tip that is not finite.
  bool take(PlaneSet<S> const& planes, S stiffness, std::uint64_t sequence, Vector3<S> const& tip) noexcept {
    if (planes.count() > max_planes || !(stiffness >= S(0)) || !std::isfinite(stiffness) || !is_finite(tip)) {
      ++refused_;
      return false;
    }
    if (heard_ && sequence <= sequence_) {
      ++dropped_;
      return false;
    }
    bool const again = heard_ && stiffness == told_stiffness_ && same(planes, to_);
    heard_ = true;
    sequence_ = sequence;
    if (again) return true;
    PlaneSet<S> const now = at(tip);
    S const stiff = this->stiffness();
    to_ = planes;
    told_stiffness_ = stiffness;
    from_stiffness_ = now.count() > 0 ? stiff : stiffness;
    to_stiffness_ = planes.count() > 0 ? stiffness : from_stiffness_;
    match(now, now.project(tip));
    tick_ = 0;
    return true;
  }

  /// The planes of this tick. Call it once a tick, with the number of periods since the last one, where that was late.
  PlaneSet<S> operator()(Vector3<S> const& tip, int periods = 1) noexcept {
    tick_ += std::min(periods, ticks_ - tick_);
    return at(tip);
  }
  /// N/m, in this tick.
  S stiffness() const noexcept {
    return tick_ >= ticks_ ? to_stiffness_ : detail::between(from_stiffness_, to_stiffness_, S(tick_) / S(ticks_));
  }

  bool blends() const noexcept { return tick_ < ticks_; }
  std::uint64_t dropped() const noexcept { return dropped_; }
  std::uint64_t refused() const noexcept { return refused_; }

  /// Discards all planes and the sequence number: no contact.
  void reset() noexcept {
    to_.clear();
    count_ = 0;
    tick_ = ticks_;
    heard_ = false;
    from_stiffness_ = to_stiffness_ = told_stiffness_ = S(0);
  }

 private:
  enum class Way { matched, coming, leaving };
  struct Pair {
    ContactPlane<S> from, to;
    Way way = Way::matched;
  };
  static constexpr S alike = S(0.5);   // cosine of the angle up to which two planes are matched
  static constexpr std::size_t max_pairs = 2 * max_planes;

  static bool same(PlaneSet<S> const& a, PlaneSet<S> const& b) noexcept {
    if (a.count() != b.count()) return false;
    for (int k = 0; k < a.count(); ++k)
      if (a[k].normal != b[k].normal || a[k].offset != b[k].offset) return false;
    return true;
  }

  /// Greedy matching of old and new planes, the most similar first; then the planes without a partner. An old plane that leaves and does
  /// not push now is dropped at once.
  void match(PlaneSet<S> const& now, PlaneProjection<S> const& felt) noexcept {
    count_ = 0;
    std::array<bool, PlaneSet<S>::capacity> used{}, found{};
    for (;;) {
      S most = alike, apart = S(0);
      int a = -1, b = -1;
      for (int i = 0; i < now.count(); ++i)
        for (int k = 0; k < to_.count(); ++k) {
          if (used[static_cast<std::size_t>(i)] || found[static_cast<std::size_t>(k)]) continue;
          S const cosine = now[i].normal.dot(to_[k].normal), gap = std::abs(now[i].distance(felt.point) - to_[k].distance(felt.point));
          if (cosine > most || (a >= 0 && cosine == most && gap < apart)) most = cosine, apart = gap, a = i, b = k;
        }
      if (a < 0) break;
      used[static_cast<std::size_t>(a)] = found[static_cast<std::size_t>(b)] = true;
      add({now[a], to_[b], Way::matched});
    }
    for (int k = 0; k < to_.count(); ++k) {
      if (found[static_cast<std::size_t>(k)]) continue;
      ContactPlane<S> start = to_[k];
      start.offset = std::min(start.offset, start.normal.dot(felt.point));
      add({start, to_[k], Way::coming});
    }
    for (int i = 0; i < felt.count; ++i)
      if (int const plane = felt.active[static_cast<std::size_t>(i)]; !used[static_cast<std::size_t>(plane)]) add({now[plane], {}, Way::leaving});
  }
  void add(Pair const& pair) noexcept {
    if (count_ < max_pairs) pairs_[count_++] = pair;
  }

  PlaneSet<S> at(Vector3<S> const& tip) const noexcept {
    if (tick_ >= ticks_ || !is_finite(tip)) return to_;
    S const share = S(tick_) / S(ticks_);
    PlaneSet<S> planes;
    bool projected = false;
    Vector3<S> next = tip;   // on the new planes
    for (std::size_t k = 0; k < count_; ++k) {
      Pair const& pair = pairs_[k];
      ContactPlane<S> plane = pair.from;
      if (pair.way == Way::matched) {
        plane.normal = detail::turned<S>(pair.from.normal, pair.to.normal, share);
        plane.offset = plane.normal.dot(tip) - detail::between(pair.from.distance(tip), pair.to.distance(tip), share);
      } else if (pair.way == Way::coming) {
        plane.offset = detail::between(pair.from.offset, pair.to.offset, share);
      } else {
        if (!projected) next = to_.project(tip).point;
        projected = true;
        plane.offset = detail::between(plane.offset, std::min(plane.offset, plane.normal.dot(next)), share);
      }
      planes.try_add(plane);
    }
    return planes;
  }

  int ticks_, tick_;   // N, and since the last set, at most N
  PlaneSet<S> to_;
  std::array<Pair, max_pairs> pairs_{};
  std::size_t count_ = 0;
  S from_stiffness_ = S(0), to_stiffness_ = S(0), told_stiffness_ = S(0);
  bool heard_ = false;
  std::uint64_t sequence_ = 0, dropped_ = 0, refused_ = 0;
};

}  // namespace palpate
