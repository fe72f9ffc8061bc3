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

/// Area of a triangle, signed volume of a tetrahedron.
inline double content(Matrix<double, 3, 3> const& p) {
  Vector3<double> const u = p.col(1) - p.col(0), v = p.col(2) - p.col(0);
  return u.cross(v).norm() / 2;
}
inline double content(Matrix<double, 3, 4> const& p) {
  Vector3<double> const u = p.col(1) - p.col(0), v = p.col(2) - p.col(0), w = p.col(3) - p.col(0);
  return u.cross(v).dot(w) / 6;
}
template <SimplexMesh Mesh>
double contents(Mesh const& mesh) {
  check_corners(mesh);
  double sum = 0;
  for (Eigen::Index e = 0; e < mesh.elements().cols(); ++e) sum += content(corners_of(mesh.points, mesh.elements(), e));
  return sum;
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
  return static_cast<Scalar>(detail::contents(mesh));
}

/// Volume inside a closed surface [m³], by the divergence theorem: V = Σ a · (b × c) / 6.
/// Positive when the triangles face outward, negative when they face inward.
/// Limits     Means nothing for an open surface; `require_valid` tells.
template <RealScalar Scalar>
Scalar volume(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh);
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    sum += detail::corners_of(mesh.points, mesh.triangles, t).determinant();
  return static_cast<Scalar>(sum / 6);
}

/// Volume of all tetrahedra [m³], signed: an inverted one counts negative.
template <RealScalar Scalar>
Scalar volume(TetrahedralMesh<Scalar> const& mesh) {
  return static_cast<Scalar>(detail::contents(mesh));
}

/// Centre of mass [m] of a shell of even thickness, Σ area · centre / Σ area, or of a volume of even density.
template <detail::SimplexMesh Mesh>
auto centroid(Mesh const& mesh) {
  using Scalar = typename decltype(mesh.points)::Scalar;
  detail::check_corners(mesh);
  Vector3<double> sum = Vector3<double>::Zero();
  double total = 0;
  for (Eigen::Index e = 0; e < mesh.elements().cols(); ++e) {
    auto const p = detail::corners_of(mesh.points, mesh.elements(), e);
    double const content = detail::content(p);
    sum += content * p.rowwise().mean();
    total += content;
  }
  if (!(total > 0)) {
    bool const flat = mesh.elements().rows() == 3;
    throw InvalidMesh(detail::message(flat ? "the surface has no area" : "the tetrahedra have no volume", ", so no centroid; `validate` names its defects"));
  }
  return Vector3<Scalar>((sum / total + mesh.points.col(0).template cast<double>()).template cast<Scalar>());
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
template <detail::SimplexMesh Mesh>
auto mean_edge_length(Mesh const& mesh) {
  using Scalar = typename decltype(mesh.points)::Scalar;
  auto const sides = edges(mesh);
  if (sides.empty()) throw InvalidMesh("the mesh has no edge, so no mean edge length; give it at least one element");
  double sum = 0;
  for (auto const& e : sides) sum += (mesh.points.col(e[1]).template cast<double>() - mesh.points.col(e[0]).template cast<double>()).norm();
  return static_cast<Scalar>(sum / static_cast<double>(sides.size()));
}

/// χ = V − E + F over the vertices in use: 2 for a closed surface without holes, 1 for a disc, 0 for a torus or a
/// tube; the sum over its pieces otherwise. Unused vertices do not count.
template <RealScalar Scalar>
int euler_characteristic(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh);
  std::vector<char> used(static_cast<std::size_t>(mesh.points.cols()), 0);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int c = 0; c < 3; ++c) used[static_cast<std::size_t>(mesh.triangles(c, t))] = 1;
  auto const vertices = std::count(used.begin(), used.end(), char{1});
  return static_cast<int>(vertices - static_cast<std::ptrdiff_t>(edges(mesh).size()) + mesh.triangles.cols());
}

}  // namespace palpate
