// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <vector>

namespace palpate {

/// How often a surface goes round a point: 1 inside and 0 outside a closed one that faces outward, −1 inside one that faces inward; between, and smooth away from
/// the surface, where it has holes.
///   w(q) = Σ Ω_t(q) / 4π,   Ω the signed solid angle of a triangle
/// Triangles that are far from q compared to their group are taken together, as a dipole and its first derivative.
/// Units      places in m; w has none.
/// Source     \cite jacobson2013; the tree \cite barill2018; the solid angle \cite vanoosterom1983.
/// Errors     InvalidMesh: a corner that is no point, or not finite.
/// Cost       O(m log m) to build; O(log m) a question, some microseconds. Questions do not allocate and are noexcept.
/// Limits     of a closed surface off by up to some hundredths: exact enough to ask whether it is above ½.
class WindingNumber {
 public:
  template <RealScalar Scalar>
  explicit WindingNumber(TriangleMesh<Scalar> const& mesh) : points_(mesh.points.template cast<double>()) {
    detail::check_corners(mesh);
    int const count = static_cast<int>(mesh.triangles.cols());
    triangles_.resize(static_cast<std::size_t>(count));
    for (int t = 0; t < count; ++t) {
      for (int c = 0; c < 3; ++c) {
        int const v = mesh.triangles(c, t);
        triangles_[static_cast<std::size_t>(t)][static_cast<std::size_t>(c)] = v;
        if (!is_finite(points_.col(v)))
          throw InvalidMesh(detail::message("triangle ", t, " has corner ", v, ", whose coordinates are not finite; repair the mesh first"));
      }
    }
    if (count > 0) build(0, count);
  }

  double operator()(Vector3<double> const& q) const noexcept { return groups_.empty() ? 0.0 : sum(0, q) / (4 * std::numbers::pi); }

 private:
  static constexpr int leaf = 8;
  static constexpr double far = 2.0;   // times the radius of a group

  struct Group {
    Vector3<double> middle, area;      // area: Σ of the area vectors
    Eigen::Matrix3d moment;            // Σ area vector ⊗ (centre − middle)
    double radius = 0;
    int begin = 0, end = 0, second = 0;   // triangles; the first child is the next group, a leaf has none
  };

  Vector3<double> corner(int t, std::size_t c) const noexcept { return points_.col(triangles_[static_cast<std::size_t>(t)][c]); }
  Vector3<double> centre(int t) const noexcept { return (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3; }
  Vector3<double> area(int t) const noexcept {
    Vector3<double> const a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    return (b - a).cross(c - a) / 2;
  }

  void build(int begin, int end) {
    std::size_t const own = groups_.size();
    groups_.emplace_back();
    Group group;
    group.begin = begin, group.end = end;
    group.middle = group.area = Vector3<double>::Zero();
    group.moment.setZero();
    double total = 0;
    Eigen::AlignedBox<double, 3> box, centres;
    for (int t = begin; t < end; ++t) {
      Vector3<double> const a = area(t), c = centre(t);
      double const size = a.norm();
      group.middle += size * c, group.area += a, total += size;
      centres.extend(c);
      for (std::size_t k = 0; k < 3; ++k) box.extend(corner(t, k));
    }
    group.middle = total > 0 ? Vector3<double>(group.middle / total) : Vector3<double>(box.center());
    for (int t = begin; t < end; ++t) {
      group.moment += area(t) * (centre(t) - group.middle).transpose();
      for (std::size_t k = 0; k < 3; ++k) group.radius = std::max(group.radius, (corner(t, k) - group.middle).norm());
    }
    if (end - begin > leaf) {
      Eigen::Index axis = 0;
      centres.sizes().maxCoeff(&axis);
      int const half = begin + (end - begin) / 2;
      auto const at = [&](int t) { return triangles_.begin() + t; };
      auto const along = [&](std::array<int, 3> const& t) { return points_(axis, t[0]) + points_(axis, t[1]) + points_(axis, t[2]); };
      std::nth_element(at(begin), at(half), at(end), [&](auto const& s, auto const& t) { return along(s) != along(t) ? along(s) < along(t) : s < t; });
      build(begin, half);
      group.second = static_cast<int>(groups_.size());
      build(half, end);
    }
    groups_[own] = group;
  }

  double sum(int g, Vector3<double> const& q) const noexcept {
    Group const& group = groups_[static_cast<std::size_t>(g)];
    Vector3<double> const r = group.middle - q;
    double const distance = r.norm();
    if (distance > far * group.radius) {
      double const cubed = distance * distance * distance;
      return group.area.dot(r) / cubed + group.moment.trace() / cubed - 3 * r.dot(group.moment * r) / (cubed * distance * distance);
    }
    if (group.second > 0) return sum(g + 1, q) + sum(group.second, q);
    double angles = 0;
    for (int t = group.begin; t < group.end; ++t) angles += solid_angle(corner(t, 0) - q, corner(t, 1) - q, corner(t, 2) - q);
    return angles;
  }
  static double solid_angle(Vector3<double> const& a, Vector3<double> const& b, Vector3<double> const& c) noexcept {
    double const x = a.norm(), y = b.norm(), z = c.norm();
    return 2 * std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }

  Matrix3X<double> points_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<Group> groups_;
};

}  // namespace palpate
