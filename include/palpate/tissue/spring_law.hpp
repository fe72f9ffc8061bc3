// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <cmath>
#include <concepts>

namespace palpate {

namespace detail {

template <class Law, class Scalar>
concept HasTension = requires(Law const& law, Scalar elongation, Scalar rest_length) {
  { law.tension(elongation, rest_length) } -> std::convertible_to<Scalar>;
};
template <class Law, class Scalar>
concept HasDamping = requires(Law const& law) {
  { law.damping } -> std::convertible_to<Scalar>;
};

}  // namespace detail

/// What a link between two particles answers: the tension at an elongation, and its damping coefficient.
///   f_i = −(T(δ, L) + c (w·n)) n,   δ = |d| − L,  d = x_i − x_j,  n = d/|d|,  w = v_i − v_j
/// A law is an aggregate of coefficients; MassSpring checks them and keeps one per link.
/// What the syntax can not say, and `testing/` checks: T(0, L) = 0, T is continuous, and T grows with δ near 0.
/// Optional: `tangent_stiffness(δ, L)` = dT/dδ [N/m], which implicit integrators need, and `energy(δ, L)` = ∫T dδ [J]; elsewhere they are found numerically.
/// Optional: `monotone(L)`, whether T grows with δ wherever a link of rest length L can be, from δ = −L on. MassSpring refuses a law
/// that says no: where the tension falls a link has no stable length.
/// Optional: `validate()`, which throws InvalidArgument for coefficients that make no law, and says which.
template <class Law, class Scalar>
concept SpringLaw = RealScalar<Scalar> && std::copyable<Law> && std::default_initializable<Law> && detail::HasTension<Law, Scalar> && detail::HasDamping<Law, Scalar>;

namespace detail {

/// s − ln(1 + s), by its series where the difference would lose its digits: so ends the energy of laws like k δ/(1 + s), s = k δ/T_max, in T_max²/k.
template <RealScalar Scalar>
Scalar less_logarithm(Scalar s) noexcept {
  if (std::abs(s) > Scalar(0.02)) return s - std::log1p(s);
  return s * s * (Scalar(0.5) + s * (-1 / Scalar(3) + s * (Scalar(0.25) + s * (-Scalar(0.2) + s * (1 / Scalar(6) + s * (-1 / Scalar(7) + s * (Scalar(0.125) - s / 9)))))));
}

/// Says, where it is instantiated, what keeps Law from being a SpringLaw of this scalar.
template <class Law, class Scalar>
struct SpringLawSentences {
  static_assert(RealScalar<Scalar>, "palpate: the scalar of a spring law is double or float.");
  static_assert(std::copyable<Law>, "palpate: each link has its spring law; give the law a copy constructor and a copy assignment.");
  static_assert(std::default_initializable<Law>, "palpate: a spring law is made before its numbers are known; make it an aggregate, with defaults for its members and no constructor.");
  static_assert(HasTension<Law, Scalar>, "palpate: the spring law has no tension(elongation, rest_length); declare: Scalar tension(Scalar elongation, Scalar rest_length) const, m to N.");
  static_assert(HasDamping<Law, Scalar>, "palpate: the spring law has no member damping; declare: Scalar damping = 0, in N s/m; LinearSpring<double> is a law.");
};

}  // namespace detail

/// A law with a coefficient `stiffness` [N/m]: a fit looks for that, unless it is told what to look for.
template <class Law, class Scalar>
concept HasStiffness = SpringLaw<Law, Scalar> && std::same_as<decltype(Law::stiffness), Scalar>;

/// A law that states its tangent stiffness dT/dδ.
template <class Law, class Scalar>
concept StatesStiffness = SpringLaw<Law, Scalar> && requires(Law const& law, Scalar elongation, Scalar rest_length) {
  { law.tangent_stiffness(elongation, rest_length) } -> std::convertible_to<Scalar>;
};

/// A law that states its energy ∫T dδ.
template <class Law, class Scalar>
concept StatesEnergy = SpringLaw<Law, Scalar> && requires(Law const& law, Scalar elongation, Scalar rest_length) {
  { law.energy(elongation, rest_length) } -> std::convertible_to<Scalar>;
};

/// A law that states whether its tension grows with the elongation from −L on.
template <class Law, class Scalar>
concept StatesMonotony = SpringLaw<Law, Scalar> && requires(Law const& law, Scalar rest_length) {
  { law.monotone(rest_length) } -> std::convertible_to<bool>;
};

/// dT/dδ [N/m]: the law's own, or a central difference over 1e-4 (float: 1e-2) of the rest length.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
Scalar tangent_stiffness_of(Law const& law, Scalar elongation, Scalar rest_length) {
  if constexpr (StatesStiffness<Law, Scalar>) {
    return static_cast<Scalar>(law.tangent_stiffness(elongation, rest_length));
  } else {
    Scalar const step = rest_length * (std::same_as<Scalar, float> ? Scalar(1e-2) : Scalar(1e-4));
    return static_cast<Scalar>(law.tension(elongation + step, rest_length) - law.tension(elongation - step, rest_length)) / (2 * step);
  }
}

/// ∫T dδ from 0 [J]: the law's own, or a five-point Gauss–Legendre rule, exact for tensions up to degree nine.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
Scalar energy_of(Law const& law, Scalar elongation, Scalar rest_length) {
  if constexpr (StatesEnergy<Law, Scalar>) {
    return static_cast<Scalar>(law.energy(elongation, rest_length));
  } else {
    constexpr double node[] = {0.0, 0.5384693101056831, 0.9061798459386640};
    constexpr double weight[] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
    Scalar const half = elongation / 2;
    Scalar sum = Scalar(weight[0]) * static_cast<Scalar>(law.tension(half, rest_length));
    for (int i = 1; i < 3; ++i)
      for (double const sign : {-1.0, 1.0})
        sum += Scalar(weight[i]) * static_cast<Scalar>(law.tension(half * (1 + Scalar(sign * node[i])), rest_length));
    return half * sum;
  }
}

}  // namespace palpate
