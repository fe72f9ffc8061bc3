// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/pseudo_normal.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>

namespace palpate::detail {

/// A solid as a tool's tip sees it that cuts it: skin and the walls of wounds are surfaces of their own, each with a border where they meet. While it cuts, it
/// touches skin alone, as if no walls were there: from one lip of an old wound to the other.
template <class Body>
class SkinOf {
 public:
  using Tissue = typename Body::Tissue;
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;

  SkinOf(Body& body, bool cuts) noexcept : body_(body), cuts_(cuts) {}

  Tissue const& tissue() const noexcept { return body_.tissue(); }
  auto positions() const noexcept { return body_.positions(); }
  Vector reference_position(int i) const { return body_.reference_position(i); }
  /// While it cuts, on a lip the skin's own: the walls do not lean it.
  Vector reference_normal(int i) const {
    if (!cuts_) return body_.reference_normal(i);
    Vector sum = Vector::Zero();
    bool is_on_lip = false;
    for (int const t : tissue().surface().triangles_at(i)) {
      is_on_lip = is_on_lip || tissue().is_wound(t);
      if (tissue().is_wound(t)) continue;
      auto const c = tissue().surface().corners(t);
      Vector const o = reference_position(c[0]);
      sum += (reference_position(c[1]) - o).cross(reference_position(c[2]) - o);
    }
    Scalar const length = sum.norm();
    return is_on_lip && length > 0 ? Vector(sum / length) : body_.reference_normal(i);
  }
  Scalar home_diagonal() { return body_.home_diagonal(); }
  std::size_t restorations() const noexcept { return body_.restorations(); }
  std::size_t topology_revision() const noexcept { return body_.topology_revision(); }
  SurfacePoint<Scalar> nearest_point(Vector const& point, int hint = -1) {
    SurfacePoint<Scalar> const nearest = body_.nearest_point(point, hint);
    return cuts_ && nearest.found() && tissue().is_wound(nearest.triangle) ? nearest_skin(point, nearest.distance, [](int) { return true; }) : nearest;
  }
  /// Of the skin that looks to the side of this direction, within some 70 degrees.
  SurfacePoint<Scalar> nearest_point_facing(Vector const& direction, Vector const& point) {
    return nearest_skin(point, 0, [&](int t) { return facet_normal(body_, t).normalized().dot(direction) > Scalar(0.3) * direction.norm(); });
  }
  int triangle_across(int a, int b) const noexcept {
    int const here = tissue().surface().triangle_with_edge(a, b), beyond = body_.triangle_across(a, b);
    return beyond >= 0 && (here < 0 || tissue().is_wound(here) == tissue().is_wound(beyond)) ? beyond : -1;
  }

 private:
  /// Of those triangles of the skin that count.
  template <class Counts>
  SurfacePoint<Scalar> nearest_skin(Vector const& point, Scalar distance, Counts const& counts) {
    for (Scalar reach = distance + body_.mean_edge();; reach *= 2) {
      SurfacePoint<Scalar> nearest;
      body_.visit_triangles_in_box(point - Vector::Constant(reach), point + Vector::Constant(reach), [&](int t) {
        if (tissue().is_wound(t) || !counts(t)) return;
        auto const c = tissue().surface().corners(t);
        auto const x = positions();
        auto const found = closest_point_on_triangle<Scalar>(point, x.col(c[0]), x.col(c[1]), x.col(c[2]));
        Scalar const far = std::sqrt(found.squared_distance);
        if (far < nearest.distance || (far == nearest.distance && t < nearest.triangle))   // in whatever order they come
          nearest = {.triangle = t, .barycentric = found.barycentric, .point = found.point, .distance = far};
      });
      if (nearest.distance <= reach || reach > 2 * distance + 2 * body_.home_diagonal()) return nearest;
    }
  }

  Body& body_;
  bool cuts_;
};

}  // namespace palpate::detail
