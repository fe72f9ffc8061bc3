// SPDX-License-Identifier: MIT
#include "charts.hpp"

#include <palpate/vtk/plot.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

namespace fit_example {

namespace {

using palpate::MeasuredPhase;
using palpate::Measurement;
using palpate::PlotSeries;

constexpr std::array all_phases{MeasuredPhase::indenting, MeasuredPhase::loading, MeasuredPhase::unloading};
constexpr std::size_t colours = palpate::plot_colours;   // the second so many series are dashed, the third are like the first
constexpr std::size_t black = 6;

/// With a little room above and below; ticks need not be at the ends.
void write(std::filesystem::path const& file, std::vector<PlotSeries> const& series, std::string title, std::string up) {
  double low = 0.0, high = 0.0;
  for (PlotSeries const& one : series)
    for (double const y : one.y) low = std::min(low, y), high = std::max(high, y);
  double const room = 0.04 * (high - low);
  palpate::PlotStyle style;
  style.width = 1000, style.height = 620;
  style.title = std::move(title);
  style.x.title = "depth [mm]";
  style.y = {.title = std::move(up), .from = low - room, .to = high + room};
  palpate::write_plot(file, series, style);
}

/// Measurements that one curve stands for: of one phase, and of about one speed.
struct Group {
  std::string label;
  double speed = 0.0;   // m/s, of the curve
  std::vector<Measurement> measurements;
};

/// Three digits, as the legend has room for: "unloading, 12.3 mm/s".
std::string label_of(MeasuredPhase phase, char const* about, double speed) {
  char text[64];
  double const shown = 1000 * speed;
  std::snprintf(text, sizeof text, shown < 100 ? "%s, %s%.3g mm/s" : "%s, %s%.0f mm/s", to_string(phase), about, shown);
  return text;
}

/// One group, or at most three of as many measurements each where the speeds are many.
std::vector<Group> by_speed(MeasuredPhase phase, std::vector<Measurement> all, bool depends_on_speed) {
  std::sort(all.begin(), all.end(), [](auto const& a, auto const& b) { return a.speed < b.speed; });
  if (!depends_on_speed) return {{to_string(phase), all[all.size() / 2].speed, std::move(all)}};
  std::vector<Group> groups;
  for (Measurement const& m : all) {
    if (groups.empty() || groups.back().speed != m.speed) groups.push_back({label_of(phase, "", m.speed), m.speed, {}});
    groups.back().measurements.push_back(m);
  }
  if (groups.size() <= 3) return groups;
  groups.clear();
  for (std::size_t third = 0; third < 3; ++third) {
    auto const at = [&](std::size_t k) { return all.begin() + static_cast<std::ptrdiff_t>(all.size() * k / 3); };
    auto const first = at(third), last = at(third + 1);
    double const middle = (first + (last - first) / 2)->speed;
    groups.push_back({label_of(phase, "~", middle), middle, {first, last}});
  }
  return groups;
}

std::vector<Measurement> of_phase(std::span<Measurement const> all, MeasuredPhase phase) {
  std::vector<Measurement> result;
  for (Measurement const& m : all)
    if (m.phase == phase) result.push_back(m);
  return result;
}

/// Groups of everything that the model stands for; seven at most.
std::vector<Group> groups_of(FittedModel const& fitted) {
  std::vector<Group> groups;
  for (MeasuredPhase const phase : all_phases) {
    auto all = of_phase(fitted.used, phase);
    if (all.empty()) continue;
    double const deepest = palpate::depths_of(all).high;
    auto const speeds = palpate::speeds_of(all);
    double const slow = fitted.force({deepest, speeds.low, phase}), fast = fitted.force({deepest, speeds.high, phase});
    for (Group& group : by_speed(phase, std::move(all), std::abs(fast - slow) > 1e-9 * std::abs(slow))) groups.push_back(std::move(group));
  }
  return groups;
}

PlotSeries points(std::string label, std::vector<Measurement> const& measurements) {
  PlotSeries series{.label = std::move(label), .lines = false};
  for (Measurement const& m : measurements) series.x.push_back(1000 * m.depth), series.y.push_back(m.force);
  return series;
}

PlotSeries curve(std::string label, FittedModel const& fitted, MeasuredPhase phase, double speed, std::vector<Measurement> const& over) {
  PlotSeries series{.label = std::move(label), .marks = false};
  auto const depths = palpate::depths_of(over);
  constexpr int steps = 200;
  for (int k = 0; k <= steps; ++k) {
    double const depth = depths.low + (depths.high - depths.low) * k / steps;
    series.x.push_back(1000 * depth), series.y.push_back(fitted.force({depth, speed, phase}));
  }
  return series;
}

}  // namespace

void draw_fit(std::filesystem::path const& file, FittedModel const& fitted) {
  auto const groups = groups_of(fitted);
  std::vector<PlotSeries> series(2 * colours + groups.size());
  for (std::size_t k = 0; k < groups.size(); ++k) {
    auto const& [label, speed, measurements] = groups[k];
    series[k] = points(label, measurements);
    series[2 * colours + k] = curve("fit", fitted, measurements.front().phase, speed, measurements);
  }
  write(file, series, "Measurements and fit: " + fitted.model, "force [N]");
}

void draw_residuals(std::filesystem::path const& file, FittedModel const& fitted) {
  std::vector<PlotSeries> series(3 * colours);
  for (std::size_t p = 0; p < all_phases.size(); ++p) {
    PlotSeries& one = series[p] = {.label = to_string(all_phases[p]), .lines = false};
    for (std::size_t k = 0; k < fitted.used.size(); ++k)
      if (fitted.used[k].phase == all_phases[p]) one.x.push_back(1000 * fitted.used[k].depth), one.y.push_back(1000 * fitted.residuals[k]);
  }
  auto const depths = palpate::depths_of(fitted.used);
  std::vector<double> const ends{1000 * depths.low, 1000 * depths.high};
  series[2 * colours + black] = {.label = "0", .x = ends, .y = {0.0, 0.0}, .marks = false};
  double const two = 2000 * fitted.rms;
  std::vector<double> const around{ends[0], ends[1], ends[1], ends[0], ends[0]};
  series[colours + black] = {.label = "twice the rms", .x = around, .y = {-two, -two, two, two, -two}, .marks = false};
  write(file, series, "Measured minus fitted: " + fitted.model, "residual [mN]");
}

void draw_comparison(std::filesystem::path const& file, std::vector<FittedModel> const& fits, std::span<Measurement const> measurements) {
  std::vector<PlotSeries> series(4 * colours);
  for (std::size_t p = 0; p < all_phases.size(); ++p)
    series[black + p * colours] = points(to_string(all_phases[p]), of_phase(measurements, all_phases[p]));
  for (FittedModel const& fitted : fits) {
    auto const colour = static_cast<std::size_t>(std::find(model_names.begin(), model_names.end(), fitted.model) - model_names.begin());
    std::vector<Measurement> in, back = of_phase(fitted.used, MeasuredPhase::unloading);
    for (MeasuredPhase const phase : {MeasuredPhase::indenting, MeasuredPhase::loading}) {
      auto const some = of_phase(fitted.used, phase);
      if (some.empty()) continue;
      PlotSeries const part = curve(fitted.model, fitted, phase, palpate::speeds_of(some).high, some);
      PlotSeries& line = series[colour];
      line = {.label = part.label, .x = line.x, .y = line.y, .marks = false};
      line.x.insert(line.x.end(), part.x.begin(), part.x.end()), line.y.insert(line.y.end(), part.y.begin(), part.y.end());
    }
    if (back.empty()) continue;
    series[colours + colour] = curve(fitted.model + ", back", fitted, MeasuredPhase::unloading, palpate::speeds_of(back).high, back);
  }
  write(file, series, "Measurements and all fits, at the fastest speed", "force [N]");
}

}  // namespace fit_example
