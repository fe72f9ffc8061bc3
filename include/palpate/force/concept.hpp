// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/policy.hpp>

#include <concepts>
#include <type_traits>

namespace palpate {

/// The branch of a force curve with hysteresis: the tool goes deeper (loading) or comes back (unloading).
enum class Phase { loading, unloading };

constexpr char const* to_string(Phase phase) noexcept {
  return phase == Phase::loading ? "loading" : "unloading";
}

/// Forces that differ by less than this share feel the same: a hand's just noticeable difference, 7 to 10 % from some 2 N on and more below.
/// Source     \cite zheng2006 ch. 1, for 7 %.
constexpr double force_just_noticeable_difference = 0.07;

/// What a force model knows about the tool in one servo tick. An open aggregate; every member has a default,
/// so a caller names only what its model needs. All vectors in the world frame.
/// Units      depths [m], velocity [m/s], force [N], seconds [s].
/// Invariant  `normal` has length one and points out of the tissue. Depth grows into the tissue and is
///            measured from the home (undeformed) surface; a depth ≤ 0 is outside.
template <RealScalar S>
struct ToolContact {
  using Scalar = S;

  CuttingPhase phase = CuttingPhase::no_contact;
  S depth = S(0);                                    ///< of the tip, along the normal
  S previous_depth = S(0);                           ///< one servo tick ago
  Vector3<S> normal = Vector3<S>::UnitZ();           ///< outward normal of the tissue
  Vector3<S> velocity = Vector3<S>::Zero();          ///< of the tip
  Vector3<S> tissue_force = Vector3<S>::Zero();      ///< reaction of the deformed tissue on the tool, for the tight coupling
  S seconds = S(0.001);                              ///< since the last servo tick
};

/// Force as a function of depth alone: [m] → [N].
template <class T, class Scalar>
concept DepthCurve = RealScalar<Scalar> && requires(T& curve, Scalar depth) {
  { curve(depth) } noexcept -> std::convertible_to<Scalar>;
};

/// Force as a function of depth and of the branch of the hysteresis: ([m], Phase) → [N].
template <class T, class Scalar>
concept HysteresisCurve = RealScalar<Scalar> && requires(T& curve, Scalar depth) {
  { curve(depth, Phase::loading) } noexcept -> std::convertible_to<Scalar>;
};

/// A measured or learnt force curve, of either kind.
/// Beyond the syntax: finite for every finite depth; positive values push the tool out of the tissue.
template <class T, class Scalar>
concept ForceCurve = DepthCurve<T, Scalar> || HysteresisCurve<T, Scalar>;

namespace detail {
template <class T, class Scalar>
concept Vector3Of = std::same_as<typename std::remove_cvref_t<T>::Scalar, Scalar> && std::convertible_to<T, Vector3<Scalar>>;
}

/// What the hand feels: maps a contact to the force on the hand [N], world frame. Beyond the syntax: called
/// once a servo tick, so no allocation, lock, or input and output; zero when `phase` is `no_contact`; a
/// finite contact gives a finite force. It may keep state between calls (noise does), so it is called as
/// non-const; a model with state offers `reset()`, which starts it anew.
template <class T, class Scalar>
concept ForceModel = RealScalar<Scalar> && requires(T& model, ToolContact<Scalar> const& contact) {
  { model(contact) } noexcept -> detail::Vector3Of<Scalar>;
};

/// A force model that is the tissue's resistance before the puncture: `CuttingForce` then adds no `IndentationSpring` of its own.
template <class T, class Scalar>
concept ContactLaw = ForceModel<T, Scalar> && T::resists_before_puncture;

/// A disturbance that depends on the noiseless force: `draw(force)` returns what is to be added to it [N].
/// Beyond the syntax: a zero force draws zero; mean zero; seeded; `reset()`, if offered, starts the sequence
/// anew.
template <class T, class Scalar>
concept ForceNoise = RealScalar<Scalar> && requires(T& noise, Vector3<Scalar> const& force) {
  { noise.draw(force) } noexcept -> detail::Vector3Of<Scalar>;
};

namespace detail {

/// A curve of either kind at one branch.
template <class Scalar, class Curve>
  requires ForceCurve<Curve, Scalar>
constexpr Scalar evaluate_curve(Curve& curve, Scalar depth, [[maybe_unused]] Phase phase) noexcept {
  if constexpr (HysteresisCurve<Curve, Scalar>)
    return static_cast<Scalar>(curve(depth, phase));
  else
    return static_cast<Scalar>(curve(depth));
}

}  // namespace detail

}  // namespace palpate
