// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>

// Smooth implicit shapes, negative inside, near their surface close to a distance. Only + − × ÷ √, so that every C library gives
// the same surface.

namespace palpate::detail {

inline double ellipsoid(Vector3<double> const& p, Vector3<double> const& centre, Vector3<double> const& radii) {
  Vector3<double> const a = (p - centre).cwiseQuotient(radii), b = a.cwiseQuotient(radii);
  double const k = a.norm(), slope = b.norm();
  return slope > 0 ? k * (k - 1) / slope : -radii.minCoeff();
}

/// A round body along `axis` (unit) whose girth falls from (1 + taper) to (1 − taper) times `girth` on the way.
inline double pear(Vector3<double> const& p, Vector3<double> const& centre, Vector3<double> const& axis, double girth,
                   double half_length, double taper) {
  Vector3<double> const d = p - centre;
  double const t = d.dot(axis), rho = (d - t * axis).norm();
  double const w = girth * (1 - taper * std::clamp(t / half_length, -1.0, 1.0));
  double const a = rho / w, b = t / half_length, k = std::sqrt(a * a + b * b);
  double const slope = std::sqrt(a * a / (w * w) + b * b / (half_length * half_length));
  return slope > 0 ? k * (k - 1) / slope : -girth;
}

/// A tube with round ends.
inline double capsule(Vector3<double> const& p, Vector3<double> const& from, Vector3<double> const& to, double radius) {
  Vector3<double> const u = to - from;
  double const t = std::clamp((p - from).dot(u) / u.squaredNorm(), 0.0, 1.0);
  return (p - from - t * u).norm() - radius;
}

/// Both shapes, the crease between them filled over a width of about k.
inline double united(double a, double b, double k) {
  double const h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}

/// What both shapes share, the edge between them rounded with a radius of about r.
inline double shared(double a, double b, double r) { return (a + b + std::sqrt((a - b) * (a - b) + r * r)) / 2; }

/// A smooth hump of height and radius one around the origin.
inline double hump(double x, double y) {
  double const s = 1 + x * x + y * y;
  return 1 / (s * s);
}

}  // namespace palpate::detail
