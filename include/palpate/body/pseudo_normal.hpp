// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate::detail {

/// Twice the area of a triangle of the body as it is now, along its outward normal.
template <class Body>
typename Body::Vector facet_normal(Body const& body, int t) {
  auto const c = body.tissue().surface().corners(t);
  typename Body::Vector const a = body.positions().col(c[0]), u = body.positions().col(c[1]) - a, v = body.positions().col(c[2]) - a;
  return u.cross(v);
}

/// The direction that tells outside from inside at a nearest point of the surface: the mean of the facet normals there, weighted by angle. `on_border`
/// becomes true where the surface ends.
template <class Body>
typename Body::Vector pseudo_normal(Body const& body, int triangle, typename Body::Vector const& barycentric, bool& on_border) {
  using Vector = typename Body::Vector;
  using Scalar = typename Body::Scalar;
  auto const& surface = body.tissue().surface();
  auto const corners = surface.corners(triangle);
  int zero = 0, kept = -1, missing = -1;
  for (int k = 0; k < 3; ++k) {
    if (barycentric[k] > 0)
      kept = k;
    else
      missing = k, ++zero;
  }
  if (zero == 0) return facet_normal(body, triangle).normalized();
  Vector sum = Vector::Zero();
  if (zero == 1) {   // on an edge
    int const a = corners[static_cast<std::size_t>((missing + 1) % 3)], b = corners[static_cast<std::size_t>((missing + 2) % 3)];
    for (int const t : {triangle, body.triangle_across(a, b)}) {
      if (t < 0)
        on_border = true;
      else
        sum += facet_normal(body, t).normalized();
    }
    return sum.normalized();
  }
  int const v = corners[static_cast<std::size_t>(kept)];
  for (int const t : surface.triangles_at(v)) {
    auto const c = surface.corners(t);
    auto const k = static_cast<std::size_t>(surface.corner_of(t, v));
    Vector const vertex = body.positions().col(v), next = body.positions().col(c[(k + 1) % 3]), last = body.positions().col(c[(k + 2) % 3]);
    Vector const e = (next - vertex).normalized(), f = (last - vertex).normalized(), n = facet_normal(body, t).normalized();
    sum += std::acos(std::min(Scalar(1), std::max(Scalar(-1), e.dot(f)))) * n;
    if (surface.triangle_with_edge(c[(k + 1) % 3], v) < 0 || surface.triangle_with_edge(v, c[(k + 2) % 3]) < 0) on_border = true;
  }
  return sum.normalized();
}

}  // namespace palpate::detail
