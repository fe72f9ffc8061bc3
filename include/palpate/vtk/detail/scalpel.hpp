// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <array>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// Cross-sections along the tool, from the tip up: where, from the back to the cutting edge, and how thick.
/// Units: shares of the tool's length; the tip is the origin, x is where the blade cuts.
struct ToolSection {
  double height, back, edge, thickness;
};

/// A prism with eight corners through the sections, closed at both ends, with corners of its own for every face: edges stay sharp.
inline vtkSmartPointer<vtkPolyData> tool_part(std::vector<ToolSection> const& sections, Eigen::Affine3d const& world) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> normals;
  normals->SetNumberOfComponents(3);
  vtkNew<vtkCellArray> faces;
  auto const corners = [&](ToolSection const& s) {
    double const x[4] = {s.back, s.back + 0.25 * (s.edge - s.back), s.edge - 0.25 * (s.edge - s.back), s.edge};
    double const y = s.thickness / 2, z = s.height;
    std::array<Vector3<double>, 8> ring{{{x[0], -y / 2, z}, {x[1], -y, z}, {x[2], -y, z}, {x[3], -y / 4, z},
                                         {x[3], y / 4, z},  {x[2], y, z},  {x[1], y, z},  {x[0], y / 2, z}}};
    for (auto& p : ring) p = world * p;
    return ring;
  };
  auto const face = [&](std::vector<Vector3<double>> const& loop) {
    Vector3<double> normal = Vector3<double>::Zero();   // Newell's: holds for faces with corners that coincide
    for (std::size_t i = 0; i < loop.size(); ++i) normal += loop[i].cross(loop[(i + 1) % loop.size()]);
    normal.normalize();
    std::vector<vtkIdType> ids;
    for (auto const& p : loop) {
      ids.push_back(points->InsertNextPoint(p.data()));
      normals->InsertNextTuple(normal.data());
    }
    faces->InsertNextCell(static_cast<vtkIdType>(ids.size()), ids.data());
  };
  for (std::size_t i = 0; i + 1 < sections.size(); ++i) {
    auto const low = corners(sections[i]), high = corners(sections[i + 1]);
    for (std::size_t c = 0; c < 8; ++c) face({low[c], low[(c + 1) % 8], high[(c + 1) % 8], high[c]});
  }
  auto const bottom = corners(sections.front()), top = corners(sections.back());
  face({bottom.rbegin(), bottom.rend()});
  face({top.begin(), top.end()});
  auto part = vtkSmartPointer<vtkPolyData>::New();
  part->SetPoints(points);
  part->SetPolys(faces);
  part->GetPointData()->SetNormals(normals);
  return part;
}

inline vtkSmartPointer<vtkPolyData> scalpel_blade(Eigen::Affine3d const& world) {
  return tool_part({{0.000, -0.001, 0.001, 0.0010},
                    {0.010, -0.006, 0.007, 0.0030},
                    {0.030, -0.011, 0.016, 0.0050},
                    {0.060, -0.016, 0.023, 0.0060},
                    {0.110, -0.018, 0.024, 0.0060},
                    {0.190, -0.018, 0.018, 0.0060},
                    {0.230, -0.014, 0.014, 0.0060}},
                   world);
}

inline vtkSmartPointer<vtkPolyData> scalpel_handle(Eigen::Affine3d const& world) {
  return tool_part({{0.200, -0.012, 0.012, 0.012},
                    {0.225, -0.016, 0.016, 0.022},
                    {0.300, -0.019, 0.019, 0.026},
                    {0.420, -0.026, 0.026, 0.030},
                    {0.600, -0.028, 0.028, 0.030},
                    {0.960, -0.022, 0.022, 0.028},
                    {1.000, -0.014, 0.014, 0.020}},
                   world);
}

}  // namespace palpate::detail
