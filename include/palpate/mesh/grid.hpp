// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <cmath>
#include <limits>

namespace palpate {

/// A square piece of tissue: nx × ny points in the plane z = 0, normals +z. Vertex (i, j) has index j·nx + i and lies at
/// (i, j, 0)·spacing. Each square has one diagonal, lower left to upper right.
///   (i,j+1) ── (i+1,j+1)
///      │    ╱     │          two triangles: lower right first, then upper left
///    (i,j) ─── (i+1,j)
/// Units      spacing [m].
/// Invariant  nx, ny ≥ 2; spacing > 0 and finite.
template <RealScalar Scalar>
TriangleMesh<Scalar> make_grid(int nx, int ny, Scalar spacing) {
  if (nx < 2 || ny < 2)
    throw InvalidArgument(detail::message("a grid of ", nx, " x ", ny, " points has no triangle; give at least 2 x 2"));
  if (static_cast<long long>(nx) * ny > std::numeric_limits<int>::max() / 2)
    throw InvalidArgument(detail::message("a grid of ", nx, " x ", ny, " points is too large for int indices"));
  detail::require_positive("grid spacing", spacing, "m");
  TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, static_cast<Eigen::Index>(nx) * ny);
  mesh.triangles.resize(3, 2 * static_cast<Eigen::Index>(nx - 1) * (ny - 1));
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) mesh.points.col(j * nx + i) << Scalar(i) * spacing, Scalar(j) * spacing, Scalar(0);
  Eigen::Index t = 0;
  for (int j = 0; j + 1 < ny; ++j)
    for (int i = 0; i + 1 < nx; ++i) {
      int const a = j * nx + i, b = a + 1, c = a + nx, d = c + 1;
      mesh.triangles.col(t++) << a, b, d;
      mesh.triangles.col(t++) << a, d, c;
    }
  return mesh;
}

}  // namespace palpate
