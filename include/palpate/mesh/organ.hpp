// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

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

namespace palpate {

struct OrganOptions {
  int vertices = 2000;      ///< exactly so many; at least 300
  std::uint64_t seed = 1;   ///< another seed, another patient: the lobes, the notch and the hollows differ a little
  double length = 0.18;     ///< m, from the right to the left end, the extent along x
};

namespace detail {

/// The liver of unit length as an implicit field: two lobes under one dome, a hollowed underside, a groove.
class LiverField {
 public:
  explicit LiverField(std::uint64_t seed) {
    Random random(Seed{seed});
    for (double& w : wobble_) w = 2 * random.uniform<double>() - 1;
  }

  double operator()(Vector3<double> const& p) const {
    using V = Vector3<double>;
    auto const& w = wobble_;
    double const x = p.x(), y = p.y(), z = p.z();
    double const right = ellipsoid(p, V(-0.17, -0.01, -0.05), V(0.33, 0.36 + 0.02 * w[0], 0.32));
    double const left = ellipsoid(p, V(0.17, 0.09 + 0.02 * w[1], -0.01), V(0.40 + 0.03 * w[2], 0.21 + 0.02 * w[3], 0.20));
    double const dome = ellipsoid(p, V(-0.12, 0.05, -0.50), V(0.92, 0.76, 0.70 + 0.02 * w[4]));
    double body = shared(united(right, left, 0.30), dome, 0.10);
    double const groove = (x - 0.07 - 0.02 * w[5] - 0.12 * y) / 0.04;   // of the falciform ligament, ends in the notch
    double const front = std::clamp((0.05 - y) / 0.33, 0.0, 1.0);
    body += (0.004 + (0.055 + 0.01 * w[6]) * front * front * front) / (1 + groove * groove);
    double const below = -0.125 + 0.01 * w[7] - 0.36 * y + 0.09 * x +
                         (0.11 + 0.02 * w[8]) * hump(x / 0.17, (y - 0.02) / 0.16) +             // porta hepatis
                         (0.055 + 0.01 * w[9]) * hump((x - 0.29) / 0.15, (y - 0.07) / 0.13) +   // stomach
                         (0.05 + 0.01 * w[10]) * hump((x + 0.27) / 0.12, (y - 0.16) / 0.12) +   // kidney
                         (0.05 + 0.01 * w[11]) * hump((x + 0.10) / 0.05, (y + 0.17) / 0.11);    // gall bladder
    return shared(body, (below - z) / 1.05, 0.028);
  }

 private:
  std::array<double, 12> wobble_;
};

inline void check_organ(int vertices, double length, int fewest) {
  if (vertices < fewest || vertices > 10'000'000)
    throw InvalidArgument(message("an organ of ", vertices, " vertices; give ", fewest, " … 10000000"));
  require_positive("organ length", length, "m");
}

/// Moves the middle of the bounding box to the origin and scales the extent along one axis to `length`.
template <RealScalar Scalar>
TriangleMesh<Scalar> placed(TriangleMesh<double> const& mesh, int axis, double length) {
  Vector3<double> const low = mesh.points.rowwise().minCoeff(), high = mesh.points.rowwise().maxCoeff();
  double const scale = length / (high - low)[axis];
  return {((mesh.points.colwise() - (low + high) / 2) * scale).template cast<Scalar>(), mesh.triangles};
}

}  // namespace detail

/// A liver: the library's own organ, of any resolution. A large right lobe (−x) tapers to a thin left lobe (+x); a smooth
/// dome on top (+z); a hollowed underside; blunt at the back (+y), a sharp lower edge in front (−y) with the notch of the
/// falciform ligament. A stroke of 6 cm fits on the dome.
/// Units      metres; the middle of the bounding box is the origin; the default is about 18 × 12.7 × 7.3 cm, 0.6 litres.
/// Shapes     exactly `vertices` points, 2·vertices − 4 triangles.
/// Invariant  closed, manifold, one piece without handles, outward; every angle above 20°, mean quality (see `quality`) above
///            0.95, the longest edge shorter than 3 times the shortest; at 2,000 vertices above 34°, 0.98, 2.2 times.
/// Cost       about 0.1 s for 2,000 vertices, 1.5 s for 20,000. The same options give the same bytes.
/// Limits     A likeness for teaching and tests, not an anatomical atlas.
template <RealScalar Scalar>
TriangleMesh<Scalar> make_organ(OrganOptions const& options = {}) {
  detail::check_organ(options.vertices, options.length, 300);
  Eigen::AlignedBox<double, 3> const box(Vector3<double>(-0.65, -0.55, -0.45), Vector3<double>(0.75, 0.55, 0.35));
  return detail::placed<Scalar>(make_implicit<double>(detail::LiverField(options.seed), box, options.vertices), 0,
                                options.length);
}

}  // namespace palpate
