// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve.hpp>
#include <palpate/force/curve_join.hpp>
#include <palpate/force/network.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {

/// The speeds [m/s] a curve was measured at.
template <RealScalar S>
struct SpeedRange {
  S low = S(0);
  S high = S(0);
};

/// A trained network of depth and speed as a force, with clamping and linear extrapolation: (depth [m], speed [m/s]) → [N], after the
/// puncture, along the normal.
///   F = s(d/fade_depth) F(d, v) n,   v = |v·n| clamped to the speeds of the training data
/// Inside the depths of its training data F is the network, not below 0. Outside it continues along the slope at the nearer end, clamped
/// to 0 … guard.largest_force, or the force at that end where it is larger. s is `CurveJoin`'s smooth step.
/// Source     \cite zheng2006 ch. 6.6: networks of depth and speed for needles in a heart. Their weights are not published.
/// Invariant  Both ranges finite, low < high for depths, 0 ≤ low ≤ high for speeds, forces at the ends of the range finite; checked at
///            set-up.
/// Cost       One evaluation of the network, with its derivative outside the range; noexcept, no allocation: allowed in the servo tick.
/// Limits     It does not distinguish loading from unloading. At one speed a closed path takes no energy. A path that goes in where the
///            force is small and out where it is large gives the hand energy, as a slow needle forced harder than a fast one. Give it to
///            a hand only beside friction that is larger than the difference.
template <class Net>
class SpeedCurve {
  static_assert(Net::outputs == 1 && Net::inputs == 2,
                "palpate::SpeedCurve: the network must have one output (force) and two inputs (depth, speed): Network<double, 2, 5, 1>.");

 public:
  using Scalar = typename Net::Scalar;

  SpeedCurve(Net network, DepthRange<Scalar> depths, SpeedRange<Scalar> speeds, CurveGuard<Scalar> guard = {}, Scalar fade_depth = Scalar(0.002))
      : network_(std::move(network)), depths_(depths), speeds_(speeds), guard_(guard), join_{.fade_depth = fade_depth} {
    join_.validate();
    depths.validate("SpeedCurve");
    if (!(speeds.low >= Scalar(0)) || !std::isfinite(speeds.high) || !(speeds.low <= speeds.high))
      throw InvalidArgument(detail::message("SpeedCurve: the speed range is ", speeds.low, " … ", speeds.high, " m/s; give two finite speeds, the lower one first"));
    detail::OptionCheck const require{"SpeedCurve"};
    require(guard.largest_force > Scalar(0), ".largest_force", guard.largest_force, " N", "give a force above zero, or none");
    for (Scalar const depth : {depths.low, depths.high})
      for (Scalar const speed : {speeds.low, speeds.high})
        if (!std::isfinite(network_(depth, speed)))
          throw InvalidArgument(detail::message("SpeedCurve: the network gives ", network_(depth, speed), " at ", depth, " m and ", speed, " m/s; give one with finite forces there"));
  }

  /// The force [N] at a depth [m] and a speed [m/s].
  Scalar operator()(Scalar depth, Scalar speed) const noexcept {
    Scalar const v = std::clamp(std::abs(speed), speeds_.low, speeds_.high), e = std::clamp(depth, depths_.low, depths_.high);
    Scalar const force = network_(e, v);
    if (e == depth) return std::max(force, Scalar(0));
    Scalar const slope = network_.input_gradient({e, v}, {Scalar(1)})[0];
    return std::clamp(force + slope * (depth - e), Scalar(0), std::max(guard_.largest_force, std::max(force, Scalar(0))));
  }

  Vector3<Scalar> operator()(ToolContact<Scalar> const& contact) const noexcept {
    Scalar const speed = contact.velocity.dot(contact.normal);
    if (contact.phase != CuttingPhase::moving || !(contact.depth > Scalar(0)) || !std::isfinite(speed)) return Vector3<Scalar>::Zero();
    return join_.fade(contact.depth) * (*this)(contact.depth, speed) * contact.normal;
  }

  Net const& network() const noexcept { return network_; }
  DepthRange<Scalar> depths() const noexcept { return depths_; }
  SpeedRange<Scalar> speeds() const noexcept { return speeds_; }

 private:
  Net network_;
  DepthRange<Scalar> depths_;
  SpeedRange<Scalar> speeds_;
  CurveGuard<Scalar> guard_;
  CurveJoin<Scalar> join_;
};

}  // namespace palpate
