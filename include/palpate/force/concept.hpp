// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/policy.hpp>
#include <palpate/force/contact.hpp>
#include <palpate/force/phase.hpp>

#include <concepts>
#include <type_traits>

namespace palpate {

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
