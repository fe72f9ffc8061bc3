// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/matrix.hpp>

#include <cstddef>

namespace palpate::detail {

/// A solid as a tool's tip sees it that cuts it: skin and the walls of wounds are surfaces of their own, each with a border where they meet. While it cuts, the
/// walls beside it are not what it touches.
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
  Vector reference_normal(int i) const { return body_.reference_normal(i); }
  Scalar home_diagonal() { return body_.home_diagonal(); }
  std::size_t restorations() const noexcept { return body_.restorations(); }
  std::size_t topology_revision() const noexcept { return body_.topology_revision(); }
  SurfacePoint<Scalar> nearest_point(Vector const& point, int hint = -1) {
    SurfacePoint<Scalar> const nearest = body_.nearest_point(point, hint);
    return cuts_ && nearest.found() && tissue().is_wound(nearest.triangle) ? SurfacePoint<Scalar>{} : nearest;
  }
  int triangle_across(int a, int b) const noexcept {
    int const here = tissue().surface().triangle_with_edge(a, b), beyond = body_.triangle_across(a, b);
    return beyond >= 0 && (here < 0 || tissue().is_wound(here) == tissue().is_wound(beyond)) ? beyond : -1;
  }

 private:
  Body& body_;
  bool cuts_;
};

}  // namespace palpate::detail
