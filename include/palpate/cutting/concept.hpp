// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/touch.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/blade_edge.hpp>

#include <concepts>
#include <optional>
#include <type_traits>

namespace palpate {

/// What a cut has done so far; the counts are those of the current cut, or of the last one. They start at zero at each puncture.
/// Source     \cite zheng2006 ch. 3: the four ways through a triangle.
struct CutReport {
  int particles_added = 0;   ///< net
  int triangles_added = 0;   ///< net
  int vertex_edge = 0;       ///< triangles entered through a vertex and left through an edge (V-P)
  int vertex_vertex = 0;     ///< from vertex to vertex, along an edge (V-V)
  int edge_vertex = 0;       ///< P-V
  int edge_edge = 0;         ///< P-P
};

namespace detail {

template <class C, class Body, class Scalar>
concept FollowsTool = requires(C& cutter, Body& body, ToolPose<Scalar> const& tool) { cutter.advance(body, tool); };

}  // namespace detail

/// Follows a tool on a body and changes the body where the tool cuts.
///   advance(body, tool)         one tick: contact, puncture, cut; tool is a ToolPose
///   contact()                   where the tip touches since the last advance
///   state()                     no contact → indenting → moving → no contact
///   report()                    what the current or last cut did
///   tip_radius()                of the ball that the tip is [m]: contact, coupling and the depth that a force is asked for reckon with it; 0 for a point
/// What the syntax can not say: the body's mesh is valid after every tick, and its mass is unchanged. So is its rest area, unless the cutter moves
/// vertices; then its report says by how much the area has changed.
template <class C, class Body>
concept Cutter = std::copyable<C> && detail::FollowsTool<C, Body, typename Body::Scalar> && requires(C const& cutter) {
  { cutter.contact() } -> std::convertible_to<SurfaceContact<typename Body::Scalar> const&>;
  { cutter.state() } -> std::same_as<CuttingPhase>;
  { cutter.report() } -> std::convertible_to<CutReport const&>;
  { cutter.tip_radius() } -> std::same_as<typename Body::Scalar>;
};

namespace detail {

/// Says, where it is instantiated, what keeps C from being a Cutter of this body.
template <class C, class Body>
struct CutterSentences {
  using Scalar = typename Body::Scalar;
  static constexpr bool is_other = !FollowsTool<C, Body, Scalar> && FollowsTool<C, Body, std::conditional_t<std::same_as<Scalar, float>, double, float>>;
  static_assert(!is_other, "palpate: the cutter computes in another scalar than the body: advance(body, ToolPose<Scalar> const& tool) must take the body's, as "
                           "NoCutter<float> does for a SoftBody in float.");
  static_assert(is_other || FollowsTool<C, Body, Scalar>,
                "palpate: the cutter has no advance(body, tool); declare: template <class Body> void advance(Body& body, ToolPose<typename Body::Scalar> const& tool); use "
                "NoCutter<double>{} for a blunt tool.");
  static_assert(is_other || !FollowsTool<C, Body, Scalar> || Cutter<C, Body>,
                "palpate: the cutter lacks one of: SurfaceContact<Scalar> const& contact() const, CuttingPhase state() const, CutReport const& report() const, Scalar "
                "tip_radius() const; or it can not be copied.");
};

}  // namespace detail

/// Refinement: a cutter that is told what the tool pressed the tissue with in the last tick [N].
template <class C, class Body>
concept FeelsReaction = Cutter<C, Body> && requires(C& cutter, Body& body, ToolPose<typename Body::Scalar> const& tool, typename Body::Scalar pressed) {
  cutter.advance(body, tool, pressed);
};

/// Refinement: a cutter that can be taken away from the body: a cut in progress ends, and the tip has to come from outside again.
template <class C, class Body>
concept ResettableCutter = Cutter<C, Body> && requires(C& cutter, Body& body) { cutter.reset(body); };

/// Refinement: a cutter whose blade can hold on to a point of the tissue and drag it along.
template <class C, class Body>
concept HoldsTissue = Cutter<C, Body> && requires(C const& cutter, Body const& body) {
  { cutter.held(body) } -> std::same_as<std::optional<BladeHold<typename Body::Scalar>>>;
};

}  // namespace palpate
