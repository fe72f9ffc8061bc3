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

/// Rows of 3 × 3 blocks, as many beside each other as a register holds columns of four: each product of a register with another then multiplies one column of
/// all of them. The fourth number of a column is nothing, and a row ends with blocks of zeros.
/// Cost       four numbers a column of a block and 4 bytes for its place.
template <RealScalar Number>
class BlockRows {
 public:
  static constexpr int beside = std::max(1, simd::lanes<Number> / 4);
  using Group = simd::Pack<Number, 4 * beside>;

  bool empty() const noexcept { return first_.empty(); }
  void clear() noexcept { first_.clear(), starts_.clear(), columns_.clear(); }
  void reserve(std::size_t rows, std::size_t blocks) {
    std::size_t const most = blocks + rows * (std::size_t{beside} - 1);
    first_.reserve(rows + 1), starts_.reserve(most), columns_.reserve(most / beside);
  }
  /// As many rows, of zeros: columns_of(i) are row i's, in a span.
  template <class ColumnsOf>
  void build(int rows, ColumnsOf const& columns_of) {
    clear();
    first_.push_back(0);
    for (int i = 0; i < rows; ++i) {
      auto const columns = columns_of(i);
      for (std::size_t k = 0; k < columns.size(); k += beside)
        for (std::size_t n = k; n < k + beside; ++n) starts_.push_back(4 * columns[std::min(n, columns.size() - 1)]);
      first_.push_back(static_cast<int>(starts_.size()) / beside);
    }
    columns_.resize(starts_.size() / beside);
  }
  void set_zero() noexcept { std::fill(columns_.begin(), columns_.end(), std::array<Group, 3>{}); }
  /// The numbers of the rows that it was built of, values_of(i) nine to a block, column after column.
  template <RealScalar Scalar, class ValuesOf>
  void round(ValuesOf const& values_of) noexcept {
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      std::span<Scalar const> const values = values_of(static_cast<int>(i));
      auto group = columns_.begin() + first_[i];
      for (std::size_t k = 0; 9 * k < values.size(); k += beside, ++group)
        for (std::size_t c = 0; c < 3; ++c) {
          std::array<Number, std::size_t{4} * beside> rounded{};
          for (std::size_t n = 0, end = std::min(std::size_t{beside}, values.size() / 9 - k); n < end; ++n)
            for (std::size_t r = 0; r < 3; ++r) rounded[4 * n + r] = static_cast<Number>(values[9 * (k + n) + 3 * c + r]);
          simd::load((*group)[c], rounded.data());
        }
    }
  }
  /// The first column of row i's block of column j, where rows are sorted: among the numbers(). The others are 4 · beside farther each.
  int start(int i, int j) const noexcept {
    auto const begin = starts_.begin() + first_[at(i)] * beside, end = starts_.begin() + first_[at(i) + 1] * beside;
    int const slot = static_cast<int>(std::lower_bound(begin, end, 4 * j) - starts_.begin());
    return slot / beside * 12 * beside + slot % beside * 4;
  }
  Number* numbers() noexcept { return reinterpret_cast<Number*>(columns_.data()); }
  /// out += factor · K d, of columns of four numbers, in rows first … end − 1.
  void add_product(Number factor, Number const* d, Number* out, int first, int end) const noexcept {
    for (std::size_t i = at(first); i < at(end); ++i) {
      Group x{}, y{}, z{}, of, change;
      for (int k = first_[i]; k < first_[i + 1]; ++k) {
        simd::load_beside(of, d, &starts_[at(k * beside)], 1);
        auto const& column = columns_[at(k)];
        simd::spread<0>(change, of), x += change * column[0];
        simd::spread<1>(change, of), y += change * column[1];
        simd::spread<2>(change, of), z += change * column[2];
      }
      Number* const to = out + 4 * i;
      simd::Pack<Number, 4> sum, row;
      simd::load(sum, to), simd::sum_beside(row, Group((x + y) + z));
      simd::store(to, simd::Pack<Number, 4>(sum + factor * row));
    }
  }

 private:
  static constexpr std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  std::vector<int> first_;                              // of each row: its groups
  HugePageVector<int> starts_;                          // of each block
  HugePageVector<std::array<Group, 3>> columns_;        // of each group
};

}  // namespace palpate::detail
