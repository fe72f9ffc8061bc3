// SPDX-License-Identifier: MIT
#pragma once

#include "picture.hpp"

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <string>
#include <vector>

namespace drawing {

/// A surface, seen from a direction.
struct View {
  std::string name;
  palpate::TriangleMesh<double> mesh;   // m
  palpate::Vector3<double> from = palpate::Vector3<double>(0.2, -1.0, 0.6), up = palpate::Vector3<double>::UnitZ();
  bool has_facets = false;   // shaded by the normals of its triangles, not by smooth ones of its vertices
};

/// What an example has to show besides its numbers.
struct Album {
  std::vector<Picture> charts;
  std::vector<View> views;
};

/// The program: NAME prints its numbers, NAME FOLDER also draws its album there. Where nothing can be drawn, without the component vtk or without a
/// display, one line on standard error says what is left out, and the numbers are the same.
/// Exit codes: 0 done; 2 the arguments or the folder can not be used; 1 anything else.
int run_example(char const* name, int argc, char** argv, Album (*example)());

}  // namespace drawing
