// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/heart.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/volume/fill.hpp>

namespace palpate {

/// The library's liver as a solid: `make_organ` filled. With the default edge some 16,000 tetrahedra; halving it makes eight times as many.
/// Units      m.
/// Cost       about 0.3 s with the default edge.
template <RealScalar Scalar>
TetrahedralMesh<Scalar> make_organ_volume(OrganOptions const& organ = {}, FillOptions const& filling = {.edge = 0.008}) {
  return fill(make_organ<Scalar>(organ), filling).mesh;
}

/// The library's heart as a solid, without chambers: `make_heart` filled. With the default edge some 10,000 tetrahedra.
template <RealScalar Scalar>
TetrahedralMesh<Scalar> make_heart_volume(HeartOptions const& heart = {}, FillOptions const& filling = {.edge = 0.0075}) {
  return fill(make_heart<Scalar>(heart), filling).mesh;
}

}  // namespace palpate
