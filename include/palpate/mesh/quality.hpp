// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace palpate {

/// How well-shaped the triangles of a surface are. Small steps and stiff, uneven springs come from bad triangles.
///   q = 4√3 · area / Σ side²:   1 for an equilateral triangle, √3/2 for half a square, 0 for a needle or a cap
/// Units      angles [rad], lengths [m], q none.
template <RealScalar Scalar>
struct MeshQuality {
  Scalar smallest_angle, largest_angle;
  Scalar worst_quality, mean_quality;
  Scalar shortest_edge, longest_edge;
};

/// Throws `InvalidMesh` for a mesh without triangles.
template <RealScalar Scalar>
MeshQuality<Scalar> quality(TriangleMesh<Scalar> const& mesh) {
  detail::check_corners(mesh);
  if (mesh.triangles.cols() == 0) throw InvalidMesh("the mesh has no triangle, so no quality");
  constexpr double far = std::numeric_limits<double>::infinity();
  double smallest = far, largest = 0, worst = far, sum = 0, shortest = far, longest = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Vector3<double> p[3];
    for (int c = 0; c < 3; ++c) p[c] = mesh.points.col(mesh.triangles(c, t)).template cast<double>();
    double squares = 0, cross = 0;
    for (int c = 0; c < 3; ++c) {
      Vector3<double> const u = p[(c + 1) % 3] - p[c], v = p[(c + 2) % 3] - p[c];
      cross = u.cross(v).norm();
      double const angle = std::atan2(cross, u.dot(v)), length = u.norm();
      squares += length * length;
      smallest = std::min(smallest, angle), largest = std::max(largest, angle);
      shortest = std::min(shortest, length), longest = std::max(longest, length);
    }
    double const q = squares > 0 ? 2 * std::numbers::sqrt3 * cross / squares : 0;
    worst = std::min(worst, q);
    sum += q;
  }
  auto const to = [](double value) { return static_cast<Scalar>(value); };
  return {to(smallest), to(largest),  to(worst), to(sum / static_cast<double>(mesh.triangles.cols())),
          to(shortest), to(longest)};
}

}  // namespace palpate
