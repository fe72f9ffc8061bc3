// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>

namespace palpate::detail {

enum class SpotKind { interior, edge, vertex };

/// What a point of a triangle snaps to: the vertex at `corner`, or the edge that faces `corner`, at s from the next corner on.
template <RealScalar Scalar>
struct Spot {
  SpotKind kind = SpotKind::interior;
  std::size_t corner = 0;
  Scalar s = 0;
};

/// Weights of the point of the triangle that a point beside it goes to.
template <RealScalar Scalar>
Vector3<Scalar> clamped(Vector3<Scalar> const& w) {
  Vector3<Scalar> const inside = w.cwiseMax(Scalar(0));
  return inside / inside.sum();
}

/// Whether the particles around have mass enough for an edge (a, b, s), or a triangle (t, weights), to be divided there. Tissue that does not say so
/// has.
template <class Body, class... Where>
bool has_mass_to_divide(Body const& body, Where const&... where) {
  if constexpr (RedistributesMass<typename Body::Tissue>)
    return body.tissue().has_mass_to_divide(where...);
  else
    return true;
}

/// When a point of a cut is taken for a vertex or put on an edge: nearer than a given length, or than a share of the edge or height it lies on,
/// in the undeformed shape; and from anywhere where there is too little mass for the pieces of the edge or triangle.
template <RealScalar Scalar>
class Snapping {
 public:
  explicit Snapping(Scalar distance = 0, Scalar share = 0) noexcept : distance_(distance), share_(std::max(share, min_share)) {}

  /// The same, but at least so near that triangles of a body with this mean edge [m] keep an area, however often they are cut.
  Snapping on(Scalar mean_edge) const noexcept {
    Snapping result = *this;
    result.distance_ = std::max(distance_, min_share * mean_edge);
    return result;
  }

  /// How near [m] to the end of something of this length [m].
  Scalar near(Scalar length) const noexcept { return std::max(distance_, share_ * length); }

  /// The point of a triangle with weights w: at a vertex, else at an edge, else inside.
  template <class Body>
  Spot<Scalar> spot_of(Body const& body, int t, Vector3<Scalar> const& w) const {
    auto const c = body.tissue().surface().corners(t);
    Vector3<Scalar> const point = rest_point(body, t, w);
    Spot<Scalar> spot;
    Scalar nearest = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      Scalar const distance = (body.tissue().rest_position(c[k]) - point).norm();
      Scalar const size = std::max(rest_length(body, c[k], c[(k + 1) % 3]), rest_length(body, c[k], c[(k + 2) % 3]));
      if (distance <= near(size) && (nearest < 0 || distance < nearest)) nearest = distance, spot = {SpotKind::vertex, k, Scalar(0)};
    }
    if (spot.kind == SpotKind::vertex) return spot;
    Scalar const mean_edge = (rest_length(body, c[0], c[1]) + rest_length(body, c[1], c[2]) + rest_length(body, c[2], c[0])) / 3;
    bool const anywhere = !has_mass_to_divide(body, t, w);
    for (std::size_t k = 0; k < 3; ++k) {
      Scalar const height = rest_height(body, t, k), distance = height * w[static_cast<int>(k)];
      if (!(anywhere || distance <= near(std::max(height, mean_edge / 2))) || (nearest >= 0 && distance >= nearest)) continue;
      Scalar const ahead = w[static_cast<int>((k + 1) % 3)], behind = w[static_cast<int>((k + 2) % 3)];
      nearest = distance, spot = {SpotKind::edge, k, behind / (ahead + behind)};
    }
    return spot.kind == SpotKind::edge ? on_edge(body, c, spot) : spot;
  }

 private:
  /// Shares of an edge, and of the body's mean edge, below which a point is not told from its end: smaller triangles have no reliable area.
  static constexpr Scalar min_share = std::same_as<Scalar, float> ? Scalar(5e-3) : Scalar(1e-4);

  /// The foot on an edge may be nearer to a corner than the point was: there it moves off, or is the corner.
  template <class Body>
  Spot<Scalar> on_edge(Body const& body, std::array<int, 3> const& c, Spot<Scalar> spot) const {
    std::size_t const from = (spot.corner + 1) % 3, to = (spot.corner + 2) % 3;
    if (std::min(spot.s, 1 - spot.s) <= min_share) return {SpotKind::vertex, spot.s <= Scalar(0.5) ? from : to, Scalar(0)};
    Scalar const length = rest_length(body, c[from], c[to]);
    Scalar const least = near(length) / (2 * length);
    spot.s = std::clamp(spot.s, std::min(Scalar(0.5), least), std::max(Scalar(0.5), 1 - least));
    if (!has_mass_to_divide(body, c[from], c[to], spot.s)) return {SpotKind::vertex, spot.s <= Scalar(0.5) ? from : to, Scalar(0)};
    return spot;
  }

  Scalar distance_, share_;
};

}  // namespace palpate::detail
