// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/padded_view.hpp>

#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>

namespace palpate {

/// The moving particles as an integrator sees them; `Matrix` is 3 × n, one column per moving particle.
///   positions(), velocities()     assignable 3 × n expressions at the current time [m], [m/s]
///   acceleration(x, v)            M⁻¹ f(x, v) [m/s²], a value: two results can live together
///   acceleration(x, v, out)       the same into a matrix of the caller's, without allocation
///   scratch(k), k < 12            an assignable 3 × n of undefined contents, so that a step need not allocate
///   previous_acceleration()     assignable 3 × n: what the integrator left there at its last step; it travels with its
///                                 particle through cuts and is zero for a particle that has just begun to move
///   remembers()                   false before the first step, after reset() and when the integrator left nothing
/// `out` may be the columns given as v. Applied forces are constant during the step. What a body hands out may have zeros between its columns: padded_view() computes through them.
template <class S>
concept System = requires(S& system, typename S::Matrix& columns, int k) {
  typename S::Scalar;
  system.positions() = columns;
  system.velocities() = columns;
  { system.acceleration(columns, columns) } -> std::convertible_to<typename S::Matrix>;
  system.acceleration(columns, columns, columns);
  system.scratch(k) = columns;
  system.previous_acceleration() = columns;
  { system.remembers() } -> std::same_as<bool>;
};

/// A System that also answers for its tangent at the present positions: what implicit integrators solve with. M, C and K are symmetric, C and K
/// positive semidefinite; where that makes K differ from the derivative of the forces, a second Newton iteration corrects it.
///   linearise()                          takes C = −∂f/∂v and K ≈ −∂f/∂x at positions(), once for many products
///   multiply_tangent(m, c, k, d, out)    out = (m M + c C + k K) d
///   tangent_diagonal(m, c, k, out)       3 × n, the diagonal of that matrix
template <class S>
concept LinearisedSystem = System<S> && requires(S& system, typename S::Matrix& columns, typename S::Scalar factor) {
  system.linearise();
  system.multiply_tangent(factor, factor, factor, columns, columns);
  system.tangent_diagonal(factor, factor, factor, columns);
};

/// A LinearisedSystem whose forces at rest, less multiply_tangent(0, 1, 0, v), are those at velocities v, and cost less: `static constexpr bool damps_by_tangent = true`.
template <class S>
concept DampedByTangent = LinearisedSystem<S> && requires { requires S::damps_by_tangent; };

/// A LinearisedSystem of doubles that multiplies with its tangent in float too, faster: float_scratch(k), k < 6, are columns of four
/// floats for that.
template <class S>
concept HasFloatTangentProduct = LinearisedSystem<S> && requires(S& system, typename S::Scalar factor, PaddedView<float>& columns, int k) {
  { system.float_scratch(k) } -> std::same_as<PaddedView<float>>;
  system.multiply_tangent(factor, factor, factor, columns, columns);
};

/// A LinearisedSystem that knows its potential at positions x, a 3 × n of the moving particles [J]: the energy inside less the work of applied forces and
/// gravity, up to a constant; infinite or NaN where there is none. And what rounding may add to that.
template <class S>
concept HasPotential = LinearisedSystem<S> && requires(S& system, typename S::Matrix& columns) {
  { system.potential_rounding() } -> std::convertible_to<typename S::Scalar>;
  { system.potential(columns) } -> std::convertible_to<typename S::Scalar>;
};

namespace detail {

/// The least a System can be; concepts are checked against it. No step takes it by value: what that moves is a copy.
template <RealScalar S>
struct SystemArchetype {
  using Scalar = S;
  using Matrix = Matrix3X<S>;

  SystemArchetype() = default;
  SystemArchetype(SystemArchetype const&) = delete;
  SystemArchetype& operator=(SystemArchetype const&) = delete;

  Matrix& positions() { return columns; }
  Matrix& velocities() { return columns; }
  template <class X, class V>
  Matrix acceleration(X const&, V const&) {
    return columns;
  }
  template <class X, class V>
  void acceleration(X const&, V const&, Matrix&) {}
  Matrix& scratch(int) { return columns; }
  Matrix& previous_acceleration() { return columns; }
  bool remembers() const { return false; }

  Matrix columns;
};

template <RealScalar S>
struct LinearisedSystemArchetype : SystemArchetype<S> {
  void linearise() {}
  template <class D, class Out>
  void multiply_tangent(S, S, S, D const&, Out&&) {}
  template <class Out>
  void tangent_diagonal(S, S, S, Out&&) {}
};

/// A number that converts to S and to nothing else: who takes it as another number computes in that.
template <RealScalar S>
struct Exactly {
  template <std::same_as<S> T>
  operator T() const;
};

template <class I, class S>
concept Steps = requires(I& integrator, S& system, Exactly<typename S::Scalar> h) { integrator.step(system, h); };
template <class I, class Scalar>
concept StepsSystems = Steps<I, SystemArchetype<Scalar>> || Steps<I, LinearisedSystemArchetype<Scalar>>;

/// What step_by_parts() is given.
struct PartsArchetype {
  template <class X, class V, class M>
  void before(X&, V const&, M&) const;
  template <class X, class V, class A>
  void after(X&, V&, A&) const;
  template <class X, class V, class A>
  void undo(X&, V&, A const&) const;
};

}  // namespace detail

/// Advances a System by one step of h seconds.
/// What the syntax can not say, and `testing/` checks: a step of zero changes nothing, and the error shrinks as h^order.
template <class I, class Scalar = double>
concept Integrator = std::copyable<I> && detail::StepsSystems<I const, Scalar>;

/// An integrator whose step takes a LinearisedSystem and nothing less.
template <class I, class Scalar = double>
concept ImplicitIntegrator = Integrator<I, Scalar> && !detail::Steps<I const, detail::SystemArchetype<Scalar>>;

namespace detail {

/// Says, where it is instantiated, what keeps I from being an Integrator of this scalar.
template <class I, class Scalar>
struct IntegratorSentences {
  using Other = std::conditional_t<std::same_as<Scalar, float>, double, float>;
  static constexpr bool is_not_const = StepsSystems<I, Scalar>, is_other = StepsSystems<I const, Other>;
  static_assert(std::copyable<I>, "palpate: an integrator is copied with its body; give it a copy constructor and a copy assignment.");
  static_assert(StepsSystems<I const, Scalar> || !is_not_const,
                "palpate: the integrator's step is not const; declare: template <class System> void step(System& system, typename System::Scalar h) const; what it has to "
                "remember is in system.previous_acceleration().");
  static_assert(StepsSystems<I const, Scalar> || is_not_const || !is_other,
                "palpate: the integrator's step takes another scalar than the body's; declare: template <class System> void step(System& system, typename System::Scalar h) "
                "const, not double h or float h, and compute in System::Scalar.");
  static_assert(StepsSystems<I const, Scalar> || is_not_const || is_other,
                "palpate: the second policy is no Integrator, which has: template <class System> void step(System& system, typename System::Scalar h) const; "
                "LeapfrogVerlet{} is one.");
};

}  // namespace detail

/// An integrator whose step is one call of step_by_parts and touches the state in no other way, and says so.
template <class I>
concept FusedStep = Integrator<I> && requires { requires I::fused_step; };

/// A System that does a step by parts at once, while what it needs is near the processor.
template <class S>
concept HasFusedStep = System<S> && requires(S& system, detail::PartsArchetype const& parts) { system.step_by_parts(parts); };

/// A step that does the same to each particle by itself, then asks for the forces once, then does the same to each again:
///   parts.before(x, v, m)   m is what was remembered; leaves there the velocity that the forces are asked for at. v is const
///   parts.after(x, v, a)    a is the acceleration at (x, m); what is left there will be remembered
///   parts.undo(x, v, a)     from x, v and a after the step back to x and v before it, to rounding
/// x, v, m and a are what one particle has of each: columns that can be added, subtracted and multiplied by a number. A body goes through its
/// particles part by part and does all of this, and looks for divergence, while the numbers of a part are near; a large one keeps no copy
/// of its state but undoes a step that diverges.
template <System S, class Parts>
void step_by_parts(S& system, Parts const& parts) {
  if constexpr (HasFusedStep<S>) {
    system.step_by_parts(parts);
  } else {
    auto&& x = system.positions();
    auto&& v = system.velocities();
    auto&& m = system.previous_acceleration();
    auto const each = [&](auto const& change) {
      for (int i = 0; i < x.cols(); ++i) {
        Vector3<typename S::Scalar> x_i = x.col(i), v_i = v.col(i), m_i = m.col(i);
        change(x_i, v_i, m_i);
        x.col(i) = x_i, v.col(i) = v_i, m.col(i) = m_i;
      }
    };
    each([&](auto& x_i, auto const& v_i, auto& m_i) { parts.before(x_i, v_i, m_i); });
    system.acceleration(x, m, m);
    each([&](auto& x_i, auto& v_i, auto& a_i) { parts.after(x_i, v_i, a_i); });
  }
}

/// An implicit integrator of the θ-scheme that says its θ, the weight of a step's end: what its steps will do can be told before, see MotionForecast.
/// The first linearise() of such a step is at the positions that the step was handed.
template <class I, class Scalar = double>
concept StatesEndWeight = ImplicitIntegrator<I, Scalar> && requires(I const& integrator) {
  { integrator.end_weight() } -> std::convertible_to<double>;
};

/// The extremes of a linearised body's modes x″ = −κ x − γ x′, from which a stable step follows.
template <RealScalar Scalar>
struct ModalBounds {
  Scalar squared_frequency = 0;   ///< largest κ = ω² [1/s²]
  Scalar decay_rate = 0;          ///< largest γ [1/s]
  Scalar min_decay_rate = 0;      ///< smallest γ of any mode [1/s]
};

/// The largest step h with h²κ/4 + share · hγ ≤ 1 for all modes within the bounds; infinity where none is needed.
template <RealScalar Scalar>
Scalar largest_step(ModalBounds<Scalar> const& modes, Scalar share) {
  Scalar const damping = share * modes.decay_rate, sum = damping + std::sqrt(damping * damping + modes.squared_frequency);
  return sum > 0 ? 2 / sum : std::numeric_limits<Scalar>::infinity();
}

/// An integrator that states its order: its error shrinks as h^order.
template <class I>
concept StatesOrder = Integrator<I> && requires {
  { I::order } -> std::convertible_to<double>;
};

/// An integrator that states its largest stable step [s] for all modes within the bounds; infinity where none is needed.
template <class I>
concept StatesStableStep = Integrator<I> && requires(I const& integrator, ModalBounds<double> const& modes) {
  { integrator.stable_step(modes) } -> std::convertible_to<double>;
};

/// An integrator that takes any step without the body's modes having to be known, and says so: `static constexpr bool steps_of_any_size = true`.
template <class I>
concept StepsOfAnySize = Integrator<I> && requires { requires I::steps_of_any_size; };

/// An integrator that evaluates forces at x + force_time · h v, and says so; the others are taken to do it at x. A stiff contact
/// predicts the step's forces there.
template <class I>
concept HasForceTime = Integrator<I> && requires {
  { I::force_time } -> std::convertible_to<double>;
};

}  // namespace palpate
