// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// The tangent stiffness of a tissue's free particles as a sparse symmetric matrix of 3 × 3 blocks: one for each free particle and one for each
/// pair of free neighbours, plus a diagonal shift μ k_i, k_i the row bounds at rest.
/// It is read off the tissue's stiffness product: particles that share no neighbour answer for themselves, so all of one colour are
/// displaced together, and as many products as three times the colours give every block, whatever the tissue.
/// Units      N/m.
/// Shapes     vectors are 3 × free particles.
/// Cost       building O(particles · neighbours²), once; update() about 50 products on a surface; allocates only while building.
/// Invariant  symmetric, as the tissue's product is. It holds the tissue's positive semidefinite tangent, not always the exact one.
template <RealScalar Scalar>
class TangentMatrix {
 public:
  using Block = Matrix<Scalar, 3, 3>;
  using Columns = Matrix3X<Scalar>;

  /// Which blocks there are: particles that are no neighbours must not feel each other.
  template <HasStiffnessProduct Tissue>
  TangentMatrix(Tissue const& tissue, std::span<int const> free) : particles_(free.begin(), free.end()) {
    std::vector<int> place(at(tissue.size()), -1);
    for (int k = 0; k < size(); ++k) place[at(particles_[at(k)])] = k;
    begin_.push_back(0);
    for (int k = 0; k < size(); ++k) {
      neighbour_.push_back(k);   // the diagonal block is the first of its row
      tissue.for_each_neighbour(particles_[at(k)], [&](int i) {
        if (place[at(i)] >= 0) neighbour_.push_back(place[at(i)]);
      });
      begin_.push_back(static_cast<int>(neighbour_.size()));
      shift_.push_back(tissue.stiffness_bound(particles_[at(k)]));
    }
    block_.resize(neighbour_.size());
    colour();
    step_ = Columns::Zero(3, tissue.size());
    answer_ = step_;
  }

  int size() const noexcept { return static_cast<int>(particles_.size()); }
  int colours() const noexcept { return static_cast<int>(first_of_colour_.size()) - 1; }

  /// Reads the blocks at positions x, 3 × particles of the body.
  template <HasStiffnessProduct Tissue>
  void update(Tissue const& tissue, Columns const& x) {
    for (int c = 0; c < colours(); ++c) {
      auto const same = std::span(by_colour_).subspan(at(first_of_colour_[at(c)]), at(first_of_colour_[at(c + 1)] - first_of_colour_[at(c)]));
      for (int axis = 0; axis < 3; ++axis) {
        for (int const k : same) step_(axis, particles_[at(k)]) = 1;
        answer_.setZero();
        tissue.add_stiffness_product(x, step_, answer_);
        for (int const k : same) {
          step_(axis, particles_[at(k)]) = 0;
          for (int e = begin_[at(k)]; e < begin_[at(k + 1)]; ++e)
            block_[at(e)].row(axis) = answer_.col(particles_[at(neighbour_[at(e)])]).transpose();   // K_jk = K_kjᵀ
        }
      }
    }
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

  /// Gives each particle the least colour that no particle within two links of it has.
  void colour() {
    std::vector<int> colour_of(at(size()), -1), taken;
    int colours = 0;
    for (int k = 0; k < size(); ++k) {
      taken.assign(at(colours + 1), 0);
      for (int e = begin_[at(k)]; e < begin_[at(k + 1)]; ++e) {
        int const j = neighbour_[at(e)];
        for (int g = begin_[at(j)]; g < begin_[at(j + 1)]; ++g)
          if (int const c = colour_of[at(neighbour_[at(g)])]; c >= 0) taken[at(c)] = 1;
      }
      int const least = static_cast<int>(std::find(taken.begin(), taken.end(), 0) - taken.begin());
      colour_of[at(k)] = least;
      colours = std::max(colours, least + 1);
    }
    first_of_colour_.push_back(0);
    for (int c = 0; c < colours; ++c) {
      for (int k = 0; k < size(); ++k)
        if (colour_of[at(k)] == c) by_colour_.push_back(k);
      first_of_colour_.push_back(static_cast<int>(by_colour_.size()));
    }
  }

  std::vector<int> particles_;
  std::vector<int> begin_, neighbour_;   // row k: entries begin_[k] … begin_[k + 1] − 1
  std::vector<Block> block_;
  std::vector<Scalar> shift_;
  Scalar factor_ = 0;
  std::vector<int> by_colour_, first_of_colour_;
  Columns step_, answer_;
};

}  // namespace palpate
