// SPDX-License-Identifier: MIT
#pragma once

#include "picture.hpp"

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <array>
#include <string>
#include <vector>

namespace drawing {

/// Another surface in a view; red, green, blue in 0 … 1.
struct Part {
  palpate::TriangleMesh<double> mesh;   // m
  std::array<double, 3> colour;
};

/// A surface, seen from a direction.
struct View {
  std::string name;
  palpate::TriangleMesh<double> mesh;   // m
  palpate::Vector3<double> from = palpate::Vector3<double>(0.2, -1.0, 0.6), up = palpate::Vector3<double>::UnitZ();
  bool has_facets = false;   // shaded by the normals of its triangles, not by smooth ones of its vertices
  std::array<double, 3> colour{0.56, 0.20, 0.16};
  std::vector<Part> parts{};
};

/// What an instrument shows: dots from 0, black, to 255, white, row by row from the top, and words in white, from their upper left corner.
struct Raster {
  struct Words {
    std::string text;
    int left, top;
  };
  std::string name;
  int width, height;
  std::vector<unsigned char> grey{};
  std::vector<Words> words{};
};

/// What an example has to show besides its numbers.
struct Album {
  std::vector<Picture> charts;
  std::vector<View> views;
  std::vector<Raster> rasters{};
};

/// The program: NAME prints its numbers, NAME FOLDER also draws its album there. Where nothing can be drawn, without the component vtk or without a
/// display, one line on standard error says what is left out, and the numbers are the same.
/// Exit codes: 0 done; 2 the arguments or the folder can not be used; 1 anything else.
int run_example(char const* name, int argc, char** argv, Album (*example)());

}  // namespace drawing
