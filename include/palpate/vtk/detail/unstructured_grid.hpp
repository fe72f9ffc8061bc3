// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/vtk/detail/poly_data.hpp>

#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>

namespace palpate::detail {

template <RealScalar Scalar>
vtkSmartPointer<vtkUnstructuredGrid> to_unstructured_grid(TetrahedralMesh<Scalar> const& mesh) {
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(mesh.tetrahedra.cols(), 4 * mesh.tetrahedra.cols());
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    vtkIdType const corners[4] = {mesh.tetrahedra(0, t), mesh.tetrahedra(1, t), mesh.tetrahedra(2, t), mesh.tetrahedra(3, t)};
    cells->InsertNextCell(4, corners);
  }
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->SetPoints(to_points<Scalar>(mesh.points));
  grid->SetCells(VTK_TETRA, cells);
  return grid;
}

}  // namespace palpate::detail
