// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <concepts>
#include <vector>

namespace palpate {

/// The vertices of a mesh whose place [m] meets a condition, in their order: what to nail, to load or to watch.
///   tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 1e-9; }));
template <class Mesh, class Condition>
  requires std::predicate<Condition const&, Vector3<typename decltype(Mesh::points)::Scalar>>
std::vector<int> vertices_where(Mesh const& mesh, Condition const& condition) {
  std::vector<int> found;
  for (int i = 0; i < static_cast<int>(mesh.points.cols()); ++i)
    if (condition(Vector3<typename decltype(Mesh::points)::Scalar>(mesh.points.col(i)))) found.push_back(i);
  return found;
}

}  // namespace palpate
