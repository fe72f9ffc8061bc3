// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/plane_set.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace palpate {

struct SurfaceProxyOptions {
  double stiffness = 500.0;         ///< K [N/m], of the spring from the tip to the proxy; see `passive_wall` for what a device holds
  double static_friction = 0.0;     ///< μ_s
  double dynamic_friction = 0.0;    ///< μ_d, not above μ_s
  double restick = 0.6;             ///< h: a proxy that slides sticks again where it lags by less than h times what it lags while sliding
};

/// Where the tool would be if the tissue could not be entered, and the force that pulls the hand there: a god-object with a friction cone.
///   x_f = the tip p projected on the planes,   d = |p − x_f|,   t = how far the proxy lies from x_f along the surface
///   sticks   while |t| ≤ μ_s d: the proxy stays where it is on the surface
///   slides   |t| = μ_d d, behind the motion;   sticks again below h μ_d d
///   F = K (proxy − p), so |F_t| ≤ μ_s |F_n|
/// Units      m, N; force on the hand, world frame.
/// Source     \cite zilles1995; the cone \cite ruspini1997.
/// Invariant  K > 0, 0 ≤ μ_d ≤ μ_s, 0 < h ≤ 1, all finite; checked at set-up. While it sticks on planes that rest the proxy does not move by a bit.
/// Cost       One projection, two with friction; noexcept, no allocation: allowed in the servo tick.
/// Limits     A spring rendered from samples: it leaks K |Δx|²/2 a tick. Moving tissue carries the proxy by `carry`.
template <RealScalar S>
class SurfaceProxy {
 public:
  using Scalar = S;

  explicit SurfaceProxy(SurfaceProxyOptions const& options = {}) : options_(options) {
    auto const require = [](bool good, char const* what, double value, char const* unit, char const* advice) {
      if (!good || !std::isfinite(value)) throw InvalidArgument(detail::message("SurfaceProxy: ", what, " is ", value, unit, "; ", advice));
    };
    require(options.stiffness > 0.0, ".stiffness", options.stiffness, " N/m", "give a finite number above zero");
    require(options.dynamic_friction >= 0.0, ".dynamic_friction", options.dynamic_friction, "", "give a finite number, zero or more");
    require(options.static_friction >= options.dynamic_friction, ".static_friction", options.static_friction, "", "give a finite number, not below .dynamic_friction");
    require(options.restick > 0.0 && options.restick <= 1.0, ".restick", options.restick, "", "give a share above 0, up to 1");
  }

  /// The force on the hand [N] for a tip in front of or behind these planes.
  Vector3<S> operator()(PlaneSet<S> const& planes, Vector3<S> const& tip) noexcept {
    if (!tip.allFinite()) return Vector3<S>::Zero();
    PlaneProjection<S> const free = planes.project(tip);
    if (free.count == 0) {
      position_ = tip;
      touches_ = slides_ = false;
      return Vector3<S>::Zero();
    }
    if (!touches_ || !(options_.static_friction > 0.0))
      position_ = free.point;
    else
      drag(planes, free, (tip - free.point).norm());
    touches_ = true;
    return S(options_.stiffness) * (position_ - tip);
  }

  /// The surface under the proxy has moved by so much since the last tick [m].
  void carry(Vector3<S> const& way) noexcept {
    if (touches_ && way.allFinite()) position_ += way;
  }

  Vector3<S> const& position() const noexcept { return position_; }
  bool touches() const noexcept { return touches_; }
  bool slides() const noexcept { return slides_; }
  void reset() noexcept { touches_ = slides_ = false; }

 private:
  void drag(PlaneSet<S> const& planes, PlaneProjection<S> const& free, S depth) noexcept {
    Vector3<S> const lag = along(planes, free, position_ - free.point);
    S const length = lag.norm(), sliding = S(options_.dynamic_friction) * depth;
    if (slides_ && length < S(options_.restick) * sliding) slides_ = false;
    if (length > (slides_ ? sliding : S(options_.static_friction) * depth)) slides_ = true;
    Vector3<S> wanted = free.point + lag;
    if (slides_ && length > sliding)
      wanted = free.point + (sliding / length) * lag;
    else if ((position_ - wanted).norm() <= S(16) * std::numeric_limits<S>::epsilon() * (position_.norm() + depth))
      return;   // it sticks, and is on the surface already: not a bit of drift
    position_ = planes.project(wanted).point;
  }

  /// What of a vector lies in all planes that push: the rest is taken off one normal after the other, each made square to those before.
  static Vector3<S> along(PlaneSet<S> const& planes, PlaneProjection<S> const& free, Vector3<S> v) noexcept {
    std::array<Vector3<S>, 3> square{};
    for (int k = 0; k < free.count; ++k) {
      Vector3<S> n = planes[free.active[static_cast<std::size_t>(k)]].normal;
      for (int j = 0; j < k; ++j) n -= n.dot(square[static_cast<std::size_t>(j)]) * square[static_cast<std::size_t>(j)];
      n.normalize();
      square[static_cast<std::size_t>(k)] = n;
      v -= v.dot(n) * n;
    }
    return v;
  }

  SurfaceProxyOptions options_;
  Vector3<S> position_ = Vector3<S>::Zero();
  bool touches_ = false;
  bool slides_ = false;
};

}  // namespace palpate
