// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

// Sums run in double and relative to the first point, so that a float mesh far from the origin keeps its digits.

namespace palpate {

namespace detail {

/// The corners of element `e` as doubles, relative to the first point of the mesh.
template <RealScalar Scalar, int Corners>
Matrix<double, 3, Corners> corners_of(Matrix<Scalar, 3, Dynamic> const& points,
                                      Matrix<int, Corners, Dynamic> const& elements, Eigen::Index e) {
  Vector3<double> const origin = points.col(0).template cast<double>();
  Matrix<double, 3, Corners> p;
  for (int c = 0; c < Corners; ++c) p.col(c) = points.col(elements(c, e)).template cast<double>() - origin;
  return p;
}

inline double triangle_area(Matrix<double, 3, 3> const& p) {
  Vector3<double> const u = p.col(1) - p.col(0), v = p.col(2) - p.col(0);
  return u.cross(v).norm() / 2;
}

inline double tetrahedron_volume(Matrix<double, 3, 4> const& p) {
  Vector3<double> const u = p.col(1) - p.col(0), v = p.col(2) - p.col(0), w = p.col(3) - p.col(0);
  return u.cross(v).dot(w) / 6;
}

template <RealScalar Scalar>
double mean_length(Matrix<Scalar, 3, Dynamic> const& points, std::vector<std::array<int, 2>> const& sides) {
  if (sides.empty()) throw InvalidMesh("the mesh has no edge, so no mean edge length; give it at least one element");
  double sum = 0;
  for (auto const& e : sides)
    sum += (points.col(e[1]).template cast<double>() - points.col(e[0]).template cast<double>()).norm();
  return sum / static_cast<double>(sides.size());
}

}  // namespace detail

/// Area of one triangle [m²].
template <RealScalar Scalar>
Scalar triangle_area(Vector3<Scalar> const& a, Vector3<Scalar> const& b, Vector3<Scalar> const& c) noexcept {
  Vector3<Scalar> const u = b - a, v = c - a;
  return u.cross(v).norm() / Scalar(2);
}

/// Area of all triangles [m²].
template <RealScalar Scalar>
Scalar surface_area(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    sum += detail::triangle_area(detail::corners_of(mesh.points, mesh.triangles, t));
  return static_cast<Scalar>(sum);
}

/// Volume inside a closed surface [m³], by the divergence theorem: V = Σ a · (b × c) / 6.
/// Positive when the triangles face outward, negative when they face inward.
/// Limits     Means nothing for an open surface; `require_valid` tells.
template <RealScalar Scalar>
Scalar volume(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    sum += detail::corners_of(mesh.points, mesh.triangles, t).determinant();
  return static_cast<Scalar>(sum / 6);
}

/// Volume of all tetrahedra [m³], signed: an inverted one counts negative.
template <RealScalar Scalar>
Scalar volume(TetrahedralMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.tetrahedra, mesh.points.cols(), "tetrahedron");
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t)
    sum += detail::tetrahedron_volume(detail::corners_of(mesh.points, mesh.tetrahedra, t));
  return static_cast<Scalar>(sum);
}

/// Centre of mass of a shell of even thickness [m]: Σ area · centre / Σ area.
template <RealScalar Scalar>
Vector3<Scalar> centroid(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  Vector3<double> sum = Vector3<double>::Zero();
  double total = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    auto const p = detail::corners_of(mesh.points, mesh.triangles, t);
    double const area = detail::triangle_area(p);
    sum += area * p.rowwise().mean();
    total += area;
  }
  if (!(total > 0)) throw InvalidMesh("the surface has no area, so no centroid; `validate` names its defects");
  return (sum / total + mesh.points.col(0).template cast<double>()).template cast<Scalar>();
}

/// Centre of mass of a volume of even density [m].
template <RealScalar Scalar>
Vector3<Scalar> centroid(TetrahedralMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.tetrahedra, mesh.points.cols(), "tetrahedron");
  Vector3<double> sum = Vector3<double>::Zero();
  double total = 0;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto const p = detail::corners_of(mesh.points, mesh.tetrahedra, t);
    double const v = detail::tetrahedron_volume(p);
    sum += v * p.rowwise().mean();
    total += v;
  }
  if (!(total > 0)) throw InvalidMesh("the tetrahedra have no volume, so no centroid; `validate` names its defects");
  return (sum / total + mesh.points.col(0).template cast<double>()).template cast<Scalar>();
}

/// The smallest box along the axes around all points, used or not; empty for a mesh without points.
template <class Mesh>
auto bounding_box(Mesh const& mesh) {
  using Scalar = typename decltype(mesh.points)::Scalar;
  Eigen::AlignedBox<Scalar, 3> box;
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) box.extend(mesh.points.col(i));
  return box;
}

/// Mean length of the edges, each counted once [m].
template <RealScalar Scalar>
Scalar mean_edge_length(TriangleMesh<Scalar> const& mesh) {
  return static_cast<Scalar>(detail::mean_length(mesh.points, edges(mesh)));
}
template <RealScalar Scalar>
Scalar mean_edge_length(TetrahedralMesh<Scalar> const& mesh) {
  return static_cast<Scalar>(detail::mean_length(mesh.points, edges(mesh)));
}

/// χ = V − E + F over the vertices in use: 2 for a closed surface without holes, 1 for a disc, 0 for a torus or a
/// tube; the sum over its pieces otherwise. Unused vertices do not count.
template <RealScalar Scalar>
int euler_characteristic(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  std::vector<char> used(static_cast<std::size_t>(mesh.points.cols()), 0);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int c = 0; c < 3; ++c) used[static_cast<std::size_t>(mesh.triangles(c, t))] = 1;
  auto const vertices = std::count(used.begin(), used.end(), char{1});
  return static_cast<int>(vertices - static_cast<std::ptrdiff_t>(edges(mesh).size()) + mesh.triangles.cols());
}

}  // namespace palpate
