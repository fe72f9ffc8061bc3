// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/tissue/block_rows.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Rows of 3 × 3 tensors K_ij, each set as a whole: K_ii first, then those of the neighbours. A row that outgrows its place goes to the end; all close up
/// where half is left empty. Where they are doubles they are kept in float too, as they were when round() was called.
/// Cost       set() is O(its length), amortised; a product is nine multiplications a tensor.
template <RealScalar Scalar>
class TensorRows {
 public:
  int size() const noexcept { return static_cast<int>(places_.size()); }
  void clear() noexcept { places_.clear(), column_.clear(), values_.clear(), empty_ = 0, is_built_ = false; }
  void reserve(std::size_t rows, std::size_t tensors) {
    places_.reserve(rows), column_.reserve(tensors), values_.reserve(9 * tensors + 1);
    if constexpr (has_float_rows<Scalar>) floats_.reserve(rows, tensors);
  }

  /// The j of row i.
  std::span<int const> columns(int i) const noexcept { return std::span(column_).subspan(place(i).first, place(i).count); }
  /// Their tensors, nine numbers each, column after column.
  Scalar const* values(int i) const noexcept { return values_.data() + 9 * place(i).first; }
  Scalar* values(int i) noexcept { return values_.data() + 9 * place(i).first; }
  Matrix<Scalar, 3, 3> tensor(int i, std::size_t k) const { return Eigen::Map<Matrix<Scalar, 3, 3> const>(values(i) + 9 * k); }

  /// Row i, one that there is or the next, becomes these.
  void set(int i, std::span<int const> columns, Scalar const* values) {
    is_built_ = false;
    if (i == size()) places_.push_back({column_.size(), 0, 0});
    Place& own = places_[static_cast<std::size_t>(i)];
    if (columns.size() > own.room) {
      empty_ += own.room;
      own = {column_.size(), columns.size(), columns.size()};
      column_.insert(column_.end(), columns.begin(), columns.end());
      values_.resize(9 * column_.size() + 1);   // the last column of a tensor is read four numbers wide
    }
    own.count = columns.size();
    std::copy(columns.begin(), columns.end(), column_.begin() + static_cast<std::ptrdiff_t>(own.first));
    std::copy_n(values, 9 * columns.size(), values_.begin() + static_cast<std::ptrdiff_t>(9 * own.first));
    if (2 * empty_ > column_.size()) close_up();
  }

  /// Σ_j K_ij d(j), of the columns j < end; d(j) is four numbers.
  template <class D>
  simd::Pack<Scalar, 4> product(int i, int end, D const& d) const noexcept {
    using Column = simd::Pack<Scalar, 4>;
    Place const& own = place(i);
    Scalar const* tensor = values_.data() + 9 * own.first;
    Column x{}, y{}, z{}, of;
    for (std::size_t k = own.first; k < own.first + own.count; ++k, tensor += 9) {
      if (column_[k] >= end) continue;
      Column const change = d(column_[k]);
      simd::load(of, tensor), x += change[0] * of;
      simd::load(of, tensor + 3), y += change[1] * of;
      simd::load(of, tensor + 6), z += change[2] * of;
    }
    return (x + y) + z;
  }

  /// The tensors in float, anew where `values_changed` or a row was set; and out += factor · K d of columns of four of those, their fourth rows 0.
  void round([[maybe_unused]] bool values_changed) {
    if constexpr (has_float_rows<Scalar>) {
      bool const was_built = std::exchange(is_built_, true);
      if (!was_built) floats_.build(size(), [this](int i) { return columns(i); });
      if (!was_built || values_changed) floats_.template round<Scalar>([this](int i) { return std::span(values(i), 9 * place(i).count); });
    }
  }
  void add_product(float factor, float const* d, float* out) const noexcept
    requires has_float_rows<Scalar>
  {
    floats_.add_product(factor, d, out, 0, size());
  }

 private:
  struct Place {
    std::size_t first, count, room;
  };
  Place const& place(int i) const noexcept { return places_[static_cast<std::size_t>(i)]; }
  void close_up() {
    TensorRows closed;
    closed.reserve(places_.size(), column_.size() - empty_);
    for (int i = 0; i < size(); ++i) closed.set(i, columns(i), values(i));
    *this = std::move(closed);
  }

  std::vector<Place> places_;
  std::vector<int> column_;
  std::vector<Scalar> values_;
  std::size_t empty_ = 0;
  BlockRows<float> floats_;
  bool is_built_ = false;   // floats_, of these rows
};

}  // namespace palpate::detail
