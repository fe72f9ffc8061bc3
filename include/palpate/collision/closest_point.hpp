// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace palpate {

/// The point of a triangle that is nearest to a query.
///   point = barycentric.x() a + barycentric.y() b + barycentric.z() c
/// Invariant  barycentric coordinates are in [0, 1] and sum to 1 up to rounding; on an edge the opposite one is exactly 0,
///            at a corner they are exactly a unit vector and `point` is exactly the corner.
template <RealScalar Scalar>
struct TrianglePoint {
  Vector3<Scalar> barycentric;
  Vector3<Scalar> point;
  Scalar squared_distance;   // m²
};

/// The point of a segment that is nearest to a query: point = a + parameter (b − a), parameter in [0, 1].
template <RealScalar Scalar>
struct SegmentPoint {
  Scalar parameter;
  Vector3<Scalar> point;
  Scalar squared_distance;   // m²
};

/// Nearest point on the segment from a to b. A segment without length is its point a.
template <RealScalar Scalar>
SegmentPoint<Scalar> closest_point_on_segment(Vector3<Scalar> const& query, Vector3<Scalar> const& a,
                                              Vector3<Scalar> const& b) noexcept {
  Vector3<Scalar> const ab = b - a;
  Scalar const along = ab.dot(query - a);
  Scalar const length2 = ab.squaredNorm();
  SegmentPoint<Scalar> nearest{};
  if (!(along > 0)) {   // also when a = b
    nearest.point = a;
  } else if (along >= length2) {
    nearest.parameter = 1;
    nearest.point = b;
  } else {
    nearest.parameter = along / length2;
    nearest.point = a + nearest.parameter * ab;
  }
  nearest.squared_distance = (query - nearest.point).squaredNorm();
  return nearest;
}

namespace detail {

/// A triangle's closest point to the origin, without the point itself: what a search needs of each candidate.
template <RealScalar Scalar>
struct OriginPoint {
  Vector3<Scalar> barycentric;
  Vector3<Scalar> point;   // relative to the query
  Scalar squared_distance;
};

template <RealScalar Scalar>
OriginPoint<Scalar> on_edge(Vector3<Scalar> const& from, Vector3<Scalar> const& edge, Scalar t, int i, int j) noexcept {
  OriginPoint<Scalar> nearest;
  nearest.barycentric.setZero();
  nearest.barycentric[i] = 1 - t;
  nearest.barycentric[j] = t;
  nearest.point = from + t * edge;
  nearest.squared_distance = nearest.point.squaredNorm();
  return nearest;
}

template <RealScalar Scalar>
OriginPoint<Scalar> at_corner(Vector3<Scalar> const& corner, int i) noexcept {
  return {Vector3<Scalar>::Unit(i), corner, corner.squaredNorm()};
}

/// For triangles as thin as a segment, or shrunk to a point: the best of the three edges and of the face, where the face is measured
/// along its longest edge and across it, so that a small height spoils only the small coordinate.
template <RealScalar Scalar>
OriginPoint<Scalar> closest_on_thin(Vector3<Scalar> const& a, Vector3<Scalar> const& b, Vector3<Scalar> const& c) noexcept {
  // An edge that holds a foot is nearer than its corners, the face than its edges: what rounding makes equal goes to them.
  constexpr Scalar equal = 1 + 4 * std::numeric_limits<Scalar>::epsilon();
  Vector3<Scalar> const* const corner[3] = {&a, &b, &c};
  OriginPoint<Scalar> best = at_corner(a, 0);
  for (int i = 1; i < 3; ++i)
    if (corner[i]->squaredNorm() < best.squared_distance) best = at_corner(*corner[i], i);
  Scalar bound = best.squared_distance * equal;
  int longest = 0;
  Scalar longest2 = 0;
  for (int i = 0; i < 3; ++i) {
    int const j = (i + 1) % 3;
    Vector3<Scalar> const edge = *corner[j] - *corner[i];
    Scalar const along = -edge.dot(*corner[i]);
    Scalar const length2 = edge.squaredNorm();
    if (length2 > longest2) {
      longest2 = length2;
      longest = i;
    }
    if (!(along > 0) || along >= length2) continue;
    OriginPoint<Scalar> const candidate = on_edge(*corner[i], edge, along / length2, i, j);
    if (candidate.squared_distance > bound) continue;
    best = candidate;
    bound = best.squared_distance;
  }
  int const i = longest, j = (i + 1) % 3, k = (i + 2) % 3;
  Vector3<Scalar> const base = *corner[j] - *corner[i], side = *corner[k] - *corner[i];
  Scalar const side_along = base.dot(side) / longest2;
  Vector3<Scalar> const height = side - side_along * base;
  Scalar const along = -base.dot(*corner[i]) / longest2;
  Vector3<Scalar> const apart = *corner[i] + along * base, across = -apart;   // without its part along the base, which would drown the height
  Scalar const w_k = height.dot(across) / height.squaredNorm();
  Scalar const w_j = along - w_k * side_along;
  Scalar const w_i = 1 - w_j - w_k;
  if (w_i >= 0 && w_j >= 0 && w_k >= 0) {   // false for the quotients of a zero height
    Vector3<Scalar> const point = *corner[i] + w_j * base + w_k * side;
    if (point.squaredNorm() <= best.squared_distance * equal) {
      best.barycentric[i] = w_i;
      best.barycentric[j] = w_j;
      best.barycentric[k] = w_k;
      best.point = point;
      best.squared_distance = point.squaredNorm();
    }
  }
  return best;
}

/// Closest point of the triangle a b c to the origin. The corners are given relative to the query, so that rounding scales
/// with the distance from the query and not with the distance from the world's origin.
template <RealScalar Scalar>
OriginPoint<Scalar> closest_to_origin(Vector3<Scalar> const& a, Vector3<Scalar> const& b, Vector3<Scalar> const& c) noexcept {
  Vector3<Scalar> const ab = b - a, ac = c - a;
  Scalar const a_ab = -a.dot(ab), a_ac = -a.dot(ac);   // the query seen from a, along both edges
  if (a_ab <= 0 && a_ac <= 0) return at_corner(a, 0);
  Scalar const b_ab = -b.dot(ab), b_ac = -b.dot(ac);
  if (b_ab >= 0 && b_ac <= b_ab) return at_corner(b, 1);
  Scalar const c_ab = -c.dot(ab), c_ac = -c.dot(ac);
  if (c_ac >= 0 && c_ab <= c_ac) return at_corner(c, 2);

  // Signed areas of the triangles query-c-a and query-a-b seen along the normal, and what is left of the whole. Each cross product
  // holds an edge: then rounding stays small beside the area also for a short edge, unless the edges at a are nearly parallel.
  Vector3<Scalar> const normal = ab.cross(ac);
  Scalar const area = normal.squaredNorm();
  constexpr Scalar thin = Scalar(1e-3);   // squared sine of the angle at a: 1.8 degrees
  if (!(area > thin * ab.squaredNorm() * ac.squaredNorm())) return closest_on_thin(a, b, c);
  Scalar const in_b = normal.dot(ac.cross(a)), in_c = normal.dot(a.cross(ab)), in_a = area - in_b - in_c;

  if (in_c <= 0 && a_ab >= 0 && b_ab <= 0) return on_edge(a, ab, a_ab / (a_ab - b_ab), 0, 1);
  if (in_b <= 0 && a_ac >= 0 && c_ac <= 0) return on_edge(a, ac, a_ac / (a_ac - c_ac), 0, 2);
  Scalar const b_bc = b_ac - b_ab, c_bc = c_ab - c_ac;
  if (in_a <= 0 && b_bc >= 0 && c_bc >= 0) return on_edge(b, Vector3<Scalar>(c - b), b_bc / (b_bc + c_bc), 1, 2);
  if (!(in_a > 0 && in_b > 0 && in_c > 0)) return closest_on_thin(a, b, c);   // rounding left no region: near an edge

  OriginPoint<Scalar> inside;
  inside.barycentric.y() = in_b / area;
  inside.barycentric.z() = in_c / area;
  inside.barycentric.x() = std::max(Scalar(0), 1 - inside.barycentric.y() - inside.barycentric.z());
  inside.point = a + inside.barycentric.y() * ab + inside.barycentric.z() * ac;
  inside.squared_distance = inside.point.squaredNorm();
  return inside;
}

/// The foot point in world coordinates: exactly a corner where it is one.
template <RealScalar Scalar>
Vector3<Scalar> foot_point(Vector3<Scalar> const& query, Vector3<Scalar> const& barycentric, Vector3<Scalar> const& relative,
                           Vector3<Scalar> const& a, Vector3<Scalar> const& b, Vector3<Scalar> const& c) noexcept {
  if (barycentric.x() == 1) return a;
  if (barycentric.y() == 1) return b;
  if (barycentric.z() == 1) return c;
  return query + relative;
}

}  // namespace detail

/// Nearest point on the triangle a b c, in any of its seven regions: face, three edges, three corners.
/// Units      all coordinates in one length unit (m); the distance comes out squared.
/// Cost       no division for a corner, one for an edge or the face; noexcept, no allocation: allowed in the servo tick.
/// Accuracy   the distance to a few ε of the distance to the farthest corner, for all shapes down to segments and points.
/// Limits     areas are formed unscaled: lengths within 1e-9 … 1e9 m in float, 1e-70 … 1e70 m in double.
///            Not finite in, not finite (or meaningless) out.
template <RealScalar Scalar>
TrianglePoint<Scalar> closest_point_on_triangle(Vector3<Scalar> const& query, Vector3<Scalar> const& a, Vector3<Scalar> const& b,
                                                Vector3<Scalar> const& c) noexcept {
  auto const relative = detail::closest_to_origin<Scalar>(a - query, b - query, c - query);
  return {relative.barycentric, detail::foot_point<Scalar>(query, relative.barycentric, relative.point, a, b, c),
          relative.squared_distance};
}

}  // namespace palpate
