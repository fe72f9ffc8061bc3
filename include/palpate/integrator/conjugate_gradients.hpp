// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Core>

#include <algorithm>

namespace palpate::detail {

/// Columns of conjugate gradients: `inverse` of the diagonal and the residual are given, the change is added to, the others are room.
template <class Inverse, class Change, class Residual, class Direction, class Product, class Scaled>
struct GradientColumns {
  Inverse& inverse;
  Change& change;
  Residual& residual;
  Direction& direction;
  Product& product;
  Scaled& scaled;
};
template <class I, class C, class R, class D, class P, class S>
GradientColumns(I&, C&, R&, D&, P&, S&) -> GradientColumns<I, C, R, D, P, S>;

/// Conjugate gradients with a diagonal preconditioner, A by multiply(direction, product), until the residual's squared norm, that of the inverse
/// diagonal, is not above `enough` or none are `left`; that norm. `negative` counts directions in which A is not positive: they end it.
template <RealScalar Scalar, class Multiply, class Columns>
Scalar conjugate_gradients(Multiply const& multiply, Columns const& at, Scalar enough, int& left, int& negative) {
  constexpr int block = 64;   // columns that stay in the fastest cache while they are worked on
  at.direction = at.inverse.cwiseProduct(at.residual);
  Scalar size = at.direction.cwiseProduct(at.residual).sum();
  for (; left > 0 && size > enough; --left) {
    multiply(at.direction, at.product);
    Scalar const curvature = at.direction.cwiseProduct(at.product).sum();
    if (!(curvature > 0)) {
      ++negative;
      break;
    }
    Scalar const length = size / curvature, last = size;
    size = 0;
    for (Eigen::Index first = 0; first < at.change.cols(); first += block) {
      Eigen::Index const count = std::min<Eigen::Index>(block, at.change.cols() - first);
      auto r = at.residual.middleCols(first, count);
      auto z = at.scaled.middleCols(first, count);
      at.change.middleCols(first, count) += length * at.direction.middleCols(first, count);
      r -= length * at.product.middleCols(first, count);
      z = at.inverse.middleCols(first, count).cwiseProduct(r);
      size += z.cwiseProduct(r).sum();
    }
    at.direction = at.scaled + size / last * at.direction;
  }
  return size;
}

}  // namespace palpate::detail
