// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace palpate {

/// The border edges that cuts have made: those that do not lie on the border of the uncut surface. {from, to} as in boundary_edges.
/// Both meshes are undeformed: body.rest_mesh() before the first cut, and now.
/// Cost       O(m log m) for m triangles; on a surface with a border also border edges then × now.
template <RealScalar Scalar>
std::vector<std::array<int, 2>> wound_edges(TriangleMesh<Scalar> const& uncut, TriangleMesh<Scalar> const& now) {
  auto const border = boundary_edges(uncut);
  auto edges = boundary_edges(now);
  std::erase_if(edges, [&](std::array<int, 2> const& edge) {
    Vector3<Scalar> const a = now.points.col(edge[0]), b = now.points.col(edge[1]);
    Scalar const near = Scalar(1e-3) * (b - a).norm();
    return std::any_of(border.begin(), border.end(), [&](std::array<int, 2> const& part) {
      Vector3<Scalar> const from = uncut.points.col(part[0]), way = uncut.points.col(part[1]) - from;
      auto const is_on_it = [&](Vector3<Scalar> const& p) {
        Scalar const s = std::clamp((p - from).dot(way) / way.squaredNorm(), Scalar(0), Scalar(1));
        return (p - from - s * way).norm() <= near;
      };
      return is_on_it(a) && is_on_it(b);
    });
  });
  return edges;
}

/// Walls below the lips of a wound, so that a surface looks as if it had an inside. For display: they have neither mass nor springs.
template <RealScalar Scalar>
struct WoundWalls {
  TriangleMesh<Scalar> mesh;   ///< seen from within the wound
  std::vector<int> lip;        ///< for each of its points, the vertex of the surface above it
  std::vector<Scalar> share;   ///< of the depth, for each of its points: 0 at the lip, 1 at the bottom
};

/// A wall goes down from each of `edges` along the inward smooth normals of the surface as it is now, `depth` [m] deep, in so many rows
/// of triangles. Edges that share a vertex share its points.
/// Errors     InvalidArgument for a depth that is not positive or rows below 1; OutOfRange for an edge of vertices that are not there.
template <RealScalar Scalar>
WoundWalls<Scalar> wound_walls(TriangleMesh<Scalar> const& mesh, std::vector<std::array<int, 2>> const& edges, Scalar depth, int rows = 1) {
  detail::require_positive("a wall", depth, "m deep");
  if (rows < 1) throw InvalidArgument(detail::message("a wall has ", rows, " rows; it must be at least 1"));
  std::vector<int> vertices;
  for (auto const& edge : edges)
    for (int const end : edge) {
      detail::check_index("vertex", end, mesh.points.cols());
      vertices.push_back(end);
    }
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  auto const normals = vertex_normals(mesh);
  WoundWalls<Scalar> walls;
  walls.mesh.points.resize(3, static_cast<Eigen::Index>(vertices.size()) * (rows + 1));
  walls.mesh.triangles.resize(3, static_cast<Eigen::Index>(edges.size()) * rows * 2);
  Eigen::Index point = 0;
  for (int const vertex : vertices)
    for (int row = 0; row <= rows; ++row) {
      Scalar const share = static_cast<Scalar>(row) / static_cast<Scalar>(rows);
      walls.mesh.points.col(point++) = mesh.points.col(vertex) - share * depth * normals.col(vertex);
      walls.lip.push_back(vertex), walls.share.push_back(share);
    }
  auto const first_of = [&](int vertex) {
    return static_cast<int>(std::lower_bound(vertices.begin(), vertices.end(), vertex) - vertices.begin()) * (rows + 1);
  };
  Eigen::Index t = 0;
  for (auto const& [from, to] : edges)
    for (int row = 0; row < rows; ++row) {
      int const a = first_of(from) + row, b = first_of(to) + row;
      walls.mesh.triangles.col(t++) << b, a, a + 1;
      walls.mesh.triangles.col(t++) << b, a + 1, b + 1;
    }
  return walls;
}

}  // namespace palpate
