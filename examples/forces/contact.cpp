// SPDX-License-Identifier: MIT
// What resists before the puncture.
#include "pictures.hpp"

#include <palpate/force/cutting_force.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/indentation_spring.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/polynomial_contact.hpp>

#include <cmath>
#include <numbers>
#include <tuple>

namespace forces {

using namespace palpate;

namespace {

constexpr double datum_depth = 0.018, datum_force = 3.0;   // m, N: where the published scalpel punctured

/// The force along the normal while the tool indents, at an inward speed.
template <class Law>
double indenting(Law const& law, double depth, double speed = 0.0) {
  return law({.phase = CuttingPhase::indenting, .depth = depth, .previous_depth = depth, .velocity = {0.0, 0.0, -speed}}).z();
}

HuntCrossleyContact<double> hunt_crossley_law(double damping) {
  return {.stiffness = datum_force / std::pow(datum_depth, 1.5), .exponent = 1.5, .damping = damping};
}

/// Force over time, a press at 20 mm/s that punctures at 18 mm; times in ms.
template <class Force>
void press_through(PlotSeries& series, Force force) {
  constexpr double speed = 0.020, tick = 0.001;
  double before = datum_depth - 0.011 * speed;
  for (int k = -10; k <= 30; ++k) {
    double const depth = datum_depth + k * tick * speed;
    ToolContact<double> const contact{.phase = k <= 0 ? CuttingPhase::indenting : CuttingPhase::moving,
                                      .depth = depth,
                                      .previous_depth = before,
                                      .velocity = {0.0, 0.0, -speed},
                                      .seconds = tick};
    add(series, k, force(contact).z());
    before = depth;
  }
}

}  // namespace

Picture contact_laws() {
  Picture picture("forces_contact", "Before the puncture: four laws through 3 N at 18 mm", "depth [mm]", "force [N]");
  // The spring is the published datum; the coefficients of the others are made up so that they pass through it.
  IndentationSpring<double> const spring;
  PolynomialContact<double> const polynomial{.linear = 40.0, .quadratic = 3000.0, .cubic = (datum_force - 0.72 - 0.972) / std::pow(datum_depth, 3)};
  ExponentialContact<double> const exponential{.scale = datum_force / std::expm1(2.7), .rate = 150.0, .largest_depth = datum_depth};
  auto const draw = [&](Colour colour, char const* label, auto const& law) {
    sample(picture.line(colour, label), 0.0, 0.022, 1000.0, [&](double d) { return indenting(law, d); });
    picture.quote("%-16s %.3f N at 9 mm, %.3f N at 18 mm, %.3f N at 22 mm", label, indenting(law, 0.009), indenting(law, 0.018),
                  indenting(law, 0.022));
  };
  draw(blue, "spring", spring);
  draw(orange, "polynomial", polynomial);
  draw(green, "exponential", exponential);
  draw(pink, "Hunt-Crossley", hunt_crossley_law(0.0));
  add(picture.dots(black, "18 mm, 3 N"), 1000 * datum_depth, datum_force);
  return picture;
}

Picture hunt_crossley() {
  Picture picture("forces_hunt_crossley", "Hunt-Crossley: 10 mm in and out at three speeds", "depth [mm]", "force [N]");
  auto const law = hunt_crossley_law(5.0);
  constexpr double deepest = 0.010;
  for (auto const& [colour, label, fastest] : {std::tuple(blue, "up to 10 mm/s", 0.010), std::tuple(orange, "up to 50 mm/s", 0.050),
                                               std::tuple(green, "up to 100 mm/s", 0.100)}) {
    PlotSeries& series = picture.line(colour, label);
    series.arrows = true;
    double taken = 0.0;
    constexpr int steps = 400;
    for (int k = 0; k <= steps; ++k) {
      double const turn = std::numbers::pi * k / steps;   // d = D sin²(turn), the speed is largest halfway
      double const depth = deepest * std::pow(std::sin(turn), 2);
      add(series, 1000 * depth, indenting(law, depth, fastest * std::sin(2 * turn)));
      if (k > 0) taken += (series.y[series.y.size() - 1] + series.y[series.y.size() - 2]) / 2 * (series.x.back() - series.x[series.x.size() - 2]);
    }
    picture.quote("%-16s takes %.2f mJ of the hand in a cycle", label, taken);   // N mm = mJ
  }
  return picture;
}

Picture puncture() {
  Picture picture("forces_puncture", "The puncture: from the spring to the liver curve", "time since the puncture [ms]", "force [N]");
  auto const curve = liver_hysteresis<double>();
  press_through(picture.line(blue, "5 ms (default)"), CuttingForce(curve));
  press_through(picture.line(orange, "20 ms"), CuttingForce(curve, CurveJoin<double>{.puncture_time = 0.020}));
  press_through(picture.line(green, "at once"), CuttingForce(curve, CurveJoin<double>{.puncture_time = 0.0}));
  press_through(picture.line(pink, "5 ms, curve x 8.3"), CuttingForce(scaled(curve, 8.3)));
  auto const& y = picture.series()[blue].y;
  picture.quote("default          %.3f N at the puncture, %.3f N after 5 ms, largest step of a tick %.3f N", y[10], y[15], y[12] - y[13]);
  auto const& at_once = picture.series()[green].y;
  picture.quote("at once          a step of %.3f N", at_once[10] - at_once[11]);
  auto const& scaled_curve = picture.series()[pink].y;
  picture.quote("curve x 8.3      %.3f N at the puncture, %.3f N after 5 ms", scaled_curve[10], scaled_curve[15]);
  return picture;
}

}  // namespace forces
