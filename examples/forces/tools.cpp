// SPDX-License-Identifier: MIT
// A needle goes in and out.
#include "pictures.hpp"

#include <palpate/device/trajectory.hpp>
#include <palpate/force/needle_force.hpp>

#include <algorithm>
#include <cmath>

namespace forces {

using namespace palpate;

Picture needle() {
  Picture picture("forces_needle", "A needle: 25 mm in, 4 mm back, in again, out", "depth [mm]", "force [N]");
  // The coefficients are made up.
  NeedleForce<double> law({.linear = 40.0,
                           .quadratic = 6000.0,
                           .cutting = 0.4,
                           .friction = {.dynamic = 20.0, .viscous = 300.0, .holding = 30.0, .stick_speed = 0.002, .stick_stiffness = 600.0}});
  constexpr double tick = 0.001, puncture = 0.010;
  double before = 0.0;
  bool punctured = false;
  auto const go = [&](PlotSeries& series, double to) {   // up to 20 mm/s, gently at both ends
    series.arrows = true;
    double const seconds = 1.875 * std::abs(to - before) / 0.020;
    auto const way = Trajectory<double>::start({0.0, 0.0, -before}).line({0.0, 0.0, -to}, seconds, Pace::minimum_jerk);
    for (double t = 0.0; t <= way.duration(); t += tick) {
      auto const now = way.at(t);
      double const depth = -now.position.z();
      punctured = punctured || depth >= puncture;
      ToolContact<double> const contact{.phase = punctured ? CuttingPhase::moving : CuttingPhase::indenting,
                                        .depth = depth,
                                        .previous_depth = before,
                                        .velocity = now.velocity};
      add(series, 1000 * depth, law(contact).z());
      before = depth;
    }
  };
  go(picture.line(blue, "in"), 0.025);
  go(picture.line(orange, "back 4 mm"), 0.021);
  go(picture.line(green, "in again"), 0.040);
  go(picture.line(pink, "out"), 0.0);
  auto const largest = [&](Colour colour) { return *std::max_element(picture.series()[colour].y.begin(), picture.series()[colour].y.end()); };
  picture.quote("largest force in %.3f N, in again %.3f N; out at least %.3f N", largest(blue), largest(green),
                *std::min_element(picture.series()[pink].y.begin(), picture.series()[pink].y.end()));
  return picture;
}

}  // namespace forces
