// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/tissue/column_force.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// The particles of an assembly: 0 … moving−1 are the chosen ones; after them comes the border, particles that are only a node of an element.
/// Block      chosen particles that follow each other, 2,048 or more; at most eight. Blocks can be walked at once: an element at the seam of two is
///            computed in both, and each takes the forces on its own particles.
/// Growth     after edits others may follow the chosen ones: they are of the last block, until there are a quarter more.
template <RealScalar Scalar>
class AssembledParticles {
 public:
  /// Local particle → particle of the body.
  std::span<int const> particles() const noexcept { return particles_; }
  int moving() const noexcept { return static_cast<int>(inverse_mass_.size()); }
  int force_columns() const noexcept { return static_cast<int>(particles_.size()); }
  static int max_force_columns(int particles) noexcept { return particles; }
  int blocks() const noexcept { return blocks_; }

 protected:
  static constexpr int min_block_size = 2048, max_blocks = 8;
  using Padded = Eigen::Map<Matrix<Scalar, 4, Dynamic>>;
  using ConstPadded = Eigen::Map<Matrix<Scalar, 4, Dynamic> const>;

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  /// These are the chosen ones; the border is empty.
  template <class Tissue>
  void choose(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : particles_)
      if (at(p) < local_.size()) local_[at(p)] = -1;
    local_.resize(at(tissue.size()), -1);
    particles_.assign(moving.begin(), moving.end());
    inverse_mass_.clear();
    for (std::size_t i = 0; i < moving.size(); ++i) {
      local_[at(moving[i])] = static_cast<int>(i);
      inverse_mass_.push_back(1 / tissue.mass(moving[i]));
    }
    chosen_ = this->moving();
    blocks_ = std::clamp(chosen_ / min_block_size, 1, max_blocks);
    for (int b = 0; b <= blocks_; ++b) starts_[at(b)] = static_cast<int>(static_cast<long long>(chosen_) * b / blocks_);
  }
  /// Whether these are the chosen ones, and behind them some that edits have added since, not too many. What acts on older ones is not gathered.
  bool can_grow_to(std::span<int const> moving) const noexcept {
    std::size_t const known = inverse_mass_.size();
    if (moving.size() < known || known == 0 || 4 * moving.size() > 5 * at(chosen_)) return false;
    auto const is_new = [this](int p) { return at(p) >= local_.size(); };
    auto const end = moving.begin() + this->moving();
    return std::equal(moving.begin(), end, particles_.begin()) && std::all_of(end, moving.end(), is_new);
  }
  /// These are the chosen ones now: the border moves on behind them. Masses of those that were there stay; see weigh().
  template <class Tissue>
  void grow_to(Tissue const& tissue, std::span<int const> moving) {
    int const before = this->moving();
    local_.resize(at(tissue.size()), -1);
    if (static_cast<int>(moving.size()) > before) {
      particles_.insert(particles_.begin() + before, moving.begin() + before, moving.end());
      for (std::size_t k = at(before); k < particles_.size(); ++k) local_[at(particles_[k])] = static_cast<int>(k);
    }
    for (std::size_t k = at(before); k < moving.size(); ++k) inverse_mass_.push_back(1 / tissue.mass(moving[k]));
    starts_[at(blocks_)] = this->moving();
  }
  /// A local particle has another mass now.
  template <class Tissue>
  void weigh(Tissue const& tissue, int i) noexcept {
    if (i < moving()) inverse_mass_[at(i)] = 1 / tissue.mass(particles_[at(i)]);
  }
  /// The local particle of one of the body, which joins the border if it is not there.
  int local(int particle) {
    int& place = local_[at(particle)];
    if (place < 0) place = static_cast<int>(particles_.size()), particles_.push_back(particle);
    return place;
  }
  /// The same, or −1 where it is neither chosen nor of the border.
  int known(int particle) const noexcept { return at(particle) < local_.size() ? local_[at(particle)] : -1; }
  void reserve(int particles) { particles_.reserve(at(particles)), local_.reserve(at(particles)), inverse_mass_.reserve(at(particles)); }

  Scalar inverse_mass(int i) const noexcept { return inverse_mass_[at(i)]; }
  int first_of(int block) const noexcept { return starts_[at(block)]; }
  int block_of(int i) const noexcept {
    int b = 0;
    while (i >= first_of(b + 1)) ++b;
    return b;
  }
  /// Whether a particle is of a block; the border is of any where there is one block.
  struct Own {
    int first, count;
    bool operator()(int i) const noexcept { return static_cast<unsigned>(i - first) < static_cast<unsigned>(count); }
  };
  Own own(int block) const noexcept {
    if (blocks() == 1) return {0, std::numeric_limits<int>::max() / 4};
    return {first_of(block), first_of(block + 1) - first_of(block)};
  }

  /// Hands after_of(block)(i, a) the accelerations that these forces and pushes make, and leaves the forces zero.
  template <class Run, class AfterOf>
  void accelerate_by(Padded f, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes, Run const& run, AfterOf const& after_of) const {
    run(blocks(), [&](int b) {
      auto const after = after_of(b);
      auto push = std::lower_bound(pushes.begin(), pushes.end(), first_of(b), [](ColumnForce<Scalar> const& p, int i) { return p.column < i; });
      for (int i = first_of(b); i < first_of(b + 1); ++i) {
        Vector3<Scalar> sum = f.col(i).template head<3>();
        for (; push != pushes.end() && push->column == i; ++push) sum += push->force;
        f.col(i).setZero();
        sum = inverse_mass_[at(i)] * sum + gravity;
        after(i, simd::Pack<Scalar, 4>{sum[0], sum[1], sum[2], Scalar(0)});
      }
    });
    f.rightCols(f.cols() - moving()).setZero();
  }
  /// out = mass M d; its border is zero.
  template <RealScalar S>
  void multiply_mass(Scalar mass, S const* d, S* out) const noexcept {
    Eigen::Map<Matrix<S, 4, Dynamic> const> const direction(d, 4, force_columns());
    Eigen::Map<Matrix<S, 4, Dynamic>> product(out, 4, force_columns());
    for (int i = 0; i < moving(); ++i) product.col(i) = static_cast<S>(mass / inverse_mass_[at(i)]) * direction.col(i);
    product.rightCols(product.cols() - moving()).setZero();
  }
  void mass_diagonal(Scalar mass, Scalar* out) const noexcept {
    Padded diagonal(out, 4, force_columns());
    diagonal.setZero();
    for (int i = 0; i < moving(); ++i) diagonal.col(i).template head<3>().setConstant(mass / inverse_mass_[at(i)]);
  }

 private:
  std::vector<int> particles_;
  std::vector<int> local_;             // particle of the body → local particle, −1 outside
  std::vector<Scalar> inverse_mass_;   // 1/kg, of the moving ones
  int chosen_ = 0, blocks_ = 1;        // so many particles when they were chosen
  std::array<int, max_blocks + 1> starts_{};   // of the blocks
};

}  // namespace palpate
