// SPDX-License-Identifier: MIT
// How much damping? damping_for() proposes coefficients for a damping ratio ζ: 0 rings for ever, 1 is critical, more is slower.
// First on a body that moves as one after an impulse, which is one oscillator with a closed form:
//   x″ + 2ζω x′ + ω² x = 0,   x(0) = 0,   x′(0) = v,   ω = 4/s, m = 0.01 kg and ζ = 0, ½, 1, 2 as in the thesis (Zheng 2006)
// Then on a sheet that is pulled in its middle and let go: many modes at once, of which the two goals damp none too much, or none too little.
#include "../album.hpp"

#include <palpate/body/damping.hpp>
#include <palpate/body/modal_view.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace {

using namespace palpate;
using Sheet = decltype(SoftBody(std::declval<MassSpring<double>>()));

constexpr double omega = 4.0, mass = 0.01, speed = 1.0;   // 1/s, kg of a particle, m/s

double closed_form(double ratio, double t) {
  double const decay = std::exp(-ratio * omega * t);
  if (ratio == 1.0) return speed * t * decay;
  double const root = omega * std::sqrt(std::abs(1.0 - ratio * ratio));
  return speed / root * decay * (ratio < 1.0 ? std::sin(root * t) : std::sinh(root * t));
}

void oscillate(double ratio, PlotSeries& line, PlotSeries& dots) {
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {.mass = {.total = 9 * mass, .lumping = Lumping::equal}, .link = {.stiffness = 1.0},
                                                            .home = {.stiffness = mass * omega * omega}});
  set_damping(tissue, damping_for(tissue, ratio));
  Sheet body(std::move(tissue));
  for (int i = 0; i < body.size(); ++i) {   // an impulse: let go with a speed
    body.hold(i);
    body.drag(i, body.rest_mesh().points.col(i), {0.0, 0.0, speed});
    body.release(i);
  }
  double highest = 0.0, lowest = 0.0, off = 0.0;
  constexpr double h = 5e-4, end = 3.0;   // s
  for (int k = 0; k * h <= end; ++k) {
    double const x = body.displacement(4).z(), exact = closed_form(ratio, k * h);
    highest = std::max(highest, x);
    lowest = std::min(lowest, x);
    off = std::max(off, std::abs(x - exact));
    if (k % 10 == 0) drawing::add(line, k * h, exact);
    if (k % 200 == 0) drawing::add(dots, k * h, x);
    body.step(h);
  }
  std::printf("%6.2f %14.4f %14.4f %22.1e\n", ratio, highest, lowest, off);
}

void let_go(char const* name, double ratio, DampingGoal goal, PlotSeries& line) {
  auto const mesh = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.05}, .link = {.stiffness = 80.0}, .home = {.stiffness = 2.0}, .link_prestrain = 0.1});
  tissue.nail(boundary_vertices(mesh));
  auto const proposal = damping_for(tissue, ratio, goal);
  set_damping(tissue, proposal);
  Sheet body(std::move(tissue));
  constexpr int middle = 220;
  body.apply_force(middle, {0.0, 0.0, 0.1});
  body.solve_statics(NewtonRaphson<>{});
  auto const modes = modal_view(body);
  double const stable = body.stable_step();
  constexpr double h = 2e-5, end = 0.1;   // s
  int crossings = 0;
  double before = body.displacement(middle).z();
  for (int k = 0; k * h <= end; ++k) {
    double const z = body.displacement(middle).z();
    if (std::abs(z) > 1e-9 && z * before < 0.0) ++crossings;
    if (std::abs(z) > 1e-9) before = z;
    if (k % 10 == 0) drawing::add(line, 1e3 * k * h, 1e3 * z);
    body.step(h);
  }
  std::printf("%-16s %11.3f ... %-8.3f %7.3f ... %-8.3f %11.3f %11d\n", name, proposal.min_ratio, proposal.max_ratio, modes.slowest.damping_ratio,
              modes.fastest.damping_ratio, 1e3 * stable, crossings);
}

drawing::Album damping() {
  using namespace drawing;
  Picture impulse("damping_impulse", "After an impulse: dots computed, lines the closed form", "time [s]", "position [m]");
  std::printf("%6s %14s %14s %22s\n", "ratio", "highest [m]", "lowest [m]", "off closed form [m]");
  oscillate(0.0, impulse.line(blue, "ratio 0: rings for ever"), impulse.dots(blue, {}));
  oscillate(0.5, impulse.line(orange, "ratio 0.5: swings back"), impulse.dots(orange, {}));
  oscillate(1.0, impulse.line(green, "ratio 1: critical"), impulse.dots(green, {}));
  oscillate(2.0, impulse.line(pink, "ratio 2: crawls"), impulse.dots(pink, {}));

  Picture sheet("damping_sheet", "A sheet pulled in its middle and let go", "time [ms]", "displacement of the middle [mm]");
  std::printf("\n%-16s %24s %20s %11s %11s\n", "proposal", "says least ... most", "slow ... fast mode", "stable [ms]", "crossings");
  let_go("none", 0.0, DampingGoal::at_most, sheet.line(blue, "no damping"));
  let_go("at most 0.3", 0.3, DampingGoal::at_most, sheet.line(orange, "ratio at most 0.3"));
  let_go("at most 1", 1.0, DampingGoal::at_most, sheet.line(green, "ratio at most 1"));
  let_go("at least 1", 1.0, DampingGoal::at_least, sheet.line(pink, "ratio at least 1"));
  return {.charts = {impulse, sheet}, .views = {}};
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("damping", argc, argv, damping); }
