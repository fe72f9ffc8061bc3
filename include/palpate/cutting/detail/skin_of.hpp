// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <cstddef>

namespace palpate::detail {

/// A solid as a tool's tip sees it that has cut it: skin and the walls of wounds are surfaces of their own, each with a border where they meet.
template <class Body>
class SkinOf {
 public:
  using Tissue = typename Body::Tissue;
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;

  explicit SkinOf(Body& body) noexcept : body_(body) {}

  Tissue const& tissue() const noexcept { return body_.tissue(); }
  auto positions() const noexcept { return body_.positions(); }
  Vector reference_position(int i) const { return body_.reference_position(i); }
  Vector reference_normal(int i) const { return body_.reference_normal(i); }
  Scalar home_diagonal() { return body_.home_diagonal(); }
  std::size_t restorations() const noexcept { return body_.restorations(); }
  std::size_t topology_revision() const noexcept { return body_.topology_revision(); }
  auto nearest_point(Vector const& point, int hint = -1) { return body_.nearest_point(point, hint); }
  int triangle_across(int a, int b) const noexcept {
    int const here = tissue().surface().triangle_with_edge(a, b), beyond = body_.triangle_across(a, b);
    return beyond >= 0 && (here < 0 || tissue().is_wound(here) == tissue().is_wound(beyond)) ? beyond : -1;
  }

 private:
  Body& body_;
};

}  // namespace palpate::detail
