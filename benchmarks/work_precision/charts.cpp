// SPDX-License-Identifier: MIT
#include "charts.hpp"

#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace work_precision {

namespace {

using palpate::PlotSeries;

/// One series an integrator, in the order of the list: each keeps its colour and mark in all charts.
template <class Add>
std::vector<PlotSeries> series_of(Rows const& rows, char const* kind, std::string const& scene, std::vector<std::string> const& integrators, Add add) {
  std::vector<PlotSeries> series;
  for (auto const& integrator : integrators) {
    PlotSeries one{.label = integrator, .x = {}, .y = {}};
    for (Row const& row : rows)
      if (row.kind == kind && row.scene == scene && row.integrator == integrator) add(one, row);
    series.push_back(std::move(one));
  }
  return series;
}

bool any_point(std::vector<PlotSeries> const& series) {
  return std::any_of(series.begin(), series.end(), [](PlotSeries const& one) { return !one.x.empty(); });
}

/// For a scene with a slow load: implicit steps and leapfrog's, with lines where they cost the same and where the error is 1 %.
template <class Write>
void write_slow_load(Write const& write, Rows const& rows, std::string const& scene, std::vector<std::string> const& integrators, palpate::PlotAxis const& error) {
  double even = 0, least = 0;
  auto series = series_of(rows, "precision", scene, integrators, [&](PlotSeries& one, Row const& row) {
    bool const leapfrog = row.integrator == "LeapfrogVerlet";
    if (row.status != "ok" || std::isnan(row.static_error) || !(row.products > 0 || leapfrog)) return;
    if (leapfrog && even == 0) even = row.cost;
    if (least == 0 || row.cost < least) least = row.cost;
    one.x.push_back(row.cost), one.y.push_back(row.error);
  });
  if (even == 0) return;
  series.push_back({.label = "leapfrog's least cost", .x = {even, even}, .y = {error.from, 1}, .marks = false});
  series.push_back({.label = "error of 1 %", .x = {least, 10 * even}, .y = {0.01, 0.01}, .marks = false});
  write(scene + "_implicit", series, {.title = "Implicit steps far above leapfrog's limit: " + scene, .x = {"computing time for a second of the scene [s]", true}, .y = error});
}

}  // namespace

std::vector<std::filesystem::path> write_charts(std::filesystem::path const& folder, Rows const& rows, std::vector<std::string> const& integrators) {
  std::vector<std::filesystem::path> files;
  palpate::VirtualDisplay const display;
  if (!display.ready()) {
    std::printf("\n%s\n", display.problem().c_str());
    return files;
  }
  auto const write = [&](std::string const& name, std::vector<PlotSeries> const& series, palpate::PlotStyle style) {
    if (!any_point(series)) return;
    style.width = 1100, style.height = 700;
    files.push_back(folder / ("work_precision_" + name + ".png"));
    write_plot(files.back(), series, style);
  };
  for (Row const& reference : rows) {
    if (reference.kind != "reference") continue;
    std::string const& scene = reference.scene;
    palpate::PlotAxis const error{"largest error / largest displacement", true, 1e-9, 2};
    write(scene, series_of(rows, "precision", scene, integrators, [](PlotSeries& one, Row const& row) {
            if (row.status == "ok" && row.error < 1) one.x.push_back(row.cost), one.y.push_back(row.error);
          }),
          {.title = "Work and precision: " + scene + ", " + std::to_string(reference.particles) + " particles", .x = {"computing time for a second of the scene [s]", true}, .y = error});
    write_slow_load(write, rows, scene, integrators, error);
    auto const path = [](PlotSeries& one, Row const& row) { one.x.push_back(row.time), one.y.push_back(row.energy); };
    write(scene + "_energy", series_of(rows, "energy_path", scene, integrators, path),
          {.title = "Energy of the undamped body: " + scene, .x = {"time [s]"}, .y = {"energy / energy at the start", false, 0, 1.4}});
  }
  return files;
}

}  // namespace work_precision
