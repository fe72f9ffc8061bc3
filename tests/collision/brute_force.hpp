// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

/// Yardsticks for the tests of this folder: slow, plain, in long double, sharing no code with the library's search.
namespace palpate_test {

using Long3 = Eigen::Matrix<long double, 3, 1>;

inline long double segment_distance(Long3 const& p, Long3 const& a, Long3 const& b) {
  long double const length2 = (b - a).squaredNorm();
  long double const t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0L, 1.0L) : 0.0L;
  return (p - a - t * (b - a)).norm();
}

/// Distance to the plane where the foot lies in the triangle, otherwise to the nearest edge.
inline long double triangle_distance(Long3 const& p, Long3 const& a, Long3 const& b, Long3 const& c) {
  long double best = std::min({segment_distance(p, a, b), segment_distance(p, b, c), segment_distance(p, c, a)});
  Long3 const n = (b - a).cross(c - a);
  bool const inside = n.dot((b - a).cross(p - a)) > 0 && n.dot((c - b).cross(p - b)) > 0 && n.dot((a - c).cross(p - c)) > 0;
  if (inside) best = std::min(best, std::abs(n.dot(p - a)) / n.norm());
  return best;
}

template <class Scalar>
long double surface_distance(palpate::TriangleMesh<Scalar> const& mesh, palpate::Vector3<Scalar> const& query) {
  Long3 const p = query.template cast<long double>();
  auto const at = [&](int i) -> Long3 { return mesh.points.col(i).template cast<long double>(); };
  long double best = std::numeric_limits<long double>::infinity();
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    auto const corner = mesh.triangles.col(t);
    best = std::min(best, triangle_distance(p, at(corner[0]), at(corner[1]), at(corner[2])));
  }
  return best;
}

/// The lowest index of the nearest vertex that a triangle uses.
template <class Scalar>
int nearest_used_vertex(palpate::TriangleMesh<Scalar> const& mesh, palpate::Vector3<Scalar> const& query) {
  int best = -1;
  Scalar best2 = std::numeric_limits<Scalar>::infinity();
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k) {
      int const i = mesh.triangles(k, t);
      Scalar const d2 = (mesh.points.col(i) - query).squaredNorm();
      if (d2 < best2 || (d2 == best2 && i < best)) {
        best2 = d2;
        best = i;
      }
    }
  return best;
}

/// The largest magnitude of a coordinate: what absolute rounding errors scale with.
template <class Scalar>
Scalar extent(palpate::TriangleMesh<Scalar> const& mesh) {
  return mesh.points.cwiseAbs().maxCoeff();
}

template <class Scalar>
palpate::Vector3<Scalar> random_in_box(palpate::Random& random, Scalar half) {
  auto const coordinate = [&] { return half * (2 * random.uniform<Scalar>() - 1); };
  Scalar const x = coordinate(), y = coordinate(), z = coordinate();
  return {x, y, z};
}

/// A sphere of `meridians` × `parallels` quads, each halved; the two rows at the poles are single triangles.
template <class Scalar>
palpate::TriangleMesh<Scalar> globe(int meridians, int parallels, Scalar radius) {
  palpate::TriangleMesh<Scalar> mesh;
  int const rings = parallels - 1;
  mesh.points.resize(3, 2 + rings * meridians);
  mesh.points.col(0) << 0, 0, radius;
  mesh.points.col(1) << 0, 0, -radius;
  double const pi = 3.14159265358979323846;
  for (int r = 0; r < rings; ++r)
    for (int m = 0; m < meridians; ++m) {
      double const polar = pi * (r + 1) / parallels, azimuth = 2 * pi * m / meridians;
      mesh.points.col(2 + r * meridians + m) << Scalar(radius * std::sin(polar) * std::cos(azimuth)),
          Scalar(radius * std::sin(polar) * std::sin(azimuth)), Scalar(radius * std::cos(polar));
    }
  mesh.triangles.resize(3, 2 * meridians * (parallels - 1));
  Eigen::Index t = 0;
  auto const at = [&](int r, int m) { return 2 + r * meridians + m % meridians; };
  for (int m = 0; m < meridians; ++m) {
    mesh.triangles.col(t++) << 0, at(0, m), at(0, m + 1);
    mesh.triangles.col(t++) << 1, at(rings - 1, m + 1), at(rings - 1, m);
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.triangles.col(t++) << at(r, m), at(r + 1, m), at(r + 1, m + 1);
      mesh.triangles.col(t++) << at(r, m), at(r + 1, m + 1), at(r, m + 1);
    }
  }
  return mesh;
}

/// A large smooth deformation: a few random waves, each moving the points by up to `amplitude`.
template <class Scalar>
void deform(palpate::TriangleMesh<Scalar>& mesh, palpate::Random& random, Scalar amplitude, Scalar wave_number) {
  auto const rest = mesh.points;
  for (int wave = 0; wave < 4; ++wave) {
    palpate::Vector3<Scalar> const k = random_in_box<Scalar>(random, wave_number);
    palpate::Vector3<Scalar> const push = random_in_box<Scalar>(random, amplitude);
    Scalar const phase = 6 * random.uniform<Scalar>();
    for (Eigen::Index i = 0; i < rest.cols(); ++i) mesh.points.col(i) += push * std::sin(k.dot(rest.col(i)) + phase);
  }
}

}  // namespace palpate_test
