// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/haptics/plane_set.hpp>
#include <palpate/mesh/normals.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <limits>

namespace palpate {

/// Up to three planes that a tip near a touched triangle must not pass: its facet, and of the facets around it those that it can run into, the ones
/// that matter to this tip first.
///   counts      a facet around it where the surface folds towards the tool: the touched facet lies in front of its plane, and it rises in front of
///               the touched one's
///   next taken  of those the one that the tip, projected on the planes taken so far, is farthest behind, or least in front of
/// Over a ridge the surface folds away: there the touched facet alone holds the tool, since the other's plane, drawn out, would shut out free space.
/// Units      m; `radius` of a tool that is a ball: its centre is kept so far in front.
/// Source     \cite zilles1995
/// Invariant  The touched facet is the first plane; no two are less than 1.1° apart. Empty for a triangle without area.
/// Cost       O(triangles at three vertices), two projections on at most two planes; noexcept, no allocation.
/// Limits     A fold flatter than 1:100 counts as none. A facet that does not share a vertex with the touched one is not seen: the tip has to touch
///            nearer to it first. The planes are drawn out without end.
template <class Body>
PlaneSet<typename Body::Scalar> facet_planes(Body const& body, int triangle, Vector3<typename Body::Scalar> const& tip,
                                             typename Body::Scalar radius = typename Body::Scalar(0)) noexcept {
  using S = typename Body::Scalar;
  constexpr S flat = S(0.01), same = S(0.9998);
  auto const& surface = body.tissue().surface();
  auto const& x = body.positions();
  auto const plane_of = [&](int t) {
    auto const c = surface.corners(t);
    ContactPlane<S> plane;
    plane.normal = triangle_normal<S>(x.col(c[0]), x.col(c[1]), x.col(c[2]));
    plane.offset = plane.normal.dot(x.col(c[0]));
    return plane;
  };
  // How far the corners of a triangle are in front of a plane, the least and the most.
  auto const heights = [&](int t, ContactPlane<S> const& plane) {
    struct { S least, most; } range{std::numeric_limits<S>::infinity(), -std::numeric_limits<S>::infinity()};
    for (int const v : surface.corners(t)) {
      S const height = plane.distance(x.col(v));
      range.least = std::min(range.least, height), range.most = std::max(range.most, height);
    }
    return range;
  };

  PlaneSet<S> planes;
  ContactPlane<S> const touched = plane_of(triangle);
  auto const corner = surface.corners(triangle);
  S edge = S(0);
  for (std::size_t k = 0; k < 3; ++k) edge = std::max(edge, (x.col(corner[k]) - x.col(corner[(k + 1) % 3])).norm());
  if (!planes.try_add({touched.normal, touched.offset + radius})) return planes;
  while (planes.count() < 3) {
    Vector3<S> const felt = planes.project(tip).point;
    ContactPlane<S> next;
    S nearest = std::numeric_limits<S>::infinity();
    for (int const v : corner)
      for (int const t : surface.triangles_at(v)) {
        if (t == triangle) continue;
        ContactPlane<S> plane = plane_of(t);
        if (plane.normal.isZero(S(0))) continue;
        bool new_side = true;
        for (int k = 0; k < planes.count(); ++k) new_side = new_side && plane.normal.dot(planes[k].normal) < same;
        if (!new_side || heights(triangle, plane).least < -flat * flat * edge || !(heights(t, touched).most > flat * edge)) continue;
        plane.offset += radius;
        if (S const height = plane.distance(felt); height < nearest) nearest = height, next = plane;
      }
    if (!(nearest < std::numeric_limits<S>::infinity()) || !planes.try_add(next)) break;
  }
  return planes;
}

}  // namespace palpate
