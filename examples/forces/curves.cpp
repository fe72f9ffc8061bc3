// SPDX-License-Identifier: MIT
// Force curves after the puncture: the liver's loop, what bounds a network, another blade, and a network that knows of speed.
#include "pictures.hpp"

#include <palpate/fitting/fit_network.hpp>
#include <palpate/force/blade.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace forces {

using namespace palpate;

namespace {

/// From one depth [m] to the next in steps of 10 µm. Points before `draw_from` are not drawn.
template <class Force>
void follow(PlotSeries& series, Force force, std::vector<double> const& ways, double draw_from) {
  double depth = ways.front();
  for (double const to : ways) {
    int const steps = std::max(1, static_cast<int>(std::lround(std::abs(to - depth) / 1e-5)));
    double const from = depth;
    for (int k = 1; k <= steps; ++k) {
      double const next = from + (to - from) * k / steps;
      double const value = force({.phase = CuttingPhase::moving, .depth = next, .previous_depth = depth}).z();
      if (next >= draw_from) add(series, 1000 * next, value);
      depth = next;
    }
  }
}

}  // namespace

Picture liver_loop() {
  Picture picture("forces_liver_loop", "The liver's loop, and a reversal inside it", "depth [mm]", "force [N]");
  auto const curve = liver_hysteresis<double>();
  sample(picture.line(blue, "loading"), 0.014, liver_range<double>().high, 1000.0, [&](double d) { return curve(d, Phase::loading); });
  sample(picture.line(orange, "unloading"), liver_range<double>().high, 0.014, 1000.0, [&](double d) { return curve(d, Phase::unloading); });
  picture.line(blue, "loading").arrows = picture.line(orange, "unloading").arrows = true;
  std::vector<double> const ways{0.010, 0.0205, 0.0175, 0.0215};
  follow(picture.dashes(black, "over 1 mm"), CuttingForce(curve), ways, 0.016);
  follow(picture.dashes(pink, "at once (thesis)"), CuttingForce(curve, CurveJoin<double>{.reversal_depth = 0.0}), ways, 0.016);
  double widest = 0.0, where = 0.0;
  for (double d = 0.0; d <= liver_range<double>().high; d += 1e-5)
    if (double const gap = curve(d, Phase::loading) - curve(d, Phase::unloading); gap > widest) widest = gap, where = d;
  picture.quote("widest %.3f N at %.2f mm; at once: %.3f N down at 20.5 mm, %.3f N up at 17.5 mm", widest, 1000 * where,
                curve(0.0205, Phase::loading) - curve(0.0205, Phase::unloading), curve(0.0175, Phase::loading) - curve(0.0175, Phase::unloading));
  return picture;
}

Picture domain_guard() {
  Picture picture("forces_guard", "Beyond the data: the tangent, a cap, and what the network would say", "depth [mm]", "force [N]");
  auto const curve = liver_loading<double>(), capped = liver_loading<double>({.largest_force = 2.0});
  double const end = liver_range<double>().high;
  auto const raw = [&](double d) { return curve.network()(d); };
  sample(picture.line(blue, "measured depths"), 0.0, end, 1000.0, curve);
  sample(picture.line(orange, "tangent"), end, 0.034, 1000.0, curve);
  sample(picture.line(green, "capped at 2 N"), end, 0.034, 1000.0, capped);
  sample(picture.dashes(black, "network alone"), end, 0.034, 1000.0, raw);
  for (double const d : {end, 0.026, 0.034})
    picture.quote("%.2f mm: tangent %.3f N, capped %.3f N, network alone %.3f N", 1000 * d, curve(d), capped(d), raw(d));
  return picture;
}

Picture blade() {
  Picture picture("forces_blade", "Another blade, held otherwise: factors on the liver's loading curve", "depth [mm]", "force [N]");
  auto const curve = liver_loading<double>({.largest_force = 2.0});
  auto const draw = [&](Colour colour, char const* label, BladeFactors<double> const& factors) {
    auto const other = bladed(curve, factors);
    sample(picture.line(colour, label), 0.0, 0.0225, 1000.0, other);
    picture.quote("%-18s force factor %.3f, depth factor %.3f, %.3f N at 18 mm", label, factors.force_factor(), factors.depth_factor(), other(0.018));
  };
  draw(black, "as measured", {});
  draw(orange, "width x 1.5", {.width_ratio = 1.5});
  draw(green, "sharpness 1.5", {.sharpness = 1.5});
  draw(pink, "slice-push 1", {.slice_push_ratio = 1.0});
  draw(blue, "leans by 0.3 rad", {.entry_angle = 0.3});
  return picture;
}

Picture speed_network() {
  Picture picture("forces_speed_network", "A network of depth and speed, trained at three speeds", "depth [mm]", "force [N]");
  std::vector<Measurement> measurements;   // friction of a shaft that nobody measured: 0.4 N + (20 N/m + 500 N s/m² v) d
  for (double const v : {0.005, 0.010, 0.020})
    for (int mm = 10; mm <= 40; mm += 2) measurements.push_back({1e-3 * mm, v, MeasuredPhase::loading, 0.4 + (20.0 + 500.0 * v) * 1e-3 * mm});
  NetworkFitOptions options;
  options.folds = 0;
  auto const found = fit_speed_network<Network<double, 2, 5, 1>>(measurements, options);
  for (auto const& [colour, v] : {std::pair(blue, 0.005), std::pair(orange, 0.010), std::pair(green, 0.020)}) {
    PlotSeries& data = picture.dots(colour, "data");
    for (Measurement const& m : measurements)
      if (m.speed == v) add(data, 1000 * m.depth, m.force);
  }
  auto const draw = [&](PlotSeries& series, double v) { sample(series, 0.002, 0.045, 1000.0, [&](double d) { return found.law(d, v); }); };
  draw(picture.line(blue, "network, 5 mm/s"), 0.005);
  draw(picture.line(orange, "network, 10 mm/s"), 0.010);
  draw(picture.line(green, "network, 20 mm/s"), 0.020);
  draw(picture.dashes(pink, "15 mm/s, between"), 0.015);
  draw(picture.dashes(black, "40 mm/s, beyond"), 0.040);
  picture.quote("rms %.1e N; at 30 mm and 15 mm/s %.4f N, made with %.4f N; at 40 mm/s %.4f N, as at 20 mm/s", found.rms, found.law(0.030, 0.015),
                0.4 + (20.0 + 500.0 * 0.015) * 0.030, found.law(0.030, 0.040));
  return picture;
}

}  // namespace forces
