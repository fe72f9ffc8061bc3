// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/touch.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/blade_edge.hpp>
#include <palpate/cutting/blade_grip.hpp>

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

template <class C, class Scalar>
concept TellsContact = requires(C const& cutter) { { cutter.contact() } -> std::convertible_to<SurfaceContact<Scalar> const&>; };
template <class C>
concept TellsState = requires(C const& cutter) { { cutter.state() } -> std::same_as<CuttingPhase>; };
template <class C>
concept TellsReport = requires(C const& cutter) { { cutter.report() } -> std::convertible_to<CutReport const&>; };
template <class C, class Scalar>
concept TellsTipRadius = requires(C const& cutter) { { cutter.tip_radius() } -> std::same_as<Scalar>; };

}  // namespace detail

/// Follows a tool on a body and changes the body where the tool cuts.
///   advance(body, tool)         one tick: contact, puncture, cut; tool is a ToolPose
///   contact()                   where the tip touches since the last advance
///   state()                     no contact → indenting → moving → no contact
///   report()                    what the current or last cut did
///   tip_radius()                of the ball that the tip is [m]: contact, coupling and the depth that a force is asked for reckon with it; 0 for a point
/// What the syntax can not say: the body's mesh is valid after every tick, and its mass is unchanged, unless the cutter takes tissue away. So is its rest area,
/// unless it moves vertices. Then its report says by how much.
template <class C, class Body>
concept Cutter = std::copyable<C> && detail::FollowsTool<C, Body, typename Body::Scalar> && detail::TellsContact<C, typename Body::Scalar> && detail::TellsState<C> &&
                 detail::TellsReport<C> && detail::TellsTipRadius<C, typename Body::Scalar>;

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
  static constexpr bool follows = !is_other && FollowsTool<C, Body, Scalar>;
  static_assert(!follows || TellsContact<C, Scalar>,
                "palpate: the cutter has no contact() const; declare: SurfaceContact<Scalar> const& contact() const, where the tip touches since the last advance.");
  static_assert(!follows || TellsState<C>, "palpate: the cutter has no state() const; declare: CuttingPhase state() const, no_contact, indenting or moving.");
  static_assert(!follows || TellsReport<C>, "palpate: the cutter has no report() const; declare: CutReport const& report() const, what the current or last cut did.");
  static_assert(!follows || TellsTipRadius<C, Scalar>, "palpate: the cutter has no tip_radius() const; declare: Scalar tip_radius() const, in m, 0 for a point.");
  static_assert(!follows || std::copyable<C>, "palpate: a cutter is copied with its simulator; give it a copy constructor and a copy assignment.");
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

/// Refinement: a cutter whose blade the tissue resists, so that cutting costs work.
template <class C, class Body>
concept ResistsBlade = Cutter<C, Body> && requires(C const& cutter) {
  { cutter.grip() } -> std::same_as<std::optional<BladeGrip<typename Body::Scalar>>>;
};

/// Refinement: one that is told after the steps of a tick what the tissue has resisted its tool with through that grip, in the mean [N], to count the hand's work.
template <class C, class Body>
concept CountsWork = ResistsBlade<C, Body> && requires(C& cutter, Vector3<typename Body::Scalar> const& force) { cutter.resisted(force); };

/// Refinement: a cutter that states the area that it has cut since it was made [m²], undeformed, of one wall.
template <class C>
concept CountsArea = requires(C const& cutter) {
  { cutter.area() } -> std::same_as<double>;
};

/// Refinement: a tool that is longer than a point and pushes the tissue itself, in each of the body's steps; then nothing else couples its tip.
///   press(body, share, h)     pushes for the next step of h seconds, at whose end the tool is at this share of the way to its last pose, 0 < share ≤ 1;
///                             returns the force of the tissue on the tool [N]
///   haptic_point()            of the tool, at its last pose, where contact() is [m]: depth is that of this point
template <class C, class Body>
concept PressesTissue = Cutter<C, Body> && requires(C& cutter, C const& seen, Body& body, typename Body::Scalar share) {
  { cutter.press(body, share, share) } -> std::same_as<Vector3<typename Body::Scalar>>;
  { seen.haptic_point() } -> std::convertible_to<Vector3<typename Body::Scalar>>;
};

namespace detail {

/// Means to be one: whoever has a haptic point, or a press, presses, or was written with a mistake.
template <class C, class Body>
concept MeansToPress = requires(C& cutter) { cutter.haptic_point(); } || requires(C& cutter, Body& body, typename Body::Scalar share) { cutter.press(body, share, share); };

}  // namespace detail

/// Refinement: one that states the moment of the tissue on the tool about its origin, of the last press [N m]: a device with torque gets it.
template <class C, class Body>
concept TellsMoment = PressesTissue<C, Body> && requires(C const& cutter) {
  { cutter.moment() } -> std::convertible_to<Vector3<typename Body::Scalar>>;
};

}  // namespace palpate
