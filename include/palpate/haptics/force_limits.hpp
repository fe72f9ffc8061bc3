// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// Slew limit: `from`, moved straight towards `to` by at most `most`.
///   |to − from| ≤ most: to;   else from + most (to − from)/|to − from|
/// Units      N.
/// Invariant  finite for finite forces; a limit that is not above zero keeps `from`.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     A limit below stiffness × speed × period makes a wall softer than stated and can destabilise it: 0.5 N a tick suffices for
///            500 N/m at 1 m/s.
template <RealScalar S>
Vector3<S> slewed(Vector3<S> const& from, Vector3<S> const& to, S most) noexcept {
  Vector3<S> const way = to - from;
  S const length = stable_norm(way);
  if (length <= most) return to;
  if (!(most > S(0))) return from;
  return from + (most / length) * way;
}

struct ThermalOptions {
  double continuous_force = 0.88;   ///< N, that the motors stand for ever
  double time = 10.0;               ///< s, in which they warm up
};

/// First-order thermal model of the motors: limits the force as they warm up with its square.
///   heat ← heat + (F² − heat) dt/time,   heat ≤ F_c² is sustainable
///   limit = F_c + (F_max − F_c) · clamp((F_c² − heat)/(0.2 F_c²), 0, 1)
/// The continuous force F_c always passes. A larger one passes until the heat reaches four fifths of F_c²; from there the limit falls to
/// F_c, without a step in the heat; the safety chain's slew limit makes what is written fall no faster than that.
/// Units      N, s; heat in N².
/// Source     a first-order model of a motor's winding; the time constant is the host's to know.
/// Invariant  continuous force and time above zero, finite; checked at set-up.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     One winding for all motors; room temperature and motors blocked by hand are not modelled.
class ThermalLimit {
 public:
  explicit ThermalLimit(ThermalOptions const& options = {}) : continuous_(options.continuous_force), time_(options.time) {
    detail::OptionCheck const require{"ThermalLimit", true};
    require(continuous_ > 0.0, ".continuous_force", continuous_, " N", "give a finite number above zero, from the device's papers");
    require.positive(".time", time_, " s");
  }

  /// The largest force [N] that may be written now, on a device of this maximum.
  double limit(double max_force) const noexcept {
    if (!(max_force > continuous_)) return max_force;
    double const square = continuous_ * continuous_, left = std::clamp((square - heat_) / (0.2 * square), 0.0, 1.0);
    if (left >= 1.0 || (left > 0.0 && !std::isfinite(max_force))) return max_force;
    return left > 0.0 ? continuous_ + (max_force - continuous_) * left : continuous_;
  }
  /// A force was written for so long.
  void add(double force, double seconds) noexcept {
    double const square = force * force;
    if (!std::isfinite(square) || !(seconds > 0.0)) return;
    heat_ += (square - heat_) * -std::expm1(-seconds / time_);
  }
  /// 0 cold, 1 as warm as the continuous force makes it.
  double warmth() const noexcept { return heat_ / (continuous_ * continuous_); }
  void reset() noexcept { heat_ = 0.0; }

 private:
  double continuous_;
  double time_;
  double heat_ = 0.0;
};

}  // namespace palpate
