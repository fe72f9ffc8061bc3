// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/network.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

namespace palpate {

/// The depths [m] a curve was measured at.
template <RealScalar S>
struct DepthRange {
  S low = S(0);
  S high = S(0);

  /// Throws `InvalidArgument`, in the owner's name, for one without extent.
  void validate(char const* owner) const {
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high))
      throw InvalidArgument(detail::message(owner, ": the depth range is ", low, " … ", high, " m; give two finite depths, the lower one first"));
  }
};

/// The depths that samples were measured at, the first input of each: `NetworkCurve(network, depth_range(samples))`.
template <class Samples>
auto depth_range(Samples const& samples) {
  using S = std::remove_cvref_t<decltype(std::begin(samples)->input.front())>;
  if (std::begin(samples) == std::end(samples)) throw InvalidArgument("depth_range: there are no samples; give at least two depths");
  DepthRange<S> range{std::begin(samples)->input.front(), std::begin(samples)->input.front()};
  for (auto const& sample : samples) {
    range.low = std::min(range.low, sample.input.front());
    range.high = std::max(range.high, sample.input.front());
  }
  return range;
}

/// What bounds a `NetworkCurve` where its network has seen no data.
/// Units      [N]
/// Invariant  Not below the force at either end of the curve's range; checked by `NetworkCurve`.
template <RealScalar S>
struct CurveGuard {
  S largest_force = std::numeric_limits<S>::infinity();   ///< outside the range the force is at most this; infinite: no cap
};

/// A trained network as a force curve, depth [m] → force [N], with linear extrapolation. Inside the depths of its training data it is the
/// network itself. Outside, where a network saturates or diverges, it continues along the tangent:
///   F(d) = F(e) + F'(e) (d − e),  e the nearer end of the range, clamped to 0 … guard.largest_force
///   one input     curve(depth)
///   two inputs    curve(depth, phase); the second input is 0 for loading, 1 for unloading
/// Units      depth [m]; the network's own input unit is a matter of its scaling.
/// Invariant  range.low < range.high, both finite; forces at the ends finite and at most guard.largest_force; checked at set-up.
///            Continuous everywhere, with a kink only where a bound is met. An end below 0 N is continued by values no further below.
/// Cost       One evaluation of the network; noexcept, no allocation: allowed in the servo tick.
/// Limits     Inside the range nothing is clamped. Without a cap the force grows without end above the range: the device limits it.
template <class Net>
class NetworkCurve {
  static_assert(Net::outputs == 1 && (Net::inputs == 1 || Net::inputs == 2),
                "palpate::NetworkCurve: the network must have one output (force) and one input (depth) or two "
                "(depth, flag of the phase): Network<double, 1, 5, 1> or Network<double, 2, 5, 1>.");

 public:
  using Scalar = typename Net::Scalar;

  NetworkCurve(Net network, DepthRange<Scalar> range, CurveGuard<Scalar> guard = {})
      : network_(std::move(network)), range_(range), guard_(guard) {
    range.validate("NetworkCurve");
    for (std::size_t branch = 0; branch < branches; ++branch) {
      low_[branch] = end_at(range.low, branch);
      high_[branch] = end_at(range.high, branch);
      check_end(range.low, low_[branch]);
      check_end(range.high, high_[branch]);
    }
  }

  Scalar operator()(Scalar depth) const noexcept
    requires(Net::inputs == 1)
  {
    return value(depth, 0);
  }

  Scalar operator()(Scalar depth, Phase phase) const noexcept
    requires(Net::inputs == 2)
  {
    return value(depth, phase == Phase::loading ? 0 : 1);
  }

  Net const& network() const noexcept { return network_; }
  DepthRange<Scalar> range() const noexcept { return range_; }
  CurveGuard<Scalar> guard() const noexcept { return guard_; }

 private:
  static constexpr std::size_t branches = Net::inputs == 1 ? 1 : 2;

  /// Value and slope at an end of the range.
  struct End {
    Scalar force = Scalar(0);
    Scalar slope = Scalar(0);
  };

  static typename Net::Input input(Scalar depth, std::size_t branch) noexcept {
    typename Net::Input result{};
    result.front() = depth;
    if constexpr (Net::inputs == 2) result.back() = Scalar(branch);
    return result;
  }

  End end_at(Scalar depth, std::size_t branch) const noexcept {
    auto const x = input(depth, branch);
    return {network_(x)[0], network_.input_gradient(x, {Scalar(1)})[0]};
  }

  void check_end(Scalar depth, End const& end) const {
    Scalar const force = end.force;
    if (!std::isfinite(force) || !std::isfinite(end.slope))
      throw InvalidArgument(detail::message("NetworkCurve: the network gives ", force, " N and a slope of ", end.slope, " N/m at ", depth,
                                            " m, an end of the range; give weights with finite results"));
    if (!(guard_.largest_force >= force))   // also where it is no number
      throw InvalidArgument(detail::message("CurveGuard: .largest_force is ", guard_.largest_force, " N, the curve has ", force, " N at ",
                                            depth, " m, an end of its range; give no less"));
  }

  Scalar beyond(End const& end, Scalar way) const noexcept {
    return std::clamp(end.force + end.slope * way, std::min(end.force, Scalar(0)), std::max(guard_.largest_force, Scalar(0)));
  }

  Scalar value(Scalar depth, std::size_t branch) const noexcept {
    if (depth < range_.low) return beyond(low_[branch], depth - range_.low);
    if (depth > range_.high) return beyond(high_[branch], depth - range_.high);
    return network_(input(depth, branch))[0];
  }

  Net network_;
  DepthRange<Scalar> range_;
  CurveGuard<Scalar> guard_;
  std::array<End, branches> low_{};
  std::array<End, branches> high_{};
};

/// A curve times a factor, and its depth times another, for a measurement with another probe or blade than the curve's own.
template <class Curve, RealScalar S>
class ScaledCurve {
  static_assert(ForceCurve<Curve const, S>, "palpate::scaled, bladed: the first argument must be a force curve, a noexcept call "
                                      "(depth [m]) -> N or (depth [m], palpate::Phase) -> N, in the scalar of the factor.");

 public:
  using Scalar = S;

  ScaledCurve(Curve curve, S factor, S depth_factor = S(1)) : curve_(std::move(curve)), factor_(factor), depth_factor_(depth_factor) {
    if (!std::isfinite(factor))
      throw InvalidArgument(detail::message("scaled: the factor is ", factor, "; give a finite number"));
  }

  S operator()(S depth) const noexcept
    requires DepthCurve<Curve const, S>
  {
    return factor_ * static_cast<S>(curve_(depth_factor_ * depth));
  }
  S operator()(S depth, Phase phase) const noexcept
    requires HysteresisCurve<Curve const, S>
  {
    return factor_ * static_cast<S>(curve_(depth_factor_ * depth, phase));
  }

 private:
  Curve curve_;
  S factor_, depth_factor_;
};

/// `scaled(liver_hysteresis<double>(), 8.3)`: the liver's curve for a probe that feels 8.3 times its force.
template <class Curve, RealScalar S>
ScaledCurve<Curve, S> scaled(Curve curve, S factor) {
  return {std::move(curve), factor};
}

}  // namespace palpate
