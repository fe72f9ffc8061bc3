// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace palpate {

namespace detail {

template <int Corners>
std::vector<std::array<int, 2>> edges_of(Matrix<int, Corners, Dynamic> const& elements) {
  std::vector<std::uint64_t> const keys = edge_keys(elements);
  std::vector<std::array<int, 2>> result;
  result.reserve(keys.size());
  for (std::uint64_t const key : keys) result.push_back({key_first(key), key_second(key)});
  return result;
}

}  // namespace detail

/// The sides of all triangles, each once: {a, b} with a < b, in lexicographic order.
/// Cost       O(m log m) for m triangles.
template <RealScalar Scalar>
std::vector<std::array<int, 2>> edges(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  return detail::edges_of(mesh.triangles);
}

/// The sides of all tetrahedra, each once: {a, b} with a < b, in lexicographic order.
template <RealScalar Scalar>
std::vector<std::array<int, 2>> edges(TetrahedralMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.tetrahedra, mesh.points.cols(), "tetrahedron");
  return detail::edges_of(mesh.tetrahedra);
}

}  // namespace palpate
