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

/// The sides of all triangles or tetrahedra, each once: {a, b} with a < b, in lexicographic order.
/// Cost       O(m log m) for m elements.
template <detail::SimplexMesh Mesh>
std::vector<std::array<int, 2>> edges(Mesh const& mesh) {
  detail::check_corners(mesh);
  std::vector<std::array<int, 2>> result;
  for (std::uint64_t const key : detail::edge_keys(mesh.elements())) result.push_back({detail::key_first(key), detail::key_second(key)});
  return result;
}

}  // namespace palpate
