// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/shaded_normal.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace palpate {

/// Change of a patch's parameters: height of its point along the normal, tilt of the normal (a vector across it), curvature.
template <RealScalar S>
struct PatchChange {
  S height = S(0);                            ///< m
  Vector3<S> tilt = Vector3<S>::Zero();       ///< rad
  S curvature = S(0);                         ///< 1/m

  SurfacePatch<S> applied_to(SurfacePatch<S> patch) const noexcept {
    patch.point += height * patch.normal;
    patch.normal = Vector3<S>(patch.normal + tilt).normalized();
    patch.curvature += curvature;
    return patch;
  }
};

/// Damped pseudo-inverse (Levenberg–Marquardt) of a patch's parameters θ: height, two tilts, curvature, from the displacements of surface
/// points.
///   Δθ = J⁺ Δd,   J⁺ = D (Dᵀ JᵀJ D + Λ)⁻¹ Dᵀ Jᵀ,   D = diag(1/|column of J|)
///   row of J at q = x − point, with a = q·n, m = n + κ q, s = distance:   ( 1 + κ a,  −q·e₁,  −q·e₂,  −(|q|² − s²)/2 ) / |m|
/// Δd are the displacements of the surface along its normal at each point; e₁, e₂ are across the normal. Λ is the damping of the
/// curvature, and a thousandth of it for the others. With too few or badly placed points the patch moves and tilts and keeps its
/// curvature, and nothing grows without bound. With Δd the distances of points from the patch it is a Gauss-Newton step of a fit.
/// Units      m, rad, 1/m.
/// Source     local models whose parameters follow the body by a pseudo-inverse \cite daulignac2000; the damping \cite marquardt1963.
/// Cost       `add` about 50 operations, `solve` one system of 4; noexcept, no allocation. In double, whatever the scalar.
/// Limits     Linear: right to the second order in Δd. Changes that are not finite are not added. With a damping of zero, points that do not
///            determine the patch change nothing.
template <RealScalar S>
class PatchUpdate {
 public:
  /// `curved` false: the curvature stays.
  explicit PatchUpdate(SurfacePatch<S> const& patch, bool curved = true, double damping = 1e-6) noexcept
      : patch_(patch), curved_(curved), damping_(damping) {
    Vector3<double> const n = patch.normal.template cast<double>();
    int least = 0;
    n.cwiseAbs().minCoeff(&least);
    across_[0] = n.cross(Vector3<double>::Unit(least)).normalized();
    across_[1] = n.cross(across_[0]);
  }

  /// Displacement of the surface along its normal [m] at p.
  void add(Vector3<S> const& p, S change) noexcept {
    Vector3<double> const q = Vector3<S>(p - patch_.point).template cast<double>(), n = patch_.normal.template cast<double>();
    double const k = double(patch_.curvature), height = double(patch_.distance(p)), length = (n + k * q).norm();
    std::array<double, 4> row{1.0 + k * q.dot(n), -q.dot(across_[0]), -q.dot(across_[1]), curved_ ? -(q.squaredNorm() - height * height) / 2 : 0.0};
    bool finite = std::isfinite(change);
    for (double& slope : row) finite = std::isfinite(slope /= length) && finite;
    if (!finite) return;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) square_[i][j] += row[i] * row[j];
      right_[i] += double(change) * row[i];
    }
    ++count_;
  }
  /// Displacement of the point at p [m].
  void add(Vector3<S> const& p, Vector3<S> const& way) noexcept { add(p, S(patch_.normal_at(p).dot(way))); }

  int count() const noexcept { return count_; }

  /// Least-squares change of the parameters; none without points.
  PatchChange<S> solve() const noexcept {
    std::array<double, 4> scale, theta;
    for (std::size_t i = 0; i < 4; ++i) scale[i] = square_[i][i] > 0.0 ? 1.0 / std::sqrt(square_[i][i]) : 0.0;
    // Cholesky: the rows of L, then L y = D right, then Lᵀ θ = y. In place of Eigen's, which is a tenth of what a simulator takes to compile.
    std::array<std::array<double, 4>, 4> factor{};
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = scale[i] * square_[i][j] * scale[j];
        if (i == j) sum += (i == 3 ? 1.0 : 1e-3) * damping_ + (scale[i] > 0.0 ? 0.0 : 1.0);
        for (std::size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
        factor[i][j] = i == j ? std::sqrt(sum) : sum / factor[j][j];
      }
      theta[i] = scale[i] * right_[i];
      for (std::size_t k = 0; k < i; ++k) theta[i] -= factor[i][k] * theta[k];
      theta[i] /= factor[i][i];
    }
    for (std::size_t i = 4; i-- > 0;) {
      for (std::size_t k = i + 1; k < 4; ++k) theta[i] -= factor[k][i] * theta[k];
      theta[i] /= factor[i][i];
    }
    for (std::size_t i = 0; i < 4; ++i)
      if (!std::isfinite(theta[i] *= scale[i])) return {};
    return {S(theta[0]), Vector3<double>(theta[1] * across_[0] + theta[2] * across_[1]).template cast<S>(), S(theta[3])};
  }

 private:
  SurfacePatch<S> patch_;
  bool curved_;
  double damping_;
  Vector3<double> across_[2];
  std::array<std::array<double, 4>, 4> square_{};   // JᵀJ
  std::array<double, 4> right_{};                   // JᵀΔd
  int count_ = 0;
};

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
