// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/reserve_and_prefault.hpp>

#include <array>
#include <cstddef>

namespace palpate {

/// A matrix of Rows × n that grows and shrinks at its last column, as particles and triangles do while tissue is cut. Its memory is
/// aligned for any register.
/// Cost       push_back is amortised O(Rows); nothing is allocated while n stays within what was reserved.
/// Limits     a view is void after the next push_back, resize or reserve.
template <class T, int Rows>
class Columns {
 public:
  using View = Eigen::Map<Matrix<T, Rows, Dynamic>>;
  using ConstView = Eigen::Map<Matrix<T, Rows, Dynamic> const>;
  using Column = Eigen::Map<Matrix<T, Rows, 1>>;

  Columns() = default;

  template <class Derived>
  explicit Columns(Eigen::MatrixBase<Derived> const& columns) {
    resize(static_cast<int>(columns.cols()));
    view() = columns;
  }

  int size() const noexcept { return static_cast<int>(data_.size()); }

  View view() noexcept { return View(numbers(), Rows, size()); }
  ConstView view() const noexcept { return ConstView(numbers(), Rows, size()); }

  Column operator[](int column) noexcept { return Column(data_[static_cast<std::size_t>(column)].data()); }
  Matrix<T, Rows, 1> operator[](int column) const noexcept { return Matrix<T, Rows, 1>(data_[static_cast<std::size_t>(column)].data()); }

  template <class Derived>
  void push_back(Eigen::MatrixBase<Derived> const& column) {
    Numbers value;   // the argument may point into this matrix
    for (int k = 0; k < Rows; ++k) value[static_cast<std::size_t>(k)] = column[k];
    data_.push_back(value);
  }

  void pop_back() noexcept { data_.pop_back(); }
  void resize(int columns) { data_.resize(static_cast<std::size_t>(columns)); }   // new columns are zero
  void reserve(int columns) { data_.reserve(static_cast<std::size_t>(columns)); }
  /// Reserves, and touches what it will grow into; see palpate::reserve_and_prefault.
  void reserve_and_prefault(int columns) { palpate::reserve_and_prefault(data_, static_cast<std::size_t>(columns)); }

 private:
  using Numbers = std::array<T, Rows>;   // of a column

  T* numbers() noexcept { return reinterpret_cast<T*>(data_.data()); }
  T const* numbers() const noexcept { return reinterpret_cast<T const*>(data_.data()); }

  HugePageVector<Numbers> data_;
};

}  // namespace palpate
