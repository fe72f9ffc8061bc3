// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <cmath>

namespace palpate::detail {

/// The unit vector a, turned towards b by a share of the angle between them, at an even speed: slerp.
///   (sin((1 − t) φ) a + sin(t φ) b) / sin φ
/// a itself for t = 0, or where b is a; of opposite ones the nearer.
template <RealScalar S>
Vector3<S> turned(Vector3<S> const& a, Vector3<S> const& b, S share) noexcept {
  S const sine = a.cross(b).norm(), cosine = a.dot(b);
  if (sine == S(0) && cosine > S(0)) return a;
  if (!(sine > S(1e-6))) {
    if (!(cosine > S(0))) return share < S(0.5) ? a : b;
    return Vector3<S>(a + share * (b - a)).normalized();
  }
  S const angle = std::atan2(sine, cosine);
  return Vector3<S>(std::sin((S(1) - share) * angle) * a + std::sin(share * angle) * b).normalized();
}

/// a, and b at share = 1, without a digit lost where both are the same.
template <class T, RealScalar S>
T between(T const& a, T const& b, S share) noexcept {
  return a + share * (b - a);
}

}  // namespace palpate::detail
