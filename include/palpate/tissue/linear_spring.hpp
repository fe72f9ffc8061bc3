// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/spring_law.hpp>

namespace palpate {

/// Hooke's spring with a damper: T = k δ.
/// Units      k [N/m], c [N·s/m].
/// Source     \cite zheng2006 eq. 5-9.
template <RealScalar Scalar>
struct LinearSpring {
  Scalar stiffness = 1;
  Scalar damping = 0;

  Scalar tension(Scalar elongation, Scalar /*rest_length*/) const noexcept { return stiffness * elongation; }
  Scalar tangent_stiffness(Scalar /*elongation*/, Scalar /*rest_length*/) const noexcept { return stiffness; }
  Scalar energy(Scalar elongation, Scalar /*rest_length*/) const noexcept { return stiffness / 2 * elongation * elongation; }
  bool monotone(Scalar /*rest_length*/) const noexcept { return stiffness > 0; }
};

}  // namespace palpate
