// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/simd_columns.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// Rows of 3 × 3 blocks, rounded to float, as many beside each other as a register holds columns of four: each product of a register with another then
/// multiplies one column of all of them. The fourth number of a column is nothing, and a row ends with blocks of zeros.
/// Cost       16 bytes a column of a block and 4 for its place.
class FloatRows {
 public:
  static constexpr int beside = std::max(1, simd::lanes<float> / 4);
  using Group = simd::Pack<float, 4 * beside>;

  bool empty() const noexcept { return first_.empty(); }
  void clear() noexcept { first_.clear(), starts_.clear(), columns_.clear(); }
  /// Blocks first[i] … first[i + 1] − 1 are of row i, and in these columns.
  void build(std::span<int const> first, std::span<int const> column) {
    clear();
    first_.push_back(0);
    for (std::size_t i = 0; i + 1 < first.size(); ++i) {
      int const begin = first[i], end = first[i + 1];
      for (int k = begin; k < end; k += beside)
        for (int n = k; n < k + beside; ++n) starts_.push_back(4 * column[at(std::min(n, end - 1))]);
      first_.push_back(static_cast<int>(starts_.size()) / beside);
    }
    columns_.resize(starts_.size() / at(beside));
  }
  /// Their numbers: column after column, nine for each block.
  template <RealScalar Scalar>
  void round(std::span<int const> first, Scalar const* values) noexcept {
    auto group = columns_.begin();
    for (std::size_t i = 0; i + 1 < first.size(); ++i)
      for (int k = first[i]; k < first[i + 1]; k += beside, ++group)
        for (std::size_t c = 0; c < 3; ++c) {
          std::array<float, std::size_t{4} * beside> rounded{};
          for (int n = 0, end = std::min(beside, first[i + 1] - k); n < end; ++n)
            for (std::size_t r = 0; r < 3; ++r) rounded[4 * at(n) + r] = static_cast<float>(values[9 * at(k + n) + 3 * c + r]);
          simd::load((*group)[c], rounded.data());
        }
  }
  /// out += factor · K d, of columns of four floats.
  void add_product(float factor, float const* d, float* out) const noexcept {
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      Group x{}, y{}, z{}, of, change;
      for (int k = first_[i]; k < first_[i + 1]; ++k) {
        simd::load_beside(of, d, &starts_[at(k * beside)], 1);
        auto const& column = columns_[at(k)];
        simd::spread<0>(change, of), x += change * column[0];
        simd::spread<1>(change, of), y += change * column[1];
        simd::spread<2>(change, of), z += change * column[2];
      }
      float* const to = out + 4 * i;
      simd::Pack<float, 4> sum, row;
      simd::load(sum, to), simd::sum_beside(row, Group((x + y) + z));
      simd::store(to, simd::Pack<float, 4>(sum + factor * row));
    }
  }

 private:
  static constexpr std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  std::vector<int> first_;                              // of each row: its groups
  HugePageVector<int> starts_;                          // of each block
  HugePageVector<std::array<Group, 3>> columns_;        // of each group
};

}  // namespace palpate::detail
