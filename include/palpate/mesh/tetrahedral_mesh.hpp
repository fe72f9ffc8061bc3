// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

namespace palpate {

/// A volume of tetrahedra: an open aggregate that any source can fill.
/// Shapes     points 3 × n, one vertex per column; tetrahedra 4 × m, vertex indices per column.
/// Units      metres.
/// Invariant  positive volume: (b − a) × (c − a) · (d − a) > 0 for corners a, b, c, d; checked by `require_valid`.
template <RealScalar Scalar>
struct TetrahedralMesh {
  Matrix<Scalar, 3, Dynamic> points;
  Matrix<int, 4, Dynamic> tetrahedra;

  static constexpr char const* element = "tetrahedron";
  auto& elements() noexcept { return tetrahedra; }
  auto const& elements() const noexcept { return tetrahedra; }
};

}  // namespace palpate
