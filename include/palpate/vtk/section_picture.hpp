// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/volume/section.hpp>
#include <palpate/vtk/detail/off_screen.hpp>
#include <palpate/vtk/detail/poly_data.hpp>
#include <palpate/vtk/picture.hpp>

#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkCamera.h>
#include <vtkCellData.h>
#include <vtkColorTransferFunction.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace palpate {

/// How the picture of a section looks.
struct SectionStyle {
  int width = 1280;   ///< pixels
  int height = 960;
  std::string quantity = "von Mises stress [Pa]";   ///< what stands at the colours
  std::optional<std::array<double, 2>> range{};      ///< values at the ends of the colours; else the least and the largest of the section
  Vector3<double> up = Vector3<double>::UnitZ();
};

/// Draws a section of a solid, coloured by a value of each tetrahedron of the volume (viridis), with a bar that says what the colours mean, and as much of a surface
/// as lies behind it, translucent. Seen against its normal, without perspective.
///   write_section_picture("section.png", section<double>(now, nodule, Vector3<double>::UnitY()), fields.von_mises, surface(now), Vector3<double>::UnitY());
/// Errors     `FileError` without a display or when the file can not be written. `InvalidArgument`: an empty section, fewer values than tetrahedra, a picture too
///            small, `up` along the normal.
template <RealScalar Scalar, class Values>
void write_section_picture(std::filesystem::path const& file, Section<Scalar> const& section, Values const& values, TriangleMesh<Scalar> const& around,
                           Vector3<double> const& normal, SectionStyle const& style = {}) {
  if (style.width < 16 || style.height < 16 || style.width > 16384 || style.height > 16384)
    throw InvalidArgument(detail::message("a picture of ", style.width, " x ", style.height, " pixels; give 16 … 16384"));
  if (section.tetrahedron.empty()) throw InvalidArgument("the section is empty; the plane does not meet the volume");
  Matrix<double, 1, Dynamic> coloured(static_cast<Eigen::Index>(section.tetrahedron.size()));
  for (std::size_t i = 0; i < section.tetrahedron.size(); ++i) {
    int const t = section.tetrahedron[i];
    if (t >= values.size()) throw InvalidArgument(detail::message("the section has tetrahedron ", t, " and there are ", values.size(), " values; give one for each"));
    coloured[static_cast<Eigen::Index>(i)] = static_cast<double>(values[t]);
  }
  detail::require_display(file);
  detail::MessageTrap const trap;

  auto const range = style.range.value_or(std::array<double, 2>{coloured.minCoeff(), coloured.maxCoeff()});
  vtkNew<vtkColorTransferFunction> viridis;
  constexpr double colours[][3] = {{0.267, 0.005, 0.329}, {0.283, 0.141, 0.458}, {0.254, 0.265, 0.530}, {0.207, 0.372, 0.553}, {0.164, 0.471, 0.558},
                                   {0.128, 0.567, 0.551}, {0.135, 0.659, 0.518}, {0.267, 0.749, 0.441}, {0.478, 0.821, 0.318}, {0.741, 0.873, 0.150}, {0.993, 0.906, 0.144}};
  for (int k = 0; k <= 10; ++k) viridis->AddRGBPoint(range[0] + (range[1] - range[0]) * k / 10, colours[k][0], colours[k][1], colours[k][2]);

  vtkNew<vtkRenderer> renderer;
  auto const add = [&](vtkPolyData* shape) {
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(shape);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    renderer->AddActor(actor);
    return actor;
  };
  auto const plane = detail::to_poly_data(section.mesh);
  plane->GetCellData()->SetScalars(detail::float_array("value", coloured));
  auto const cut = add(plane);
  cut->GetMapper()->SetLookupTable(viridis);
  cut->GetMapper()->SetScalarRange(range[0], range[1]);
  cut->GetProperty()->LightingOff();
  auto const behind = add(detail::to_smooth_poly_data(around));
  vtkNew<vtkPlane> front;
  front->SetOrigin(section.mesh.points(0, 0), section.mesh.points(1, 0), section.mesh.points(2, 0));
  front->SetNormal(-normal.x(), -normal.y(), -normal.z());
  behind->GetMapper()->AddClippingPlane(front);
  behind->GetProperty()->SetColor(0.56, 0.20, 0.16);
  behind->GetProperty()->SetOpacity(0.15);

  vtkNew<vtkScalarBarActor> bar;
  bar->SetLookupTable(viridis);
  bar->SetTitle(style.quantity.c_str());
  bar->SetNumberOfLabels(6);
  double const largest = std::max(std::abs(range[0]), std::abs(range[1])), span = range[1] - range[0];
  int const digits = span > 1e-9 * largest ? std::max(3, 3 + static_cast<int>(std::log10(largest / span))) : 3;
  bar->SetLabelFormat(span >= 50 ? "%.0f" : detail::message("%.", digits, "g").c_str());
  bar->SetUnconstrainedFontSize(true);
  bar->SetPosition(0.85, 0.1);
  bar->SetWidth(0.08);
  bar->SetHeight(0.8);
  for (vtkTextProperty* const text : {bar->GetTitleTextProperty(), bar->GetLabelTextProperty()}) {
    text->SetColor(0.1, 0.1, 0.1);
    text->SetFontSize(std::min(style.height, 3 * style.width / 4) / 45);
    text->ItalicOff(), text->BoldOff(), text->ShadowOff();
  }
  renderer->AddActor2D(bar);

  TriangleMesh<double> const all{around.points.template cast<double>(), around.triangles};
  Camera const camera = framing(all, normal, style.up, static_cast<double>(style.width) / style.height, 0.35);
  vtkCamera* const eye = renderer->GetActiveCamera();
  eye->SetPosition(camera.position.data());
  eye->SetFocalPoint(camera.target.data());
  eye->SetViewUp(camera.up.data());
  eye->ParallelProjectionOn();
  eye->SetParallelScale(std::max(1.0, static_cast<double>(style.height) / style.width) * (camera.position - camera.target).norm() * std::tan(camera.view_angle / 2 * 3.14159265358979323846 / 180));
  renderer->ResetCameraClippingRange();
  renderer->SetBackground(1.0, 1.0, 1.0);

  detail::write_png(file, renderer, style.width, style.height);
}

}  // namespace palpate
