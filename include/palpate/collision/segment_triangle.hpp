// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace palpate {

/// Where a segment and a triangle are nearest to each other.
///   on_segment = from + parameter (to − from),   on_triangle = Σ barycentric[k] · corner k
/// Invariant  parameter and weights are in [0, 1], and the weights sum to 1 up to rounding. Where the segment goes through the triangle both points are
///            the same, the distance is 0, and `crosses` is true.
template <RealScalar Scalar>
struct SegmentTrianglePoints {
  Scalar parameter = 0;
  Vector3<Scalar> barycentric = Vector3<Scalar>::Zero();
  Vector3<Scalar> on_segment = Vector3<Scalar>::Zero();
  Vector3<Scalar> on_triangle = Vector3<Scalar>::Zero();
  Scalar squared_distance = std::numeric_limits<Scalar>::infinity();   // m²
  bool crosses = false;
};

namespace detail {

/// Parameters of the nearest points of the straight lines a + s u and b + t v; false where the lines are parallel. The part of v across u is formed
/// first: of nearly parallel lines it keeps its digits, which the determinant of the normal equations loses.
template <RealScalar Scalar>
bool nearest_on_lines(Vector3<Scalar> const& a, Vector3<Scalar> const& u, Vector3<Scalar> const& b, Vector3<Scalar> const& v, Scalar& s, Scalar& t) noexcept {
  Scalar const length2 = u.squaredNorm();
  if (!(length2 > 0)) return false;
  Vector3<Scalar> const apart = b - a;
  Scalar const along = v.dot(u) / length2, ahead = apart.dot(u) / length2;
  Vector3<Scalar> const across = v - along * u, offset = apart - ahead * u;
  Scalar const across2 = across.squaredNorm();
  if (!(across2 > 0)) return false;
  t = -offset.dot(across) / across2;
  s = ahead + t * along;
  return true;
}

}  // namespace detail

/// The nearest points of the segment from → to and the triangle a b c: the best of the segment's ends, the triangle's corners, the three pairs of edge and
/// segment, and the place where the segment goes through the plane. Where several are equally near (parallel ones), it is any of them.
/// Units      all coordinates in one length unit (m); the distance comes out squared.
/// Cost       some 300 operations, no allocation, noexcept: allowed in the servo tick.
/// Accuracy   the distance to a few ε of the farthest coordinate difference, also for nearly parallel ones and for thin triangles. A segment without length
///            is a point, a triangle without area is its edges.
/// Limits     Not finite in, not finite (or meaningless) out.
template <RealScalar Scalar>
SegmentTrianglePoints<Scalar> closest_points(Vector3<Scalar> const& from, Vector3<Scalar> const& to, Vector3<Scalar> const& a, Vector3<Scalar> const& b,
                                             Vector3<Scalar> const& c) noexcept {
  using Vector = Vector3<Scalar>;
  std::array<Vector, 3> const corner{a - from, b - from, c - from};   // relative to the segment's begin, so that the world's origin costs no digits
  Vector const way = to - from;
  SegmentTrianglePoints<Scalar> best;
  // A line is nearer than its ends: what rounding makes equal goes to it, so that the foot keeps its digits.
  constexpr Scalar equal = 1 + 4 * std::numeric_limits<Scalar>::epsilon();
  auto const take = [&](Scalar parameter, Vector const& weights, Vector const& segment, Vector const& triangle, Scalar slack = 1) {
    Scalar const squared = (segment - triangle).squaredNorm();
    if (!(squared < slack * best.squared_distance)) return;
    best.parameter = parameter, best.barycentric = weights, best.on_segment = segment, best.on_triangle = triangle, best.squared_distance = squared;
  };

  for (int k = 0; k < 2; ++k) {
    Vector const end = Scalar(k) * way;
    auto const foot = detail::closest_to_origin<Scalar>(corner[0] - end, corner[1] - end, corner[2] - end);
    take(Scalar(k), foot.barycentric, end, end + foot.point);
  }
  for (int k = 0; k < 3; ++k) {
    auto const i = static_cast<std::size_t>(k);
    auto const near = closest_point_on_segment<Scalar>(corner[i], Vector::Zero(), way);
    if (near.parameter > 0 && near.parameter < 1) take(near.parameter, Vector::Unit(k), near.point, corner[i], equal);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    std::size_t const j = (i + 1) % 3;
    Scalar s = 0, t = 0;
    Vector const edge = corner[j] - corner[i];
    if (!detail::nearest_on_lines<Scalar>(Vector::Zero(), way, corner[i], edge, s, t) || !(s > 0 && s < 1 && t > 0 && t < 1)) continue;
    Vector weights = Vector::Zero();
    weights[static_cast<int>(i)] = 1 - t, weights[static_cast<int>(j)] = t;
    take(s, weights, s * way, corner[i] + t * edge, equal);
  }
  Vector const normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  Scalar const above = -normal.dot(corner[0]), beyond = normal.dot(way - corner[0]);   // of the segment's ends
  if ((above > 0 && beyond < 0) || (above < 0 && beyond > 0)) {
    Scalar const parameter = above / (above - beyond);
    Vector const point = parameter * way;
    auto const foot = detail::closest_to_origin<Scalar>(corner[0] - point, corner[1] - point, corner[2] - point);
    Scalar const size = way.cwiseAbs().maxCoeff() + std::max({corner[0].cwiseAbs().maxCoeff(), corner[1].cwiseAbs().maxCoeff(), corner[2].cwiseAbs().maxCoeff()});
    Scalar const rounding = 16 * std::numeric_limits<Scalar>::epsilon() * size;
    if (foot.squared_distance <= rounding * rounding) best = {parameter, foot.barycentric, point, point, 0, true};
  }
  best.on_segment += from, best.on_triangle += from;
  return best;
}

}  // namespace palpate
