// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace palpate::detail {

/// Two vertex indices in one sortable word; the order of the words is the lexicographic order of the pairs.
constexpr std::uint64_t directed_key(int from, int to) noexcept {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(from)) << 32) | static_cast<std::uint32_t>(to);
}
constexpr std::uint64_t edge_key(int a, int b) noexcept { return a < b ? directed_key(a, b) : directed_key(b, a); }
constexpr int key_first(std::uint64_t key) noexcept { return static_cast<int>(key >> 32); }
constexpr int key_second(std::uint64_t key) noexcept { return static_cast<int>(key & 0xffffffffU); }

/// A mesh of triangles or of tetrahedra.
template <class Mesh>
concept SimplexMesh = requires(Mesh const& mesh) {
  mesh.points;
  mesh.elements();
  Mesh::element;
};

/// Throws `InvalidMesh` unless every corner names a point.
template <SimplexMesh Mesh>
void check_corners(Mesh const& mesh) {
  auto const& elements = mesh.elements();
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    for (Eigen::Index c = 0; c < elements.rows(); ++c)
      if (int const v = elements(c, e); v < 0 || v >= mesh.points.cols())
        throw InvalidMesh(message(Mesh::element, " ", e, " names vertex ", v, " but the mesh has ", mesh.points.cols(),
                                  " points; indices count from 0; `validate` lists every such element"));
}

/// Every side of every triangle or tetrahedron once, as sorted keys.
template <int Corners>
std::vector<std::uint64_t> edge_keys(Matrix<int, Corners, Dynamic> const& elements) {
  std::vector<std::uint64_t> keys;
  keys.reserve(static_cast<std::size_t>(elements.cols()) * (Corners * (Corners - 1) / 2));
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    for (int i = 0; i < Corners; ++i)
      for (int j = i + 1; j < Corners; ++j) keys.push_back(edge_key(elements(i, e), elements(j, e)));
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace palpate::detail
