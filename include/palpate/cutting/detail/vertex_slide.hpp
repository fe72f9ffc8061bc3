// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace palpate::detail {

/// What a slide did to the undeformed shape.
template <RealScalar Scalar>
struct Slide {
  Scalar moved = 0;         // m
  Scalar area_change = 0;   // m²
};

/// Slides a particle over the undeformed surface, within the triangles at it, by `wanted` or as much of that as is allowed:
/// no triangle's quality q = 4√3 A/Σ side² falls below 0.4, or at all where it is below, and no triangle turns by more than 30°.
template <RealScalar Scalar>
class VertexSlide {
 public:
  using Vector = Vector3<Scalar>;
  static constexpr Scalar min_quality = Scalar(0.4);
  static constexpr Scalar min_cosine = Scalar(0.8660254);

  template <class Body>
  static Slide<Scalar> move(Body& body, int p, Vector const& wanted) {
    auto const& tissue = body.tissue();
    auto const& surface = tissue.surface();
    Vector const at = tissue.rest_position(p);
    Scalar const distance = wanted.norm();
    if (!(distance > 64 * std::numeric_limits<Scalar>::epsilon() * (at.norm() + distance))) return {};
    Way const way = way_over(body, p, wanted);
    if (way.triangle < 0) return {};
    Scalar share = 1;
    if (!fits(body, p, at + way.step)) {
      share = 0;
      for (Scalar half = Scalar(0.5); half > Scalar(0.01); half /= 2)
        if (fits(body, p, at + (share + half) * way.step)) share += half;
    }
    if (!(share > 0)) return {};
    Scalar const before = area_around(body, p);
    Vector w = Vector::Zero();
    auto const k = static_cast<std::size_t>(surface.corner_of(way.triangle, p));
    w[static_cast<int>(k)] = 1 - share * (way.ahead + way.behind);
    w[static_cast<int>((k + 1) % 3)] = share * way.ahead;
    w[static_cast<int>((k + 2) % 3)] = share * way.behind;
    body.slide_particle(p, way.triangle, w);
    return {share * way.step.norm(), area_around(body, p) - before};
  }

 private:
  /// A step within a triangle at the particle, in shares of the edges to the next corner and to the one before.
  struct Way {
    int triangle = -1;
    Scalar ahead = 0, behind = 0;
    Vector step = Vector::Zero();
  };

  /// The triangle at p that a direction leads into, and the step in it that goes as far along the direction.
  template <class Body>
  static Way way_over(Body const& body, int p, Vector const& wanted) {
    auto const& surface = body.tissue().surface();
    Vector const at = body.tissue().rest_position(p);
    Way best;
    Scalar max_inside = -std::numeric_limits<Scalar>::infinity();
    for (int const t : surface.triangles_at(p)) {
      auto const c = surface.corners(t);
      auto const k = static_cast<std::size_t>(surface.corner_of(t, p));
      Vector const e = body.tissue().rest_position(c[(k + 1) % 3]) - at, f = body.tissue().rest_position(c[(k + 2) % 3]) - at;
      Scalar const ee = e.squaredNorm(), ff = f.squaredNorm(), ef = e.dot(f), we = wanted.dot(e), wf = wanted.dot(f);
      Scalar const determinant = ee * ff - ef * ef;
      if (!(determinant > 0)) continue;
      Scalar const ahead = (we * ff - wf * ef) / determinant, behind = (wf * ee - we * ef) / determinant;
      Scalar const inside = std::min(ahead, behind) / (std::abs(ahead) + std::abs(behind));
      if (!(inside > max_inside)) continue;
      Scalar const a = std::max(ahead, Scalar(0)), b = std::max(behind, Scalar(0));
      Vector const step = a * e + b * f;
      Scalar const along = step.dot(wanted);
      if (!(along > 0)) continue;
      Scalar const stretch = std::min(wanted.squaredNorm() / along, Scalar(1.5));   // the triangle is inclined to the direction
      max_inside = inside;
      best = {t, stretch * a, stretch * b, stretch * step};
    }
    // Not beyond the triangle: nine tenths of the way to its far edge.
    if (Scalar const sum = best.ahead + best.behind; sum > Scalar(0.9)) {
      Scalar const part = Scalar(0.9) / sum;
      best.ahead *= part, best.behind *= part, best.step *= part;
    }
    return best;
  }

  template <class Body>
  static bool fits(Body const& body, int p, Vector const& there) {
    auto const& surface = body.tissue().surface();
    Vector const at = body.tissue().rest_position(p);
    for (int const t : surface.triangles_at(p)) {
      auto const c = surface.corners(t);
      auto const k = static_cast<std::size_t>(surface.corner_of(t, p));
      Vector const q = body.tissue().rest_position(c[(k + 1) % 3]), r = body.tissue().rest_position(c[(k + 2) % 3]);
      Vector const before = (q - at).cross(r - at), after = (q - there).cross(r - there);
      if (!(after.dot(before) >= min_cosine * after.norm() * before.norm())) return false;
      Scalar const side = (q - r).squaredNorm();
      Scalar const quality_before = quality(before, side + (q - at).squaredNorm() + (r - at).squaredNorm());
      Scalar const quality_after = quality(after, side + (q - there).squaredNorm() + (r - there).squaredNorm());
      if (!(quality_after >= std::min(quality_before, min_quality))) return false;
    }
    return true;
  }

  static Scalar quality(Vector const& twice_area, Scalar squared_sides) {
    return 2 * std::numbers::sqrt3_v<Scalar> * twice_area.norm() / squared_sides;
  }

  template <class Body>
  static Scalar area_around(Body const& body, int p) {
    Scalar sum = 0;
    for (int const t : body.tissue().surface().triangles_at(p)) sum += body.tissue().triangle_area(t);
    return sum;
  }
};

}  // namespace palpate::detail
