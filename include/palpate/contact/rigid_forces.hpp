// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <cstddef>

namespace palpate::detail {

/// Forces on points, each by its share, as a rigid body's accelerations would be: f_i = w_i (a + b × d_i). Two of them make a moment of 1 N m about
/// the middle and no force, two a force of 1 N and no moment, the last a moment again; so those on one side of a contact are opposite to those on the other.
/// Units      d_i from the middle [m]; `radius` [m] is about their size.
class RigidForces {
 public:
  using Vector = Vector3<double>;

  explicit RigidForces(double radius) : radius_(radius) {}

  void add(double share, Vector const& arm) noexcept {
    Vector const d = arm / radius_;
    Matrix<double, 3, 3> cross;
    cross << 0, -d[2], d[1], d[2], 0, -d[0], -d[1], d[0], 0;
    sums_.topLeftCorner<3, 3>().diagonal().array() += share;
    sums_.topRightCorner<3, 3>() -= share * cross, sums_.bottomLeftCorner<3, 3>() += share * cross;
    sums_.bottomRightCorner<3, 3>() -= share * cross * cross;
  }
  /// Moments about two directions, forces along them, and a moment about an axis; all unit. False where the points are too near to a line for that.
  bool make(Vector const& first, Vector const& second, Vector const& axis) noexcept {
    Matrix<double, 6, 5> wanted = Matrix<double, 6, 5>::Zero();
    wanted.block<3, 1>(3, 0) = first / radius_, wanted.block<3, 1>(3, 1) = second / radius_;
    wanted.block<3, 1>(0, 2) = first, wanted.block<3, 1>(0, 3) = second, wanted.block<3, 1>(3, 4) = axis / radius_;
    found_ = sums_.ldlt().solve(wanted);
    return (sums_ * found_ - wanted).cwiseAbs().maxCoeff() < 1e-11 * (1 + 1 / radius_);
  }
  /// On a point [N], in that order.
  Vector on(std::size_t which, double share, Vector const& arm) const noexcept {
    auto const column = found_.col(static_cast<int>(which));
    return share * (Vector(column.head<3>()) + Vector(column.tail<3>()).cross(arm / radius_));
  }

 private:
  double radius_;
  Matrix<double, 6, 6> sums_ = Matrix<double, 6, 6>::Zero();
  Matrix<double, 6, 5> found_ = Matrix<double, 6, 5>::Zero();
};

}  // namespace palpate::detail
