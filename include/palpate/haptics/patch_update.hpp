// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <Eigen/Geometry>

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

}  // namespace palpate
