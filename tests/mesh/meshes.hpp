// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>

// Small meshes written out by hand, for the tests of this folder.

namespace palpate_test {

template <class Scalar>
palpate::TriangleMesh<Scalar> surface_of(std::initializer_list<std::array<double, 3>> points,
                                         std::initializer_list<std::array<int, 3>> triangles) {
  palpate::TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, static_cast<Eigen::Index>(points.size()));
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  Eigen::Index i = 0;
  for (auto const& p : points) mesh.points.col(i++) << Scalar(p[0]), Scalar(p[1]), Scalar(p[2]);
  i = 0;
  for (auto const& t : triangles) mesh.triangles.col(i++) << t[0], t[1], t[2];
  return mesh;
}

/// The corner of the unit cube at the origin: volume 1/6, outward.
template <class Scalar>
palpate::TriangleMesh<Scalar> tetrahedron() {
  return surface_of<Scalar>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
}

/// A torus around z of n × m quads, each cut in two: closed, one handle.
template <class Scalar>
palpate::TriangleMesh<Scalar> torus(int n, int m, double large, double small) {
  palpate::TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, n * m);
  mesh.triangles.resize(3, 2 * n * m);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < m; ++j) {
      double const u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / m, r = large + small * std::cos(v);
      mesh.points.col(i * m + j) << Scalar(r * std::cos(u)), Scalar(r * std::sin(u)), Scalar(small * std::sin(v));
      int const a = i * m + j, b = (i + 1) % n * m + j, c = (i + 1) % n * m + (j + 1) % m, d = i * m + (j + 1) % m;
      mesh.triangles.col(2 * a) << a, b, c;
      mesh.triangles.col(2 * a + 1) << a, c, d;
    }
  return mesh;
}

/// Both meshes as one, the second moved by `shift`.
template <class Scalar>
palpate::TriangleMesh<Scalar> together(palpate::TriangleMesh<Scalar> const& a, palpate::TriangleMesh<Scalar> const& b,
                                       palpate::Vector3<Scalar> const& shift) {
  palpate::TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, a.points.cols() + b.points.cols());
  mesh.points << a.points, b.points.colwise() + shift;
  mesh.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  mesh.triangles << a.triangles, (b.triangles.array() + static_cast<int>(a.points.cols())).matrix();
  return mesh;
}

}  // namespace palpate_test
