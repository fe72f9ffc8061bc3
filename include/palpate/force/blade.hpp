// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/curve.hpp>

#include <cmath>
#include <numbers>
#include <utility>

namespace palpate {

/// How another blade, held otherwise, changes a force curve that was measured: factors for `bladed`.
///   F(d) = w · cos θ / (s (1 + ξ²)) · curve(d / cos θ)
/// Units      width ratio w, sharpness s and slice–push ratio ξ without unit, entry angle θ [rad]; d [m], F [N] along the normal.
/// Source     w: the force to part a plane is its width times the work of fracture, \cite atkins2009. ξ: a blade that is drawn across at ξ times
///            its speed into the tissue takes 1/(1 + ξ²) of the pushing force, \cite atkins2004, for a thin offcut without friction. θ: geometry,
///            a blade that leans by θ reaches a depth d on a way d / cos θ, and cos θ of its force is along the normal. s: a definition.
/// Invariant  w > 0, s > 0, all finite, |θ| < π/2; checked by `validate`.
/// Limits     Not validated on an organ: the sources are polymers and food, and the liver was measured with one tool. The work of fracture
///            holds while a cut runs steadily, not up to the puncture, and not for a wedge that is forced in. Of sharpness only the ratio of two
///            measured forces counts here; edge radius or wear do not give it. The force across the normal of a leaning blade is not in it.
///            A network that was trained with any of these as an input needs no factor.
template <RealScalar S>
struct BladeFactors {
  S width_ratio = S(1);        ///< w: this blade's width over that of the measured one
  S sharpness = S(1);          ///< s: force of the measured blade over that of this one, all else equal
  S slice_push_ratio = S(0);   ///< ξ: speed along the edge over speed into the tissue
  S entry_angle = S(0);        ///< θ: from the inward normal

  void validate() const {
    detail::OptionCheck const require{"BladeFactors"};
    require.positive(".width_ratio", width_ratio);
    require.positive(".sharpness", sharpness);
    require(std::isfinite(slice_push_ratio), ".slice_push_ratio", slice_push_ratio, "give a finite number");
    require(std::abs(entry_angle) < std::numbers::pi_v<S> / 2, ".entry_angle", entry_angle, "give radians between -pi/2 and pi/2");
  }

  S depth_factor() const noexcept { return S(1) / std::cos(entry_angle); }
  S force_factor() const noexcept { return width_ratio * std::cos(entry_angle) / (sharpness * (S(1) + slice_push_ratio * slice_push_ratio)); }
};

/// A curve as another blade feels it; made by `bladed`.
template <class Curve, RealScalar S>
using BladedCurve = ScaledCurve<Curve, S>;

/// `bladed(liver_hysteresis<double>(), BladeFactors<double>{.width_ratio = 1.5, .entry_angle = 0.3})`
template <class Curve, RealScalar S>
BladedCurve<Curve, S> bladed(Curve curve, BladeFactors<S> const& factors) {
  factors.validate();
  return {std::move(curve), factors.force_factor(), factors.depth_factor()};
}

}  // namespace palpate
