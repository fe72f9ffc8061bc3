// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/simd_columns.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// Whether rows of these numbers are kept in float besides.
template <RealScalar Scalar>
inline constexpr bool has_float_rows = std::same_as<Scalar, double> && simd::lanes<float> > 1;

/// The columns of a row of 3 × 3 blocks and their numbers, nine each, column after column.
template <RealScalar Scalar>
struct RowOfBlocks {
  std::span<int const> columns;
  Scalar const* values;
};

/// Rows of 3 × 3 blocks, rounded to float, as many beside each other as a register holds columns of four: each product of a register with another then
/// multiplies one column of all of them. The fourth number of a column is nothing, and a row ends with blocks of zeros.
/// Cost       16 bytes a column of a block and 4 for its place.
class FloatRows {
 public:
  static constexpr int beside = std::max(1, simd::lanes<float> / 4);
  using Group = simd::Pack<float, 4 * beside>;

  void clear() noexcept { first_.clear(), starts_.clear(), columns_.clear(); }
  void reserve(std::size_t rows, std::size_t blocks) {
    std::size_t const most = blocks + rows * (std::size_t{beside} - 1);
    first_.reserve(rows + 1), starts_.reserve(most), columns_.reserve(most / beside);
  }
  /// As many rows: blocks_of(i) is a RowOfBlocks.
  template <class BlocksOf>
  void build(int rows, BlocksOf const& blocks_of) {
    clear();
    first_.push_back(0);
    for (int i = 0; i < rows; ++i) {
      auto const columns = blocks_of(i).columns;
      for (std::size_t k = 0; k < columns.size(); k += beside)
        for (std::size_t n = k; n < k + beside; ++n) starts_.push_back(4 * columns[std::min(n, columns.size() - 1)]);
      first_.push_back(static_cast<int>(starts_.size()) / beside);
    }
    columns_.resize(starts_.size() / beside);
  }
  /// The numbers of the rows that it was built of.
  template <class BlocksOf>
  void round(BlocksOf const& blocks_of) noexcept {
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      auto const& [columns, values] = blocks_of(static_cast<int>(i));
      auto group = columns_.begin() + first_[i];
      for (std::size_t k = 0; k < columns.size(); k += beside, ++group)
        for (std::size_t c = 0; c < 3; ++c) {
          std::array<float, std::size_t{4} * beside> rounded{};
          for (std::size_t n = 0, end = std::min(std::size_t{beside}, columns.size() - k); n < end; ++n)
            for (std::size_t r = 0; r < 3; ++r) rounded[4 * n + r] = static_cast<float>(values[9 * (k + n) + 3 * c + r]);
          simd::load((*group)[c], rounded.data());
        }
    }
  }
  /// out += factor · K d, of columns of four floats, in rows first … end − 1.
  void add_product(float factor, float const* d, float* out, int first, int end) const noexcept {
    for (std::size_t i = at(first); i < at(end); ++i) {
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
