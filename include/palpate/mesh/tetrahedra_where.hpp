// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>

#include <concepts>
#include <vector>

namespace palpate {

/// The tetrahedra whose centre [m], the mean of their corners, meets a condition, in their order: what to make of another material.
///   tissue.set_material(tetrahedra_where(mesh, [&](auto const& centre) { return (centre - nodule).norm() < 0.008; }), {.young = 1e5, .poisson = 0.45});
template <RealScalar Scalar, std::predicate<Vector3<Scalar>> Condition>
std::vector<int> tetrahedra_where(TetrahedralMesh<Scalar> const& mesh, Condition const& condition) {
  std::vector<int> found;
  for (int t = 0; t < static_cast<int>(mesh.tetrahedra.cols()); ++t) {
    Vector3<Scalar> sum = Vector3<Scalar>::Zero();
    for (int c = 0; c < 4; ++c) sum += mesh.points.col(mesh.tetrahedra(c, t));
    if (condition(Vector3<Scalar>(sum / 4))) found.push_back(t);
  }
  return found;
}

}  // namespace palpate
