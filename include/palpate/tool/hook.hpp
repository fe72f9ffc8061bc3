// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/tool/blunt_tool.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

namespace palpate {

template <RealScalar Scalar>
struct HookOptions {
  HookShape shape = {};
  Scalar friction = Scalar(0.3);
  Scalar angle = std::numbers::pi_v<Scalar> / 4;   ///< rad, between the point and the way into the tissue, up to which it hooks in
  Scalar hooking_force = Scalar(0.05);             ///< N, with which its point must press to hook in, where it has not gone through; what pulls it out without a side load
  Scalar tear_force = Scalar(10);                  ///< N, at which the tissue tears off; while the point presses harder it does not hook in
};

/// A surgical hook, or retractor: it slides or hooks in by its orientation.
///   Hook<double> hook({.friction = 0.5});
///   Simulator simulator(device, std::move(body), hook, TissueReaction{});
/// Its point and its shaft push like a blunt tool's. Where the point is turned into the tissue, within `angle` of it, and presses with `hooking_force`, the
/// tissue at the tip is held: drawn to any side it comes along. So is the tissue that it has gone through. It lets go
///   when the tissue there has been taken away;
///   when the point is turned away, by `angle` and ten degrees;
///   when it is pulled out: the pull along the point is above friction · side load + hooking_force;
///   when the load is above `tear_force`.
/// A point that lies on the tissue slides: the force along the surface is at most friction times that across it.
/// Units      m, N, rad; world frame. As it is, not turned, the point looks down, −z; see HookShape.
/// Source     \cite bielser2002: a hook that slides or hooks in, depending on its orientation.
/// Limits     It holds one point of the surface: what it is hooked into does not rip, and does not slide along the point.
template <RealScalar Scalar>
class Hook {
 public:
  using Vector = Vector3<Scalar>;

  explicit Hook(HookOptions<Scalar> const& options = {})
      : options_(checked(options)), tool_(make_hook_shape<Scalar>(options.shape), {.friction = options.friction}) {}

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool) {
    if (body.restorations() != restorations_) hooked_ = false;
    restorations_ = body.restorations();
    tool_.advance(body, tool);
    if (hooked_) follow(body);
    if (!hooked_)
      hook_in(body);
    else if (lets_go(body))
      hooked_ = false;   // it hooks in again after a tick, where it presses then
    if (hooked_ && !tool_.contact().touching) tool_.show(body, 0, pin_.triangle, pin_.barycentric, tool_.rods().pose().position);
  }
  template <class Body>
  Vector press(Body& body, Scalar share, Scalar h) {
    if (hooked_ && revision_ != body.topology_revision()) follow(body);   // another tool has cut it since
    Vector const force = tool_.press(body, share, h, hooked_ ? &pin_ : nullptr);
    load_ = hooked_ ? pin_.force : Vector(Vector::Zero());
    for (auto const& touch : rods().touches())
      if (touch.rod == 0) load_ += touch.force;
    return force;
  }
  template <class Body>
  void reset(Body& body) noexcept {
    hooked_ = false;
    tool_.reset(body);
  }

  /// Whether it has hooked in, and what it holds.
  bool hooked() const noexcept { return hooked_; }
  PinnedPoint<Scalar> const& held() const noexcept { return pin_; }

  SurfaceContact<Scalar> const& contact() const noexcept { return tool_.contact(); }
  CuttingPhase state() const noexcept { return hooked_ ? CuttingPhase::indenting : tool_.state(); }
  CutReport const& report() const noexcept { return tool_.report(); }
  Scalar tip_radius() const noexcept { return tool_.tip_radius(); }
  Vector const& haptic_point() const noexcept { return tool_.haptic_point(); }
  Vector const& force() const noexcept { return tool_.force(); }
  Vector const& moment() const noexcept { return tool_.moment(); }
  RodContact<Scalar> const& rods() const noexcept { return tool_.rods(); }
  HookOptions<Scalar> const& options() const noexcept { return options_; }

 private:
  static HookOptions<Scalar> const& checked(HookOptions<Scalar> const& options) {
    detail::OptionCheck const check{"HookOptions"};
    check(options.angle > 0 && options.angle < std::numbers::pi_v<Scalar> / 2, ".angle", static_cast<double>(options.angle), " rad",
          "give one between 0 and pi/2");
    check.not_negative(".friction", static_cast<double>(options.friction));
    check.positive(".hooking_force", static_cast<double>(options.hooking_force), " N");
    check.positive(".tear_force", static_cast<double>(options.tear_force), " N");
    return options;
  }
  /// The way that the point looks, from the bend to the tip.
  Vector point_direction() const noexcept { return rods().pose().orientation * Vector(-Vector::UnitZ()); }

  template <class Body>
  void hook_in(Body const& body) {
    for (auto const& touch : rods().touches()) {
      if (!touch.acts || touch.rod != 0 || (touch.parameter > 0 && !touch.crosses)) continue;   // at the point's end, or where it is through
      Vector const into = -outward(body, touch.triangle, touch.barycentric);
      Scalar const pressed = -tool_.force().dot(into);
      if (!(point_direction().dot(into) > std::cos(options_.angle)) || !(pressed > (touch.crosses ? Scalar(0) : options_.hooking_force)) ||
          !(pressed < options_.tear_force))
        continue;
      Vector const on_rod = touch.crosses ? touch.on_axis : Vector(touch.on_axis - static_cast<Scalar>(options_.shape.radius) * touch.normal);
      pin_ = {.through = touch.crosses,
              .triangle = touch.triangle,
              .barycentric = touch.barycentric,
              .offset = rods().pose().orientation.conjugate() * (on_rod - rods().pose().position),
              .limit = options_.tear_force};
      know(body);
      hooked_ = true;
      return;
    }
  }

  /// After a cut the point that is held may be in another triangle: the one nearest to where its particles have gone, which keep their numbers; where one of them
  /// is no more, nearest to where it was. Where they are there and the surface is not within the point's radius, the tissue was taken away. Where particles have
  /// other numbers now, that which has its place at rest.
  template <class Body>
  void follow(Body& body) {
    bool is_renumbered = false;
    if constexpr (RenumbersParticles<Body>) is_renumbered = body.renumberings() != renumberings_;
    if (is_renumbered) {
      if (!find_home(body)) return void(hooked_ = false);
    } else if (revision_ != body.topology_revision()) {
      bool const is_known = std::ranges::all_of(held_by_, [&](int p) { return p < body.positions().cols(); });
      if (is_known) {
        held_at_.setZero();
        for (std::size_t k = 0; k < 3; ++k) held_at_ += pin_.barycentric[static_cast<int>(k)] * body.positions().col(held_by_[k]);
      }
      auto const nearest = body.nearest_point(held_at_);
      Scalar const radius = static_cast<Scalar>(options_.shape.radius);
      if (!nearest.found() || (is_known && !(nearest.distance < radius))) return void(hooked_ = false);
      pin_.triangle = nearest.triangle, pin_.barycentric = nearest.barycentric / nearest.barycentric.sum();
    }
    know(body);
  }
  /// The point of the surface near the one that was held that is nearest to its place at rest.
  template <class Body>
  bool find_home(Body& body) {
    Vector const reach = Vector::Constant(4 * static_cast<Scalar>(options_.shape.radius));
    Scalar least = std::numeric_limits<Scalar>::infinity();
    body.visit_triangles_in_box(held_at_ - reach, held_at_ + reach, [&](int t) {
      auto const c = body.tissue().surface().corners(t);
      auto const near = closest_point_on_triangle<Scalar>(home_, body.reference_position(c[0]), body.reference_position(c[1]), body.reference_position(c[2]));
      if (near.squared_distance < least) least = near.squared_distance, pin_.triangle = t, pin_.barycentric = near.barycentric / near.barycentric.sum();
    });
    return std::isfinite(least);
  }
  template <class Body>
  void know(Body const& body) {
    auto const corners = body.tissue().surface().corners(pin_.triangle);
    for (std::size_t k = 0; k < 3; ++k) held_by_[k] = corners[k];
    held_at_ = RodContact<Scalar>::point_at(body, pin_.triangle, pin_.barycentric);
    if constexpr (RenumbersParticles<Body>) {
      home_.setZero();
      for (std::size_t k = 0; k < 3; ++k) home_ += pin_.barycentric[static_cast<int>(k)] * body.reference_position(corners[k]);
      renumberings_ = body.renumberings();
    }
    revision_ = body.topology_revision();
  }

  template <class Body>
  bool lets_go(Body const& body) const {
    constexpr Scalar ten_degrees = std::numbers::pi_v<Scalar> / 18;
    Vector const into = -outward(body, pin_.triangle, pin_.barycentric), along = point_direction();
    if (!(along.dot(into) > std::cos(options_.angle + ten_degrees))) return true;
    Scalar const pull = load_.dot(along);   // the tissue draws the point in: it is being pulled out
    Scalar const side = (load_ - pull * along).norm();
    return pull > options_.friction * side + options_.hooking_force || !(pin_.force.norm() < Scalar(0.999) * options_.tear_force);
  }

  /// Smooth outward normal of the undisturbed surface.
  template <class Body>
  static Vector outward(Body const& body, int triangle, Vector const& weights) {
    auto const corners = body.tissue().surface().corners(triangle);
    Vector normal = Vector::Zero();
    for (std::size_t k = 0; k < 3; ++k) normal += weights[static_cast<int>(k)] * body.reference_normal(corners[k]);
    return normal.normalized();
  }

  HookOptions<Scalar> options_;
  BluntTool<Scalar> tool_;
  PinnedPoint<Scalar> pin_;
  Vector load_ = Vector::Zero();      // N, of the tissue on the point in the last step: what is held, and what is pushed beside it
  Vector held_at_ = Vector::Zero();   // m, the point that is held
  std::array<int, 3> held_by_{};      // particles, of the triangle that is held, when the body had this revision
  Vector home_ = Vector::Zero();      // m, where it is at rest, of a body whose particles get other numbers
  std::size_t revision_ = 0, restorations_ = 0, renumberings_ = 0;
  bool hooked_ = false;
};

}  // namespace palpate
