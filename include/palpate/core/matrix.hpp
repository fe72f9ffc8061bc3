// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/instruction_set.hpp>

#include <Eigen/Core>

#include <concepts>

namespace palpate {

/// A scalar the library computes in: float or double.
template <class T>
concept RealScalar = std::same_as<T, float> || std::same_as<T, double>;

inline constexpr int Dynamic = Eigen::Dynamic;

template <class T, int Rows, int Columns>
using Matrix = Eigen::Matrix<T, Rows, Columns>;

/// A point, direction or force in world coordinates.
template <RealScalar Scalar>
using Vector3 = Matrix<Scalar, 3, 1>;

/// 3 × n: one column per particle.
template <RealScalar Scalar>
using Matrix3X = Matrix<Scalar, 3, Dynamic>;

}  // namespace palpate
