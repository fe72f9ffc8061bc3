// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// Blending rules of `CuttingForce`: to zero force and between curves, so that the hand feels no step. A part of `CuttingForce`; without
/// it these defaults hold. s(t) = t² (3 − 2t), from 0 at t ≤ 0 to 1 at t ≥ 1.
///   at the surface     a curve counts s(d / fade_depth)
///   on a reversal      F = unloading + q (loading − unloading);  q ← clamp(q + Δd / reversal_depth, 0, 1) in every tick
///   at the puncture    F = F_p g(d) + s(t / puncture_time) (F_after − F_p g(d)), t since the puncture;  g(d) = min(1, d/d_p)ⁿ
/// The share q is a stop operator on depth (hysteresis, \cite visintin1994). Of two passes of one depth, the one on the way back has no
/// larger share, and unloading is never above loading. So every closed path in depth after the puncture takes energy from the hand, or none. The remainder
/// of the force at the puncture, F_p at the depth d_p, falls with depth. n ≥ 1 is such that it returns no more than the tool has put in:
/// F_p d_p/(n + 1) ≤ ∫F dd.
/// Units      [m], [s]
/// Invariant  All finite and not negative; checked by `validate`.
template <RealScalar S>
struct CurveJoin {
  using Scalar = S;

  /// Above this depth a curve fades to zero. The default lets the published liver curves, which read 4 mN at depth 0, be unchanged below 2 mm.
  S fade_depth = S(0.002);

  /// Distance over which the force blends from the loading to the unloading curve, and again on the way down. With the thesis's rule, 0,
  /// the curve changes at once, by up to 0.3 N for the liver, and a tool that trembles in place chatters between the two.
  S reversal_depth = S(0.001);

  /// Time over which the force blends from its value at the puncture to that of the parts after it. 0: at once.
  S puncture_time = S(0.005);

  void validate() const {
    detail::OptionCheck const require{"CurveJoin"};
    require.not_negative(".fade_depth", fade_depth, " m");
    require.not_negative(".reversal_depth", reversal_depth, " m");
    require.not_negative(".puncture_time", puncture_time, " s");
  }

  /// Share of a curve at a depth: 0 at the surface, 1 from fade_depth on.
  constexpr S fade(S depth) const noexcept { return smooth(depth, fade_depth); }
  /// Share of the loading curve after a way deeper, or back for a negative one. A way that is no number changes nothing.
  S reverse(S loading_share, S way) const noexcept {
    if (!(reversal_depth > S(0))) return way > S(0) ? S(1) : S(0);
    return std::isfinite(way) ? std::clamp(loading_share + way / reversal_depth, S(0), S(1)) : loading_share;
  }
  /// Share of the force at the puncture so long after it: 1 at first, 0 from puncture_time on.
  constexpr S puncture_share(S seconds) const noexcept { return S(1) - smooth(seconds, puncture_time); }

 private:
  static constexpr S smooth(S value, S whole) noexcept {
    if (!(value > S(0))) return S(0);
    if (value >= whole) return S(1);
    S const t = value / whole;
    return t * t * (S(3) - S(2) * t);
  }
};

}  // namespace palpate
