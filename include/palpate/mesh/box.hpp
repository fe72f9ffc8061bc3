// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

namespace palpate {

/// The surface of a box along the axes, two triangles a side: a table, a plane that is as large as needed.
///
///   Obstacle<double> table(make_box<double>({-0.2, -0.2, -0.1}, {0.2, 0.2, 0}));
///
/// Units      m.
/// Shapes     8 points, the one of bit 0 at high x, of bit 1 at high y, of bit 2 at high z; 12 triangles, outward.
/// Errors     InvalidArgument where a corner is not finite, or `high` not higher.
template <RealScalar Scalar>
TriangleMesh<Scalar> make_box(Vector3<Scalar> const& low, Vector3<Scalar> const& high) {
  detail::require_finite("the low corner of a box", low, "m"), detail::require_finite("the high corner of a box", high, "m");
  for (int k = 0; k < 3; ++k)
    if (!(high[k] > low[k])) throw InvalidArgument(detail::message("a box from ", low[k], " to ", high[k], " m along ", "xyz"[k], "; its high corner must be higher"));
  TriangleMesh<Scalar> mesh{Matrix3X<Scalar>(3, 8), Matrix<int, 3, Dynamic>(3, 12)};
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) mesh.points(k, i) = (i >> k & 1) == 0 ? low[k] : high[k];
  mesh.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,   //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                 //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return mesh;
}

}  // namespace palpate
