// SPDX-License-Identifier: MIT
#pragma once

/// A tool of one's own: all that it takes. The page to this header is docs/new_tool.md.
///
/// A shape alone is no code: BluntTool<double>(ToolShape<double>{.rods = {…}}, {.friction = 0.2}) touches along all of its rods.
/// A tool that does more has a BluntTool, which finds contacts and pushes, and adds to it. Required, together the concept PressesTissue<C, Body>
///   template <class Body> void advance(Body& body, ToolPose<Scalar> const& tool)     one tick: where the tool is now
///   template <class Body> Vector3<Scalar> press(Body& body, Scalar share, Scalar h)  before each step of h seconds, at whose end the tool is at this share
///                                                         of the way to its last pose: applies forces; returns the force on the tool [N]
///   Vector3<Scalar> const& haptic_point() const           of the tool, where contact() is [m]
///   SurfaceContact<Scalar> const& contact() const         the place that stands for all
///   CuttingPhase state() const                            indenting while it touches, else no_contact
///   CutReport const& report() const                       what it has cut; of a tool that does not cut, {}
///   Scalar tip_radius() const                             at contact() [m]
///   copyable
/// Optional
///   template <class Body> void reset(Body& body)          the tool is taken away                                            ResettableCutter
///   Vector3<Scalar> const& moment() const                 of the last step, about the tool's origin [N m]                     TellsMoment
///
/// Of a ToolPose: position [m], orientation (world ← tool), velocity [m/s], opening of jaws (0 closed … 1 open)
/// Of a BluntTool: advance, press(body, share, h, pin), reset, rods(); of its rods()
///   touches()                                 each: rod, triangle, barycentric, point, on_axis, normal, depth [m], acts, force [N]
///   pose(), pose_at(share), placed(pose, p)   the tool; a point of its frame in the world
///   step_poses<Body>(share)                   the tool at the begin and end of the body's next step
///   PinnedPoint{.rod, .triangle, .barycentric, .offset, .limit}   one point of the tissue that is held, up to a force; then its .force
/// Of a body: apply_force(i, f), predicted_acceleration(i, h), positions(), velocities(), tissue().mass(i), or of a body without
///   masses mobility(i, j, h), see StatesMobility, tissue().nailed(i), is_held(i), topology_revision(), restorations(), nearest_point(p), tissue().surface()
/// Battery
///   testing::to_text(testing::check_tool(tool, body)) == ""

#include <palpate/body/body_shape.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/testing/tool.hpp>
#include <palpate/tool/blunt_tool.hpp>

namespace palpate::testing {

/// The least tool: it touches nothing and presses nothing.
template <RealScalar Scalar>
struct ToolArchetype {
  SurfaceContact<Scalar> touched = {};
  CutReport cut = {};
  Vector3<Scalar> at = Vector3<Scalar>::Zero();

  template <class Body>
  void advance(Body&, ToolPose<Scalar> const&) {}
  template <class Body>
  Vector3<Scalar> press(Body&, Scalar, Scalar) {
    return Vector3<Scalar>::Zero();
  }
  Vector3<Scalar> const& haptic_point() const { return at; }
  SurfaceContact<Scalar> const& contact() const { return touched; }
  CuttingPhase state() const { return CuttingPhase::no_contact; }
  CutReport const& report() const { return cut; }
  Scalar tip_radius() const { return 0; }
};

}  // namespace palpate::testing
