// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <span>

namespace palpate {

/// What resists a blade that stands in a solid: the tissue along it hangs on to it like a spring, up to a force at which it gives way.
template <RealScalar Scalar>
struct BladeGrip {
  std::span<int const> particles;    ///< of the tetrahedra that the blade goes through
  std::span<Scalar const> weights;   ///< of their positions in the point that hangs on to the blade; the sum is 1
  Vector3<Scalar> target = Vector3<Scalar>::Zero();   ///< m, where the tool would have that point
  Scalar stiffness = 0;              ///< N/m
  Scalar slip_force = 0;             ///< N
};

}  // namespace palpate
