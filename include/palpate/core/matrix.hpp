// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/instruction_set.hpp>

#include <Eigen/Core>

#if !EIGEN_VERSION_AT_LEAST(3, 4, 0)
#error "palpate needs Eigen 3.4 or newer"
#endif

#include <cmath>
#include <concepts>
#include <limits>
#include <string_view>
#include <utility>

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

/// Whether each number is finite. Not Eigen's allFinite(): that makes half a dozen types for each type it is asked of, and types are what a
/// program that includes this waits for.
template <class Derived>
bool is_finite(Eigen::DenseBase<Derived> const& numbers) noexcept {
  for (Eigen::Index c = 0; c < numbers.cols(); ++c)
    for (Eigen::Index r = 0; r < numbers.rows(); ++r)
      if (!std::isfinite(numbers.derived().coeff(r, c))) return false;
  return true;
}
namespace detail {

/// Throws InvalidArgument unless the three numbers of a vector are finite.
template <class Vector>
void require_finite(std::string_view what, Vector const& v, std::string_view unit) {
  if (!is_finite(v)) throw InvalidArgument(message(what, " is (", v[0], ", ", v[1], ", ", v[2], ") ", unit, "; it must be finite"));
}

}  // namespace detail

/// Whether each number is zero; for isZero(0), likewise.
template <class Derived>
bool is_zero(Eigen::DenseBase<Derived> const& numbers) noexcept {
  for (Eigen::Index c = 0; c < numbers.cols(); ++c)
    for (Eigen::Index r = 0; r < numbers.rows(); ++r)
      if (!(numbers.derived().coeff(r, c) == 0)) return false;
  return true;
}
/// The length of a vector whose squares may overflow; for stableNorm(), likewise.
template <class Derived>
auto stable_norm(Eigen::DenseBase<Derived> const& vector) noexcept {
  using Scalar = typename Derived::Scalar;
  Scalar largest = 0, sum = 0;
  for (Eigen::Index k = 0; k < vector.size() && !std::isnan(largest); ++k)
    if (Scalar const size = std::abs(vector.derived().coeff(k)); !(size <= largest)) largest = size;   // NaN too
  if (!(largest > 0) || !std::isfinite(largest)) return largest;
  Scalar const inverse = 1 / largest;
  for (Eigen::Index k = 0; k < vector.size(); ++k) {
    Scalar const share = std::isfinite(inverse) ? vector.derived().coeff(k) * inverse : vector.derived().coeff(k) / largest;
    sum += share * share;
  }
  return largest * std::sqrt(sum);
}

/// The corners of the box around the columns of a 3 × n matrix; for rowwise().minCoeff() and maxCoeff(), likewise. NaN does not count.
template <class Derived>
auto low_and_high(Eigen::DenseBase<Derived> const& columns) noexcept {
  using Scalar = typename Derived::Scalar;
  constexpr Scalar infinity = std::numeric_limits<Scalar>::infinity();
  std::pair<Vector3<Scalar>, Vector3<Scalar>> box(Vector3<Scalar>(infinity, infinity, infinity), Vector3<Scalar>(-infinity, -infinity, -infinity));
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    for (int k = 0; k < 3; ++k) {
      Scalar const place = columns.derived().coeff(k, c);
      if (place < box.first[k]) box.first[k] = place;
      if (place > box.second[k]) box.second[k] = place;
    }
  return box;
}

}  // namespace palpate
