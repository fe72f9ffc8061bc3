// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/network.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace palpate {

/// The depths [m] a curve was measured at.
template <RealScalar S>
struct DepthRange {
  S low = S(0);
  S high = S(0);
};

/// A trained network as a force curve: depth [m] → force [N], inside the depths it was trained on; outside
/// continued along the tangent at the nearer end, because a network saturates or runs away where it has seen
/// no data.
///   one input     curve(depth)
///   two inputs    curve(depth, phase); the second input is 0 for loading, 1 for unloading
/// Units      depth [m]; the network's own input unit is a matter of its scaling.
/// Invariant  range.low < range.high, both finite; checked at set-up. The continuation has neither step nor
///            kink.
/// Cost       One evaluation of the network; noexcept, no allocation: allowed in the servo tick.
/// Limits     Far below the range the tangent turns negative, far above it grows without end: the device
///            limits the force.
template <class Net>
class NetworkCurve {
  static_assert(Net::outputs == 1 && (Net::inputs == 1 || Net::inputs == 2),
                "palpate::NetworkCurve: the network must have one output (force) and one input (depth) or two "
                "(depth, flag of the phase): Network<double, 1, 5, 1> or Network<double, 2, 5, 1>.");

 public:
  using Scalar = typename Net::Scalar;

  NetworkCurve(Net network, DepthRange<Scalar> range) : network_(std::move(network)), range_(range) {
    if (!std::isfinite(range.low) || !std::isfinite(range.high) || !(range.low < range.high))
      throw InvalidArgument(detail::message("NetworkCurve: the depth range is ", range.low, " … ", range.high,
                                            " m; give two finite depths, the lower one first"));
    for (std::size_t branch = 0; branch < branches; ++branch) {
      low_[branch] = end_at(range.low, branch);
      high_[branch] = end_at(range.high, branch);
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

  Scalar value(Scalar depth, std::size_t branch) const noexcept {
    if (depth < range_.low) return low_[branch].force + low_[branch].slope * (depth - range_.low);
    if (depth > range_.high) return high_[branch].force + high_[branch].slope * (depth - range_.high);
    return network_(input(depth, branch))[0];
  }

  Net network_;
  DepthRange<Scalar> range_;
  std::array<End, branches> low_{};
  std::array<End, branches> high_{};
};

/// A curve times a factor, for a measurement with another probe or blade than the curve's own.
template <class Curve, RealScalar S>
class ScaledCurve {
  static_assert(ForceCurve<Curve const, S>, "palpate::scaled: the first argument must be a force curve, a noexcept call "
                                      "(depth [m]) -> N or (depth [m], palpate::Phase) -> N, in the scalar of the factor.");

 public:
  using Scalar = S;

  ScaledCurve(Curve curve, S factor) : curve_(std::move(curve)), factor_(factor) {
    if (!std::isfinite(factor))
      throw InvalidArgument(detail::message("scaled: the factor is ", factor, "; give a finite number"));
  }

  S operator()(S depth) const noexcept
    requires DepthCurve<Curve const, S>
  {
    return factor_ * static_cast<S>(curve_(depth));
  }
  S operator()(S depth, Phase phase) const noexcept
    requires HysteresisCurve<Curve const, S>
  {
    return factor_ * static_cast<S>(curve_(depth, phase));
  }

 private:
  Curve curve_;
  S factor_;
};

/// `scaled(liver_hysteresis<double>(), 8.3)`: the liver's curve for a probe that feels 8.3 times its force.
template <class Curve, RealScalar S>
ScaledCurve<Curve, S> scaled(Curve curve, S factor) {
  return {std::move(curve), factor};
}

}  // namespace palpate
