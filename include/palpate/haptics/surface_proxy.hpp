// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/plane_set.hpp>

#include <limits>

namespace palpate {

struct SurfaceProxyOptions {
  double stiffness = 500.0;         ///< K [N/m], of the spring from the tip to the proxy; see `passive_wall` for what a device holds
  double static_friction = 0.0;     ///< μ_s
  double dynamic_friction = 0.0;    ///< μ_d, not above μ_s
  double restick = 0.6;             ///< h: a proxy that slides sticks again where it lags by less than h times what it lags while sliding

  /// Throws `InvalidArgument`; `owner` and `of_stiffness` are what it was called where it was given.
  void validate(char const* owner = "SurfaceProxy", char const* of_stiffness = ".stiffness") const {
    detail::OptionCheck const require{owner, true};
    require.positive(of_stiffness, stiffness, " N/m");
    require.not_negative(".dynamic_friction", dynamic_friction, "");
    require(static_friction >= dynamic_friction, ".static_friction", static_friction, "", "give a finite number, not below .dynamic_friction");
    require(dynamic_friction > 0.0 || !(static_friction > 0.0), ".dynamic_friction", dynamic_friction, "",
            "give a number above zero where .static_friction is: without it the tool would never stick again");
    require(restick > 0.0 && restick <= 1.0, ".restick", restick, "", "give a share above 0, up to 1");
  }
};

/// God-object with a friction cone: the tool as it would be if the tissue could not be entered, and the force that pulls the hand there.
///   x_f = the tip p projected on the planes,   d = |p − x_f|,   t = offset of the proxy, on the surface, from x_f
///   sticks   while |t| ≤ μ_s d: the proxy stays where it is on the surface
///   slides   |t| = μ_d d, behind the motion;   sticks again below h μ_d d
///   F = K (proxy − p), so |F_t| ≤ μ_s |F_n|
/// Units      m, N; force on the hand, world frame.
/// Source     \cite zilles1995; the cone \cite ruspini1997.
/// Invariant  K > 0, 0 < μ_d ≤ μ_s or both 0, 0 < h ≤ 1, all finite; checked at set-up. While it sticks on planes at rest the proxy does
///            not move by a bit.
/// Cost       One projection, two with friction; noexcept, no allocation: allowed in the servo tick.
/// Limits     A spring rendered from samples: it leaks K |Δx|²/2 a tick. Moving tissue carries the proxy by `carry`.
template <RealScalar S>
class SurfaceProxy {
 public:
  using Scalar = S;

  explicit SurfaceProxy(SurfaceProxyOptions const& options = {}) : options_(options) { options_.validate(); }

  /// The force on the hand [N] for a tip in front of or behind these planes.
  Vector3<S> operator()(PlaneSet<S> const& planes, Vector3<S> const& tip) noexcept { return (*this)(planes, tip, S(options_.stiffness)); }

  /// The same with another stiffness [N/m], which may change from tick to tick: that of the tissue there. The proxy does not depend on it.
  Vector3<S> operator()(PlaneSet<S> const& planes, Vector3<S> const& tip, S stiffness) noexcept {
    if (!is_finite(tip)) return Vector3<S>::Zero();
    PlaneProjection<S> const free = planes.project(tip);
    held_by_ = free.count;
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
    if (free.count == 1 || free.count == 2) {
      Vector3<S> const first = planes[free.active[0]].normal;
      axis_ = (free.count == 1 ? first : Vector3<S>(first.cross(planes[free.active[1]].normal))).normalized();
    }
    return stiffness > S(0) ? Vector3<S>(stiffness * (position_ - tip)) : Vector3<S>(Vector3<S>::Zero());
  }

  /// The surface under the proxy has moved by so much since the last tick [m].
  void carry(Vector3<S> const& way) noexcept {
    if (touches_ && is_finite(way)) position_ += way;
  }

  Vector3<S> const& position() const noexcept { return position_; }
  bool touches() const noexcept { return touches_; }
  bool slides() const noexcept { return slides_; }
  /// Projects on the ways that the proxy does not go with the tip: there the tip feels the spring. One across a plane, two across an edge; all three in a
  /// corner, and where it sticks; none in free space.
  Matrix<S, 3, 3> held_ways() const noexcept {
    using Ways = Matrix<S, 3, 3>;
    if (held_by_ == 0) return Ways::Zero();
    if (held_by_ == 3 || (options_.static_friction > 0.0 && !slides_)) return Ways::Identity();
    Ways const along = axis_ * axis_.transpose();
    return held_by_ == 1 ? along : Ways(Ways::Identity() - along);
  }
  void reset() noexcept {
    touches_ = slides_ = false;
    held_by_ = 0;
  }

 private:
  void drag(PlaneSet<S> const& planes, PlaneProjection<S> const& free, S depth) noexcept {
    Vector3<S> const place = on_surface(planes, depth), lag = place - free.point;
    S const length = lag.norm(), sliding = S(options_.dynamic_friction) * depth;
    if (slides_ && length < S(options_.restick) * sliding) slides_ = false;
    if (length > (slides_ ? sliding : S(options_.static_friction) * depth)) slides_ = true;
    position_ = slides_ && length > sliding ? Vector3<S>(free.point + (sliding / length) * lag) : place;   // between two points in front of all planes
  }

  /// Where the proxy is on the surface now: brought down to the nearest plane, if all have gone away under it, and up to those that came.
  Vector3<S> on_surface(PlaneSet<S> const& planes, S depth) const noexcept {
    int nearest = 0;
    for (int k = 1; k < planes.count(); ++k)
      if (planes[k].distance(position_) < planes[nearest].distance(position_)) nearest = k;
    S const above = planes[nearest].distance(position_), rounding = S(16) * std::numeric_limits<S>::epsilon() * (position_.norm() + depth);
    Vector3<S> const lowered = above > rounding ? Vector3<S>(position_ - above * planes[nearest].normal) : position_;
    Vector3<S> const raised = planes.project(lowered).point;
    return (raised - position_).norm() <= rounding ? position_ : raised;   // it sticks, and is on the surface already: not a bit of drift
  }

  SurfaceProxyOptions options_;
  Vector3<S> position_ = Vector3<S>::Zero();
  Vector3<S> axis_ = Vector3<S>::UnitZ();   // of the plane or the edge that holds it
  int held_by_ = 0;                         // planes
  bool touches_ = false;
  bool slides_ = false;
};

}  // namespace palpate
