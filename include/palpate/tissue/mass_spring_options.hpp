// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/policy.hpp>
#include <palpate/tissue/spring_elements.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <cmath>
#include <string_view>

namespace palpate {

/// How the total mass is shared among the particles.
enum class Lumping {
  area,   ///< in proportion to the surface around a particle (a volume: to the volume around it)
  equal,  ///< m_i = total / n, as the thesis has it
};

template <RealScalar Scalar>
struct MassOptions {
  Scalar total = 1;   // kg
  Lumping lumping = Lumping::area;
};

/// What a MassSpring is built from besides its mesh; every particle and link starts with these values.
template <RealScalar Scalar, class Law>
struct MassSpringOptions {
  MassOptions<Scalar> mass{};
  Law link{};
  HomeSpring<Scalar> home{};
  /// ε: a link's rest length is (1 − ε) × its undeformed length, so that a cut gapes. 0 ≤ ε < 1.
  Scalar link_prestrain = 0;
};

namespace detail {

/// Throws unless the law is usable on a link of this rest length: no tension at rest, a positive stiffness there, damping ≥ 0, valid
/// by its own validate(), if it has one, and monotone if it says whether it is.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
void require_valid_law(Law const& law, Scalar rest_length) {
  if constexpr (Validatable<Law>) law.validate();
  require_non_negative("link damping", static_cast<Scalar>(law.damping), "N s/m");
  Scalar const at_rest = static_cast<Scalar>(law.tension(Scalar(0), rest_length));
  if (!(at_rest == 0))
    throw InvalidArgument(message("the spring law pulls with ", at_rest, " N at rest; tension(0, L) must be 0"));
  Scalar const stiffness = tangent_stiffness_of(law, Scalar(0), rest_length);
  require_positive("the link stiffness", stiffness, "N/m at rest");
  if constexpr (StatesMonotony<Law, Scalar>)
    if (!law.monotone(rest_length))
      throw InvalidArgument(message("the spring law gives way on a link of ", rest_length, " m: its tension must grow with the "
                                    "elongation, from -", rest_length, " m on; check its coefficients"));
}

}  // namespace detail

}  // namespace palpate
