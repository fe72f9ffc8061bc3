// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

namespace palpate {

/// A triangle surface: an open aggregate that any source can fill.
/// Shapes     points 3 × n, one vertex per column; triangles 3 × m, vertex indices per column.
/// Units      metres.
/// Invariant  corners counter-clockwise seen from outside; checked by `require_valid`, repaired by `repair`.
template <RealScalar Scalar>
struct TriangleMesh {
  Matrix<Scalar, 3, Dynamic> points;
  Matrix<int, 3, Dynamic> triangles;

  static constexpr char const* element = "triangle";
  auto& elements() noexcept { return triangles; }
  auto const& elements() const noexcept { return triangles; }
};

}  // namespace palpate
