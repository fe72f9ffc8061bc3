// SPDX-License-Identifier: MIT
#include "album.hpp"
#include "exit_code.hpp"

#include <palpate/core/error.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <system_error>

#ifdef PALPATE_EXAMPLES_DRAW
#include <palpate/vtk/detail/off_screen.hpp>
#include <palpate/vtk/picture.hpp>
#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <vtkActor2D.h>
#include <vtkImageData.h>
#include <vtkImageMapper.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#endif

namespace drawing {

namespace {

#ifdef PALPATE_EXAMPLES_DRAW

/// Each triangle with corners of its own: a vertex normal is then the triangle's.
palpate::TriangleMesh<double> faceted(palpate::TriangleMesh<double> const& mesh) {
  palpate::TriangleMesh<double> apart;
  apart.points.resize(3, 3 * mesh.triangles.cols());
  apart.triangles.resize(3, mesh.triangles.cols());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k) {
      apart.points.col(3 * t + k) = mesh.points.col(mesh.triangles(k, t));
      apart.triangles(k, t) = static_cast<int>(3 * t) + k;
    }
  return apart;
}

void write_raster(std::filesystem::path const& file, Raster const& raster) {
  palpate::detail::require_display(file);
  vtkNew<vtkImageData> image;
  image->SetDimensions(raster.width, raster.height, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  for (int y = 0; y < raster.height; ++y)   // VTK's rows begin at the bottom
    std::copy_n(raster.grey.begin() + static_cast<std::ptrdiff_t>(y) * raster.width, raster.width,
                static_cast<unsigned char*>(image->GetScalarPointer(0, raster.height - 1 - y, 0)));
  vtkNew<vtkImageMapper> mapper;
  mapper->SetInputData(image);
  mapper->SetColorWindow(255.0), mapper->SetColorLevel(127.5);
  vtkNew<vtkActor2D> dots;
  dots->SetMapper(mapper);
  vtkNew<vtkRenderer> renderer;
  renderer->AddActor2D(dots);
  for (Raster::Words const& words : raster.words) {
    vtkNew<vtkTextActor> text;
    text->SetInput(words.text.c_str());
    text->SetPosition(words.left, raster.height - words.top);
    text->GetTextProperty()->SetFontSize(14);
    text->GetTextProperty()->SetVerticalJustificationToTop();
    renderer->AddActor2D(text);
  }
  palpate::detail::write_png(file, renderer, raster.width, raster.height);
}

/// Returns why nothing can be drawn, or nothing.
std::string draw(Album const& album, std::filesystem::path const& folder) {
  palpate::VirtualDisplay const display;
  if (!display.ready()) return display.problem();
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem || !std::filesystem::is_directory(folder))
    throw palpate::FileError(palpate::detail::message("can not make the folder ", folder.string(), "; choose another"));
  for (Picture const& chart : album.charts) palpate::write_plot(folder / (chart.name() + ".png"), chart.series(), chart.style());
  for (View const& view : album.views) {
    palpate::PictureStyle const style{.width = 560, .height = 480, .tissue = view.colour, .wound_depth = 0.0};
    std::vector<palpate::PicturePart> parts;
    palpate::TriangleMesh<double> all = view.mesh;   // as far as its points, to be framed
    for (Part const& part : view.parts) {
      parts.push_back({part.mesh, part.colour});
      all.points.conservativeResize(3, all.points.cols() + part.mesh.points.cols());
      all.points.rightCols(part.mesh.points.cols()) = part.mesh.points;
    }
    auto const camera = palpate::framing(all, view.from, view.up, 560.0 / 480.0);
    palpate::write_picture(folder / (view.name + ".png"), view.has_facets ? faceted(view.mesh) : view.mesh, camera, std::nullopt, style, parts);
  }
  for (Raster const& raster : album.rasters) write_raster(folder / (raster.name + ".png"), raster);
  return {};
}

#else

std::string draw(Album const&, std::filesystem::path const&) { return "this program was built without the component vtk (Debian: libvtk9-dev)"; }

#endif

}  // namespace

int run_example(char const* name, int argc, char** argv, Album (*example)()) {
  std::string const folder = argc > 1 ? argv[1] : "";
  if (argc > 2 || (argc == 2 && (folder.empty() || folder.front() == '-'))) {
    bool const asked = folder == "--help";
    std::fprintf(asked ? stdout : stderr, "usage: %s [FOLDER]\nprints its numbers, and draws its pictures into the folder\n", name);
    return asked ? 0 : 2;
  }
  return exit_code_of(name, [&]() -> int {
    Album const album = example();
    std::string names;
    for (Picture const& chart : album.charts) names += ' ' + chart.name() + ".png";
    for (View const& view : album.views) names += ' ' + view.name + ".png";
    for (Raster const& raster : album.rasters) names += ' ' + raster.name + ".png";
    if (folder.empty()) {
      std::printf("%s FOLDER also draws%s\n", name, names.c_str());
      return 0;
    }
    if (std::string const reason = draw(album, folder); reason.empty())
      std::printf("drawn in %s:%s\n", folder.c_str(), names.c_str());
    else
      std::fprintf(stderr, "%s: no pictures, without%s: %s\n", name, names.c_str(), reason.c_str());
    return 0;
  });
}

}  // namespace drawing
