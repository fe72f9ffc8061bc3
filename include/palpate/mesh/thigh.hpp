// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/vertices_where.hpp>

#include <cmath>
#include <vector>

namespace palpate {

struct ThighOptions {
  int vertices = 1500;    ///< exactly so many; at least 300
  double length = 0.30;   ///< m, from knee to hip; all else in proportion
};

namespace detail {

/// A thigh of unit length along z as an implicit field: a cone, bent a little, with flat ends that are rounded off.
struct ThighField {
  static double bend(double z) noexcept { return 0.05 * (1 - 4 * z * z); }   // where the middle is, along y
  static double off_axis(Vector3<double> const& p) noexcept { return std::hypot(p.x(), p.y() - bend(p.z())); }

  double operator()(Vector3<double> const& p) const {
    double const radius = 0.225 + 0.085 * p.z();
    return shared(off_axis(p) - radius, std::abs(p.z()) - 0.5, 0.06);
  }
};

}  // namespace detail

/// The skin of a thigh: a tapered cylinder along z, thick at the hip (+z), with its middle bent to the front (+y), closed by rounded ends.
/// Units      metres; the default is 30 cm long, 15 cm across at the hip and some 10 cm at the knee, 4 litres.
/// Shapes     exactly `vertices` points, 2·vertices − 4 triangles.
/// Invariant  closed, manifold, outward, as make_implicit has it; the same options give the same bytes.
/// Limits     a likeness for teaching and tests, not an atlas.
template <RealScalar Scalar>
TriangleMesh<Scalar> make_thigh(ThighOptions const& options = {}) {
  detail::check_organ(options.vertices, options.length, 300);
  Eigen::AlignedBox<double, 3> const box(Vector3<double>(-0.4, -0.4, -0.6), Vector3<double>(0.4, 0.45, 0.6));
  auto const mesh = make_implicit<double>(detail::ThighField{}, box, options.vertices);
  return {(options.length * mesh.points).template cast<Scalar>(), mesh.triangles};
}

/// The vertices of a solid thigh that are bone: those within `radius` [m] of its bent middle, to be nailed. `length` is that of make_thigh.
/// Errors     InvalidArgument where there are none: the tetrahedra are wider than the bone.
template <RealScalar Scalar>
std::vector<int> thigh_bone(TetrahedralMesh<Scalar> const& mesh, double radius = 0.015, double length = 0.30) {
  detail::require_positive("the radius of the bone", radius, "m");
  detail::require_positive("the length of the thigh", length, "m");
  auto bone = vertices_where(mesh, [&](auto const& p) { return length * detail::ThighField::off_axis(p.template cast<double>() / length) <= radius; });
  if (bone.empty())
    throw InvalidArgument(
        detail::message("no vertex lies within ", radius, " m of the middle of the thigh; fill it with a shorter edge than ", 1.7 * radius, " m"));
  return bone;
}

}  // namespace palpate
