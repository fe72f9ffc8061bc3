// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace palpate {

/// A block of tissue: nx × ny × nz points. Vertex (i, j, k) has index (k·ny + j)·nx + i and lies at (i, j, k)·spacing. Each
/// cube is six tetrahedra around its diagonal from (i, j, k) to (i+1, j+1, k+1); on top every square has its diagonal from
/// lower left to upper right, as in `make_grid`.
/// Units      spacing [m].
/// Invariant  nx, ny, nz ≥ 2; spacing > 0 and finite; every tetrahedron has the volume spacing³ / 6.
template <RealScalar Scalar>
TetrahedralMesh<Scalar> make_block(int nx, int ny, int nz, Scalar spacing) {
  if (nx < 2 || ny < 2 || nz < 2)
    throw InvalidArgument(detail::message("a block of ", nx, " x ", ny, " x ", nz,
                                          " points has no tetrahedron; give at least 2 x 2 x 2"));
  if (static_cast<double>(nx) * ny * nz > std::numeric_limits<int>::max() / 6)
    throw InvalidArgument(
        detail::message("a block of ", nx, " x ", ny, " x ", nz, " points is too large for int indices"));
  if (!(spacing > Scalar(0)) || !std::isfinite(spacing))
    throw InvalidArgument(detail::message("block spacing is ", spacing, " m; give a positive length"));
  TetrahedralMesh<Scalar> mesh;
  mesh.points.resize(3, static_cast<Eigen::Index>(nx) * ny * nz);
  mesh.tetrahedra.resize(4, 6 * static_cast<Eigen::Index>(nx - 1) * (ny - 1) * (nz - 1));
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        mesh.points.col((k * ny + j) * nx + i) << Scalar(i) * spacing, Scalar(j) * spacing, Scalar(k) * spacing;
  int const stride[3] = {1, nx, nx * ny};
  static constexpr int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  static constexpr bool even[6] = {true, false, false, true, true, false};
  Eigen::Index t = 0;
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i)
        for (int s = 0; s < 6; ++s) {
          int const a = (k * ny + j) * nx + i, b = a + stride[orders[s][0]], c = b + stride[orders[s][1]],
                    d = c + stride[orders[s][2]];
          if (even[s]) mesh.tetrahedra.col(t++) << a, b, c, d;
          else mesh.tetrahedra.col(t++) << a, c, b, d;
        }
  return mesh;
}

}  // namespace palpate
