// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace palpate {

/// Where a plane cuts a volume: triangles that face the way of its normal, and for each the tetrahedron that it lies in, to colour it by.
template <RealScalar Scalar>
struct Section {
  TriangleMesh<Scalar> mesh;
  std::vector<int> tetrahedron;
};

/// The section of a volume with the plane through `point` across `normal` (any length); empty where they do not meet.
/// Cost       O(tetrahedra).
/// Errors     InvalidArgument: a normal of no length, or not finite. A corner that is no point: InvalidMesh.
/// Invariant  a face that lies in the plane comes once, of the tetrahedron on the side the normal points away from.
template <RealScalar Scalar>
Section<Scalar> section(TetrahedralMesh<Scalar> const& volume, Vector3<Scalar> const& point, Vector3<Scalar> const& normal) {
  Scalar const largest = normal.cwiseAbs().maxCoeff();   // the square of a normal may be no number
  if (!(largest > 0) || !is_finite(normal) || !is_finite(point))
    throw InvalidArgument(detail::message("a plane needs a point and a normal of some length; the normal is (", normal.x(), ", ", normal.y(), ", ", normal.z(), ")"));
  detail::check_corners(volume);
  Vector3<Scalar> const n = (normal / largest).normalized();
  auto const height = [&](int v) { return n.dot(volume.points.col(v) - point); };
  std::unordered_map<std::uint64_t, int> made;   // of an edge that is cut, or of a vertex in the plane
  std::vector<Vector3<Scalar>> points;
  std::vector<std::array<int, 3>> triangles;
  Section<Scalar> result;
  auto const cut = [&](int below, int above) {
    Scalar const low = -height(below), high = height(above);
    auto const [place, fresh] = made.try_emplace(detail::edge_key(high > 0 ? below : above, above), static_cast<int>(points.size()));
    if (fresh) {
      Vector3<Scalar> const a = volume.points.col(below), b = volume.points.col(above);
      points.push_back((high * a + low * b) / (low + high));
    }
    return place->second;
  };
  for (int t = 0; t < static_cast<int>(volume.tetrahedra.cols()); ++t) {
    std::array<int, 4> below, above;
    std::size_t lows = 0, highs = 0;
    for (int c = 0; c < 4; ++c) {
      int const v = volume.tetrahedra(c, t);
      height(v) < 0 ? below[lows++] = v : above[highs++] = v;
    }
    auto const add = [&](int a, int b, int c) {
      if (a == b || b == c || c == a) return;   // in a corner or an edge
      auto const p = [&](int i) -> Vector3<Scalar> const& { return points[static_cast<std::size_t>(i)]; };
      Scalar const side = n.dot(triangle_area_vector(p(a), p(b), p(c)));
      if (side == 0) return;
      triangles.push_back(side > 0 ? std::array{a, b, c} : std::array{a, c, b});
      result.tetrahedron.push_back(t);
    };
    if (lows == 1) add(cut(below[0], above[0]), cut(below[0], above[1]), cut(below[0], above[2]));
    if (lows == 3) add(cut(below[0], above[0]), cut(below[1], above[0]), cut(below[2], above[0]));
    if (lows == 2) {
      std::array const corners{cut(below[0], above[0]), cut(below[0], above[1]), cut(below[1], above[1]), cut(below[1], above[0])};
      add(corners[0], corners[1], corners[2]);
      add(corners[0], corners[2], corners[3]);
    }
  }
  result.mesh.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) result.mesh.points.col(static_cast<Eigen::Index>(i)) = points[i];
  result.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) result.mesh.triangles(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(i)) = triangles[i][c];
  return result;
}

}  // namespace palpate
