// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/block.hpp>

#include <cstdlib>

namespace palpate_test {

/// A block of n x n x n points, each moved at random by up to some quarter of an edge: the same ones every time.
template <class S>
palpate::TetrahedralMesh<S> distorted(int n, S spacing) {
  std::srand(3);
  auto mesh = palpate::make_block<S>(n, n, n, spacing, palpate::BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) += S(0.15) * spacing * palpate::Vector3<S>::Random();
  return mesh;
}

}  // namespace palpate_test
