// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/tetrahedral_adjacency.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Whether a border stays a manifold where tetrahedra go.
/// The triangles opposite a vertex, of the tetrahedra that stay there, are its link. Where each part of it that hangs together over edges is a disc or a
/// sphere, χ = vertices − edges + triangles = 1 or 2, the vertex may be split into one copy for each, and no edge or vertex of the border is shared by two
/// parts of it.
/// What hangs together over edges and is part of a sphere has χ = 1 or 2 exactly then: a hole, or two corners that touch, takes 1 off each.
class BorderRule {
 public:
  /// Into how many the vertex splits, 0: nothing is left there; −1: no.
  template <class IsTaken>
  int copies(TetrahedralAdjacency const& solid, int vertex, IsTaken const& is_taken) {
    left_.clear();
    for (int const t : solid.tetrahedra_at(vertex))
      if (!is_taken(t)) left_.push_back(t);
    int count = 0;
    for (auto first = left_.begin(), end = first; first != left_.end(); first = end, ++count) {
      int inner = 0;   // faces at the vertex between two of them, counted from both sides
      ++end;
      others_.clear();
      for (auto t = first; t != end; ++t) {
        auto const c = solid.corners(*t);
        for (int k = 0; k < 4; ++k) {
          int const v = c[static_cast<std::size_t>(k)], u = solid.neighbour(*t, k);
          if (v == vertex) continue;
          others_.push_back(v);
          if (u < 0 || is_taken(u)) continue;
          ++inner;
          if (auto const found = std::find(end, left_.end(), u); found != left_.end()) std::iter_swap(found, end++);
        }
      }
      std::sort(others_.begin(), others_.end());
      int const vertices = static_cast<int>(std::unique(others_.begin(), others_.end()) - others_.begin()), triangles = static_cast<int>(end - first);
      if (int const chi = vertices - (3 * triangles - inner / 2) + triangles; chi < 1) return -1;
    }
    return count;
  }

 private:
  std::vector<int> left_, others_;
};

}  // namespace palpate::detail
