// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/touch.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/core/units.hpp>
#include <palpate/cutting/blade_edge.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>
#include <palpate/cutting/detail/snapping.hpp>

#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

namespace palpate::detail {

/// What all scalpels do: touch, press, puncture, move and leave. How the mesh changes is the front's part.
///
///   no contact → indenting → moving → no contact
///
/// A front falls behind a tip that is fast; then it catches up in the ticks that follow and goes on to where the tip is, or was last when it has left
/// already. The next puncture waits for that.
/// Invariant  state() is moving from the puncture until the tip leaves the surface, the tool is taken away or the body is restored.
template <RealScalar Scalar, class Front>
class Blade {
 public:
  using Vector = Vector3<Scalar>;

  /// `puncture_depth` and `tip_radius` in m, `puncture_force` in N.
  Blade(Scalar puncture_depth, Scalar puncture_force, Scalar tip_radius, std::optional<BladeEdge<Scalar>> const& edge)
      : puncture_depth_(puncture_depth), puncture_force_(puncture_force), edge_(edge), touch_(tip_radius) {
    if (edge_) turn(edge_->axis);
    require_positive("puncture_depth", puncture_depth, "m");
    require_length("puncture_depth", static_cast<double>(puncture_depth), puncture_depth_range);
    require_positive("puncture_force", puncture_force, "N");
  }

  /// Moves the tool by one tick. `start(front, contact)` punctures, `go_on(front, contact)` moves the blade in the tissue. Each returns the
  /// triangle that the tip is to be followed from, as the mesh has changed under it, or −1.
  /// Throws InvalidArgument for a pose that is not finite, or a body that can not be cut; then nothing has changed.
  template <class Body, class Start, class GoOn>
  void advance(Body& body, ToolPose<Scalar> const& tool, Scalar force, Start const& start, GoOn const& go_on) {
    Vector const& tip = tool.position;
    require_pose("the blade", tool);
    if (!body.tissue().cuttable())
      throw InvalidArgument("this body is built from a volume, and this cutter cuts surfaces; VolumeCutter cuts it");
    if (touch_.was_restored(body)) reset(body);
    if (edge_) edge_->axis = tool.orientation * axis_;
    bool const was_behind = is_behind(), was_lifted = is_lifted_;
    if (was_behind) front_.catch_up(body), body.even_masses();
    if (is_lifted_) end(body, go_on);
    SurfaceContact<Scalar> const& contact = touch_.update(body, tip, state_ == CuttingPhase::moving);
    if (!contact.touching) {
      if (state_ == CuttingPhase::moving) is_lifted_ = true, end(body, go_on);
      state_ = CuttingPhase::no_contact;
      is_held_ = false;
      return;
    }
    if (was_behind && state_ == CuttingPhase::moving) {
      remember(body, contact);
      return;
    }
    next_.triangle = -1;
    int restart = -1;
    is_held_ = state_ == CuttingPhase::moving && edge_ && !contact.off_surface && !edge_->cuts(contact.home_point - cut_to_, contact.normal);
    if (is_held_) return;
    cut_to_ = contact.home_point;
    if (state_ == CuttingPhase::moving) {
      restart = go_on(front_, contact);
    } else {
      state_ = CuttingPhase::indenting;
      if (was_lifted || (contact.depth < puncture_depth_ && !(force >= puncture_force_))) return;
      state_ = CuttingPhase::moving;
      restart = start(front_, contact);
    }
    body.even_masses();
    if (restart >= 0) touch_.restart_from(body, restart, tip);
  }

  /// A cut in progress ends, and the tip has to come from outside again.
  template <class Body>
  void reset(Body& body) {
    if (touch_.was_restored(body))
      front_ = {};   // what it knew of the body does not exist any more
    else if (state_ == CuttingPhase::moving || is_lifted_)
      front_.finish(body), body.even_masses();
    touch_.reset();
    state_ = CuttingPhase::no_contact;
    is_held_ = is_lifted_ = false;
    next_.triangle = -1;
  }

  /// The edge turns in the tool: to this direction in the tool's frame.
  void turn(Vector const& axis) {
    BladeEdge<Scalar> edge = edge_ ? *edge_ : BladeEdge<Scalar>{};
    edge.axis = axis;
    edge.validate();
    edge_ = edge, axis_ = axis;
  }

  /// What the blade drags along while it is held across its edge.
  template <class Body>
  std::optional<BladeHold<Scalar>> held(Body const& body) const noexcept {
    if (!is_held_ || touch_.was_restored(body)) return {};
    auto const [triangle, barycentric] = front_.blade_point(body);
    return BladeHold<Scalar>{triangle, barycentric, edge_->slip_force};
  }

  /// The cut has not come to where the tip was: so much way is not cut in one tick.
  bool is_behind() const noexcept { return front_.is_behind(); }

  CuttingPhase state() const noexcept { return state_; }
  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  Scalar tip_radius() const noexcept { return touch_.tip_radius(); }
  Front const& front() const noexcept { return front_; }

 private:
  /// Where the tip was last on the surface while the front was behind, for a tip that leaves before the front is told.
  struct Next {
    int triangle = -1;
    Vector point = Vector::Zero();   // m, undeformed
  };

  template <class Body>
  void remember(Body const& body, SurfaceContact<Scalar> const& contact) {
    if (contact.off_surface || (edge_ && !edge_->cuts(contact.home_point - cut_to_, contact.normal))) return;
    next_ = {contact.triangle, rest_point(body, contact.triangle, contact.barycentric)};
  }

  /// Ends the cut of a tip that has left, unless the front is behind, also on the way to where the tip was last.
  template <class Body, class GoOn>
  void end(Body& body, GoOn const& go_on) {
    if (is_behind()) return;
    if (next_.triangle >= 0) {
      SurfaceContact<Scalar> last;
      last.triangle = triangle_near(body, std::exchange(next_.triangle, -1), next_.point);
      last.barycentric = clamped(rest_weights(body, last.triangle, next_.point));
      go_on(front_, last);
      body.even_masses();
      if (is_behind()) return;
    }
    front_.finish(body), body.even_masses();
    is_lifted_ = false;
  }

  static void require_positive(std::string_view what, Scalar value, std::string_view unit) {
    if (!(value > 0)) throw InvalidArgument(message(what, " is ", value, " ", unit, "; it must be positive"));
  }

  Scalar puncture_depth_, puncture_force_;
  std::optional<BladeEdge<Scalar>> edge_;   // in the world, where the tool was last
  Vector axis_ = Vector::UnitX();           // its axis, in the tool's frame
  bool is_held_ = false;              // across its edge
  bool is_lifted_ = false;            // the tip has left the surface, and the front is behind
  Next next_;
  Vector cut_to_ = Vector::Zero();    // m, where the blade has cut to, in the undisturbed body
  Touch<Scalar> touch_;
  Front front_;
  CuttingPhase state_ = CuttingPhase::no_contact;
};

}  // namespace palpate::detail
