// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace palpate {

/// The surface of all that is within `radius` of the segment from a to b: a rod, a rib, the shaft of an instrument.
///
///   Obstacle<double> rib(make_capsule<double>({-0.05, 0, 0}, {0.05, 0, 0}, 0.006));
///
/// Units      m.
/// Shapes     `around` points in a ring, a multiple of 4; edges about as long along the segment as around it; outward. a = b is a ball.
/// Errors     InvalidArgument for what is not finite, a radius that is not positive, and `around` that is not one of 4, 8, … 4000.
/// Limits     Its points lie on the capsule, so it holds less: volume and area converge with around⁻².
template <RealScalar Scalar>
TriangleMesh<Scalar> make_capsule(Vector3<Scalar> const& a, Vector3<Scalar> const& b, Scalar radius, int around = 16) {
  detail::require_finite("an end of a capsule", a, "m"), detail::require_finite("an end of a capsule", b, "m");
  detail::require_positive("the radius of a capsule", radius, "m");
  if (around < 4 || around > 4000 || around % 4 != 0) throw InvalidArgument(detail::message("a capsule of ", around, " points in a ring; give 4, 8, … 4000"));
  using Place = Vector3<double>;
  double const pi = std::numbers::pi, r = static_cast<double>(radius);
  Place const from = a.template cast<double>(), way = b.template cast<double>() - from;
  double const length = way.norm();
  Place const axis = length > 0 ? Place(way / length) : Place::UnitZ(), u = axis.unitOrthogonal(), v = axis.cross(u);
  std::vector<std::pair<double, double>> rings;   // along the axis from a, and how wide
  int const cap = around / 4, parts = length > 0 ? std::max(1, static_cast<int>(std::min(1e4, std::round(length * around / (2 * pi * r))))) : 0;
  for (int k = 1; k < cap; ++k) rings.emplace_back(-r * std::cos(pi / 2 * k / cap), r * std::sin(pi / 2 * k / cap));
  for (int k = 0; k <= parts; ++k) rings.emplace_back(length * k / std::max(1, parts), r);
  for (int k = cap - 1; k > 0; --k) rings.emplace_back(length + r * std::cos(pi / 2 * k / cap), r * std::sin(pi / 2 * k / cap));
  int const count = static_cast<int>(rings.size()), last = 1 + count * around;
  TriangleMesh<Scalar> mesh{Matrix3X<Scalar>(3, last + 1), Matrix<int, 3, Dynamic>(3, 2 * count * around)};
  auto const put = [&](int i, Place const& p) { mesh.points.col(i) = p.template cast<Scalar>(); };
  put(0, from - r * axis), put(last, from + (length + r) * axis);
  Eigen::Index t = 0;
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < around; ++i) {
      double const turn = 2 * pi * i / around;
      auto const [along, wide] = rings[static_cast<std::size_t>(k)];
      int const here = 1 + k * around + i, next = 1 + k * around + (i + 1) % around;
      put(here, from + along * axis + wide * (std::cos(turn) * u + std::sin(turn) * v));
      if (k == 0) mesh.triangles.col(t++) << 0, next, here;
      if (k + 1 == count) mesh.triangles.col(t++) << here, next, last;
      if (k + 1 < count) {
        mesh.triangles.col(t++) << here, next, next + around;
        mesh.triangles.col(t++) << here, next + around, here + around;
      }
    }
  return mesh;
}

}  // namespace palpate
