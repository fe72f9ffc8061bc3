// SPDX-License-Identifier: MIT
#include "charts.hpp"

#include <palpate/vtk/plot.hpp>

#include <cstddef>

namespace training {

namespace {

constexpr std::size_t every = 4;   // ticks; a tremor of 12 Hz has twenty points a period

template <class Value>
palpate::PlotSeries series_of(Drawn const& one, Value value) {
  palpate::PlotSeries series{.label = one.label, .marks = false};
  auto const& ticks = one.session->recording.ticks();
  for (std::size_t i = 0; i < ticks.size(); i += every) {
    auto const [x, y] = value(ticks[i], i);
    series.x.push_back(x);
    series.y.push_back(y);
  }
  return series;
}

}  // namespace

void write_charts(std::filesystem::path const& folder, std::vector<Drawn> const& all) {
  struct Point {
    double x, y;
  };
  std::vector<palpate::PlotSeries> paths, deviations, forces;
  for (Drawn const& one : all) {
    paths.push_back(series_of(one, [](palpate::Tick const& tick, std::size_t) { return Point{1000.0 * tick.tip.x(), 1000.0 * tick.tip.y()}; }));
    forces.push_back(series_of(one, [](palpate::Tick const& tick, std::size_t) {
      bool const touches = tick.phase != palpate::CuttingPhase::no_contact;
      return Point{1000.0 * tick.depth, touches ? tick.force.norm() : 0.0};
    }));
    if (one.comparison == nullptr)
      deviations.push_back({});   // a series without points keeps the colours of the others
    else
      deviations.push_back(series_of(one, [&](palpate::Tick const& tick, std::size_t i) {
        return Point{tick.time, 1000.0 * one.comparison->alignment.distance[i]};
      }));
  }
  palpate::write_plot(folder / "path.png", paths,
                      {.title = "Where the tip went, seen from above", .x = {.title = "x [mm]"}, .y = {.title = "y [mm]", .from = 38.0, .to = 54.0}});
  palpate::write_plot(folder / "deviation.png", deviations,
                      {.title = "Distance from the expert's path", .x = {.title = "time [s]"}, .y = {.title = "distance [mm]"}});
  palpate::write_plot(folder / "force.png", forces,
                      {.title = "Force of the tissue over depth", .x = {.title = "depth [mm]"}, .y = {.title = "force [N]"}});
}

}  // namespace training
