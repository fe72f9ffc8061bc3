// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/detail/turned.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

struct PatchHandoverOptions {
  int ticks = 33;            ///< N, over which a new patch takes over: about as many as lie between two; 1: at once
  double period = 0.001;     ///< s, of the servo
  double moves_for = 0.0;    ///< s after its arrival during which a patch is extrapolated with its velocity; 0: it rests until the next one
};

/// Interpolates between patches that arrive at the body's rate, for a faster servo: each replaces the one before over N ticks, with no
/// step in the force. When a patch arrives, the present state is kept as one patch F, anchored at the tip. In the i-th tick, with t =
/// i/N,
///   distance = (1 − t) distance_F(tip) + t distance_new(tip);   curvature, stiffness and velocity likewise
///   normal     that of F, rotated towards the new one by t of the angle between them
/// and from i = N on it is the new patch. A patch that arrives earlier replaces the interpolated one.
/// New contact  Where nothing was and the tip is in the tissue already, the stiffness rises from 0 over N ticks; a patch of stiffness 0
///              lets go in the same way. A normal turned by more than 120° is another contact: the old one fades, then the new one rises,
///              in N ticks together.
/// Order        A sequence number not above the last one's is dropped. The same patch again changes nothing, to the bit.
/// Source       the tangent plane as a local model \cite mark1996; its parameters interpolated between updates \cite mendoza2001.
/// Invariant    N ≥ 1, period > 0, moves_for ≥ 0, all finite; checked at set-up.
/// Cost         Two patches a tick; noexcept, no allocation: allowed in the servo tick.
/// Limits       It hides the delay of a patch and adds to it: the force lags by N ticks more. Interpolation may give the hand energy that
///              the tissue never got, K (d₂² − d₁²)/2 for a surface that rises under the tip. `PassivityController` observes that when
///              the tip leaves.
template <RealScalar S>
class PatchHandover {
 public:
  using Scalar = S;

  explicit PatchHandover(PatchHandoverOptions const& options = {}) : ticks_(options.ticks), period_(S(options.period)) {
    detail::OptionCheck const require{"PatchHandover", true};
    require(options.ticks >= 1, ".ticks", options.ticks, "give 1 or more");
    require(options.period > 0.0, ".period", options.period, " s", "give that of the servo, 0.001 for most");
    require(options.moves_for >= 0.0 && options.moves_for / options.period < 1e6, ".moves_for", options.moves_for, " s",
            "give 0 or about the time between two patches");
    moving_ticks_ = static_cast<int>(options.moves_for / options.period);
    tick_ = ticks_;
  }

  /// A new patch, for the present tip. Returns false and changes nothing for one that is not newer or not valid, and for a tip that is
  /// not finite.
  bool take(SurfacePatch<S> const& patch, std::uint64_t sequence, Vector3<S> const& tip) noexcept {
    if (!patch.valid() || !is_finite(tip)) {
      ++refused_;
      return false;
    }
    if (heard_ && sequence <= sequence_) {
      ++dropped_;
      return false;
    }
    bool const again = heard_ && patch == told_ && !(moving_ticks_ > 0 && patch.moves());
    heard_ = true;
    sequence_ = sequence;
    if (!again) begin(patch, tip);
    return true;
  }

  /// The surface of this tick. Call it once a tick, with the number of periods since the last one, where that was late.
  SurfacePatch<S> operator()(Vector3<S> const& tip, int periods = 1) noexcept {
    tick_ += std::min(periods, ticks_ - tick_);
    if (int const moves = std::min(periods, moving_ticks_ - age_); moves > 0) {
      age_ += moves;
      if (to_.moves()) to_ = to_.moved(S(moves) * period_);
      if (tick_ < ticks_ && from_.moves()) from_ = from_.moved(S(moves) * period_);
    }
    return at(tip);
  }

  /// The last patch as it arrived; whether the one before is still blended in.
  SurfacePatch<S> const& told() const noexcept { return told_; }
  bool blends() const noexcept { return tick_ < ticks_; }
  /// How many patches were late or repeated, and how many were not valid.
  std::uint64_t dropped() const noexcept { return dropped_; }
  std::uint64_t refused() const noexcept { return refused_; }

  /// Discards all patches and the sequence number: no contact.
  void reset() noexcept {
    to_ = from_ = told_ = {};
    tick_ = ticks_;
    age_ = 0;
    heard_ = another_ = false;
  }

 private:
  static constexpr S opposite = S(-0.5);   // cosine of the angle from which on it is another contact

  void begin(SurfacePatch<S> const& patch, Vector3<S> const& tip) noexcept {
    SurfacePatch<S> const now = at(tip).anchored_at(tip);
    told_ = to_ = patch;
    if (!(patch.stiffness > S(0))) {   // it lets go where it is
      to_ = now;
      to_.stiffness = S(0);
    }
    from_ = now;
    tick_ = 0;
    age_ = 0;
    if (!(now.stiffness > S(0))) {   // nothing was there
      from_ = to_.anchored_at(tip);
      from_.stiffness = S(0);
      if (!(to_.distance(tip) < S(0))) tick_ = ticks_;
    }
    another_ = from_.normal.dot(to_.normal_at(tip)) < opposite;
  }

  SurfacePatch<S> at(Vector3<S> const& tip) const noexcept {
    if (tick_ >= ticks_) return to_;
    S const share = S(tick_) / S(ticks_);
    if (another_) {
      SurfacePatch<S> one = share < S(0.5) ? from_ : to_;
      one.stiffness *= std::abs(S(1) - S(2) * share);
      return one;
    }
    SurfacePatch<S> mixed = to_;
    mixed.normal = detail::turned<S>(from_.normal_at(tip), to_.normal_at(tip), share);
    mixed.point = tip - detail::between(from_.distance(tip), to_.distance(tip), share) * mixed.normal;
    mixed.curvature = detail::between(from_.curvature, to_.curvature, share);
    mixed.stiffness = detail::between(from_.stiffness, to_.stiffness, share);
    mixed.velocity = detail::between(from_.velocity_at(mixed.point), to_.velocity_at(mixed.point), share);
    mixed.angular_velocity = detail::between(from_.angular_velocity, to_.angular_velocity, share);
    return mixed;
  }

  int ticks_ = 1, moving_ticks_ = 0;
  S period_;
  SurfacePatch<S> from_, to_;   // both where they are now
  SurfacePatch<S> told_;        // as it came
  int tick_ = 0;                // since the last patch, at most ticks_
  int age_ = 0;                 // the same, at most moving_ticks_
  bool another_ = false;        // the last patch is another contact
  bool heard_ = false;
  std::uint64_t sequence_ = 0, dropped_ = 0, refused_ = 0;
};

}  // namespace palpate
