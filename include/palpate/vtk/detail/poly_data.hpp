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

/// A matrix as a VTK array: a tuple a column.
template <class Derived>
vtkSmartPointer<vtkFloatArray> float_array(char const* name, Eigen::MatrixBase<Derived> const& tuples) {
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(tuples.rows()));
  array->SetNumberOfTuples(tuples.cols());
  for (Eigen::Index i = 0; i < tuples.cols(); ++i)
    for (Eigen::Index k = 0; k < tuples.rows(); ++k) array->SetComponent(i, static_cast<int>(k), static_cast<double>(tuples(k, i)));
  return array;
}

template <RealScalar Scalar>
vtkSmartPointer<vtkPoints> to_points(Matrix3X<Scalar> const& columns) {
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetNumberOfPoints(columns.cols());
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    Vector3<double> const p = columns.col(i).template cast<double>();
    points->SetPoint(i, p.data());
  }
  return points;
}

template <RealScalar Scalar>
vtkSmartPointer<vtkPolyData> to_poly_data(TriangleMesh<Scalar> const& mesh) {
  vtkNew<vtkCellArray> triangles;
  triangles->AllocateExact(mesh.triangles.cols(), 3 * mesh.triangles.cols());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    vtkIdType const corners[3] = {mesh.triangles(0, t), mesh.triangles(1, t), mesh.triangles(2, t)};
    triangles->InsertNextCell(3, corners);
  }
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPoints(to_points<Scalar>(mesh.points));
  surface->SetPolys(triangles);
  return surface;
}

/// With a smooth normal at every vertex. A cut gives each of its sides vertices of their own, so its edges stay sharp.
template <RealScalar Scalar>
vtkSmartPointer<vtkPolyData> to_smooth_poly_data(TriangleMesh<Scalar> const& mesh) {
  auto surface = to_poly_data(mesh);
  surface->GetPointData()->SetNormals(float_array("Normals", vertex_normals(mesh)));
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
