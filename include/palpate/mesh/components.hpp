// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/detail/surface_sides.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <cstddef>
#include <vector>

namespace palpate {

/// The pieces of a surface or of a volume: two vertices belong together when a chain of elements joins them. Each piece is its
/// vertices in rising order; pieces come in the order of their smallest vertex. Vertices of no element belong to none.
/// Cost       nearly linear in elements and vertices.
/// Limits     Pieces that touch in a single shared vertex count as one.
template <detail::SimplexMesh Mesh>
std::vector<std::vector<int>> connected_components(Mesh const& mesh) {
  detail::check_corners(mesh);
  auto const& elements = mesh.elements();
  auto const vertices = static_cast<std::size_t>(mesh.points.cols());
  detail::DisjointSets joined(vertices);
  std::vector<char> used(vertices, 0);
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    for (Eigen::Index c = 0; c < elements.rows(); ++c) {
      used[static_cast<std::size_t>(elements(c, e))] = 1;
      joined.join(elements(0, e), elements(c, e));
    }
  return joined.sets([&](int v) { return used[static_cast<std::size_t>(v)] != 0; });
}

}  // namespace palpate
