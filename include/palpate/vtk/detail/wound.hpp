// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/vtk/detail/poly_data.hpp>

#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <vector>

namespace palpate::detail {

/// The walls of a wound: a surface has no inside, so below every border edge a wall goes down along the inward normal,
/// from `lip` red to `deep` dark. Rows of vertices: 0 the lip itself, then `rows` deeper ones.
template <RealScalar Scalar>
vtkSmartPointer<vtkPolyData> wound_walls(TriangleMesh<Scalar> const& mesh, double depth, std::array<double, 3> const& lip,
                                         std::array<double, 3> const& deep) {
  constexpr int rows = 4;
  auto const edges = boundary_edges(mesh);
  auto const normals = vertex_normals(mesh);
  std::vector<int> const vertices = boundary_vertices(mesh);
  auto const wall_vertex = [&](int vertex, int row) {
    auto const found = std::lower_bound(vertices.begin(), vertices.end(), vertex);
    return static_cast<int>(found - vertices.begin()) * (rows + 1) + row;
  };
  TriangleMesh<Scalar> walls;
  walls.points.resize(3, static_cast<Eigen::Index>(vertices.size()) * (rows + 1));
  walls.triangles.resize(3, static_cast<Eigen::Index>(edges.size()) * rows * 2);
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetName("colours");
  colours->SetNumberOfComponents(3);
  for (int const vertex : vertices)
    for (int row = 0; row <= rows; ++row) {
      double const share = double(row) / rows;
      walls.points.col(wall_vertex(vertex, row)) =
          mesh.points.col(vertex) - static_cast<Scalar>(depth * share) * normals.col(vertex);
      double rgb[3];
      for (std::size_t c = 0; c < 3; ++c) rgb[c] = 255.0 * (lip[c] + (deep[c] - lip[c]) * share);
      colours->InsertNextTuple(rgb);
    }
  Eigen::Index t = 0;
  for (auto const& [a, b] : edges)
    for (int row = 0; row < rows; ++row) {
      int const a0 = wall_vertex(a, row), b0 = wall_vertex(b, row), a1 = wall_vertex(a, row + 1), b1 = wall_vertex(b, row + 1);
      walls.triangles.col(t++) << b0, a0, a1;
      walls.triangles.col(t++) << b0, a1, b1;
    }
  auto surface = to_smooth_poly_data(walls);
  surface->GetPointData()->SetScalars(colours);
  return surface;
}

}  // namespace palpate::detail
