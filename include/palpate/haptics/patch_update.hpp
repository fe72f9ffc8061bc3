// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

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
/// Limits     Linear: right to the second order in Δd. Changes that are not finite are not added.
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
    Vector3<double> const q = (p - patch_.point).template cast<double>(), n = patch_.normal.template cast<double>();
    double const k = double(patch_.curvature), height = double(patch_.distance(p)), length = (n + k * q).norm();
    Matrix<double, 4, 1> row(1.0 + k * q.dot(n), -q.dot(across_[0]), -q.dot(across_[1]), curved_ ? -(q.squaredNorm() - height * height) / 2 : 0.0);
    row /= length;
    if (!row.allFinite() || !std::isfinite(change)) return;
    square_ += row * row.transpose();
    right_ += double(change) * row;
    ++count_;
  }
  /// Displacement of the point at p [m].
  void add(Vector3<S> const& p, Vector3<S> const& way) noexcept { add(p, S(patch_.normal_at(p).dot(way))); }

  int count() const noexcept { return count_; }

  /// Least-squares change of the parameters; none without points.
  PatchChange<S> solve() const noexcept {
    Matrix<double, 4, 1> scale;
    for (Eigen::Index i = 0; i < 4; ++i) scale[i] = square_(i, i) > 0.0 ? 1.0 / std::sqrt(square_(i, i)) : 0.0;
    Matrix<double, 4, 4> system = scale.asDiagonal() * square_ * scale.asDiagonal();
    for (Eigen::Index i = 0; i < 4; ++i) system(i, i) += (i == 3 ? 1.0 : 1e-3) * damping_ + (scale[i] > 0.0 ? 0.0 : 1.0);
    Matrix<double, 4, 1> const theta = scale.cwiseProduct(Matrix<double, 4, 1>(system.ldlt().solve(scale.cwiseProduct(right_))));
    if (!theta.allFinite()) return {};
    return {S(theta[0]), (theta[1] * across_[0] + theta[2] * across_[1]).template cast<S>(), S(theta[3])};
  }

 private:
  SurfacePatch<S> patch_;
  bool curved_;
  double damping_;
  Vector3<double> across_[2];
  Matrix<double, 4, 4> square_ = Matrix<double, 4, 4>::Zero();   // JᵀJ
  Matrix<double, 4, 1> right_ = Matrix<double, 4, 1>::Zero();    // JᵀΔd
  int count_ = 0;
};

}  // namespace palpate
