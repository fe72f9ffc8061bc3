// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/integrator/concept.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <utility>

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

/// An iteration from a residual of this squared norm, that of the inverse diagonal, which becomes that of the next one: false where A does not have more than
/// `least` in the direction, and nothing is changed.
template <RealScalar Scalar, class Multiply, class Columns>
bool iterate(Multiply const& multiply, Columns const& at, Scalar least, Scalar& size) {
  constexpr int block = 64;   // columns that stay in the fastest cache while they are worked on
  multiply(at.direction, at.product);
  Scalar const curvature = at.direction.cwiseProduct(at.product).sum();
  if (!(curvature > least)) return false;
  Scalar const length = size / curvature, last = size;
  double sum = 0;   // of many floats
  for (Eigen::Index first = 0; first < at.change.cols(); first += block) {
    Eigen::Index const count = std::min<Eigen::Index>(block, at.change.cols() - first);
    auto r = at.residual.middleCols(first, count);
    auto z = at.scaled.middleCols(first, count);
    at.change.middleCols(first, count) += length * at.direction.middleCols(first, count);
    r -= length * at.product.middleCols(first, count);
    z = at.inverse.middleCols(first, count).cwiseProduct(r);
    sum += static_cast<double>(z.cwiseProduct(r).sum());
  }
  size = static_cast<Scalar>(sum);
  at.direction = at.scaled + size / last * at.direction;
  return true;
}

/// Conjugate gradients from this direction, and a residual of this squared norm: see below.
template <RealScalar Scalar, class Multiply, class Columns>
Scalar go_on(Multiply const& multiply, Columns const& at, Scalar size, Scalar enough, int& left, int& negative) {
  for (; left > 0 && size > enough; --left)
    if (!iterate(multiply, at, Scalar(0), size)) {
      ++negative;
      break;
    }
  return size;
}

/// Conjugate gradients with a diagonal preconditioner, A by multiply(direction, product), until the residual's squared norm, that of the inverse
/// diagonal, is not above `enough` or none are `left`; that norm. `negative` counts directions in which A is not positive: they end it.
template <RealScalar Scalar, class Multiply, class Columns>
Scalar conjugate_gradients(Multiply const& multiply, Columns const& at, Scalar enough, int& left, int& negative) {
  at.direction = at.inverse.cwiseProduct(at.residual);
  Scalar const size = at.direction.cwiseProduct(at.residual).sum();
  return go_on(multiply, at, size, enough, left, negative);
}

/// The same of a system that may have its tangent in float as well, by multiply(direction, product) of either: iterations in float, and after each few digits
/// the residual anew, in double, from which they go on. Where float can no more, double takes over with its direction: so where A has less than 10⁻⁴ of its
/// diagonal in a direction, of which float knows no three digits, and may have none where A is positive.
/// Source     \cite vandervorst2000, residual replacement.
template <class System, RealScalar Scalar, class Multiply, class Columns>
Scalar conjugate_gradients(System& system, Multiply const& multiply, Columns const& at, Scalar enough, int& left, int& negative) {
  if constexpr (HasFloatTangentProduct<System>) {
    constexpr float digits = 1e-6f, weak = 1e-4f;   // of the squared norm: three of the residual
    auto&& change = system.float_scratch(0);
    auto&& residual = system.float_scratch(1);
    auto&& inverse = system.float_scratch(2);
    auto&& product = system.float_scratch(3);
    auto&& direction = system.float_scratch(4);
    auto&& scaled = system.float_scratch(5);
    GradientColumns const floats{inverse, change, residual, direction, product, scaled};
    auto const squared = [&] { return at.residual.cwiseProduct(at.residual).cwiseProduct(at.inverse).sum(); };
    inverse = at.inverse.template cast<float>();
    Scalar size = squared();
    Scalar const length = std::sqrt(size);
    scaled.setZero(), direction.setZero();
    float along = 0;   // the direction's squared norm, that of the diagonal, from residual to residual; not finite where float does not reach
    for (bool goes_on = true; goes_on && left > 0 && size > enough;) {
      residual = (at.residual / length).template cast<float>();
      direction -= scaled;
      scaled = inverse.cwiseProduct(residual);
      direction += scaled;
      change.setZero();
      float square = scaled.cwiseProduct(residual).sum();
      along = std::max(square, along);
      float const target = std::max(static_cast<float>(enough / (length * length)), digits * square);
      for (; left > 0 && square > target; --left) {
        float const last = square;
        if (!(goes_on = iterate(multiply, floats, weak * along, square))) break;
        along = square + (square / last) * (square / last) * along;
      }
      at.direction = length * change.template cast<Scalar>();
      multiply(at.direction, at.product);
      at.change += at.direction, at.residual -= at.product;
      Scalar const last = std::exchange(size, squared());
      goes_on = goes_on && std::isfinite(along) && 4 * size < last;
    }
    if (left == 0 || !(size > enough)) return size;
    at.direction = at.inverse.cwiseProduct(at.residual);
    if (std::isfinite(along)) at.direction += length * (direction - scaled).template cast<Scalar>();
    return go_on(multiply, at, size, enough, left, negative);
  } else {
    return conjugate_gradients<Scalar>(multiply, at, enough, left, negative);
  }
}

}  // namespace palpate::detail
