// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace palpate {

/// How the cubes of a block are divided.
enum class BlockPattern {
  kuhn,          ///< six tetrahedra around the diagonal from (i, j, k) to (i+1, j+1, k+1), of spacing³ / 6 each: all diagonals rise
  alternating,   ///< five, one in the middle of spacing³ / 3 and one of spacing³ / 6 in every second corner, mirrored from cube to cube: no bias
};

/// A block of tissue: nx × ny × nz points. Vertex (i, j, k) has index (k·ny + j)·nx + i and lies at (i, j, k)·spacing. In Kuhn's
/// pattern every square on top has its diagonal from lower left to upper right, as in `make_grid`.
/// Units      spacing [m].
/// Invariant  nx, ny, nz ≥ 2; spacing > 0 and finite.
/// Limits     linear elements in Kuhn's pattern bend stiffly and drift sideways, since all its diagonals lean one way.
template <RealScalar Scalar>
TetrahedralMesh<Scalar> make_block(int nx, int ny, int nz, Scalar spacing, BlockPattern pattern = BlockPattern::kuhn) {
  if (nx < 2 || ny < 2 || nz < 2)
    throw InvalidArgument(detail::message("a block of ", nx, " x ", ny, " x ", nz,
                                          " points has no tetrahedron; give at least 2 x 2 x 2"));
  if (static_cast<double>(nx) * ny * nz > std::numeric_limits<int>::max() / 6)
    throw InvalidArgument(
        detail::message("a block of ", nx, " x ", ny, " x ", nz, " points is too large for int indices"));
  detail::require_positive("block spacing", spacing, "m");
  int const parts = pattern == BlockPattern::kuhn ? 6 : 5;
  TetrahedralMesh<Scalar> mesh;
  mesh.points.resize(3, static_cast<Eigen::Index>(nx) * ny * nz);
  mesh.tetrahedra.resize(4, parts * static_cast<Eigen::Index>(nx - 1) * (ny - 1) * (nz - 1));
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        mesh.points.col((k * ny + j) * nx + i) << Scalar(i) * spacing, Scalar(j) * spacing, Scalar(k) * spacing;
  // Corner 4 z + 2 y + x of a cube is the one at (x, y, z).
  static constexpr int kuhn[][4] = {{0, 1, 3, 7}, {0, 5, 1, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 6, 4, 7}};
  static constexpr int alternating[][4] = {{0, 3, 6, 5}, {1, 3, 0, 5}, {2, 0, 3, 6}, {4, 0, 6, 5}, {7, 3, 5, 6}};
  auto const* const cube = pattern == BlockPattern::kuhn ? kuhn : alternating;
  Eigen::Index t = 0;
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i) {
        bool const mirrored = pattern == BlockPattern::alternating && (i + j + k) % 2 != 0;   // in x, which turns tetrahedra over
        for (int part = 0; part < parts; ++part, ++t) {
          for (int c = 0; c < 4; ++c) {
            int const v = cube[part][c] ^ (mirrored ? 1 : 0);
            mesh.tetrahedra(c, t) = ((k + (v >> 2)) * ny + j + (v >> 1 & 1)) * nx + i + (v & 1);
          }
          if (mirrored) std::swap(mesh.tetrahedra(2, t), mesh.tetrahedra(3, t));
        }
      }
  return mesh;
}

}  // namespace palpate
