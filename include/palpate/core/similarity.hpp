// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <cmath>

namespace palpate {

/// One frame seen from another: turned, scaled alike in all directions, and moved. Named after its frames: `world_from_device.point(p)` takes a point
/// of the device's frame to the world's; `c_from_b * b_from_a` is c_from_a.
///   point(p) = s R p + t,   vector(v) = s R v for differences of points and velocities,   direction(n) = R n
/// Units      t [m] of the target frame; s is a number.
/// Invariant  s > 0, R a rotation: no mirror, no stretching along one axis, which would turn forces and lose energy. Checked by `make` and
///            `from_matrix`. The default changes no bit of a point but the sign of a zero.
/// Cost       noexcept, no allocation, but for the two that check.
template <RealScalar S>
class Similarity {
 public:
  using Scalar = S;
  using Rotation = Matrix<S, 3, 3>;

  Similarity() = default;

  /// From scale, rotation and translation. Throws `InvalidArgument` for a scale that is not positive, a quaternion without direction, or a value that is not finite.
  static Similarity make(S scale, Eigen::Quaternion<S> const& rotation, Vector3<S> const& translation) {
    S const norm = stable_norm(rotation.coeffs());
    if (!(scale > S(0)) || !std::isfinite(scale)) throw InvalidArgument(detail::message("Similarity: the scale is ", scale, "; give a finite number above zero"));
    if (!(norm > S(0)) || !std::isfinite(norm)) throw InvalidArgument("Similarity: the rotation is a quaternion without direction; give a finite one that is not zero");
    if (!is_finite(translation)) throw InvalidArgument(detail::message("Similarity: the translation is (", translation.x(), ", ", translation.y(), ", ", translation.z(), ") m; give finite numbers"));
    Similarity result;
    result.scale_ = scale;
    result.rotation_ = Eigen::Quaternion<S>(Vector4(rotation.coeffs() / norm)).toRotationMatrix();
    result.translation_ = translation;
    return result;
  }

  /// From a 4 × 4 matrix of homogeneous coordinates, as graphics libraries give them. Throws `InvalidArgument`, with what was found, for a mirror, a stretch along one axis,
  /// a shear or a perspective; `tolerance` is relative.
  static Similarity from_matrix(Matrix<S, 4, 4> const& matrix, S tolerance = S(1e-4)) {
    for (int k = 0; k < 16; ++k)
      if (!std::isfinite(matrix(k / 4, k % 4)))
        throw InvalidArgument(detail::message("Similarity: the matrix has ", matrix(k / 4, k % 4), " in row ", k / 4, ", column ", k % 4, "; give finite numbers"));
    if (!((matrix.row(3) - Matrix<S, 1, 4>(S(0), S(0), S(0), S(1))).cwiseAbs().maxCoeff() <= tolerance))
      throw InvalidArgument("Similarity: the matrix' last row is not 0 0 0 1; a perspective can not carry forces: give the view's matrix without the projection");
    Rotation const linear = matrix.template topLeftCorner<3, 3>();
    S const determinant = linear.determinant(), scale = std::cbrt(std::abs(determinant));
    if (!(determinant > S(0)))
      throw InvalidArgument(detail::message("Similarity: the matrix' determinant is ", determinant, "; a mirror turns right hands into left ones: swap or negate an axis"));
    Rotation const rotation = linear / scale;
    if (S const off = (rotation.transpose() * rotation - Rotation::Identity()).cwiseAbs().maxCoeff(); !(off <= tolerance))
      throw InvalidArgument(detail::message("Similarity: the matrix is ", off, " away from a rotation times a number; scale all axes alike and do not shear"));
    return make(scale, Eigen::Quaternion<S>(rotation), matrix.template topRightCorner<3, 1>());
  }

  Vector3<S> point(Vector3<S> const& p) const noexcept { return vector(p) + translation_; }
  Vector3<S> vector(Vector3<S> const& v) const noexcept { return scale_ * direction(v); }
  Vector3<S> direction(Vector3<S> const& n) const noexcept { return {turned(n, 0, 0), turned(n, 1, 0), turned(n, 2, 0)}; }
  /// From the target frame back.
  Vector3<S> direction_back(Vector3<S> const& n) const noexcept { return {turned(n, 0, 1), turned(n, 1, 1), turned(n, 2, 1)}; }
  Eigen::Quaternion<S> orientation(Eigen::Quaternion<S> const& q) const noexcept { return (Eigen::Quaternion<S>(rotation_) * q).normalized(); }

  Similarity inverse() const noexcept {
    Similarity result;
    result.scale_ = S(1) / scale_;
    result.rotation_ = rotation_.transpose();
    result.translation_ = -result.vector(translation_);
    return result;
  }
  /// First `before`, then this one.
  Similarity operator*(Similarity const& before) const noexcept {
    Similarity result;
    result.scale_ = scale_ * before.scale_;
    result.rotation_ = rotation_ * before.rotation_;
    result.translation_ = point(before.translation_);
    return result;
  }
  /// The same, moved by so much in the target frame.
  Similarity moved(Vector3<S> const& by) const noexcept {
    Similarity result = *this;
    result.translation_ += by;
    return result;
  }

  S scale() const noexcept { return scale_; }
  Rotation const& rotation() const noexcept { return rotation_; }
  Vector3<S> const& translation() const noexcept { return translation_; }

  template <RealScalar T>
  Similarity<T> cast() const noexcept {
    if constexpr (std::same_as<S, T>) {
      return *this;
    } else {
      Similarity<T> result;
      result.scale_ = T(scale_);
      result.rotation_ = rotation_.template cast<T>();
      result.translation_ = translation_.template cast<T>();
      return result;
    }
  }

 private:
  using Vector4 = Matrix<S, 4, 1>;
  /// A component of R n, or of Rᵀ n; Eigen's product would be types of its own, see CONTRIBUTING.md.
  S turned(Vector3<S> const& n, int i, int back) const noexcept {
    auto const r = [&](int k) { return back == 0 ? rotation_(i, k) : rotation_(k, i); };
    return r(0) * n[0] + (r(1) * n[1] + r(2) * n[2]);
  }
  template <RealScalar T>
  friend class Similarity;

  S scale_ = S(1);
  Rotation rotation_ = Rotation::Identity();
  Vector3<S> translation_ = Vector3<S>::Zero();
};

}  // namespace palpate
