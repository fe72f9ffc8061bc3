// SPDX-License-Identifier: MIT
#include "outputs.hpp"

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/volume/section.hpp>
#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/section_picture.hpp>
#include <palpate/vtk/series.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <array>
#include <cstdio>

namespace palpation {

std::vector<std::string> write_outputs(Options const& options, Organ const& organ, std::vector<Press> const& with, std::vector<Press> const& without) {
  using namespace palpate;
  std::string table = "place_m,x_m,y_m,z_m,force_with_nodule_N,force_without_N\n";
  for (std::size_t k = 0; k < with.size(); ++k) {
    Place const& place = organ.places[k];
    for (double const value : {place.along, place.point.x(), place.point.y(), place.point.z(), with[k].force}) {
      palpate::detail::append_number(table, value);
      table += ',';
    }
    palpate::detail::append_number(table, without[k].force);
    table += '\n';
  }
  palpate::detail::write_whole_file(options.out / "palpation.csv", table);

  SeriesWriter series(options.out / "palpation.pvd");
  std::size_t nearest = 0;   // to the nodule
  for (std::size_t k = 0; k < with.size(); ++k) {
    Press const& press = with[k];
    series.add(static_cast<double>(k), TetrahedralMesh<double>{press.positions, organ.solid.tetrahedra}, Matrix3X<double>(press.positions - organ.solid.points), press.fields);
    if ((organ.places[k].point - organ.nodule).norm() < (organ.places[nearest].point - organ.nodule).norm()) nearest = k;
  }
  std::vector<std::string> written{"palpation.csv", "palpation.pvd"};
  if (!options.pictures) return written;
  VirtualDisplay const display;
  if (!display.ready()) {
    std::fprintf(stderr, "palpation: no pictures: %s\n", display.problem().c_str());
    return written;
  }
  std::array<PlotSeries, 2> lines{PlotSeries{.label = "with nodule"}, PlotSeries{.label = "without"}};
  for (std::size_t k = 0; k < with.size(); ++k)
    for (std::size_t s = 0; s < 2; ++s) {
      lines[s].x.push_back(1000 * organ.places[k].along);
      lines[s].y.push_back((s == 0 ? with : without)[k].force);
    }
  write_plot(options.out / "force_place.png", lines, {.title = "Force that holds a press, along the line", .x = {.title = "place (mm)"}, .y = {.title = "force (N)"}});

  Press const& press = with[nearest];
  TetrahedralMesh<double> const now{press.positions, organ.solid.tetrahedra};
  Vector const across = -Vector::UnitY();
  write_section_picture(options.out / "section.png", section<double>(now, organ.nodule, across), press.fields.von_mises, surface(now), across);
  written.insert(written.end(), {"force_place.png", "section.png"});
  return written;
}

}  // namespace palpation
