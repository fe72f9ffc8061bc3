// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <concepts>
#include <type_traits>

namespace palpate {

/// 3 × n columns of which each has a zero behind it in memory: what a body hands its integrator.
template <RealScalar Scalar>
using StridedView = Eigen::Map<Matrix3X<Scalar>, Eigen::Unaligned, Eigen::OuterStride<4>>;
/// The same with the zeros as a fourth row, contiguous.
template <RealScalar Scalar>
using PaddedView = Eigen::Map<Matrix<Scalar, 4, Dynamic>>;

/// Columns with the zeros behind them, where they have some, so that arithmetic on whole arrays runs through memory without gaps and
/// fills registers; else the argument itself. An integrator that computes in padded_view(x) instead of x is faster and does the same.
template <class Columns>
decltype(auto) padded_view(Columns&& columns) noexcept {
  using Given = std::remove_cvref_t<Columns>;
  using Scalar = typename Given::Scalar;
  if constexpr (std::same_as<Given, StridedView<Scalar>>)
    return PaddedView<Scalar>(const_cast<Scalar*>(columns.data()), 4, columns.cols());
  else
    return static_cast<Columns>(columns);   // a reference stays one, a view is copied
}

}  // namespace palpate
