// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>


namespace palpate::detail {

/// A point of a blade in the undeformed solid.
struct MaterialPoint {
  Vector3<double> at = Vector3<double>::Zero();   // m, where the solid would have it undeformed
  int tetrahedron = -1;                           // that it is in, or that carries it on beyond the skin
  bool inside = false;
  bool in_wound = false;                          // outside, with a wound nearest
  double distance = 0;                            // m, outside, from the body as it is now
};

/// Where points of the world are in an undeformed solid.
///   inside      X = Σ w_k X_k with the weights of x in the tetrahedron that holds it now
///   outside     the same weights of the tetrahedron behind the nearest skin, some of them negative
///   in a wound  the nearest point of its walls, a hair beyond, so that edges of the wall are crossed: both walls lie on the cut, undeformed
/// Cost       inside a walk from a tetrahedron that was near, outside one search of the body's surface; no allocation.
template <class Body>
class MaterialFrame {
  using Vector = Vector3<typename Body::Scalar>;

 public:
  explicit MaterialFrame(Body& body) : body_(body) {}

  /// `near` is a tetrahedron that is likely near, or −1.
  MaterialPoint find(Vector const& x, int near) const {
    MaterialPoint found;
    if (near >= 0 && near < count()) found.tetrahedron = walk(x, near);
    if (found.tetrahedron < 0) {
      auto const foot = body_.nearest_point(x);
      if (!foot.found()) return found;
      auto const [t, k] = body_.tissue().topology().border_face(foot.triangle);
      found.tetrahedron = walk(x, t);
      if (found.tetrahedron < 0) {
        found.tetrahedron = t;
        found.distance = static_cast<double>(foot.distance);
        found.in_wound = body_.tissue().is_wound(foot.triangle);
        auto const c = body_.tissue().surface().corners(foot.triangle);
        Vector3<double> const w = foot.barycentric.template cast<double>();
        found.at = w[0] * rest(c[0]) + w[1] * rest(c[1]) + w[2] * rest(c[2]);
        if (found.in_wound) {
          Vector3<double> const outward = (rest(c[1]) - rest(c[0])).cross(rest(c[2]) - rest(c[0]));
          found.at += 1e-6 * static_cast<double>(body_.mean_edge()) / outward.norm() * outward;
        } else if (auto const all = weights(x, t); is_finite(all)) {
          found.at = point(t, all);
        }
        return found;
      }
    }
    found.inside = true;
    found.at = point(found.tetrahedron, weights(x, found.tetrahedron));
    return found;
  }

  /// Where a point of the undeformed solid is now, by the tetrahedron that it was found with.
  Vector now(MaterialPoint const& point) const noexcept {
    if (point.tetrahedron < 0 || point.tetrahedron >= count()) return point.at.cast<typename Body::Scalar>();
    auto const c = body_.tissue().topology().corners(point.tetrahedron);
    Weights const w = weights(point.at, rest(c[0]), rest(c[1]), rest(c[2]), rest(c[3]));
    return (w[0] * now(c[0]) + w[1] * now(c[1]) + w[2] * now(c[2]) + w[3] * now(c[3])).template cast<typename Body::Scalar>();
  }

 private:
  using Weights = Matrix<double, 4, 1>;

  int count() const noexcept { return body_.tissue().topology().tetrahedron_count(); }
  Vector3<double> rest(int i) const noexcept { return body_.tissue().rest_position(i).template cast<double>(); }
  Vector3<double> now(int i) const noexcept { return body_.positions().col(i).template cast<double>(); }

  /// Barycentric, of a tetrahedron as it is now; not finite where it is flat.
  Weights weights(Vector const& x, int t) const noexcept {
    auto const c = body_.tissue().topology().corners(t);
    return weights(x.template cast<double>(), now(c[0]), now(c[1]), now(c[2]), now(c[3]));
  }
  static Weights weights(Vector3<double> const& x, Vector3<double> const& o, Vector3<double> const& second, Vector3<double> const& third,
                         Vector3<double> const& fourth) noexcept {
    Vector3<double> const a = second - o, b = third - o, d = fourth - o, p = x - o;
    double const volume = a.cross(b).dot(d);
    Weights w;
    w[1] = p.cross(b).dot(d) / volume, w[2] = a.cross(p).dot(d) / volume, w[3] = a.cross(b).dot(p) / volume;
    w[0] = 1 - w[1] - w[2] - w[3];
    return w;
  }
  Vector3<double> point(int t, Weights const& w) const noexcept {
    auto const c = body_.tissue().topology().corners(t);
    return w[0] * rest(c[0]) + w[1] * rest(c[1]) + w[2] * rest(c[2]) + w[3] * rest(c[3]);
  }

  /// From tetrahedron to tetrahedron across the face that x is farthest beyond; −1 where that leaves the solid.
  int walk(Vector const& x, int t) const noexcept {
    for (int steps = 0; steps < 64; ++steps) {
      Weights const w = weights(x, t);
      int farthest = 0;
      for (int k = 1; k < 4; ++k)
        if (w[k] < w[farthest]) farthest = k;
      if (w[farthest] >= -1e-12) return t;
      t = body_.tissue().topology().neighbour(t, farthest);
      if (t < 0) return -1;
    }
    return -1;
  }

  Body& body_;
};

}  // namespace palpate::detail
