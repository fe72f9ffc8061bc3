// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/patch_update.hpp>
#include <palpate/haptics/shaded_normal.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace palpate {

/// The tangent plane of the present surface at a point of a triangle, with smooth normal and velocity; its stiffness is 0.
template <class Body>
SurfacePatch<typename Body::Scalar> tangent_plane(Body const& body, int triangle, Vector3<typename Body::Scalar> const& barycentric) noexcept {
  using S = typename Body::Scalar;
  auto const c = body.tissue().surface().corners(triangle);
  SurfacePatch<S> patch;
  for (std::size_t k = 0; k < 3; ++k) {
    S const w = barycentric[static_cast<Eigen::Index>(k)];
    patch.point += w * body.positions().col(c[k]);
    patch.velocity += w * body.velocities().col(c[k]);
  }
  patch.normal = shaded_normal(body, triangle, barycentric);
  return patch;
}

struct SurfaceFitOptions {
  int rings = 1;             ///< so many edges away from the touched triangle vertices count; 1 or 2 for most
  bool curved = true;        ///< fit a ball; false: a plane
  double stiffness = 500.0;  ///< N/m, of the patch; set `patch().stiffness` where the body knows better
  double damping = 1e-6;     ///< Λ, see `PatchUpdate`
};

/// Least-squares fit of a plane or a ball to the vertices around a touched point, with its velocity. Between two fits it follows the same
/// vertices by the pseudo-inverse of its parameters' Jacobian.
///   fit      minimises Σ distance(x_i)² over the vertices up to `rings` edges away, by Gauss-Newton steps from the tangent plane
///   follow   Δθ = J⁺ Δd with Δd the displacements of the same vertices since
/// Units      m, m/s, rad/s, N/m; world frame.
/// Invariant  0 ≤ rings ≤ 4, stiffness, damping > 0, finite; checked at set-up. For a finite body the patch is always valid: where no fit
///            is found it is the tangent plane.
/// Cost       O(vertices near), at most 64, whatever the size of the body; noexcept, no allocation.
/// Limits     Three vertices determine no curvature. The curvature is at most 2 over the distance of the farthest vertex. After a cut, or
///            for another topology, fit again: vertices are identified by index.
template <RealScalar S>
class SurfaceFit {
 public:
  using Scalar = S;
  static constexpr int capacity = 64;

  explicit SurfaceFit(SurfaceFitOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"SurfaceFit", true};
    require(options.rings >= 0 && options.rings <= 4, ".rings", options.rings, "give 0 to 4, 1 for most");
    require.positive(".stiffness", options.stiffness, " N/m");
    require(options.damping > 0.0, ".damping", options.damping, "give a small number above zero, 1e-6 for most");
  }

  /// Fits the surface around a point of a triangle.
  template <class Body>
  SurfacePatch<S> const& fit(Body const& body, int triangle, Vector3<S> const& barycentric) noexcept {
    triangle_ = triangle;
    barycentric_ = barycentric;
    gather(body);
    patch_ = tangent_plane(body, triangle, barycentric);
    if (is_zero(patch_.normal)) patch_.normal = Vector3<S>::UnitZ();
    S const extent = reach_from(patch_.point), steepest = extent > S(0) ? S(2) / extent : S(0);
    SurfacePatch<S> best = patch_;
    residual_ = misses(patch_);
    for (int step = 0; step < steps; ++step) {
      PatchUpdate<S> update(patch_, options_.curved, options_.damping);
      for (int k = 0; k < count_; ++k) update.add(last_[at(k)], patch_.distance(last_[at(k)]));
      patch_ = update.solve().applied_to(patch_);
      patch_.curvature = std::clamp(patch_.curvature, -steepest, steepest);
      if (S const misses_now = misses(patch_); misses_now < residual_ && patch_.valid()) best = patch_, residual_ = misses_now;
    }
    patch_ = best;
    settle(body, extent);
    return patch_;
  }

  /// Lets the patch follow the vertices since the last call.
  template <class Body>
  SurfacePatch<S> const& follow(Body const& body) noexcept {
    PatchUpdate<S> update(patch_, options_.curved, options_.damping);
    for (int k = 0; k < count_; ++k) {
      if (vertex_[at(k)] >= body.positions().cols()) continue;
      Vector3<S> const now = body.positions().col(vertex_[at(k)]);
      update.add(last_[at(k)], Vector3<S>(now - last_[at(k)]));
      last_[at(k)] = now;
    }
    if (SurfacePatch<S> const next = update.solve().applied_to(patch_); next.valid()) patch_ = next;
    residual_ = misses(patch_);
    if (triangle_ >= 0 && triangle_ < body.tissue().surface().triangle_count()) settle(body, patch_.reach);
    return patch_;
  }

  /// The stiffness may be set here; `fit` resets it to that of the options, `follow` keeps it.
  SurfacePatch<S>& patch() noexcept { return patch_; }
  SurfacePatch<S> const& patch() const noexcept { return patch_; }
  /// Root mean square distance of the vertices from the patch [m]; number of vertices.
  S residual() const noexcept { return residual_; }
  int vertices() const noexcept { return count_; }

 private:
  static constexpr int steps = 6;
  static std::size_t at(int k) noexcept { return static_cast<std::size_t>(k); }

  template <class Body>
  void gather(Body const& body) noexcept {
    auto const& surface = body.tissue().surface();
    count_ = 0;
    for (int const v : surface.corners(triangle_)) note(body, v);
    int from = 0;
    for (int ring = 0; ring < options_.rings; ++ring)
      for (int const to = count_; from < to; ++from)
        for (int const t : surface.triangles_at(vertex_[at(from)]))
          for (int const v : surface.corners(t)) note(body, v);
  }
  template <class Body>
  void note(Body const& body, int v) noexcept {
    if (count_ == capacity || std::find(vertex_.begin(), vertex_.begin() + count_, v) != vertex_.begin() + count_) return;
    vertex_[at(count_)] = v;
    last_[at(count_)] = body.positions().col(v);
    ++count_;
  }

  S reach_from(Vector3<S> const& p) const noexcept {
    S most = S(0);
    for (int k = 0; k < count_; ++k) most = std::max(most, (last_[at(k)] - p).norm());
    return most;
  }
  S misses(SurfacePatch<S> const& patch) const noexcept {
    S sum = S(0);
    for (int k = 0; k < count_; ++k) {
      S const miss = patch.distance(last_[at(k)]);
      sum += miss * miss;
    }
    return count_ > 0 ? std::sqrt(sum / S(count_)) : S(0);
  }

  /// Anchors the patch at the touched point with the surface's velocity there; the angular velocity is fitted to the velocities of the
  /// vertices.
  template <class Body>
  void settle(Body const& body, S reach) noexcept {
    auto const c = body.tissue().surface().corners(triangle_);
    Vector3<S> point = Vector3<S>::Zero(), velocity = Vector3<S>::Zero();
    for (std::size_t k = 0; k < 3; ++k) point += barycentric_[static_cast<Eigen::Index>(k)] * body.positions().col(c[k]);
    patch_ = patch_.anchored_at(point);
    PatchUpdate<S> rate(patch_, options_.curved, options_.damping);
    for (std::size_t k = 0; k < 3; ++k) velocity += barycentric_[static_cast<Eigen::Index>(k)] * body.velocities().col(c[k]);
    for (int k = 0; k < count_; ++k)
      if (vertex_[at(k)] < body.velocities().cols()) rate.add(last_[at(k)], Vector3<S>(body.velocities().col(vertex_[at(k)]) - velocity));
    patch_.velocity = velocity;
    patch_.angular_velocity = patch_.normal.cross(rate.solve().tilt);
    patch_.reach = reach;
    if (!(patch_.stiffness > S(0))) patch_.stiffness = S(options_.stiffness);
  }

  SurfaceFitOptions options_;
  SurfacePatch<S> patch_;
  int triangle_ = -1;
  Vector3<S> barycentric_ = Vector3<S>::Zero();
  std::array<int, capacity> vertex_{};
  std::array<Vector3<S>, capacity> last_{};   // where they were
  int count_ = 0;
  S residual_ = S(0);
};

}  // namespace palpate
