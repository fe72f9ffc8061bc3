// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace palpate::detail {

/// Whether a symmetric n × n matrix has no eigenvalue below 0 but for rounding: Cholesky's factorisation of a + εI, in `a` itself. ε is some rounding
/// errors of the largest entry.
template <RealScalar Scalar>
bool is_semidefinite(Scalar* a, int n, Scalar largest) noexcept {
  Scalar const rounding = static_cast<Scalar>(8 * n) * std::numeric_limits<Scalar>::epsilon() * largest;
  for (int k = 0; k < n; ++k) {
    Scalar const pivot = a[k * n + k] += rounding;
    if (!(pivot > 0)) return false;
    for (int j = k + 1; j < n; ++j) {
      Scalar const factor = a[k * n + j] / pivot;
      for (int i = j; i < n; ++i) a[j * n + i] -= factor * a[k * n + i];
    }
  }
  return true;
}

/// Jacobi's cyclic method: `a`, symmetric n × n, becomes diagonal, the eigenvalues; column k of `vectors` is the k-th eigenvector.
/// Source     \cite golub2013 ch. 8.5.
template <RealScalar Scalar>
void diagonalise(Scalar* a, Scalar* vectors, int n, Scalar largest) noexcept {
  for (int i = 0; i < n * n; ++i) vectors[i] = i % (n + 1) == 0 ? Scalar(1) : Scalar(0);
  Scalar const small = std::numeric_limits<Scalar>::epsilon() * largest;
  bool is_diagonal = false;
  for (int sweep = 0; sweep < 16 && !is_diagonal; ++sweep) {
    is_diagonal = true;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        if (!(std::abs(a[q * n + p]) > small)) continue;
        is_diagonal = false;
        Scalar const half = (a[q * n + q] - a[p * n + p]) / (2 * a[q * n + p]);
        Scalar const tangent = std::copysign(Scalar(1), half) / (std::abs(half) + std::sqrt(1 + half * half));
        Scalar const cosine = 1 / std::sqrt(1 + tangent * tangent), sine = tangent * cosine;
        auto const turn = [=](Scalar& first, Scalar& second) {
          Scalar const before = first;
          first = cosine * before - sine * second;
          second = sine * before + cosine * second;
        };
        for (int k = 0; k < n; ++k) turn(a[p * n + k], a[q * n + k]), turn(vectors[p * n + k], vectors[q * n + k]);
        for (int k = 0; k < n; ++k) turn(a[k * n + p], a[k * n + q]);
      }
  }
}

/// The positive semidefinite matrix nearest to a symmetric one: its negative eigenvalues become 0. One that has none is handed back as it is.
template <RealScalar Scalar, int N>
Matrix<Scalar, N, N> semidefinite_part(Matrix<Scalar, N, N> matrix) noexcept {
  std::array<Scalar, std::size_t{N} * N> a, vectors;
  auto const begin = matrix.data(), end = begin + N * N;
  Scalar largest = 0;
  for (auto const* entry = begin; entry != end; ++entry) largest = std::max(largest, std::abs(*entry));
  std::copy(begin, end, a.data());
  if (is_semidefinite(a.data(), N, largest) || !std::isfinite(largest) || largest == 0) return matrix;
  std::copy(begin, end, a.data());
  diagonalise(a.data(), vectors.data(), N, largest);
  for (int k = 0; k < N; ++k)
    if (Scalar const value = a[static_cast<std::size_t>(k * N + k)]; value < 0)
      for (int j = 0; j < N; ++j)
        for (int i = 0; i < N; ++i) begin[j * N + i] -= value * vectors[static_cast<std::size_t>(k * N + i)] * vectors[static_cast<std::size_t>(k * N + j)];
  return matrix;
}

/// An upper bound of the spectral norm: the Frobenius norm, or √(‖B‖₁ ‖B‖∞) where that is less. Exact for multiples of the identity and for n nᵀ.
template <RealScalar Scalar>
Scalar norm_bound(Matrix<Scalar, 3, 3> const& block) noexcept {
  Matrix<Scalar, 3, 3> const size = block.cwiseAbs();
  return std::sqrt(std::min(block.squaredNorm(), size.rowwise().sum().maxCoeff() * size.colwise().sum().maxCoeff()));
}

}  // namespace palpate::detail
