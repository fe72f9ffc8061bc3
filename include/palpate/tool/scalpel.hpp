// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/tool/blunt_tool.hpp>

#include <concepts>
#include <optional>
#include <utility>

namespace palpate {

namespace detail {

template <class C>
concept TellsGrip = requires(C const& cutter) { cutter.grip(); };
template <class C, class Scalar>
concept TakesResistance = requires(C& cutter, Vector3<Scalar> const& force) { cutter.resisted(force); };

}  // namespace detail

template <RealScalar Scalar>
struct ScalpelOptions {
  ScalpelShape shape = {};
  ContactOptions<Scalar> handle = {};   ///< how the handle pushes
  ContactCoupling tip = {};             ///< how the tip presses before it has punctured
};

/// A scalpel: the edge cuts, the handle pushes what it meets, such as the lips of a deep wound.
///   Scalpel<double> scalpel({.puncture_depth = 0.003});                  // of solids
///   Scalpel<double, ProgressiveCutter<double>> knife(ProgressiveCutter<double>({.puncture_depth = 0.003}));
/// Of a VolumeCutter the edge is the shape's first rod. Force, phase and contact are the edge's where it touches, else the handle's.
/// Units      m, N; world frame.
template <RealScalar Scalar, class BladeType = VolumeCutter<Scalar>>
class Scalpel {
 public:
  using Vector = Vector3<Scalar>;

  explicit Scalpel(VolumeCutOptions<Scalar> const& cut = {}, ScalpelOptions<Scalar> const& options = {})
    requires std::same_as<BladeType, VolumeCutter<Scalar>>
      : Scalpel(options, BladeType(with_edge(cut, make_scalpel_shape<Scalar>(options.shape).rods[0].rod))) {}
  explicit Scalpel(BladeType blade, ScalpelOptions<Scalar> const& options = {})
    requires(!std::same_as<BladeType, VolumeCutter<Scalar>>)
      : Scalpel(options, std::move(blade)) {}

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool, Scalar force = 0) {
    if constexpr (FeelsReaction<BladeType, Body>)
      blade_.advance(body, tool, force);
    else
      blade_.advance(body, tool);
    handle_.advance(body, tool);
  }
  template <class Body>
  Vector press(Body& body, Scalar share, Scalar h) {
    handle_.press(body, share, h);
    force_ = handle_.force(), moment_ = handle_.moment();
    if (blade_.state() != CuttingPhase::indenting) return force_;
    ToolPose<Scalar> const now = handle_.rods().pose_at(share);
    Vector const pressed = tip_.apply(body, blade_.contact(), now.position, now.velocity, blade_.tip_radius(), h);
    force_ += pressed;
    moment_ += (RodContact<Scalar>::point_at(body, blade_.contact().triangle, blade_.contact().barycentric) - now.position).cross(pressed);
    return force_;
  }
  template <class Body>
  void reset(Body& body) {
    blade_.reset(body), handle_.reset(body);
    force_.setZero(), moment_.setZero();
  }

  BladeType const& blade() const noexcept { return blade_; }
  BluntTool<Scalar> const& handle() const noexcept { return handle_; }

  SurfaceContact<Scalar> const& contact() const noexcept { return edge_touches() ? blade_.contact() : handle_.contact(); }
  CuttingPhase state() const noexcept { return edge_touches() ? blade_.state() : handle_.state(); }
  auto const& report() const noexcept { return blade_.report(); }
  Scalar tip_radius() const noexcept { return edge_touches() ? blade_.tip_radius() : handle_.tip_radius(); }
  Vector const& haptic_point() const noexcept { return edge_touches() ? handle_.rods().pose().position : handle_.haptic_point(); }
  /// Of the last step: the tissue's force on the tool [N], without what resists the edge, and its moment about the tool's origin [N m].
  Vector const& force() const noexcept { return force_; }
  Vector const& moment() const noexcept { return moment_; }

  template <class Body>
    requires HoldsTissue<BladeType, Body>
  auto held(Body const& body) const {
    return blade_.held(body);
  }
  auto grip() const
    requires detail::TellsGrip<BladeType>
  {
    return blade_.grip();
  }
  void resisted(Vector const& force)
    requires detail::TakesResistance<BladeType, Scalar>
  {
    blade_.resisted(force);
  }
  double area() const noexcept
    requires CountsArea<BladeType>
  {
    return blade_.area();
  }

 private:
  Scalpel(ScalpelOptions<Scalar> const& options, BladeType blade)
      : blade_(std::move(blade)), handle_(make_scalpel_shape<Scalar>(options.shape), options.handle), tip_(options.tip) {
    tip_.validate();
  }

  bool edge_touches() const noexcept { return blade_.state() != CuttingPhase::no_contact; }

  static VolumeCutOptions<Scalar> with_edge(VolumeCutOptions<Scalar> cut, Capsule<Scalar> const& edge) {
    if (cut.edge != VolumeCutOptions<Scalar>{}.edge) throw InvalidArgument("Scalpel: .edge is the shape's; give ScalpelOptions::shape its length and angle");
    cut.edge = {edge.from, edge.to};
    return cut;
  }

  BladeType blade_;
  BluntTool<Scalar> handle_;
  ContactCoupling tip_;
  Vector force_ = Vector::Zero(), moment_ = Vector::Zero();
};

}  // namespace palpate
