// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <cstddef>
#include <numeric>
#include <vector>

namespace palpate {

namespace detail {

template <int Corners>
std::vector<std::vector<int>> components_of(Matrix<int, Corners, Dynamic> const& elements, Eigen::Index vertices) {
  std::vector<int> parent(static_cast<std::size_t>(vertices));
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<char> used(parent.size(), 0);
  auto const root = [&](int v) {
    while (parent[static_cast<std::size_t>(v)] != v) {
      int& up = parent[static_cast<std::size_t>(v)];
      up = parent[static_cast<std::size_t>(up)];   // halve the path
      v = up;
    }
    return v;
  };
  for (Eigen::Index e = 0; e < elements.cols(); ++e) {
    for (int c = 0; c < Corners; ++c) used[static_cast<std::size_t>(elements(c, e))] = 1;
    for (int c = 1; c < Corners; ++c) {
      int const a = root(elements(0, e)), b = root(elements(c, e));
      if (a != b) parent[static_cast<std::size_t>(a < b ? b : a)] = a < b ? a : b;   // the smallest vertex stays the root
    }
  }
  std::vector<std::vector<int>> result;
  std::vector<std::size_t> slot(parent.size(), 0);
  for (int v = 0; v < static_cast<int>(parent.size()); ++v) {
    if (!used[static_cast<std::size_t>(v)]) continue;
    int const r = root(v);
    if (r == v) {
      slot[static_cast<std::size_t>(v)] = result.size();
      result.emplace_back();
    }
    result[slot[static_cast<std::size_t>(r)]].push_back(v);
  }
  return result;
}

}  // namespace detail

/// The pieces of a surface: two vertices belong together when a chain of triangles joins them. Each piece is its
/// vertices in rising order; pieces come in the order of their smallest vertex. Vertices of no triangle belong to none.
/// Cost       nearly linear in triangles and vertices.
/// Limits     Pieces that touch in a single shared vertex count as one.
template <RealScalar Scalar>
std::vector<std::vector<int>> connected_components(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.triangles, mesh.points.cols(), "triangle");
  return detail::components_of(mesh.triangles, mesh.points.cols());
}

/// The pieces of a volume, as for a surface.
template <RealScalar Scalar>
std::vector<std::vector<int>> connected_components(TetrahedralMesh<Scalar> const& mesh) {
  detail::check_corners(mesh.tetrahedra, mesh.points.cols(), "tetrahedron");
  return detail::components_of(mesh.tetrahedra, mesh.points.cols());
}

}  // namespace palpate
