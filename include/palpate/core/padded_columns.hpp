// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/padded_view.hpp>

namespace palpate {

/// 3 × n columns that grow and shrink like Columns, each with a zero behind it in memory: a column is then one or two registers, and
/// arithmetic on all of them runs without gaps.
/// Invariant  the zeros stay zero: what writes through padded_view() sees to that.
/// Limits     a view is void after the next push_back, resize or reserve.
template <RealScalar Scalar>
class PaddedColumns {
 public:
  using ConstView = Eigen::Map<Matrix3X<Scalar> const, Eigen::Unaligned, Eigen::OuterStride<4>>;
  using Column = Eigen::Map<Vector3<Scalar>>;

  int size() const noexcept { return columns_.size(); }

  StridedView<Scalar> view() noexcept { return view(size()); }
  ConstView view() const noexcept { return ConstView(columns_.view().data(), 3, size()); }
  StridedView<Scalar> view(int first_columns) noexcept { return StridedView<Scalar>(columns_.view().data(), 3, first_columns); }
  PaddedView<Scalar> padded_view() noexcept { return columns_.view(); }
  typename Columns<Scalar, 4>::ConstView padded_view() const noexcept { return columns_.view(); }

  Column operator[](int column) noexcept { return Column(columns_[column].data()); }
  Vector3<Scalar> operator[](int column) const noexcept { return columns_[column].template head<3>(); }

  template <class Derived>
  void push_back(Eigen::MatrixBase<Derived> const& column) {
    Vector3<Scalar> const value = column;
    columns_.push_back(Matrix<Scalar, 4, 1>(value[0], value[1], value[2], 0));
  }
  void pop_back() noexcept { columns_.pop_back(); }
  void resize(int columns) { columns_.resize(columns); }   // new columns are zero
  void reserve(int columns) { columns_.reserve(columns); }
  void reserve_and_prefault(int columns) { columns_.reserve_and_prefault(columns); }
  void set_zero() noexcept { columns_.view().setZero(); }

 private:
  Columns<Scalar, 4> columns_;
};

}  // namespace palpate
