// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/mass_spring_options.hpp>

#include <cstddef>
#include <vector>

namespace palpate {

namespace detail {

/// The total mass, shared in proportion to what is around each particle.
template <RealScalar Scalar>
std::vector<Scalar> shared_mass(std::vector<Scalar> const& around, MassOptions<Scalar> const& mass) {
  require_positive("the total mass", mass.total, "kg");
  Scalar sum = 0;
  for (Scalar const share : around) sum += share;
  std::vector<Scalar> masses;
  for (Scalar const share : around)
    masses.push_back(mass.lumping == Lumping::equal ? mass.total / Scalar(around.size()) : mass.total * share / sum);
  return masses;
}

}  // namespace detail

/// The mass of each particle [kg]: of a surface by the area of the triangles around it, of a volume by the volume of the tetrahedra, or all equal.
template <RealScalar Scalar>
std::vector<Scalar> lumped_masses(TriangleMesh<Scalar> const& mesh, MassOptions<Scalar> const& mass) {
  std::vector<Scalar> around(static_cast<std::size_t>(mesh.points.cols()), Scalar(0));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    auto const c = mesh.triangles.col(t);
    Vector3<Scalar> const a = mesh.points.col(c[1]) - mesh.points.col(c[0]), b = mesh.points.col(c[2]) - mesh.points.col(c[0]);
    Scalar const area = a.cross(b).norm() / 2;
    for (int k = 0; k < 3; ++k) around[static_cast<std::size_t>(c[k])] += area;
  }
  return detail::shared_mass(around, mass);
}
template <RealScalar Scalar>
std::vector<Scalar> lumped_masses(TetrahedralMesh<Scalar> const& mesh, MassOptions<Scalar> const& mass) {
  std::vector<Scalar> around(static_cast<std::size_t>(mesh.points.cols()), Scalar(0));
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto const c = mesh.tetrahedra.col(t);
    Vector3<Scalar> const o = mesh.points.col(c[0]), a = mesh.points.col(c[1]) - o, b = mesh.points.col(c[2]) - o, d = mesh.points.col(c[3]) - o;
    for (int k = 0; k < 4; ++k) around[static_cast<std::size_t>(c[k])] += a.cross(b).dot(d) / 24;
  }
  return detail::shared_mass(around, mass);
}

}  // namespace palpate
