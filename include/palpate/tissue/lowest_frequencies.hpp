// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/tissue/concept.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace palpate {

/// The lowest frequencies at which undamped tissue swings about its rest [Hz], rising: roots of det(K − (2πf)² M). What nothing holds has six of 0 for each
/// piece. By subspace iteration with a sparse factorisation of K and a small share of M. Nailed particles stay.
/// A header of its own, which palpate.hpp leaves out: Eigen's factorisations take long to compile.
/// Errors     InvalidArgument for a count below 1, or above the free particles' coordinates, or where there is no equilibrium to swing about,
///            as where tissue is pre-strained.
/// Limits     of float tissue a mode of 1/40,000 of the fastest frequency is off by 1 %, and those of 0 are up to 1/30,000 of it: blocks resist
///            turns by their rounding.
/// Source     \cite bathe1973.
/// Cost       that of a factorisation, see DirectFactorisation. Allocates.
template <HasStiffnessBlocks Tissue>
std::vector<typename Tissue::Scalar> lowest_frequencies(Tissue const& tissue, int count) {
  using Scalar = typename Tissue::Scalar;
  using Dense = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  using Sparse = Eigen::SparseMatrix<double>;   // a small share of M is lost in float
  std::vector<int> place(static_cast<std::size_t>(tissue.size()), -1), free;
  for (int i = 0; i < tissue.size(); ++i)
    if (!tissue.nailed(i)) place[static_cast<std::size_t>(i)] = static_cast<int>(free.size()), free.push_back(i);
  Eigen::Index const n = 3 * std::ssize(free);
  if (count < 1 || count > n) throw InvalidArgument(detail::message(count, " frequencies asked of ", free.size(), " free particles; give 1 to three times as many"));

  Matrix3X<Scalar> const rest = tissue.rest_positions(), still = Matrix3X<Scalar>::Zero(3, tissue.size());
  for (int const i : free) {
    Scalar longest = 0;
    tissue.for_each_neighbour(i, [&](int j) { longest = std::max(longest, (rest.col(j) - rest.col(i)).norm()); });
    Scalar const pull = tissue.internal_force(i, rest, still).norm();
    if (!(pull <= std::sqrt(std::numeric_limits<Scalar>::epsilon()) * tissue.stiffness_bound(i) * longest))
      throw InvalidArgument(detail::message("particle ", i, " is pulled with ", pull, " N where it rests, as in pre-strained tissue; without equilibrium there it has no frequencies"));
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Eigen::Matrix3d> sums(free.size(), Eigen::Matrix3d::Zero());   // of rows: what a translation is resisted with
  std::vector<double> sizes(free.size(), 0.0);
  tissue.for_each_stiffness_block(rest, [&](int i, int j, Matrix<Scalar, 3, 3> const& block) {
    int const row = 3 * place[static_cast<std::size_t>(i)], column = 3 * place[static_cast<std::size_t>(j)];
    if (auto const k = static_cast<std::size_t>(row / 3); row >= 0) sums[k] += block.template cast<double>(), sizes[k] += static_cast<double>(block.norm());
    for (int a = 0; row >= 0 && column >= 0 && row >= column && a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (row + a >= column + b) entries.emplace_back(row + a, column + b, static_cast<double>(block(a, b)));
  });
  for (std::size_t k = 0; k < free.size(); ++k)   // what is rounding there would hold slow modes
    for (int a = 0; a < 3 && sums[k].norm() <= 32 * static_cast<double>(std::numeric_limits<Scalar>::epsilon()) * sizes[k]; ++a)
      for (int b = 0; b <= a; ++b) entries.emplace_back(3 * static_cast<int>(k) + a, 3 * static_cast<int>(k) + b, -(sums[k](a, b) + sums[k](b, a)) / 2);
  Sparse shifted(n, n);
  shifted.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd mass(n);
  for (std::size_t k = 0; k < free.size(); ++k) mass.segment<3>(3 * static_cast<Eigen::Index>(k)).setConstant(static_cast<double>(tissue.mass(free[k])));
  double const shift = 1e-8 * shifted.diagonal().cwiseQuotient(mass).maxCoeff();   // so that free pieces can be solved for
  for (Eigen::Index k = 0; k < n; ++k) shifted.coeffRef(k, k) += shift * mass[k];
  Eigen::SimplicialLDLT<Sparse> const factors(shifted);
  if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 0))
    throw InvalidArgument("the stiffness at rest is not positive semidefinite; without equilibrium there it has no frequencies");

  Eigen::Index const width = std::min<Eigen::Index>(n, 2 * count + 6);
  Random random(Seed{1});
  Dense space = Dense::NullaryExpr(n, width, [&] { return random.uniform<double>() - 0.5; });
  Eigen::VectorXd values = Eigen::VectorXd::Zero(width);
  Eigen::VectorXd const root = mass.cwiseSqrt();
  for (int round = 0; round < 200; ++round) {
    space = factors.solve(Dense(mass.asDiagonal() * space));
    // Normal to each other by Householder: free motions are 10⁸ times as large in it as the fastest, and a square of that is lost in rounding.
    Eigen::HouseholderQR<Dense> const basis(Dense(root.asDiagonal() * space));
    space = root.cwiseInverse().asDiagonal() * Dense(basis.householderQ() * Dense::Identity(n, width));
    Eigen::SelfAdjointEigenSolver<Dense> const small(space.transpose() * Dense(shifted.selfadjointView<Eigen::Lower>() * space));
    space = space * small.eigenvectors();
    Eigen::VectorXd const before = values;
    values = small.eigenvalues();
    if ((values - before).head(count).cwiseAbs().maxCoeff() <= 1e-9 * values[count - 1]) break;
  }
  std::vector<Scalar> found;
  for (int k = 0; k < count; ++k) found.push_back(static_cast<Scalar>(std::sqrt(std::max(0.0, values[k] - shift)) / (2 * std::numbers::pi)));
  return found;
}
/// Of what is no such tissue: what is wrong.
template <class Other>
  requires(!HasStiffnessBlocks<Other>)
std::vector<typename Other::Scalar> lowest_frequencies(Other const&, int) {
  static_assert(HasStiffnessBlocks<Other>, "lowest_frequencies: this is no tissue that hands out its stiffness, see HasStiffnessBlocks; of a body give body.tissue().");
  return {};
}

}  // namespace palpate
