// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/wound_walls.hpp>
#include <palpate/vtk/detail/poly_data.hpp>

#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <array>
#include <cstddef>

namespace palpate::detail {

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
