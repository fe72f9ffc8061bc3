// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/detail/surface_sides.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace palpate {

/// The sides that belong to exactly one triangle: {from, to} as that triangle runs, so the surface lies to the left
/// seen from outside. Sorted. A closed surface has none.
/// Cost       O(m log m) for m triangles.
template <RealScalar Scalar>
std::vector<std::array<int, 2>> boundary_edges(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh);
  std::vector<std::array<int, 2>> result;
  detail::for_each_edge(detail::sorted_sides(mesh.triangles, [](int) { return true; }), [&](detail::Side const* first, detail::Side const* last) {
    int const a = detail::key_first(first->edge), b = detail::key_second(first->edge);
    if (last - first == 1) result.push_back(first->rising ? std::array{a, b} : std::array{b, a});
  });
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
  detail::check_corners(mesh);
  std::vector<std::int64_t> open;
  detail::for_each_face(mesh.tetrahedra, [](int) { return true; }, [&](auto const* first, auto const* last) {
    if (last - first == 1) open.push_back(first->second);
  });
  std::sort(open.begin(), open.end());

  TriangleMesh<Scalar> result;
  result.points = mesh.points;
  result.triangles.resize(3, static_cast<Eigen::Index>(open.size()));
  for (std::size_t i = 0; i < open.size(); ++i)
    for (int c = 0; c < 3; ++c)
      result.triangles(c, static_cast<Eigen::Index>(i)) = mesh.tetrahedra(detail::outward_faces[open[i] % 4][c], open[i] / 4);
  return result;
}

}  // namespace palpate
