// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <optional>
#include <string_view>

namespace palpate {

/// How the service places what it says: position [m], rotation, and factors of length.
struct HaplyTransform {
  Vector3<double> position = Vector3<double>::Zero();
  Eigen::Quaternion<double> rotation = Eigen::Quaternion<double>::Identity();
  Vector3<double> scale = Vector3<double>::Ones();

  bool keeps_lengths() const noexcept { return near(scale, Vector3<double>::Ones()); }
  bool is_identity() const noexcept { return *this == HaplyTransform{}; }
  /// Equal to the last digits that a message carries.
  bool operator==(HaplyTransform const& other) const noexcept {
    bool const turned_alike = near(rotation.coeffs(), other.rotation.coeffs()) || near(rotation.coeffs(), -other.rotation.coeffs());
    return near(position, other.position) && turned_alike && near(scale, other.scale);
  }

 private:
  template <class A, class B>
  static bool near(A const& a, B const& b) noexcept {
    return ((a - b).cwiseAbs().array() <= 1e-6).all();
  }
};

/// The matrix of axes written as XYZ with signs, none of them twice; nothing for other text.
///   "YZX": new x = old y, new y = old z, new z = old x;   "XZ-Y": (x, y, z) → (x, z, −y)
inline std::optional<Matrix<double, 3, 3>> signed_axes(std::string_view text) noexcept {
  Matrix<double, 3, 3> axes = Matrix<double, 3, 3>::Zero();
  for (int row = 0; row < 3; ++row) {
    double sign = 1.0;
    if (!text.empty() && (text.front() == '+' || text.front() == '-')) {
      if (text.front() == '-') sign = -1.0;
      text.remove_prefix(1);
    }
    if (text.empty() || text.front() < 'X' || text.front() > 'Z') return std::nullopt;
    int const column = text.front() - 'X';
    if (!axes.col(column).isZero(0.0)) return std::nullopt;
    axes(row, column) = sign;
    text.remove_prefix(1);
  }
  if (!text.empty()) return std::nullopt;
  return axes;
}

/// From what the service says to the device's frame here, and back for forces. The service permutes Haply's axes by the basis, also into a mirror
/// image: that is undone, then the axes are named as here.
///   p = A Bᵀ p_service,   f_service = (A Bᵀ)ᵀ f,   R = (A Bᵀ) R_service (A Bᵀ)ᵀ
/// Haply's own frame has x to the right, y forward, z up (\cite haply_service). Mount and workspace transform are part of what the service says and stay in.
/// Invariant  A Bᵀ is orthogonal with entries 0 and ±1, so powers f·v are the same on both sides, to the bit of each product.
class HaplyFrame {
 public:
  HaplyFrame() = default;
  HaplyFrame(Matrix<double, 3, 3> const& axes, Matrix<double, 3, 3> const& basis) : matrix_(axes * basis.transpose()) {}

  Matrix<double, 3, 3> const& matrix() const noexcept { return matrix_; }
  Vector3<double> from_service(Vector3<double> const& vector) const noexcept { return matrix_ * vector; }
  Vector3<double> to_service(Vector3<double> const& vector) const noexcept { return matrix_.transpose() * vector; }
  Eigen::Quaternion<double> from_service(Eigen::Quaternion<double> const& rotation) const noexcept {
    Matrix<double, 3, 3> const turned = matrix_ * rotation.toRotationMatrix() * matrix_.transpose();
    return Eigen::Quaternion<double>(turned).normalized();
  }

 private:
  Matrix<double, 3, 3> matrix_ = Matrix<double, 3, 3>::Identity();
};

}  // namespace palpate
