// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate {

/// The sides that belong to exactly one triangle: {from, to} as that triangle runs, so the surface lies to the left
/// seen from outside. Sorted. A closed surface has none.
/// Cost       O(m log m) for m triangles.
template <RealScalar Scalar>
std::vector<std::array<int, 2>> boundary_edges(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  std::vector<std::pair<std::uint64_t, std::uint64_t>> sides;   // undirected, directed
  sides.reserve(3 * static_cast<std::size_t>(mesh.triangles.cols()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int c = 0; c < 3; ++c) {
      int const a = mesh.triangles(c, t), b = mesh.triangles((c + 1) % 3, t);
      sides.emplace_back(detail::edge_key(a, b), detail::directed_key(a, b));
    }
  std::sort(sides.begin(), sides.end());
  std::vector<std::array<int, 2>> result;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].first == sides[i].first) ++end;
    if (end == i + 1) result.push_back({detail::key_first(sides[i].second), detail::key_second(sides[i].second)});
    i = end;
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// The vertices on the border of the surface, sorted, each once. A closed surface has none.
template <RealScalar Scalar>
std::vector<int> boundary_vertices(TriangleMesh<Scalar> const& mesh) {
  std::vector<int> result;
  for (auto const& edge : boundary_edges(mesh)) result.insert(result.end(), {edge[0], edge[1]});
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

/// The skin of a volume: every face that belongs to exactly one tetrahedron, outward. All points are kept, those inside
/// too, so that indices mean the same in both meshes; `repair` drops the unused ones where that is wanted.
/// Invariant  outward for tetrahedra of positive volume, in the order of the tetrahedra.
/// Cost       O(m log m) for m tetrahedra.
template <RealScalar Scalar>
TriangleMesh<Scalar> surface(TetrahedralMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.tetrahedra, mesh.points.cols(), "tetrahedron");
  static constexpr int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  struct Face {
    std::array<int, 3> sorted;
    std::int64_t place;   // 4 · tetrahedron + face
  };
  std::vector<Face> all;
  all.reserve(4 * static_cast<std::size_t>(mesh.tetrahedra.cols()));
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t)
    for (int f = 0; f < 4; ++f) {
      std::array<int, 3> corners{mesh.tetrahedra(faces[f][0], t), mesh.tetrahedra(faces[f][1], t),
                                 mesh.tetrahedra(faces[f][2], t)};
      std::sort(corners.begin(), corners.end());
      all.push_back({corners, 4 * static_cast<std::int64_t>(t) + f});
    }
  std::sort(all.begin(), all.end(), [](Face const& a, Face const& b) {
    return a.sorted != b.sorted ? a.sorted < b.sorted : a.place < b.place;
  });
  std::vector<std::int64_t> open;
  for (std::size_t i = 0; i < all.size();) {
    std::size_t end = i + 1;
    while (end < all.size() && all[end].sorted == all[i].sorted) ++end;
    if (end == i + 1) open.push_back(all[i].place);
    i = end;
  }
  std::sort(open.begin(), open.end());

  TriangleMesh<Scalar> result;
  result.points = mesh.points;
  result.triangles.resize(3, static_cast<Eigen::Index>(open.size()));
  for (std::size_t i = 0; i < open.size(); ++i)
    for (int c = 0; c < 3; ++c)
      result.triangles(c, static_cast<Eigen::Index>(i)) = mesh.tetrahedra(faces[open[i] % 4][c], open[i] / 4);
  return result;
}

}  // namespace palpate
