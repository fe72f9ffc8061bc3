// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// Who is joined to whom by an edge: the neighbours of every vertex in rising order, in one flat table.
///   neighbours of v = neighbour[start[v]] … neighbour[start[v + 1] − 1]
/// Build it once to ask for rings often; `vertex_rings` builds it for a single question.
/// Cost       O(m log m) to build for m elements, O(1) to ask.
/// Limits     A copy of the topology at the time of building: a cut does not show in it.
class VertexNeighbours {
 public:
  template <detail::SimplexMesh Mesh>
  explicit VertexNeighbours(Mesh const& mesh) {
    detail::check_corners(mesh);
    build(detail::edge_keys(mesh.elements()), mesh.points.cols());
  }

  int size() const noexcept { return static_cast<int>(start_.size()) - 1; }

  /// Precondition 0 ≤ vertex < size().
  std::span<int const> operator[](int vertex) const noexcept {
    std::size_t const v = static_cast<std::size_t>(vertex);
    return {neighbour_.data() + start_[v], start_[v + 1] - start_[v]};
  }

  /// rings[0] = seeds, rings[k] = the vertices k edges away from the nearest seed, in rising order. Always
  /// `rings + 1` entries; those past the end of the mesh are empty.
  std::vector<std::vector<int>> rings(std::vector<int> const& seeds, int rings) const {
    if (rings < 0)
      throw InvalidArgument(detail::message("number of rings is ", rings, "; ask for 0 (the seeds alone) or more"));
    std::vector<std::vector<int>> result(static_cast<std::size_t>(rings) + 1);
    std::vector<char> seen(start_.size() - 1, 0);
    for (int const seed : seeds) {
      detail::check_index("seed vertex", seed, size());
      if (!std::exchange(seen[static_cast<std::size_t>(seed)], char{1})) result[0].push_back(seed);
    }
    for (std::size_t k = 1; k < result.size() && !result[k - 1].empty(); ++k) {
      for (int const v : result[k - 1])
        for (int const w : (*this)[v])
          if (!std::exchange(seen[static_cast<std::size_t>(w)], char{1})) result[k].push_back(w);
      std::sort(result[k].begin(), result[k].end());
    }
    return result;
  }

 private:
  void build(std::vector<std::uint64_t> const& keys, Eigen::Index vertices) {
    start_.assign(static_cast<std::size_t>(vertices) + 1, 0);
    for (std::uint64_t const key : keys) {
      if (detail::key_first(key) == detail::key_second(key)) continue;   // a corner named twice is no neighbour
      ++start_[static_cast<std::size_t>(detail::key_first(key)) + 1];
      ++start_[static_cast<std::size_t>(detail::key_second(key)) + 1];
    }
    for (std::size_t v = 1; v < start_.size(); ++v) start_[v] += start_[v - 1];
    neighbour_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (int pass = 0; pass < 2; ++pass)   // sorted keys: the smaller neighbours of a vertex first, then the larger ones
      for (std::uint64_t const key : keys) {
        int const a = detail::key_first(key), b = detail::key_second(key);
        if (a == b) continue;
        if (pass == 0) neighbour_[next[static_cast<std::size_t>(b)]++] = a;
        else neighbour_[next[static_cast<std::size_t>(a)]++] = b;
      }
  }

  std::vector<std::size_t> start_;
  std::vector<int> neighbour_;
};

/// The vertices around some seeds, by their distance in edges: rings[0] = seeds (repeats dropped), rings[k] = those k
/// edges away from the nearest seed, in rising order; `rings + 1` entries.
/// Cost       O(m log m) for m elements.
template <class Mesh>
std::vector<std::vector<int>> vertex_rings(Mesh const& mesh, std::vector<int> const& seeds, int rings) {
  return VertexNeighbours(mesh).rings(seeds, rings);
}

/// The same around one vertex.
template <class Mesh>
std::vector<std::vector<int>> vertex_rings(Mesh const& mesh, int seed, int rings) {
  return VertexNeighbours(mesh).rings(std::vector<int>{seed}, rings);
}

}  // namespace palpate
