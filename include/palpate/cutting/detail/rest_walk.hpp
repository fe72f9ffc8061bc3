// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>
#include <utility>

namespace palpate::detail {

/// Walking over a body's undeformed surface: where a point of a triangle is, and over which edge a way leaves it.
/// Weights are barycentric, one for each corner of the triangle.

template <class Body>
using VectorOf = typename Body::Vector;

template <class Body>
VectorOf<Body> rest_point(Body const& body, int t, VectorOf<Body> const& w) {
  auto const c = body.tissue().surface().corners(t);
  return w[0] * body.tissue().rest_position(c[0]) + w[1] * body.tissue().rest_position(c[1]) + w[2] * body.tissue().rest_position(c[2]);
}

/// A point of a triangle of the surface.
template <RealScalar Scalar>
struct TrianglePoint {
  int triangle;
  Vector3<Scalar> barycentric;

  template <class Body>
  static TrianglePoint at_particle(Body const& body, int p) noexcept {
    auto const& surface = body.tissue().surface();
    int const t = surface.triangles_at(p).front();
    return {t, Vector3<Scalar>::Unit(surface.corner_of(t, p))};
  }
};

/// The smooth normal there; zero where the corners' normals cancel.
template <class Body>
VectorOf<Body> rest_normal(Body const& body, int t, VectorOf<Body> const& w) {
  auto const c = body.tissue().surface().corners(t);
  return (w[0] * body.reference_normal(c[0]) + w[1] * body.reference_normal(c[1]) + w[2] * body.reference_normal(c[2])).normalized();
}

/// The weights of a point, seen along the triangle's normal.
template <class Body>
VectorOf<Body> rest_weights(Body const& body, std::array<int, 3> const& c, VectorOf<Body> const& point) {
  using Vector = VectorOf<Body>;
  Vector const a = body.tissue().rest_position(c[0]) - point, b = body.tissue().rest_position(c[1]) - point,
               d = body.tissue().rest_position(c[2]) - point;
  Vector const n = (b - a).cross(d - a);
  return Vector(n.dot(b.cross(d)), n.dot(d.cross(a)), n.dot(a.cross(b))) / n.squaredNorm();
}
template <class Body>
VectorOf<Body> rest_weights(Body const& body, int t, VectorOf<Body> const& point) {
  return rest_weights(body, body.tissue().surface().corners(t), point);
}

template <class Body>
auto rest_length(Body const& body, int a, int b) {
  return (body.tissue().rest_position(a) - body.tissue().rest_position(b)).norm();
}

/// The distance of a corner from the edge that faces it.
template <class Body>
auto rest_height(Body const& body, int t, std::size_t corner) {
  auto const c = body.tissue().surface().corners(t);
  return 2 * body.tissue().triangle_area(t) / rest_length(body, c[(corner + 1) % 3], c[(corner + 2) % 3]);
}

/// The triangle that holds a point, from one on that held it before others were divided or took its number: on to whichever beside holds it better.
template <class Body>
int triangle_near(Body const& body, int t, VectorOf<Body> const& point) {
  using Scalar = typename Body::Scalar;
  auto const& surface = body.tissue().surface();
  constexpr Scalar outside = Scalar(-1e-4);   // more than rounding
  t = std::min(t, surface.triangle_count() - 1);
  Scalar best = rest_weights(body, t, point).minCoeff();
  for (int from = -1; best < outside && t != std::exchange(from, t);)
    for (int const corner : surface.corners(from))
      for (int const beside : surface.triangles_at(corner))
        if (Scalar const least = rest_weights(body, beside, point).minCoeff(); least > best) best = least, t = beside;
  return t;
}

/// A straight way from one point of the surface to another: in the plane that holds both and their mean normal.
template <RealScalar Scalar>
struct RestWay {
  using Vector = Vector3<Scalar>;

  RestWay(Vector const& start, Vector const& start_normal, Vector const& end, Vector const& end_normal)
      : from(start), way(end - start), side(way.cross(start_normal + end_normal)), length2(way.squaredNorm()) {}

  /// From the end to the start, in the same plane.
  RestWay reversed() const {
    RestWay back = *this;
    back.from = from + way, back.way = -way, back.side = -side;
    return back;
  }

  Scalar to_the_right(Vector const& point) const { return side.dot(point - from); }
  /// How far along the way, times its length: 0 … length2.
  Scalar progress(Vector const& point) const { return way.dot(point - from); }

  Vector from, way, side;
  Scalar length2;
};

/// The triangle at a particle that a way enters: its facing edge starts to the right of the way and ends to the left. Of several `preferred`, or where the
/// way is longest; −1 where there is none.
template <class Body>
int triangle_towards(Body const& body, int particle, RestWay<typename Body::Scalar> const& way, int preferred = -1) {
  using Scalar = typename Body::Scalar;
  using Vector = VectorOf<Body>;
  auto const& surface = body.tissue().surface();
  int best = -1;
  Scalar best_progress = 0;
  for (int const t : surface.triangles_at(particle)) {
    auto const c = surface.corners(t);
    auto const k = static_cast<std::size_t>(surface.corner_of(t, particle));
    Vector const p = body.tissue().rest_position(c[(k + 1) % 3]), q = body.tissue().rest_position(c[(k + 2) % 3]);
    Scalar const at_p = way.to_the_right(p), at_q = way.to_the_right(q);
    if (!(at_p >= 0 && at_q <= 0 && at_p > at_q)) continue;
    Scalar const progress = way.progress(p + at_p / (at_p - at_q) * (q - p));
    if (!(progress > 0)) continue;
    if (t == preferred) return t;
    if (best < 0 || progress > best_progress) best = t, best_progress = progress;
  }
  return best;
}

/// Where a way leaves a triangle: over the edge from corner `edge` to the next, at parameter s. No exit: edge < 0.
template <RealScalar Scalar>
struct RestExit {
  int edge = -1;
  Scalar s = 0;
  Scalar progress = 0;
  Vector3<Scalar> point = Vector3<Scalar>::Zero();
};

template <class Body>
RestExit<typename Body::Scalar> exit_of(Body const& body, int t, RestWay<typename Body::Scalar> const& way) {
  using Scalar = typename Body::Scalar;
  using Vector = VectorOf<Body>;
  auto const c = body.tissue().surface().corners(t);
  RestExit<Scalar> best;
  for (std::size_t k = 0; k < 3; ++k) {
    Vector const p = body.tissue().rest_position(c[k]), q = body.tissue().rest_position(c[(k + 1) % 3]);
    Scalar const at_p = way.to_the_right(p), at_q = way.to_the_right(q);
    if (!(at_p >= 0 && at_q <= 0 && at_p > at_q)) continue;   // a way out has the start of its edge to the right, the end to the left
    Scalar const s = at_p / (at_p - at_q);
    Vector const point = p + s * (q - p);
    Scalar const progress = way.progress(point);
    if (best.edge < 0 || progress > best.progress) best = {static_cast<int>(k), s, progress, point};
  }
  return best;
}

}  // namespace palpate::detail
