// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/wound_walls.hpp>

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <array>
#include <cstddef>

namespace palpate::detail {

/// A 3 × n matrix as a VTK array of n vectors.
template <RealScalar Scalar>
vtkSmartPointer<vtkFloatArray> vector_array(char const* name, Matrix<Scalar, 3, Dynamic> const& vectors) {
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(vectors.cols());
  for (Eigen::Index i = 0; i < vectors.cols(); ++i)
    array->SetTuple3(i, static_cast<double>(vectors(0, i)), static_cast<double>(vectors(1, i)), static_cast<double>(vectors(2, i)));
  return array;
}

template <RealScalar Scalar>
vtkSmartPointer<vtkPolyData> to_poly_data(TriangleMesh<Scalar> const& mesh) {
  vtkNew<vtkPoints> points;
  points->SetNumberOfPoints(mesh.points.cols());
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
    Vector3<double> const p = mesh.points.col(i).template cast<double>();
    points->SetPoint(i, p.data());
  }
  vtkNew<vtkCellArray> triangles;
  triangles->AllocateExact(mesh.triangles.cols(), 3 * mesh.triangles.cols());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    vtkIdType const corners[3] = {mesh.triangles(0, t), mesh.triangles(1, t), mesh.triangles(2, t)};
    triangles->InsertNextCell(3, corners);
  }
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPoints(points);
  surface->SetPolys(triangles);
  return surface;
}

/// With a smooth normal at every vertex. A cut gives each of its sides vertices of their own, so its edges stay sharp.
template <RealScalar Scalar>
vtkSmartPointer<vtkPolyData> to_smooth_poly_data(TriangleMesh<Scalar> const& mesh) {
  auto surface = to_poly_data(mesh);
  surface->GetPointData()->SetNormals(vector_array<Scalar>("Normals", vertex_normals(mesh)));
  return surface;
}

/// Walls below every border edge, from `lip` red to `deep` dark.
template <RealScalar Scalar>
vtkSmartPointer<vtkPolyData> coloured_walls(TriangleMesh<Scalar> const& mesh, double depth, std::array<double, 3> const& lip,
                                            std::array<double, 3> const& deep) {
  auto const walls = wound_walls(mesh, boundary_edges(mesh), static_cast<Scalar>(depth), 4);
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetName("colours");
  colours->SetNumberOfComponents(3);
  for (Scalar const share : walls.share) {
    double rgb[3];
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = 255.0 * (lip[c] + (deep[c] - lip[c]) * static_cast<double>(share));
    colours->InsertNextTuple(rgb);
  }
  auto surface = to_smooth_poly_data(walls.mesh);
  surface->GetPointData()->SetScalars(colours);
  return surface;
}

}  // namespace palpate::detail
