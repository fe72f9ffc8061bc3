// SPDX-License-Identifier: MIT
#pragma once

/// A cutter of one's own: all that it takes. The page to this header is docs/new_cutter.md.
///
/// Required, together the concept Cutter<C, Body>; Scalar is the body's
///   template <class Body> void advance(Body& body, ToolPose<typename Body::Scalar> const& tool)   one tick: contact, puncture, cut
///   SurfaceContact<Scalar> const& contact() const       where the tip touches since the last advance
///   CuttingPhase state() const                          no_contact → indenting → moving → no_contact
///   CutReport const& report() const                     what the current or last cut did
///   Scalar tip_radius() const                           of the ball that the tip is [m]; 0: a point
///   copyable
/// Optional; static_assert(ResettableCutter<MyCutter<double>, MyBody>) finds a misspelt one
///   template <class Body> void reset(Body& body)                                 the tool is taken away              ResettableCutter
///   void advance(Body& body, ToolPose<Scalar> const& tool, Scalar force)         force on the tissue, last tick [N]  FeelsReaction
///   template <class Body> std::optional<BladeHold<Scalar>> held(Body const& body) const    what it drags along       HoldsTissue
///   std::optional<BladeGrip<Scalar>> grip() const                                what of a solid resists the blade  ResistsBlade
///   void resisted(Vector3<Scalar> const& force)                                  what that was, last tick [N]        CountsWork
///   Vector3<Scalar> press(Body& body, Scalar share, Scalar h), Vector3<Scalar> haptic_point() const      a long tool  PressesTissue
///   double area() const                                                          cut so far [m²]                    CountsArea
///
/// A cutter has a Touch<Scalar>, which finds and follows the contact, and edits the body by these; t, a, b and p are indices
///   int insert_in_triangle(t, weights)       divides a triangle at barycentric weights, all > 0; returns the new particle
///   int insert_on_edge(a, b, s)              divides an edge at X_a + s (X_b − X_a), undeformed, and the triangles at it
///   int split_particle(p, triangles)         gives some of the triangles at p a copy of it; returns the copy
///   void even_masses()                       once a tick, after all edits
///   touch.restart_from(body, t, tip)         after an edit: goes on from a triangle near the contact
///   touch.update(body, tip)                  finds the contact; touch.contact(), touch.tip_radius(), touch.reset()
///   SurfaceContact: touching, off_surface, triangle, barycentric, point and home_point [m], normal, depth [m]
///   CutReport: particles_added, triangles_added, vertex_edge, vertex_vertex, edge_vertex, edge_edge, counts
///   body.nearest_point(x).triangle           the triangle nearest to a place; body.mean_edge() [m]; body.tissue().cuttable()
///   body.tissue().surface()                  corners(t), triangles_at(p), triangle_with_edge(a, b), triangle_count()
///   body.tissue().rest_position(p)           m, undeformed; positions() and reference_position(p): now, undisturbed
/// Battery
///   testing::to_text(testing::check_cutter(cutter, body, {.way = {above, in, along, out}})) == ""

#include <palpate/body/body_shape.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/testing/cutter.hpp>

namespace palpate::testing {

/// The least cutter: it follows nothing and cuts nothing.
template <RealScalar Scalar>
struct CutterArchetype {
  SurfaceContact<Scalar> touched = {};
  CutReport cut = {};

  template <class Body>
  void advance(Body&, ToolPose<Scalar> const&) {}
  SurfaceContact<Scalar> const& contact() const { return touched; }
  CuttingPhase state() const { return CuttingPhase::no_contact; }
  CutReport const& report() const { return cut; }
  Scalar tip_radius() const { return 0; }
};

}  // namespace palpate::testing
