// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/policy.hpp>
#include <palpate/tissue/concept.hpp>

#include <concepts>
#include <cstddef>
#include <type_traits>

namespace palpate {

namespace detail {

template <class B>
concept HasBodyScalars = RealScalar<typename B::Scalar> && std::same_as<typename B::Vector, Vector3<typename B::Scalar>>;
template <class B>
concept HasBodySurface = requires(B const& body) { { body.tissue().surface() } -> std::same_as<SurfaceTopology const&>; };
template <class B>
concept HasMotion = requires(B const& body, int i) {
  { body.positions().col(i) } -> std::convertible_to<typename B::Vector>;
  { body.velocities().col(i) } -> std::convertible_to<typename B::Vector>;
};
template <class B>
concept HasReference = requires(B const& body, int i) {
  { body.reference_position(i) } -> std::convertible_to<typename B::Vector>;
  { body.reference_normal(i) } -> std::convertible_to<typename B::Vector>;
};
template <class B>
concept HasHomeDiagonal = requires(B& body) { { body.home_diagonal() } -> std::convertible_to<typename B::Scalar>; };
template <class B>
concept FindsNearestPoint = requires(B& body, typename B::Vector const& point, int i) { { body.nearest_point(point, i) } -> std::same_as<SurfacePoint<typename B::Scalar>>; };
template <class B>
concept FindsTriangleAcross = requires(B const& body, int i) { { body.triangle_across(i, i) } -> std::same_as<int>; };
template <class B>
concept CountsChanges = requires(B const& body) {
  { body.topology_revision() } -> std::same_as<std::size_t>;
  { body.restorations() } -> std::same_as<std::size_t>;
};
template <class B>
concept TakesSteps = requires(B& body, typename B::Scalar h) {
  { body.step(h).moving } -> std::convertible_to<int>;
  static_cast<bool>(body.step(h));
};
template <class B>
concept StatesSteps = requires(B& body, B const& seen) {
  { body.stable_step() } -> std::convertible_to<typename B::Scalar>;
  { seen.guaranteed_stable_step() } -> std::convertible_to<typename B::Scalar>;
  { body.stable_step_fell() } -> std::same_as<bool>;
};
template <class B>
concept HasMeanEdge = requires(B const& body) { { body.mean_edge() } -> std::convertible_to<typename B::Scalar>; };
template <class B>
concept TakesForces = requires(B& body, typename B::Vector const& force, int i) { body.apply_force(i, force); };
template <class B>
concept PredictsAcceleration = requires(B const& body, typename B::Scalar h, int i) {
  { body.predicted_acceleration(i, h) } -> std::convertible_to<typename B::Vector>;
  { body.is_held(i) } -> std::same_as<bool>;
};
template <class B>
concept IsRestored = requires(B& body, B const& seen) { body.restore(seen.save()); };

}  // namespace detail

/// A body that a tool can touch: where its surface is now and where it is undisturbed. SoftBody is one.
///   positions(), velocities()     3 × particles [m], [m/s]
///   nearest_point(p, hint)        the surface point nearest to p, as the body is now
///   triangle_across(a, b)         the triangle beyond the edge a → b of a triangle, or −1
///   topology_revision()           counts the changes of triangles
///   restorations()                counts how often it was brought back to an earlier state: what was touched then may not exist
template <class B>
concept TouchableBody = detail::HasBodyScalars<B> && detail::HasBodySurface<B> && detail::HasMotion<B> && detail::HasReference<B> && detail::HasHomeDiagonal<B> &&
                        detail::FindsNearestPoint<B> && detail::FindsTriangleAcross<B> && detail::CountsChanges<B>;

/// A body that a simulator moves: it takes steps, says how long they may be, and feels forces. SoftBody is one.
template <class B>
concept SimulatedBody = TouchableBody<B> && detail::TakesSteps<B> && detail::StatesSteps<B> && detail::HasMeanEdge<B> && detail::TakesForces<B> && detail::PredictsAcceleration<B> &&
                        detail::IsRestored<B>;

namespace detail {

template <class B>
concept NamesTissue = requires { typename B::Tissue; };
/// The tissue of a body; of what is none, void.
template <class B>
struct TissueOf {
  using type = void;
};
template <NamesTissue B>
struct TissueOf<B> {
  using type = typename B::Tissue;
};

/// Whether a tool can act on B. Where it is instantiated it says what keeps it from that: it is no body, or const.
template <class B>
consteval bool can_act_on() {
  constexpr bool is_body = HasRealScalar<B> && HasBodySurface<B>, is_const = std::is_const_v<B>;
  static_assert(is_body || IsRefused<B>, "palpate: a tool acts on a body, and this is none; of a tissue make one: SoftBody body(std::move(tissue)).");
  static_assert(!is_body || !is_const, "palpate: a tool changes the body that it acts on, and this one is const; give the body itself.");
  return is_body && !is_const;
}

/// Says, where it is instantiated, what keeps B from being a SimulatedBody.
template <class B>
struct BodySentences {
  static constexpr bool is_tissue = TissueModel<B>;   // then there is no use in the others
  static_assert(!is_tissue, "palpate: this is a tissue where a body is wanted; make one of it: SoftBody body(std::move(tissue)).");
  static_assert(is_tissue || HasBodyScalars<B>, "palpate: the body has no types Scalar, float or double, and Vector, which is Vector3<Scalar>; declare both.");
  static_assert(is_tissue || HasBodySurface<B>, "palpate: the body has no tissue().surface() const; declare: what tissue() returns says SurfaceTopology const& surface() const, its triangles.");
  static_assert(is_tissue || HasMotion<B>, "palpate: the body has no positions() const or velocities() const; declare both: 3 x particles, in m and m/s.");
  static_assert(is_tissue || HasReference<B>,
                "palpate: the body has no reference_position(i) const or reference_normal(i) const; declare both: of the undisturbed surface, in m, and of length one.");
  static_assert(is_tissue || HasHomeDiagonal<B>, "palpate: the body has no home_diagonal(); declare: Scalar home_diagonal(), of the box around the undisturbed body, in m.");
  static_assert(is_tissue || FindsNearestPoint<B>,
                "palpate: the body has no nearest_point(p, hint); declare: SurfacePoint<Scalar> nearest_point(Vector const& p, int hint = -1), on the surface as it is now.");
  static_assert(is_tissue || FindsTriangleAcross<B>,
                "palpate: the body has no triangle_across(a, b) const; declare: int triangle_across(int a, int b) const, beyond the edge a -> b of a triangle, or -1.");
  static_assert(is_tissue || CountsChanges<B>,
                "palpate: the body has no topology_revision() const or restorations() const; declare both: std::size_t, how often triangles changed, and how often it was brought back.");
  static_assert(is_tissue || TakesSteps<B>,
                "palpate: the body has no step(h); declare: StepReport<Scalar> step(Scalar h), or a report of its own: int moving, and explicit operator bool() const, whether it was taken.");
  static_assert(is_tissue || StatesSteps<B>, "palpate: the body lacks one of Scalar stable_step(), Scalar guaranteed_stable_step() const, in s, and bool stable_step_fell(); declare all.");
  static_assert(is_tissue || HasMeanEdge<B>, "palpate: the body has no mean_edge() const; declare: Scalar mean_edge() const, in m.");
  static_assert(is_tissue || TakesForces<B>, "palpate: the body has no apply_force(i, force); declare: void apply_force(int i, Vector const& force), in N, for the next step.");
  static_assert(is_tissue || PredictsAcceleration<B>, "palpate: the body has no predicted_acceleration(i, h) const, in m/s2, or bool is_held(i) const; declare both.");
  static_assert(is_tissue || IsRestored<B>, "palpate: the body has no save() const and restore(state); declare both.");
};

}  // namespace detail

/// Refinement: a body that tells what was applied to particle i for its next step: applied_force(i) [N]. In a tick of several steps it acts in each.
template <class B>
concept TellsAppliedForces = SimulatedBody<B> && requires(B const& body, int i) { { body.applied_force(i) } -> std::convertible_to<typename B::Vector>; };

/// Refinement: a body of which any step is stable, whatever happens to it.
template <class B>
concept AnyStepIsStable = SimulatedBody<B> && B::any_step_is_stable;

/// Refinement: a body that finds the triangles near a tool that is longer than a point: those in a box.
template <class B>
concept SearchableBody = TouchableBody<B> && requires(B& body, typename B::Vector const& corner, void (*visit)(int)) {
  body.visit_triangles_in_box(corner, corner, visit);
};

/// Refinement: a body that counts how often numbers of its triangles went to others: as it was brought back, or tissue was taken away.
template <class B>
concept CountsRenumberings = TouchableBody<B> && requires(B const& seen) { { seen.renumberings() } -> std::same_as<std::size_t>; };

/// Refinement: one whose particles get other numbers with that, and not only triangles: its cubes are split and joined. What holds a particle finds it again by
/// its place at rest.
template <class B>
concept RenumbersParticles = CountsRenumberings<B> && B::renumbers_particles;

/// Refinement: a body that states what a force on particle j adds to predicted_acceleration(i, h) by the newton, at most: mobility(i, j, h) [1/kg], symmetric.
/// Of others a force accelerates its own particle alone, by 1/mass, and tissue().mass(i) [kg] is asked for.
template <class B>
concept StatesMobility = SimulatedBody<B> && requires(B const& seen, int i, typename B::Scalar h) {
  { seen.mobility(i, i, h) } -> std::same_as<typename B::Scalar>;
};

/// Refinement: a body that tells how its next step will go, and how its particles give way in it together: forecast(h), an optional MotionForecast. Of others the two above
/// say it, of each particle by itself, which an implicit step lets move by far less.
template <class B>
concept ForecastsSteps = SimulatedBody<B> && requires(B& body, typename B::Scalar h) { body.forecast(h)->along(); };

/// Refinement: a body of cubes that a blade's edge parts.
///   cut(a, b, c, d, moved)        the edge went from a–b to c–d [m], while each cube's middle came by moved(cube) [m]; how many faces between two cubes it opened
///   cubes(), middle(cube)         how many, and where [m]
template <class B>
concept CuttableCubes = TouchableBody<B> && requires(B& body, B const& seen, typename B::Vector const& x, typename B::Vector (*moved)(int), int i) {
  { body.cut(x, x, x, x, moved) } -> std::same_as<int>;
  { seen.cubes() } -> std::same_as<int>;
  { seen.middle(i) } -> std::convertible_to<typename B::Vector>;
};

namespace detail {

/// Whether a particle gives way in a step of h seconds by far less than its mass says: where the step is three times as long as an explicit one could be,
/// h > 3 · 2/√(k/m), k its row bound.
template <ForecastsSteps B>
bool is_stiff_in_step(B const& body, int i, typename B::Scalar h) {
  auto const& tissue = body.tissue();
  return h * h * tissue.stiffness_bound(i) > 36 * tissue.mass(i);
}

/// What a force on a particle adds to its own predicted acceleration by the newton: 1/kg.
template <class B>
typename B::Scalar own_mobility(B const& body, int i, typename B::Scalar h) {
  using Scalar = typename B::Scalar;
  if (body.tissue().nailed(i) || body.is_held(i)) return 0;
  if constexpr (StatesMobility<B>) {
    return body.mobility(i, i, h);
  } else {
    Scalar const mass = body.tissue().mass(i);
    return mass > 0 ? 1 / mass : Scalar(0);
  }
}

/// Whether a forecast for steps of h seconds knows of a particle how it gives way: not of one that can move, and that it holds fast.
template <ForecastsSteps B>
bool knows(auto const& forecast, B const& body, int i, typename B::Scalar h) {
  return forecast.moves(i) || !(own_mobility(body, i, h) > 0);
}

}  // namespace detail

/// Refinement: a body whose forces in a step are those of the time force_time · h after its begin; of others it is the begin.
template <class B>
concept StatesForceTime = SimulatedBody<B> && requires { { B::force_time } -> std::convertible_to<double>; };

}  // namespace palpate
