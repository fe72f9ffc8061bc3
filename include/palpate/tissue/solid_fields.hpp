// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/tensor3.hpp>

#include <cmath>

namespace palpate {

/// √(3/2 s : s) of a stress, s its deviator: what a uniaxial stress of the same shear would be.
template <RealScalar Scalar>
Scalar von_mises_stress(Tensor3<Scalar> const& stress) noexcept {
  Scalar const x = stress.xx - stress.yy, y = stress.yy - stress.zz, z = stress.zz - stress.xx;
  return std::sqrt((x * x + y * y + z * z) / 2 + 3 * (stress.xy * stress.xy + stress.yz * stress.yz + stress.zx * stress.zx));
}

/// What a solid feels inside, a column a tetrahedron: to colour pictures by, to search for its hottest spot.
/// Shapes     stress 6 × m: σ_xx, σ_yy, σ_zz, σ_xy, σ_yz, σ_zx, in ParaView's order of a symmetric tensor.
/// Units      Pa, J/m³ of the tissue at rest; determinants have none.
template <RealScalar Scalar>
struct SolidFields {
  Matrix<Scalar, 6, Dynamic> stress;                   ///< Cauchy's
  Matrix<Scalar, Dynamic, 1> von_mises, energy_density;
  Matrix<Scalar, Dynamic, 1> determinant;                 ///< J: the volume over that at rest
};

/// Those at x (3 × particles), of a solid that states stress and strain energy of its tetrahedra; see FiniteElements.
/// Throws InvalidArgument when x has another number of columns than the tissue has particles. Allocates.
template <class Tissue, class X>
SolidFields<typename Tissue::Scalar> solid_fields(Tissue const& tissue, X const& x) {
  using Scalar = typename Tissue::Scalar;
  if (x.cols() != tissue.size())
    throw InvalidArgument(detail::message("the solid has ", tissue.size(), " particles and ", x.cols(), " positions; give one column for each"));
  Eigen::Index const count = tissue.tetrahedra();
  SolidFields<Scalar> fields;
  fields.stress.resize(6, count), fields.von_mises.resize(count), fields.energy_density.resize(count), fields.determinant.resize(count);
  for (int t = 0; t < tissue.tetrahedra(); ++t) {
    Tensor3<Scalar> const s = tissue.cauchy_stress(t, x);
    auto const& element = tissue.list().elements[static_cast<std::size_t>(t)];
    auto const& nodes = tissue.list().nodes[static_cast<std::size_t>(t)];
    Matrix<Scalar, 3, 4> corners;
    for (int k = 0; k < 4; ++k) corners.col(k) = x.col(nodes[static_cast<std::size_t>(k)]);
    fields.stress.col(t) << s.xx, s.yy, s.zz, s.xy, s.yz, s.zx;
    fields.von_mises[t] = von_mises_stress(s);
    fields.energy_density[t] = tissue.strain_energy(t, x) / element.volume();
    fields.determinant[t] = element.volume(corners) / element.volume();
  }
  return fields;
}

}  // namespace palpate
