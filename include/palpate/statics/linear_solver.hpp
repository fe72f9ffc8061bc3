// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// The tangent stiffness of the free particles as a symmetric block sparse matrix (compressed rows of 3 × 3 blocks): a block for each
/// free particle and for each pair of free neighbours. A diagonal shift μ k_i can be added, k_i the row bound at rest.
/// Units      N/m.
/// Shapes     vectors are 3 × free particles.
/// Cost       building O(particles · neighbours), once; update() one pass over the tissue's blocks. Only building allocates.
/// Invariant  symmetric, as the tissue's blocks are. It holds the tissue's positive semidefinite tangent, which is not always the exact
///            one.
template <RealScalar Scalar>
class TangentMatrix {
 public:
  using Block = Matrix<Scalar, 3, 3>;
  using Columns = Matrix3X<Scalar>;

  /// Builds the sparsity pattern. Particles that are not neighbours must not interact.
  template <HasStiffnessBlocks Tissue>
  TangentMatrix(Tissue const& tissue, std::span<int const> free) : particles_(free.begin(), free.end()), place_(at(tissue.size()), -1) {
    for (int k = 0; k < size(); ++k) place_[at(particles_[at(k)])] = k;
    begin_.push_back(0);
    for (int k = 0; k < size(); ++k) {
      neighbour_.push_back(k);   // the diagonal block is the first of its row
      tissue.for_each_neighbour(particles_[at(k)], [&](int i) {
        if (place_[at(i)] >= 0) neighbour_.push_back(place_[at(i)]);
      });
      begin_.push_back(static_cast<int>(neighbour_.size()));
      shift_.push_back(tissue.stiffness_bound(particles_[at(k)]));
    }
    block_.resize(neighbour_.size());
  }

  int size() const noexcept { return static_cast<int>(particles_.size()); }

  /// Evaluates the blocks at positions x, 3 × particles of the body.
  template <HasStiffnessBlocks Tissue>
  void update(Tissue const& tissue, Columns const& x) {
    std::fill(block_.begin(), block_.end(), Block::Zero());
    tissue.for_each_stiffness_block(x, [&](int i, int j, Block const& block) {
      int const row = place_[at(i)], column = place_[at(j)];
      if (row < 0 || column < 0) return;
      auto const end = neighbour_.begin() + begin_[at(row + 1)], entry = std::find(neighbour_.begin() + begin_[at(row)], end, column);
      if (entry != end) block_[static_cast<std::size_t>(entry - neighbour_.begin())] += block;
    });
  }

  void set_shift(Scalar factor) noexcept { factor_ = factor; }
  Scalar shift() const noexcept { return factor_; }

  Block diagonal(int k) const noexcept { return block_[at(begin_[at(k)])] + factor_ * shift_[at(k)] * Block::Identity(); }

  /// Row k of K x without its diagonal block.
  Vector3<Scalar> beside(int k, Columns const& x) const noexcept {
    Vector3<Scalar> sum = Vector3<Scalar>::Zero();
    for (int e = begin_[at(k)] + 1; e < begin_[at(k + 1)]; ++e) sum += block_[at(e)] * x.col(neighbour_[at(e)]);
    return sum;
  }

  /// visit(row, column, block) for all blocks, that of the diagonal shifted.
  template <class Visit>
  void for_each_block(Visit visit) const {
    for (int k = 0; k < size(); ++k) {
      visit(k, k, diagonal(k));
      for (int e = begin_[at(k)] + 1; e < begin_[at(k + 1)]; ++e) visit(k, neighbour_[at(e)], block_[at(e)]);
    }
  }

  /// y = K x
  void multiply(Columns const& x, Columns& y) const noexcept {
    for (int k = 0; k < size(); ++k) y.col(k) = beside(k, x) + diagonal(k) * x.col(k);
  }

 private:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  std::vector<int> particles_, place_;   // free → body, body → free; −1 for those that are not free
  std::vector<int> begin_, neighbour_;   // row k: entries begin_[k] … begin_[k + 1] − 1
  std::vector<Block> block_;
  std::vector<Scalar> shift_;
  Scalar factor_ = 0;
};

/// Solves K p = f for a symmetric positive (semi)definite tangent, from p = 0. Returns its iterations, or −1 when K is singular to it
/// and p is not to be used. It need not be exact: Newton's method corrects it.
template <class Solver, class Scalar>
concept TangentSolver = requires(Solver const& solver, TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) {
  { solver.solve(k, f, p) } -> std::same_as<int>;
};

namespace detail {

/// What a solver goes on for: else the loads get the blame for what it does not find.
inline void require_budget(char const* owner, double tolerance, char const* name, int most) {
  OptionCheck const require{owner};
  require(tolerance >= 0 && tolerance < 1, ".tolerance", tolerance, "give a share from 0 to below 1");
  require(most >= 1, name, most, "give one or more");
}

}  // namespace detail

/// Conjugate gradients, preconditioned with the diagonal blocks. Until |f − K p| ≤ tolerance |f| in the preconditioner's norm.
/// Cost       one product an iteration; iterations grow with the root of the condition number. Allocates.
struct TangentConjugateGradients {
  double tolerance = 1e-4;
  int iterations = 10000;

  template <RealScalar Scalar>
  int solve(TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) const {
    detail::require_budget("TangentConjugateGradients", tolerance, ".iterations", iterations);
    int const n = k.size();
    std::vector<Matrix<Scalar, 3, 3>> inverse(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) inverse[static_cast<std::size_t>(i)] = k.diagonal(i).inverse();
    Matrix3X<Scalar> r = f, z(3, n), d(3, n), kd(3, n);
    p.setZero(3, n);
    auto const precondition = [&] {
      for (int i = 0; i < n; ++i) z.col(i) = inverse[static_cast<std::size_t>(i)] * r.col(i);
    };
    precondition();
    d = z;
    Scalar rz = r.cwiseProduct(z).sum();
    if (!std::isfinite(rz)) return -1;
    Scalar const share = std::max(static_cast<Scalar>(tolerance), 4 * std::numeric_limits<Scalar>::epsilon());
    Scalar const enough = share * share * rz;
    int count = 0;
    for (; count < iterations && rz > enough; ++count) {
      k.multiply(d, kd);
      Scalar const curvature = d.cwiseProduct(kd).sum();
      if (!(curvature > 0)) return -1;
      Scalar const step = rz / curvature;
      p += step * d;
      r -= step * kd;
      precondition();
      Scalar const last = rz;
      rz = r.cwiseProduct(z).sum();
      if (!std::isfinite(rz)) return -1;
      d = z + rz / last * d;
    }
    return count;
  }
};

/// Successive over-relaxation in blocks, p_i ← (1 − ω) p_i + ω K_ii⁻¹ (f_i − Σ_{j≠i} K_ij p_j). Until no change is above tolerance times the
/// largest |p_i|. Converges for 0 < ω < 2 on a positive definite K.
/// Source     \cite deformable_survey, its inner solver.
/// Cost       one product a sweep; sweeps grow with the condition number (ω = 1), or its root (the best ω, near 2 for large bodies). Allocates.
struct TangentOverRelaxation {
  double omega = 1.7;
  double tolerance = 1e-5;
  int sweeps = 20000;

  template <RealScalar Scalar>
  int solve(TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) const {
    if (!(omega > 0 && omega < 2)) throw InvalidArgument(detail::message("omega is ", omega, "; over-relaxation needs 0 < omega < 2"));
    detail::require_budget("TangentOverRelaxation", tolerance, ".sweeps", sweeps);
    int const n = k.size();
    std::vector<Matrix<Scalar, 3, 3>> inverse(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) inverse[static_cast<std::size_t>(i)] = k.diagonal(i).inverse();
    p.setZero(3, n);
    Scalar const share = std::max(static_cast<Scalar>(tolerance), 4 * std::numeric_limits<Scalar>::epsilon());
    for (int count = 1; count <= sweeps; ++count) {
      Scalar largest = 0, change = 0;
      for (int i = 0; i < n; ++i) {
        Vector3<Scalar> const there = inverse[static_cast<std::size_t>(i)] * (f.col(i) - k.beside(i, p));
        Vector3<Scalar> const shift = static_cast<Scalar>(omega) * (there - p.col(i));
        p.col(i) += shift;
        if (!is_finite(p.col(i))) return -1;
        largest = std::max(largest, p.col(i).cwiseAbs().maxCoeff());
        change = std::max(change, shift.cwiseAbs().maxCoeff());
      }
      if (change <= share * largest) return count;
    }
    return sweeps;
  }
};

}  // namespace palpate
