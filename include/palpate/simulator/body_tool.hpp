// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/surface_sensor.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace palpate {

/// What holds several bodies, in places from 0 on: a scene.
template <class B>
concept HoldsBodies = requires { typename B::template Body<0>; };

/// A cutter and what it acts on: a body, or a scene that says of each cutter whether all its bodies take it.
template <class C, class Body>
concept CutterFor = (SimulatedBody<Body> && Cutter<C, Body>) || Body::template takes_cutter<C>;

/// What one tool does to a body, in a tick of it: advance() touches and cuts, push() couples it to the tissue before each step, model() says what its servo needs
/// to know. While the tool indents, the touched point is coupled to the tip, and so is the point at a blade that is held across its edge, or that a solid resists;
/// the tip moves evenly through the tick. A tool that presses the tissue itself does so in each of them.
template <class BodyType, class CutterType>
class BodyTool {
  static_assert(SimulatedBody<BodyType> && Cutter<CutterType, BodyType>);
  static_assert(!detail::MeansToPress<CutterType, BodyType> || PressesTissue<CutterType, BodyType>,
                "palpate: the tool does not press; declare: template <class Body> Vector3<Scalar> press(Body& body, Scalar share, Scalar h), which applies its forces and returns the "
                "force on the tool, and Vector3<Scalar> const& haptic_point() const.");

 public:
  using Scalar = typename BodyType::Scalar;
  using Vector = Vector3<Scalar>;
  static constexpr bool presses_itself = PressesTissue<CutterType, BodyType>;

  BodyTool(CutterType cutter, ContactCoupling const& coupling) : cutter_(std::move(cutter)), coupling_(coupling) {}

  /// The tool is here now. Where `pose_discontinuities`, the servo's count, has changed, it was not moved there but placed: nothing is touched or cut on the way, a
  /// cut in progress ends where the blade was, and the tip has to come from outside again. A cutter without `reset(body)` can not be told.
  void advance(BodyType& body, ToolPose<Scalar> const& tool, std::uint64_t pose_discontinuities) {
    if (pose_discontinuities != pose_discontinuities_) {
      pose_discontinuities_ = pose_discontinuities;
      take_away(body);
    }
    from_ = ticked_ ? tool_.position : tool.position;
    tool_ = tool;
    ticked_ = is_here_ = true;
    if constexpr (FeelsReaction<CutterType, BodyType>)
      cutter_.advance(body, tool, pressed_);
    else
      cutter_.advance(body, tool);
    presses_ = cutter_.state() == CuttingPhase::indenting;
    reaction_.setZero(), moment_.setZero(), resistance_.setZero();
    renumberings_ = renumberings(body);
  }
  /// It is nowhere in this tick.
  void rest() noexcept { is_here_ = false; }

  /// Before step `i` of so many, from 1 on, each so many seconds.
  void push(BodyType& body, int i, int steps, Scalar each) {
    if (!is_here_ || renumberings(body) != renumberings_) return;   // another tool has taken tissue away: it finds its contact again in the next tick
    Vector const& tip = tool_.position;
    Vector const now = from_ + (tip - from_) * (Scalar(i) / Scalar(steps));
    if constexpr (HoldsTissue<CutterType, BodyType>)
      if (auto const held = cutter_.held(body))
        reaction_ += coupling_.drag(body, *held, cutter_.contact().normal, now, tool_.velocity, each) / Scalar(steps);
    if constexpr (ResistsBlade<CutterType, BodyType>)
      if (auto const grip = cutter_.grip()) {
        Vector const resists = coupling_.resist(body, *grip, tip - now, tool_.velocity, each) / Scalar(steps);
        reaction_ += resists, resistance_ += resists;
      }
    if constexpr (PressesTissue<CutterType, BodyType>) {
      reaction_ += cutter_.press(body, Scalar(i) / Scalar(steps), each) / Scalar(steps);
      if constexpr (TellsMoment<CutterType, BodyType>) moment_ += cutter_.moment() / Scalar(steps);
      return;
    }
    if (!presses_) return;
    reaction_ += coupling_.apply(body, cutter_.contact(), now, tool_.velocity, cutter_.tip_radius(), each) / Scalar(steps);
  }

  /// After the steps of a tick.
  LocalModel<Scalar> model(BodyType& body, bool diverged) {
    pressed_ = std::min(std::numeric_limits<Scalar>::max(), reaction_.norm());   // its square may be too large for a number
    if constexpr (CountsWork<CutterType, BodyType>) cutter_.resisted(resistance_);
    LocalModel<Scalar> model;
    SurfaceContact<Scalar> const& contact = cutter_.contact();
    model.phase = cutter_.state();
    model.diverged = diverged;
    model.restorations = body.restorations();
    if (model.phase != CuttingPhase::no_contact) {
      model.home_point = contact.home_point;
      model.normal = contact.normal;
      model.tip_radius = cutter_.tip_radius();
      model.tissue_force = reaction_;
      model.tissue_moment = moment_;
      if constexpr (PressesTissue<CutterType, BodyType>) model.home_point += tool_.position - cutter_.haptic_point();   // a depth below it is one of the haptic point
    }
    if constexpr (CountsArea<CutterType>) model.cut_area = cutter_.area();
    if (sensor_.kind() != SurfaceKind::none) {
      if (renumberings(body) == renumberings_)
        surface_ = sensor_.look(detail::shape_of(body), contact, model.phase, tool_.position, cutter_.tip_radius(), static_cast<Scalar>(coupling_.stiffness));
      model.surface = surface_;
    }
    return model;
  }

  /// From now on local models hold the surface too, as a force wants it.
  void sense_surface(SurfaceKind kind, SurfaceSensorOptions const& options = {}) { sensor_ = SurfaceSensor<Scalar>(kind, options); }
  /// The body was restored: what the tool pressed with is no more.
  void forget_press() noexcept { pressed_ = 0; }

  CutterType& cutter() noexcept { return cutter_; }
  CutterType const& cutter() const noexcept { return cutter_; }

 private:
  static std::size_t renumberings(BodyType const& body) noexcept {
    if constexpr (CountsRenumberings<BodyType>)
      return body.renumberings();
    else
      return body.restorations();
  }
  void take_away(BodyType& body) {
    if constexpr (ResettableCutter<CutterType, BodyType>) cutter_.reset(body);
    ticked_ = false;
    pressed_ = 0;
  }

  CutterType cutter_;
  ContactCoupling coupling_;
  SurfaceSensor<Scalar> sensor_;
  ToolPose<Scalar> tool_{};
  Vector from_ = Vector::Zero();       // where the tip was at the tick's begin
  Vector reaction_ = Vector::Zero();   // N, of this tick
  Vector moment_ = Vector::Zero();     // N m, likewise, about the tool's origin
  Vector resistance_ = Vector::Zero(); // N, of that what resists a blade in a solid
  Scalar pressed_ = 0;                 // N, of the last tick
  bool ticked_ = false, is_here_ = false, presses_ = false;
  std::uint64_t pose_discontinuities_ = 0;
  std::size_t renumberings_ = 0;     // of the body, when it was advanced last
  SurfaceModel<Scalar> surface_{};   // the last that was sensed
};

}  // namespace palpate
