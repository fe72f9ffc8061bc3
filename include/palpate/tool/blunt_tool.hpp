// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/cutting/concept.hpp>
#include <palpate/tool/built_in_shapes.hpp>
#include <palpate/tool/rod_contact.hpp>

#include <concepts>
#include <utility>

namespace palpate {

/// A tool of any shape that touches along its whole length and never cuts: a probe, a spatula, the handle of something.
///   BluntTool<double> rod(make_probe_shape<double>({.radius = 0.003}), {.friction = 0.2});
///   Simulator simulator(device, std::move(body), rod, TissueReaction{});
/// It is a Cutter that cuts nothing and presses by itself: see RodContact for the contact and ContactForces for the forces.
/// Units      m, N; world frame.
/// Haptic     contact() is where the shape's haptic point is, or for an averaged one the deepest place; haptic_point() is the tool's point there.
template <RealScalar Scalar>
class BluntTool {
 public:
  using Vector = Vector3<Scalar>;

  BluntTool() : BluntTool(make_probe_shape<Scalar>()) {}
  explicit BluntTool(ToolShape<Scalar> shape, ContactOptions<Scalar> const& options = {}) : rods_(std::move(shape), options) {}

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool) {
    static_assert(std::same_as<Scalar, typename Body::Scalar>,
                  "BluntTool: the tool computes in another scalar than the body; take BluntTool<float> for a body in float.");
    rods_.advance(body, tool);
    choose(body);
  }
  template <class Body, class Leaves = LeavesNone>
  Vector press(Body& body, Scalar share, Scalar h, PinnedPoint<Scalar>* pin = nullptr, Leaves const& leaves = {}) {
    Vector const force = rods_.press(body, share, h, pin, leaves);
    if (!contact_.touching && !is_zero(force)) choose(body);   // tissue that was not at a rod yet, and is kept from coming into it in this step
    return force;
  }
  template <class Body>
  void reset(Body&) noexcept {
    forget();
  }

  SurfaceContact<Scalar> const& contact() const noexcept { return contact_; }
  CuttingPhase state() const noexcept { return contact_.touching ? CuttingPhase::indenting : CuttingPhase::no_contact; }
  CutReport const& report() const noexcept { return report_; }
  Scalar tip_radius() const noexcept { return rods_.shape().rods[static_cast<std::size_t>(rod_)].rod.radius; }   // m, of the rod in contact
  Vector const& haptic_point() const noexcept { return haptic_point_; }
  /// Of the last step: the tissue's force on the tool [N], and its moment about the tool's origin [N m].
  Vector const& force() const noexcept { return rods_.force(); }
  Vector const& moment() const noexcept { return rods_.moment(); }
  RodContact<Scalar> const& rods() const noexcept { return rods_; }

  /// Makes this contact the one that stands for all: a point of the surface, and of the tool [m].
  template <class Body>
  void show(Body const& body, int rod, int triangle, Vector const& barycentric, Vector const& on_tool) {
    rod_ = rod;
    haptic_point_ = on_tool;
    contact_ = {};
    contact_.touching = true;
    contact_.place(body, triangle, barycentric, on_tool, tip_radius());
  }

 private:
  void forget() noexcept {
    rods_.reset();
    contact_ = {};
  }

  /// The place that stands for all.
  template <class Body>
  void choose(Body const& body) {
    auto const& shape = rods_.shape();
    auto const on_axis = [&](RodTouch<Scalar> const& touch) {   // at the tool's last pose, wherever it was when that was found
      auto const axis = shape.rods[static_cast<std::size_t>(touch.rod)].at(rods_.pose().opening);
      return RodContact<Scalar>::placed(rods_.pose(), axis.from + touch.parameter * (axis.to - axis.from));
    };
    RodTouch<Scalar> const *best = nullptr, *other = nullptr;   // of the rods that count, of all
    Vector sum = Vector::Zero();
    Scalar weight = 0;
    for (auto const& touch : rods_.touches()) {
      if (!touch.acts) continue;
      if (touch.depth > 0) sum += touch.depth * on_axis(touch), weight += touch.depth;
      if (other == nullptr || touch.depth > other->depth) other = &touch;
      if (shape.haptic_point == HapticPoint::chosen && touch.rod != shape.chosen) continue;
      if (best == nullptr || touch.depth > best->depth) best = &touch;
    }
    contact_ = {};
    haptic_point_ = rods_.pose().position;
    if (best == nullptr) best = other;   // the chosen rod touches nothing: the others are felt all the same
    if (best == nullptr) return;
    show(body, best->rod, best->triangle, best->barycentric, shape.haptic_point == HapticPoint::averaged && weight > 0 ? Vector(sum / weight) : on_axis(*best));
  }

  RodContact<Scalar> rods_;
  SurfaceContact<Scalar> contact_;
  CutReport report_;
  Vector haptic_point_ = Vector::Zero();
  int rod_ = 0;
};

/// A blunt rod, unless it is given another shape.
template <RealScalar Scalar>
using Probe = BluntTool<Scalar>;

}  // namespace palpate
