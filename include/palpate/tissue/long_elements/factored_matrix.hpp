// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <cstddef>
#include <vector>

namespace palpate::detail {

/// L D Lᵀ of a symmetric positive definite matrix, as Eigen makes it, and solutions with it that allocate nothing.
template <RealScalar Scalar>
class FactoredMatrix {
 public:
  using Vector = Matrix<Scalar, Dynamic, 1>;

  /// Of the lower triangle. False where it is not positive definite.
  bool factorise(Eigen::SparseMatrix<Scalar> const& lower) {
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<Scalar>> const made(lower);
    if (made.info() != Eigen::Success || !(lower.rows() == 0 || made.vectorD().minCoeff() > 0)) return false;
    factor_ = made.matrixL().nestedExpression();
    diagonal_ = made.vectorD();
    place_.resize(static_cast<std::size_t>(lower.rows()));
    auto const& moved = made.permutationP();   // empty where nothing is
    for (int i = 0; i < static_cast<int>(place_.size()); ++i) place_[static_cast<std::size_t>(i)] = moved.size() > 0 ? moved.indices()[i] : i;
    work_.resize(lower.rows());
    return true;
  }

  /// b becomes the solution.
  void solve(Vector& b) const noexcept {
    int const n = static_cast<int>(diagonal_.size());
    for (int i = 0; i < n; ++i) work_[place_[static_cast<std::size_t>(i)]] = b[i];
    auto const* const start = factor_.outerIndexPtr();
    auto const* const row = factor_.innerIndexPtr();
    Scalar const* const value = factor_.valuePtr();
    for (int j = 0; j < n; ++j) {
      Scalar const known = work_[j];
      for (int k = start[j]; k < start[j + 1]; ++k)
        if (row[k] > j) work_[row[k]] -= value[k] * known;
    }
    for (int j = n - 1; j >= 0; --j) {
      Scalar sum = work_[j] / diagonal_[j];
      for (int k = start[j]; k < start[j + 1]; ++k)
        if (row[k] > j) sum -= value[k] * work_[row[k]];
      work_[j] = sum;
    }
    for (int i = 0; i < n; ++i) b[i] = work_[place_[static_cast<std::size_t>(i)]];
  }

 private:
  Eigen::SparseMatrix<Scalar> factor_;   // strictly lower
  Vector diagonal_;
  mutable Vector work_;
  std::vector<int> place_;               // of each number in the order of the factor
};

}  // namespace palpate::detail
