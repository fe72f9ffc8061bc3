// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace benchmarks {

/// A point of a ball of 10 cm with dents, so much further out [m].
inline palpate::Vector3<double> on_dented_ball(double polar, double azimuth, double out = 0) {
  palpate::Vector3<double> const way(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar));
  return (0.1 * (1 + 0.01 * std::sin(20 * way.x()) * std::cos(17 * way.y() + 1)) + out) * way;
}

/// That ball with so many vertices on circles of latitude: 1442, 3970, 5762 or 8664, as in a published table, or 10002, 30002, 100002, 1000002. Of another
/// number an empty one.
inline palpate::TriangleMesh<double> dented_ball(long vertices) {
  struct Size {
    long vertices;
    int rings, meridians;
  };
  constexpr std::array<Size, 8> sizes{{{1442, 30, 48}, {3970, 62, 64}, {5762, 60, 96}, {8664, 71, 122}, {10002, 80, 125}, {30002, 120, 250}, {100002, 250, 400},
                                       {1000002, 800, 1250}}};
  auto const size = std::find_if(sizes.begin(), sizes.end(), [&](Size const& s) { return s.vertices == vertices; });
  palpate::TriangleMesh<double> mesh;
  if (size == sizes.end()) return mesh;
  int const rings = size->rings, meridians = size->meridians;
  mesh.points.resize(3, 2 + rings * meridians);
  mesh.triangles.resize(3, 2 * meridians * rings);
  auto const at = [&](int r, int m) { return 2 + r * meridians + m % meridians; };
  mesh.points.col(0) = on_dented_ball(0, 0), mesh.points.col(1) = on_dented_ball(std::numbers::pi, 0);
  Eigen::Index t = 0;
  for (int m = 0; m < meridians; ++m) {
    mesh.triangles.col(t++) << 0, at(0, m), at(0, m + 1);
    mesh.triangles.col(t++) << 1, at(rings - 1, m + 1), at(rings - 1, m);
    for (int r = 0; r < rings; ++r) mesh.points.col(at(r, m)) = on_dented_ball(std::numbers::pi * (r + 1) / (rings + 1), 2 * std::numbers::pi * m / meridians);
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.triangles.col(t++) << at(r, m), at(r + 1, m), at(r + 1, m + 1);
      mesh.triangles.col(t++) << at(r, m), at(r + 1, m + 1), at(r, m + 1);
    }
  }
  return mesh;
}

}  // namespace benchmarks
