// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/border_walk.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>
#include <palpate/cutting/detail/snapping.hpp>

#include <algorithm>
#include <cstddef>

namespace palpate::detail {

/// Where a straight way over a wound goes on beyond: all of it undeformed, where lips lie on each other.

/// The end of its edge that a place snaps to, as a place without b, or the place.
template <class Body>
BorderPlace<typename Body::Scalar> snapped(Body const& body, BorderPlace<typename Body::Scalar> const& place, Snapping<typename Body::Scalar> const& snapping) {
  using Scalar = typename Body::Scalar;
  Scalar const length = rest_length(body, place.a, place.b);
  if (std::min(place.s, 1 - place.s) * length > snapping.near(length) && has_mass_to_divide(body, place.a, place.b, place.s)) return place;
  return {place.s <= Scalar(0.5) ? place.a : place.b};
}

/// A way leads from a particle on a lip away from that: the same place of the other lip, where the way enters that; none, a < 0, where it does not.
template <class Body>
BorderPlace<typename Body::Scalar> place_across(Body const& body, int particle, RestWay<typename Body::Scalar> const& way,
                                                Snapping<typename Body::Scalar> const& snapping) {
  auto const& tissue = body.tissue();
  for (int copy = tissue.next_copy(particle); copy != particle; copy = tissue.next_copy(copy))
    if (triangle_towards(body, copy, way) >= 0) return {copy};
  for (int const t : tissue.surface().triangles_at(particle))
    for (int const beside : tissue.surface().corners(t)) {
      if (beside == particle || !is_open_edge(body, particle, beside)) continue;
      for (int copy = tissue.next_copy(beside); copy != beside; copy = tissue.next_copy(copy)) {
        auto place = border_edge_at(body, copy, tissue.rest_position(particle));
        if (place.a < 0 || !(way.to_the_right(tissue.rest_position(place.a)) <= 0 && way.to_the_right(tissue.rest_position(place.b)) >= 0)) continue;
        place = snapped(body, place, snapping);
        if (place.b >= 0 || triangle_towards(body, place.a, way) >= 0) return place;
      }
    }
  return {};
}

/// Where a way, followed back from a triangle at its end, comes to a border, and the triangle there.
template <RealScalar Scalar>
struct BorderExit {
  int triangle = -1;
  BorderPlace<Scalar> place;
};

/// `back`: from the end to the start. None, triangle < 0, where it comes to a triangle of the start, which `is_start(t)` says, or to its length.
template <class Body, class IsStart>
BorderExit<typename Body::Scalar> border_on_the_way(Body const& body, int t, RestWay<typename Body::Scalar> const& back, IsStart const& is_start) {
  using Scalar = typename Body::Scalar;
  auto const& surface = body.tissue().surface();
  Scalar progress = -back.length2;
  while (!is_start(t)) {
    auto const exit = exit_of(body, t, back);
    if (exit.edge < 0 || !(exit.progress > progress) || exit.progress > back.length2 * (1 + Scalar(1e-3))) break;
    progress = exit.progress;
    auto const c = surface.corners(t);
    int const a = c[static_cast<std::size_t>(exit.edge)], b = c[(static_cast<std::size_t>(exit.edge) + 1) % 3];
    int const next = surface.triangle_with_edge(b, a);
    if (next < 0) return {t, {a, b, exit.s}};
    t = next;
  }
  return {};
}

}  // namespace palpate::detail
