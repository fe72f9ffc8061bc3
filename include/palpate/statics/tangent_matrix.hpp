// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cstddef>
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

}  // namespace palpate
