// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>

#include <concepts>
#include <cstddef>

namespace palpate::detail {

/// Whether one side of an edge is a border or a lip: nothing holds there, nothing is to cut.
template <class Body>
bool is_open_edge(Body const& body, int a, int b) noexcept {
  auto const& surface = body.tissue().surface();
  return surface.triangle_with_edge(a, b) < 0 || surface.triangle_with_edge(b, a) < 0;
}

/// Whether a particle, whose triangles are one fan, lies on a border or lip. In a closed fan every edge is the next of one triangle and the last
/// of another; in an open one the first and the last differ.
template <class Body>
bool is_on_border(Body const& body, int p) noexcept {
  auto const& surface = body.tissue().surface();
  std::ptrdiff_t difference = 0;
  for (int const t : surface.triangles_at(p)) {
    auto const c = surface.corners(t);
    auto const k = static_cast<std::size_t>(surface.corner_of(t, p));
    difference += c[(k + 1) % 3] - c[(k + 2) % 3];
  }
  return difference != 0;
}

/// Whether a particle on a border is where a wound ends: both its border edges lead to the same place, and there is surface all around.
template <class Body>
bool is_wound_end(Body const& body, int p) noexcept {
  auto const& surface = body.tissue().surface();
  int first = -1, last = -1;
  for (int const t : surface.triangles_at(p)) {
    auto const c = surface.corners(t);
    auto const k = static_cast<std::size_t>(surface.corner_of(t, p));
    int const ahead = c[(k + 1) % 3], behind = c[(k + 2) % 3];
    if (surface.triangle_with_edge(ahead, p) < 0) first = ahead;
    if (surface.triangle_with_edge(p, behind) < 0) last = behind;
  }
  return first >= 0 && last >= 0 && body.tissue().rest_position(first) == body.tissue().rest_position(last);
}

/// A border edge, as its triangle has it, that holds a point at s.
template <RealScalar Scalar>
struct BorderPlace {
  int a = -1, b = -1;
  Scalar s = 0;
};

/// Follows the border from a particle, straight, to the edge that holds a point.
template <class Body>
BorderPlace<typename Body::Scalar> border_edge_at(Body const& body, int particle, VectorOf<Body> const& point) {
  using Scalar = typename Body::Scalar;
  using Vector = VectorOf<Body>;
  constexpr int max_edges = 100;
  auto const& surface = body.tissue().surface();
  for (bool const ahead : {true, false}) {
    int at = particle;
    for (int k = 0; k < max_edges && at >= 0; ++k) {
      int next = -1;
      for (int const t : surface.triangles_at(at)) {
        auto const c = surface.corners(t);
        int const q = c[static_cast<std::size_t>((surface.corner_of(t, at) + (ahead ? 1 : 2)) % 3)];
        if ((ahead ? surface.triangle_with_edge(q, at) : surface.triangle_with_edge(at, q)) < 0) next = q;
      }
      if (next < 0) break;
      Vector const start = body.tissue().rest_position(at), edge = body.tissue().rest_position(next) - start, off = point - start;
      Scalar const s = off.dot(edge) / edge.squaredNorm();
      constexpr Scalar slack = std::same_as<Scalar, float> ? Scalar(1e-3) : Scalar(1e-6);
      if (!(s > 0) || (off - s * edge).norm() > slack * (edge.norm() + off.norm())) break;
      if (s <= 1) return ahead ? BorderPlace<Scalar>{at, next, s} : BorderPlace<Scalar>{next, at, 1 - s};
      at = next;
    }
  }
  return {};
}

}  // namespace palpate::detail
