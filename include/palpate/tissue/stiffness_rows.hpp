// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/block_rows.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// The stiffness of particles as rows of 3 × 3 blocks, one for each two that share an element, sorted: a product reads each number once. What of an element is
/// outside of the particles has none.
/// Cost       a build sorts the neighbours of each.
template <RealScalar Number>
class StiffnessRows : public BlockRows<Number> {
  using Base = BlockRows<Number>;

 public:
  /// The blocks of `particles` and these elements; nothing is in them. Of less than the last time it allocates nothing.
  void build(int particles, std::span<std::array<int, 4> const> nodes) {
    auto const inside = [&](int i) { return i < particles; };
    first_.assign(at(particles) + 1, 0);
    for (auto const& n : nodes)
      for (int const i : n)
        if (inside(i)) first_[at(i) + 1] += static_cast<int>(std::count_if(n.begin(), n.end(), inside));
    for (int i = 0; i < particles; ++i) first_[at(i) + 1] += first_[at(i)];
    next_.assign(first_.begin(), first_.end() - 1);
    column_.resize(at(first_.back()));
    for (auto const& n : nodes)
      for (int const i : n)
        for (int const j : n)
          if (inside(i) && inside(j)) column_[at(next_[at(i)]++)] = j;
    Base::build(particles, [&](int i) {   // each once
      auto const from = column_.begin() + first_[at(i)], end = column_.begin() + first_[at(i) + 1];
      std::sort(from, end);
      return std::span<int const>(from, std::unique(from, end));
    });
    particles_ = particles;
  }
  /// Of the block of particles i and j, as in the base; −1 where one is outside.
  int start(int i, int j) const noexcept { return std::max(i, j) < particles_ ? Base::start(i, j) : -1; }

 private:
  static constexpr std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  int particles_ = 0;
  std::vector<int> first_, next_, column_;   // while it is built
};

}  // namespace palpate::detail
