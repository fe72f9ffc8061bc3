// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <string>
#include <vector>

namespace palpation {

using Vector = palpate::Vector3<double>;

/// A place on the skin that is pressed.
struct Place {
  double along = 0.0;   // m, on the line from its middle
  Vector point, normal;
};

/// What is palpated: a solid, held from below, and the line across its upper side.
struct Organ {
  std::string name, filled;   // what the filling says of itself
  palpate::TriangleMesh<double> skin;
  palpate::TetrahedralMesh<double> solid;
  std::vector<int> held;      // nailed vertices
  std::vector<Place> places;
  Vector nodule = Vector::Zero();
  double nodule_radius = 0.0, nodule_young = 0.0;   // m, Pa
  std::vector<int> hard;      // tetrahedra of the nodule
};

/// Throws palpate::Error for a mesh that can not be used, a press deeper or wider than it is thick, a nodule that no tetrahedron lies in, a line without
/// room.
Organ prepare_organ(Options const& options);

}  // namespace palpation
