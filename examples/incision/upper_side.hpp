// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <string>
#include <vector>

namespace incision {

using palpate::TriangleMesh;
using Vector = palpate::Vector3<double>;

/// A line on a surface, seen from above as a straight one: points on the surface with their smooth outward normals.
struct SurfaceLine {
  std::vector<Vector> points, normals;
  double score = -1.0;   // 1: a plane across the view from above; below 0: there is no such line
};

/// The line on the side that looks along `up` where the surface turns least, about `length` long, away from the outline.
SurfaceLine smoothest_line(TriangleMesh<double> const& mesh, Vector const& up, double length);

/// How long a stroke an organ offers: a third of its longer side, at most 6 cm.
double stroke_length(TriangleMesh<double> const& mesh);

/// The direction of the upper side: "x", "-x", …, or "auto": across the flattest extent, towards the smoother, rounder side.
Vector upper_direction(TriangleMesh<double> const& mesh, std::string const& name);

}  // namespace incision
