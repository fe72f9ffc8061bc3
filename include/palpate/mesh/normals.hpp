// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <cmath>

namespace palpate {

/// What a triangle counts for in the normal of its corner: its angle at the corner (independent of how the surface
/// is cut into triangles), or its area (cheaper).
enum class NormalWeight { angle, area };

/// (b − a) × (c − a): along the outward normal, twice the area long.
/// The scalar's own precision; `a`, `b`, `c` counter-clockwise seen from outside.
template <RealScalar Scalar>
Vector3<Scalar> triangle_area_vector(Vector3<Scalar> const& a, Vector3<Scalar> const& b,
                                     Vector3<Scalar> const& c) noexcept {
  Vector3<Scalar> const u = b - a, v = c - a;
  return u.cross(v);
}

/// The unit outward normal of the triangle a, b, c; zero when it has no area.
template <RealScalar Scalar>
Vector3<Scalar> triangle_normal(Vector3<Scalar> const& a, Vector3<Scalar> const& b,
                                Vector3<Scalar> const& c) noexcept {
  Vector3<Scalar> const n = triangle_area_vector(a, b, c);
  Scalar const largest = n.cwiseAbs().maxCoeff();   // scaled first: the square of a small area would vanish in float
  if (!(largest > Scalar(0))) return Vector3<Scalar>::Zero();
  Vector3<Scalar> const scaled = n / largest;
  return scaled.normalized();
}

/// The unit outward normal of one triangle of a mesh. Throws `OutOfRange`.
template <RealScalar Scalar>
Vector3<Scalar> triangle_normal(TriangleMesh<Scalar> const& mesh, int triangle) {
  detail::check_index("triangle", triangle, mesh.triangles.cols());
  for (int c = 0; c < 3; ++c) detail::check_index("corner", mesh.triangles(c, triangle), mesh.points.cols());
  return triangle_normal<Scalar>(mesh.points.col(mesh.triangles(0, triangle)),
                                 mesh.points.col(mesh.triangles(1, triangle)),
                                 mesh.points.col(mesh.triangles(2, triangle)));
}

/// Smooth unit normals at the vertices, one per column, outward.
///   n_i = Σ_t w_it n_t / |…|,   w_it = angle of triangle t at vertex i, or the area of t
/// Units      none; the result does not depend on the unit of the points.
/// Cost       O(n + m), one allocation.
/// Limits     zero where no triangle with area meets the vertex, or where the sum cancels (a fold without thickness).
template <RealScalar Scalar>
Matrix<Scalar, 3, Dynamic> vertex_normals(TriangleMesh<Scalar> const& mesh,
                                          NormalWeight weight = NormalWeight::angle) {
  detail::check_corners(mesh);
  Matrix<Scalar, 3, Dynamic> normals = Matrix<Scalar, 3, Dynamic>::Zero(3, mesh.points.cols());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Vector3<Scalar> p[3];
    for (int c = 0; c < 3; ++c) p[c] = mesh.points.col(mesh.triangles(c, t));
    if (weight == NormalWeight::area) {
      Vector3<Scalar> const n = triangle_area_vector(p[0], p[1], p[2]);
      for (int c = 0; c < 3; ++c) normals.col(mesh.triangles(c, t)) += n;
      continue;
    }
    Vector3<Scalar> const n = triangle_normal(p[0], p[1], p[2]);
    for (int c = 0; c < 3; ++c) {
      Vector3<Scalar> const u = p[(c + 1) % 3] - p[c], v = p[(c + 2) % 3] - p[c];
      Vector3<Scalar> const across = u.cross(v);
      normals.col(mesh.triangles(c, t)) += std::atan2(across.norm(), u.dot(v)) * n;
    }
  }
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    Vector3<Scalar> sum = normals.col(i);
    Scalar const largest = sum.cwiseAbs().maxCoeff();
    if (!(largest > Scalar(0))) continue;
    sum /= largest;
    normals.col(i) = sum.normalized();
  }
  return normals;
}

}  // namespace palpate
