// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/haptics/detail/turned.hpp>
#include <palpate/mesh/normals.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <numbers>

namespace palpate {

/// The smooth outward unit normal of a body's surface at a vertex, as the body is now: its triangles' normals, weighted by their angles there.
/// Zero where no triangle with area meets the vertex, or where they cancel.
/// Cost       O(triangles at the vertex); noexcept, no allocation.
template <class Body>
Vector3<typename Body::Scalar> smooth_normal(Body const& body, int vertex) noexcept {
  using S = typename Body::Scalar;
  auto const& surface = body.tissue().surface();
  auto const& x = body.positions();
  Vector3<S> sum = Vector3<S>::Zero();
  for (int const t : surface.triangles_at(vertex)) {
    auto const c = surface.corners(t);
    auto const k = static_cast<std::size_t>(surface.corner_of(t, vertex));
    Vector3<S> const a = x.col(c[k]), b = x.col(c[(k + 1) % 3]), d = x.col(c[(k + 2) % 3]);
    Vector3<S> const u = b - a, v = d - a;
    sum += std::atan2(u.cross(v).norm(), u.dot(v)) * triangle_normal<S>(a, b, d);
  }
  S const length = sum.norm();
  return length > S(1e-3) ? Vector3<S>(sum / length) : Vector3<S>(Vector3<S>::Zero());   // rounding of what cancels has no direction
}

/// Force shading: the corners' smooth normals interpolated by barycentric weight, tilted from the facet's normal by at most `max_tilt`
/// [rad].
///   n = Σ barycentric[k] n_k / |…|;   beyond the tilt: the facet's normal, turned towards n by it
/// With a tilt below a right angle a force along it never points into the facet. Across an edge it is continuous, unless the tilt is
/// limited there.
/// Source     force shading \cite ruspini1997, after the shading of light \cite phong1975.
/// Invariant  of length one, outward. For a facet without area the interpolated normal, zero where that vanishes. The tilt is clamped to
///            0 … 85°.
/// Cost       O(triangles at three vertices); noexcept, no allocation.
template <class Body>
Vector3<typename Body::Scalar> shaded_normal(Body const& body, int triangle, Vector3<typename Body::Scalar> const& barycentric,
                                             typename Body::Scalar max_tilt = typename Body::Scalar(0.6)) noexcept {
  using S = typename Body::Scalar;
  auto const c = body.tissue().surface().corners(triangle);
  auto const& x = body.positions();
  Vector3<S> const facet = triangle_normal<S>(x.col(c[0]), x.col(c[1]), x.col(c[2]));
  Vector3<S> mixed = Vector3<S>::Zero();
  for (std::size_t k = 0; k < 3; ++k) mixed += barycentric[static_cast<Eigen::Index>(k)] * smooth_normal(body, c[k]);
  S const length = mixed.norm();
  if (!(length > S(1e-3))) return facet;
  mixed /= length;
  if (is_zero(facet)) return mixed;
  constexpr S right = std::numbers::pi_v<S> / 2, steepest = S(85) / S(90) * right;
  S const tilt = max_tilt > S(0) ? (max_tilt < steepest ? max_tilt : steepest) : S(0);
  S const angle = std::atan2(facet.cross(mixed).norm(), facet.dot(mixed));
  return angle > tilt ? detail::turned<S>(facet, mixed, tilt / angle) : mixed;
}

/// Rotates a force of a flat facet by the smallest rotation from the facet's normal to the shaded one; friction rotates with it.
///   F' = F (n·s) + (n × s) × F + (n × s) ((n × s)·F) / (1 + n·s)
template <RealScalar S>
Vector3<S> shaded_force(Vector3<S> const& force, Vector3<S> const& facet, Vector3<S> const& shaded) noexcept {
  Vector3<S> const axis = facet.cross(shaded);
  S const cosine = facet.dot(shaded);
  if (!(cosine > S(-0.5))) return force;
  return cosine * force + axis.cross(force) + (axis.dot(force) / (S(1) + cosine)) * axis;
}

}  // namespace palpate
