// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// A geodesic sphere around the origin: the icosahedron with every edge cut into `frequency` parts along the great circle.
/// Units      radius [m].
/// Shapes     10·frequency² + 2 points on the sphere, 20·frequency² triangles, outward. frequency 4, 8, 16 is the
///            icosahedron halved two, three, four times.
/// Invariant  radius > 0 and finite; 1 ≤ frequency ≤ 1000. Angles between 50° and 75°.
/// Limits     The flat triangles enclose less than the ball: volume and area converge with frequency⁻².
template <RealScalar Scalar>
TriangleMesh<Scalar> make_sphere(Scalar radius, int frequency) {
  detail::require_positive("sphere radius", radius, "m");
  if (frequency < 1 || frequency > 1000)
    throw InvalidArgument(detail::message("sphere frequency is ", frequency, "; give 1 (icosahedron) … 1000"));
  double const g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vector3<double>> const corners = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g},
                                                {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  static constexpr int faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                       {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                       {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                       {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  double const arc = std::acos(1 / std::sqrt(5.0));   // between neighbouring corners
  int const f = frequency;
  std::vector<double> weight(static_cast<std::size_t>(f) + 1);
  for (int i = 0; i <= f; ++i) weight[static_cast<std::size_t>(i)] = std::sin(arc * i / f);

  // Points: 12 corners, then f − 1 on each of 30 edges, then the inside of each face.
  std::vector<std::uint64_t> sides;
  for (auto const& face : faces)
    for (int c = 0; c < 3; ++c)
      if (face[c] < face[(c + 1) % 3]) sides.push_back(detail::directed_key(face[c], face[(c + 1) % 3]));
  std::sort(sides.begin(), sides.end());
  TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, 10 * static_cast<Eigen::Index>(f) * f + 2);
  mesh.triangles.resize(3, 20 * static_cast<Eigen::Index>(f) * f);
  auto const on_edge = [&](int a, int b, int i) {   // i parts of the way from a to b
    auto const side = std::lower_bound(sides.begin(), sides.end(), detail::edge_key(a, b)) - sides.begin();
    return 12 + static_cast<int>(side) * (f - 1) + (a < b ? i : f - i) - 1;
  };
  Eigen::Index t = 0;
  int next = 12 + 30 * (f - 1);
  for (auto const& face : faces) {
    // Row j, place i: i + j ≤ f; weights f − i − j, i, j at the three corners.
    std::vector<int> name(static_cast<std::size_t>(f + 1) * static_cast<std::size_t>(f + 1));
    auto const at = [&](int i, int j) -> int& { return name[static_cast<std::size_t>(j * (f + 1) + i)]; };
    for (int j = 0; j <= f; ++j)
      for (int i = 0; i + j <= f; ++i) {
        int const k = f - i - j;
        int& v = at(i, j);
        if (k == f) v = face[0];
        else if (i == f) v = face[1];
        else if (j == f) v = face[2];
        else if (j == 0) v = on_edge(face[0], face[1], i);
        else if (i == 0) v = on_edge(face[0], face[2], j);
        else if (k == 0) v = on_edge(face[1], face[2], j);
        else v = next++;
        Vector3<double> const p = weight[static_cast<std::size_t>(k)] * corners[static_cast<std::size_t>(face[0])] +
                                  weight[static_cast<std::size_t>(i)] * corners[static_cast<std::size_t>(face[1])] +
                                  weight[static_cast<std::size_t>(j)] * corners[static_cast<std::size_t>(face[2])];
        mesh.points.col(v) = (static_cast<double>(radius) * p.normalized()).template cast<Scalar>();
      }
    for (int j = 0; j < f; ++j)
      for (int i = 0; i + j < f; ++i) {
        mesh.triangles.col(t++) << at(i, j), at(i + 1, j), at(i, j + 1);
        if (i + j + 1 < f) mesh.triangles.col(t++) << at(i + 1, j), at(i + 1, j + 1), at(i, j + 1);
      }
  }
  return mesh;
}

}  // namespace palpate
