// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/LU>

#include <optional>

namespace palpate::detail {

/// The rotation nearest to a matrix that almost is one: X ← (X + X⁻ᵀ)/2, the polar factor, quadratically.
/// Source     \cite higham1986, Newton's iteration
/// Limits     nothing for a matrix that is not finite, mirrors, or is far from a rotation.
template <RealScalar Scalar>
std::optional<Matrix<Scalar, 3, 3>> nearest_rotation(Matrix<Scalar, 3, 3> const& matrix) noexcept {
  if (!is_finite(matrix) || !(matrix.determinant() > Scalar(0.1))) return std::nullopt;
  Matrix<Scalar, 3, 3> rotation = matrix;
  for (int k = 0; k < 8; ++k) {
    Matrix<Scalar, 3, 3> const inverse = rotation.inverse();
    rotation = (rotation + inverse.transpose()) / 2;
  }
  if (!is_finite(rotation) || (matrix - rotation).norm() > Scalar(0.1)) return std::nullopt;
  return rotation;
}

}  // namespace palpate::detail
