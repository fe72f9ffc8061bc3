// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <cmath>

namespace palpate {

/// Lamé's constants [Pa]: λ = νE/((1 + ν)(1 − 2ν)), μ = E/(2(1 + ν)).
template <class T>
struct LameConstants {
  T lambda, mu;
};

namespace detail {

/// Throws InvalidArgument unless 10 Pa ≤ young ≤ 10 GPa.
template <RealScalar Scalar>
void require_young(char const* what, Scalar young) {
  if (!(young >= Scalar(10) && young <= Scalar(1e10)))
    throw InvalidArgument(message(what, " is ", young, " Pa; give 10 Pa ... 10 GPa: soft tissue has 500 Pa ... 1 MPa, kPa times 1,000"));
}
/// Throws InvalidArgument unless 10 kg/m³ ≤ density ≤ 100,000 kg/m³.
template <RealScalar Scalar>
void require_density(char const* what, Scalar density) {
  if (!(density >= Scalar(10) && density <= Scalar(1e5)))
    throw InvalidArgument(message(what, " is ", density, " kg/m3; give 10 ... 100,000 kg/m3: soft tissue has 900 ... 1,100 kg/m3, g/cm3 times 1,000"));
}

}  // namespace detail

/// Throws InvalidArgument unless 10 Pa ≤ young ≤ 10 GPa and −1 < poisson < ½.
template <RealScalar Scalar>
LameConstants<Scalar> lame_constants(Scalar young, Scalar poisson) {
  detail::require_young("Young's modulus", young);
  if (!(poisson > Scalar(-1) && poisson < Scalar(0.5)))
    throw InvalidArgument(detail::message("Poisson's ratio is ", poisson, "; give one above -1 and below 0.5: soft tissue has 0.45 ... 0.49"));
  return {young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))};
}

/// A material that two numbers tell, and its law Law<T>, which is made of Lamé's constants.
template <template <class> class Law, RealScalar Scalar>
struct IsotropicMaterial {
  Scalar young{};     ///< Young's modulus E at small strain [Pa]
  Scalar poisson{};   ///< Poisson's ratio ν

  Law<Scalar> law() const { return Law<Scalar>::of(lame_constants(young, poisson)); }
};

}  // namespace palpate
