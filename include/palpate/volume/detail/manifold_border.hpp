// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/detail/surface_sides.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Takes tetrahedra away until the border of a volume is a surface: where parts of it touch in an edge or a vertex only, the larger part stays; where the border
/// touches itself in a vertex, the tetrahedra there that have a face in the smaller fan go. Returns how many went. Vertices of no tetrahedron are left.
template <RealScalar Scalar>
int make_border_manifold(TetrahedralMesh<Scalar>& mesh) {
  auto const before = mesh.tetrahedra.cols();
  for (;;) {
    auto const border = surface(mesh);
    // Of each edge (a, b) or vertex (a, a) where the border is no surface, its tetrahedra.
    std::map<std::pair<int, int>, std::vector<int>> spots;
    std::vector<char> marked(static_cast<std::size_t>(mesh.points.cols()), 0);
    for (auto const& defect : validate(border, {.distinct_points = false, .no_unused_points = false})) {
      if (defect.kind != MeshDefectKind::non_manifold_edge && defect.kind != MeshDefectKind::non_manifold_vertex) continue;
      int const other = defect.kind == MeshDefectKind::non_manifold_edge ? defect.other : defect.index;
      spots[{std::min(defect.index, other), std::max(defect.index, other)}];
      marked[static_cast<std::size_t>(defect.index)] = marked[static_cast<std::size_t>(other)] = 1;
    }
    if (spots.empty()) break;
    for (int t = 0; t < static_cast<int>(mesh.tetrahedra.cols()); ++t)
      for (int i = 0; i < 4; ++i)
        for (int j = i; j < 4; ++j) {
          int const a = mesh.tetrahedra(i, t), b = mesh.tetrahedra(j, t);
          if (!marked[static_cast<std::size_t>(a)] || !marked[static_cast<std::size_t>(b)]) continue;
          if (auto const spot = spots.find({std::min(a, b), std::max(a, b)}); spot != spots.end()) spot->second.push_back(t);
        }

    std::vector<char> keep(static_cast<std::size_t>(mesh.tetrahedra.cols()), 1);
    auto const holds = [&](int t, int v) { return (mesh.tetrahedra.col(t).array() == v).any(); };
    for (auto const& [spot, around] : spots) {
      DisjointSets joined(around.size());
      for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t j = i + 1; j < around.size(); ++j) {
          int shared = 0;
          for (int c = 0; c < 4; ++c) shared += holds(around[j], mesh.tetrahedra(c, around[i]));
          if (shared == 3) joined.join(static_cast<int>(i), static_cast<int>(j));   // by a face, which holds the spot
        }
      auto const parts = joined.sets([](int) { return true; });
      if (parts.size() > 1) {
        std::vector<double> size;
        for (auto const& part : parts) {
          size.push_back(0);
          for (int const i : part) size.back() += content(corners_of(mesh.points, mesh.tetrahedra, around[static_cast<std::size_t>(i)]));
        }
        auto const largest = std::max_element(size.begin(), size.end()) - size.begin();
        for (std::size_t p = 0; p < parts.size(); ++p)
          if (static_cast<std::ptrdiff_t>(p) != largest)
            for (int const i : parts[p]) keep[static_cast<std::size_t>(around[static_cast<std::size_t>(i)])] = 0;
        continue;
      }
      // The border's triangles there, in fans.
      std::vector<std::array<int, 3>> faces;
      for (Eigen::Index f = 0; f < border.triangles.cols(); ++f)
        if ((border.triangles.col(f).array() == spot.first).any()) faces.push_back({border.triangles(0, f), border.triangles(1, f), border.triangles(2, f)});
      DisjointSets fans(faces.size());
      for (std::size_t i = 0; i < faces.size(); ++i)
        for (std::size_t j = i + 1; j < faces.size(); ++j)
          if (std::count_if(faces[i].begin(), faces[i].end(), [&](int v) { return std::find(faces[j].begin(), faces[j].end(), v) != faces[j].end(); }) > 1)
            fans.join(static_cast<int>(i), static_cast<int>(j));
      auto const list = fans.sets([](int) { return true; });
      auto const most = std::max_element(list.begin(), list.end(), [](auto const& a, auto const& b) { return a.size() < b.size(); });
      bool gone = false;
      for (auto fan = list.begin(); fan != list.end(); ++fan) {
        if (fan == most && list.size() > 1) continue;
        for (int const f : *fan)
          for (int const t : around)
            if (auto const& face = faces[static_cast<std::size_t>(f)]; holds(t, face[0]) && holds(t, face[1]) && holds(t, face[2]))
              keep[static_cast<std::size_t>(t)] = 0, gone = true;
      }
      if (!gone)
        for (int const t : around) keep[static_cast<std::size_t>(t)] = 0;
    }
    keep_elements(mesh.tetrahedra, keep);
  }
  return static_cast<int>(before - mesh.tetrahedra.cols());
}

}  // namespace palpate::detail
