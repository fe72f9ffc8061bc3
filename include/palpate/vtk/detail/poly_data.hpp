// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

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

}  // namespace palpate::detail
