// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/statics/linear_solver.hpp>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <vector>

namespace palpate {

/// Solves with a sparse factorisation K = L D Lᵀ by Eigen: exact but for rounding, for reference solutions and for bodies that iterations find hard.
/// NewtonRaphson<DirectFactorisation>{} settles with it. A singular K, as of a free piece, it refuses, and Newton's method shifts its diagonal.
/// A header of its own, which palpate.hpp leaves out: Eigen's factorisations take long to compile.
/// Cost       for a solid of n particles some n² operations and n^(4/3) numbers. Allocates.
struct DirectFactorisation {
  template <RealScalar Scalar>
  int solve(TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) const {
    std::vector<Eigen::Triplet<Scalar>> entries;
    k.for_each_block([&](int row, int column, Matrix<Scalar, 3, 3> const& block) {
      for (int i = 0; row >= column && i < 3; ++i)
        for (int j = 0; j < 3; ++j) entries.emplace_back(3 * row + i, 3 * column + j, block(i, j));
    });
    Eigen::SparseMatrix<Scalar> lower(3 * k.size(), 3 * k.size());
    lower.setFromTriplets(entries.begin(), entries.end());
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<Scalar>> const factors(lower);
    if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 0)) return -1;
    p = factors.solve(f.reshaped()).reshaped(3, k.size());
    return is_finite(p) ? 1 : -1;
  }
};

}  // namespace palpate
