// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>
#include <palpate/tissue/float_rows.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// The stiffness of particles as rows of 3 × 3 blocks, one for each two that share an element: a product reads each number once. What of an element is
/// outside of the particles has none.
/// Cost       a build sorts the neighbours of each; a product is 9 multiplications a block.
template <RealScalar Scalar>
class StiffnessRows {
 public:
  /// Of nodes 0 … 3 of an element: 00 11 22 33 01 02 03 12 13 23.
  static constexpr int pairs = 10;
  static constexpr std::array<std::array<std::size_t, 2>, pairs> pair = {{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

  bool empty() const noexcept { return first_.empty(); }
  void clear() noexcept { first_.clear(), diagonal_.clear(), floats_.clear(); }
  /// The blocks of `particles` and these elements; nothing is in them. Of less than the last time it allocates nothing.
  void build(int particles, std::span<std::array<int, 4> const> nodes) {
    auto const inside = [&](int i) { return i < particles; };
    first_.assign(at(particles) + 1, 0);
    for (auto const& n : nodes)
      for (int const i : n)
        if (inside(i)) first_[at(i) + 1] += static_cast<int>(std::count_if(n.begin(), n.end(), inside));
    for (int i = 0; i < particles; ++i) first_[at(i) + 1] += first_[at(i)];
    diagonal_.assign(first_.begin(), first_.end() - 1);   // where the next one of each row is put
    column_.resize(at(first_.back()));
    for (auto const& n : nodes)
      for (int const i : n)
        for (int const j : n)
          if (inside(i) && inside(j)) column_[at(diagonal_[at(i)]++)] = j;
    auto to = column_.begin();   // each once
    for (int i = 0; i < particles; ++i) {
      auto const from = column_.begin() + first_[at(i)], end = column_.begin() + first_[at(i) + 1];
      std::sort(from, end);
      first_[at(i)] = static_cast<int>(to - column_.begin());
      to = std::copy(from, std::unique(from, end), to);
    }
    first_.back() = static_cast<int>(to - column_.begin());
    column_.erase(to, column_.end());
    mirror_.assign(column_.size(), -1);
    for (int i = 0; i < particles; ++i) {
      diagonal_[at(i)] = place(i, i);
      for (int k = first_[at(i)]; k < diagonal_[at(i)]; ++k) mirror_[at(k)] = place(column_[at(k)], i);
    }
    values_.assign(9 * column_.size() + 1, Scalar(0));   // the last column of a block is read four numbers wide
    if constexpr (has_float_rows<Scalar>) floats_.build(particles, blocks_of());
  }
  /// Of the block of particles i and j, or −1 where one is outside.
  int place(int i, int j) const noexcept {
    if (std::max(i, j) >= static_cast<int>(diagonal_.size())) return -1;
    return static_cast<int>(std::lower_bound(column_.begin() + first_[at(i)], column_.begin() + first_[at(i) + 1], j) - column_.begin());
  }

  void set_zero() noexcept { std::fill(values_.begin(), values_.end(), Scalar(0)); }
  /// The nine numbers of a block, column after column, begin at 9 · its place: what is added to those at and right of the diagonal, mirror() copies.
  Scalar* values() noexcept { return values_.data(); }
  void mirror() noexcept {
    for (std::size_t k = 0; k < mirror_.size(); ++k) {
      if (mirror_[k] < 0) continue;
      Scalar const* const from = &values_[9 * at(mirror_[k])];
      Scalar* const to = &values_[9 * k];
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) to[3 * c + r] = from[3 * r + c];
    }
    if constexpr (has_float_rows<Scalar>) floats_.round(blocks_of());
  }

  /// out += factor · K d, of columns of four numbers, in rows first … end − 1.
  void add_product(Scalar factor, Scalar const* d, Scalar* out, int first, int end) const noexcept {
    using Column = simd::Pack<Scalar, 4>;
    Scalar const* values = values_.data() + 9 * static_cast<std::ptrdiff_t>(first_[at(first)]);
    for (std::size_t i = at(first); i < at(end); ++i) {
      Column x{}, y{}, z{}, of, sum;
      for (int k = first_[i]; k < first_[i + 1]; ++k, values += 9) {
        Scalar const* const change = d + 4 * static_cast<std::ptrdiff_t>(column_[at(k)]);
        simd::load(of, values), x += change[0] * of;
        simd::load(of, values + 3), y += change[1] * of;
        simd::load(of, values + 6), z += change[2] * of;
      }
      Scalar* const to = out + 4 * i;
      simd::load(sum, to);
      Scalar const fourth = to[3];
      simd::store(to, Column(sum + factor * ((x + y) + z)));
      to[3] = fourth;
    }
  }
  /// The same in float.
  void add_product(float factor, float const* d, float* out, int first, int end) const noexcept
    requires has_float_rows<Scalar>
  {
    floats_.add_product(factor, d, out, first, end);
  }
  /// out += factor · its diagonal.
  void add_diagonal(Scalar factor, Scalar* out) const noexcept {
    for (std::size_t i = 0; i < diagonal_.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) out[4 * i + c] += factor * values_[9 * at(diagonal_[i]) + 4 * c];
  }

 private:
  auto blocks_of() const noexcept {
    return [this](int i) {
      std::size_t const first = at(first_[at(i)]);
      return RowOfBlocks<Scalar>{std::span(column_).subspan(first, at(first_[at(i) + 1]) - first), values_.data() + 9 * first};
    };
  }
  static constexpr std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  std::vector<int> first_, column_, diagonal_;
  std::vector<int> mirror_;   // of a block left of the diagonal: that on the other side
  std::vector<Scalar> values_;
  FloatRows floats_;   // of doubles
};

}  // namespace palpate::detail
