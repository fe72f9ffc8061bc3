// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/plane_set.hpp>
#include <palpate/mesh/normals.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace palpate {

namespace detail {

/// Local search: the triangle nearest to p found by moving from `triangle` to the nearest neighbour until none is nearer, at most so many
/// times.
template <class Body>
int walked_to(Body const& body, int triangle, Vector3<typename Body::Scalar> const& p) noexcept {
  using S = typename Body::Scalar;
  constexpr int max_steps = 64;
  auto const& surface = body.tissue().surface();
  auto const x = [&](int i) { return Vector3<S>(body.positions().col(i)); };
  auto const distance = [&](int t) {   // squared
    auto const c = surface.corners(t);
    return (closest_point_on_triangle<S>(p, x(c[0]), x(c[1]), x(c[2])).point - p).squaredNorm();
  };
  S least = distance(triangle);
  auto const corner = surface.corners(triangle);
  if (!(least > S(1e-6) * (x(corner[1]) - x(corner[0])).squaredNorm())) return triangle;   // on it
  for (int step = 0; step < max_steps; ++step) {
    int next = triangle;
    for (int const v : surface.corners(triangle))
      for (int const t : surface.triangles_at(v))
        if (S const d = distance(t); d < least) least = d, next = t;
    if (next == triangle) break;
    triangle = next;
  }
  return triangle;
}

}  // namespace detail

/// Up to three half-space constraints for a tip near a touched triangle: its facet, and the facets that the tip runs into first.
///   candidates  facets around the touched one, and around those nearest to the tip as projected on the planes so far, now and at `ahead`,
///               where the tip may be before the next planes arrive
///   concave     only folds towards the tool count: the touched facet lies in front of the candidate's plane, the candidate rises above its plane
///   order       next comes the plane that the projected tip is farthest behind, or least in front of, now or at `ahead`
/// Over a convex ridge the touched facet alone holds the tool: the extended plane of the other would exclude free space.
/// Units      m; `radius` of a ball-shaped tool: its centre is kept that far in front of each plane, or, where a contact presses it against the direction `pressed`
///            (of length one), so far from what it touches that way.
/// Source     \cite zilles1995
/// Invariant  The touched facet is the first plane; no two are less than 1.1° apart. Empty for a triangle without area.
/// Cost       O(triangles at the vertices on the way from the touched facet), at most 64 facets a search; two projections on at most two
///            planes; noexcept, no allocation.
/// Limits     A fold flatter than 1:100 does not count. Planes are unbounded. What a tip meets beyond `ahead` it meets late, by up to its
///            way until the next planes.
template <class Body>
PlaneSet<typename Body::Scalar> facet_planes(Body const& body, int triangle, Vector3<typename Body::Scalar> const& tip, typename Body::Scalar radius,
                                             Vector3<typename Body::Scalar> const& ahead,
                                             Vector3<typename Body::Scalar> const& pressed = Vector3<typename Body::Scalar>::Zero()) noexcept {
  using S = typename Body::Scalar;
  constexpr S flat = S(0.01), same = S(0.9998);
  auto const& surface = body.tissue().surface();
  auto const x = [&](int i) { return Vector3<S>(body.positions().col(i)); };
  auto const plane_of = [&](int t) {
    auto const c = surface.corners(t);
    ContactPlane<S> plane;
    plane.normal = triangle_normal<S>(x(c[0]), x(c[1]), x(c[2]));
    plane.offset = plane.normal.dot(x(c[0]));
    return plane;
  };
  // How far the corners of a triangle are in front of a plane, the least and the most.
  auto const heights = [&](int t, ContactPlane<S> const& plane) {
    struct { S least, most; } range{std::numeric_limits<S>::infinity(), -std::numeric_limits<S>::infinity()};
    for (int const v : surface.corners(t)) {
      S const height = plane.distance(x(v));
      range.least = std::min(range.least, height), range.most = std::max(range.most, height);
    }
    return range;
  };

  PlaneSet<S> planes;
  ContactPlane<S> const touched = plane_of(triangle);
  auto const corner = surface.corners(triangle);
  S edge = S(0);
  for (std::size_t k = 0; k < 3; ++k) edge = std::max(edge, (x(corner[k]) - x(corner[(k + 1) % 3])).norm());
  auto const in_front = [&](Vector3<S> const& normal) { return is_zero(pressed) ? radius : radius * normal.dot(pressed); };
  Vector3<S> const lowest = radius * (is_zero(pressed) ? touched.normal : pressed);   // of the ball, from its lowest point to its centre
  if (!planes.try_add({touched.normal, touched.offset + in_front(touched.normal)})) return planes;
  while (planes.count() < 3) {
    std::array<Vector3<S>, 2> const felt{planes.project(tip).point, planes.project(ahead).point};
    ContactPlane<S> next;
    S nearest = std::numeric_limits<S>::infinity();
    auto const look_around = [&](int from) {
      for (int const v : surface.corners(from))
        for (int const t : surface.triangles_at(v)) {
          if (t == triangle) continue;
          ContactPlane<S> plane = plane_of(t);
          if (is_zero(plane.normal)) continue;
          bool new_side = true;
          for (int k = 0; k < planes.count(); ++k) new_side = new_side && plane.normal.dot(planes[k].normal) < same;
          if (!new_side || heights(triangle, plane).least < -flat * flat * edge || !(heights(t, touched).most > flat * edge)) continue;
          plane.offset += in_front(plane.normal);
          if (S const height = std::min(plane.distance(felt[0]), plane.distance(felt[1])); height < nearest) nearest = height, next = plane;
        }
    };
    look_around(triangle);
    int seen = triangle;
    for (Vector3<S> const& p : felt)
      if (int const there = detail::walked_to(body, seen, Vector3<S>(p - lowest)); there != seen) look_around(seen = there);
    if (!(nearest < std::numeric_limits<S>::infinity()) || !planes.try_add(next)) break;
  }
  return planes;
}
template <class Body>
PlaneSet<typename Body::Scalar> facet_planes(Body const& body, int triangle, Vector3<typename Body::Scalar> const& tip,
                                             typename Body::Scalar radius = typename Body::Scalar(0)) noexcept {
  return facet_planes(body, triangle, tip, radius, tip);
}

}  // namespace palpate
