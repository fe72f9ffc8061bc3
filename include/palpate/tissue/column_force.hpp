// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

namespace palpate {

/// A force [N] from outside on the particle of one column.
template <RealScalar Scalar>
struct ColumnForce {
  int column = 0;
  Vector3<Scalar> force = Vector3<Scalar>::Zero();
};

}  // namespace palpate
