// SPDX-License-Identifier: MIT
// Springs that are not linear, four of the library and one written here. Each is pulled and pushed: the tip of a triangle, whose other corners are
// nailed, is dragged, and the force on the hand beside that of the law's formula by hand:
//   F = 2 T(δ) h/ℓ,   ℓ the length of the two springs at the tip, δ = ℓ − L, h the height of the tip
// Then a sheet of each is pressed in its middle: what the law means for the finger.
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace {

using namespace palpate;

/// A law of one's own: Fung's exponential, which stiffens with the strain. All that a law needs is a tension and a damping coefficient.
///   T = (k L/α) (e^{α δ/L} − 1)
struct FungSpring {
  double stiffness = 1.0;   // N/m, at rest
  double alpha = 5.0;
  double damping = 0.0;     // N·s/m

  double tension(double elongation, double rest_length) const noexcept { return stiffness * rest_length / alpha * std::expm1(alpha * elongation / rest_length); }
};

constexpr double stiffness = 50.0, largest = 0.5, lock = 0.8, cubic = 1e6;   // N/m, N, N, N/m³

/// The formulas once more, as a textbook has them, without the library.
double linear(double d, double) { return stiffness * d; }
double saturating(double d, double) { return d / (std::abs(d) / largest + 1.0 / stiffness); }
double locking(double d, double) { return d / (d / lock + 1.0 / stiffness); }   // its pole, -16 mm, is not reached here
double third_order(double d, double) { return stiffness * d + cubic * d * d * d; }
double fung(double d, double length) { return stiffness * length / 5.0 * (std::exp(5.0 * d / length) - 1.0); }

/// The tip of a triangle is dragged: the tension found, and the largest difference from the formula.
template <class Law>
double drag_tip(Law const& law, double (*formula)(double, double), PlotSeries& line, PlotSeries& dots) {
  constexpr double half = 0.005, rest = 0.02;   // m: half of the base, the rest length of the two springs
  TriangleMesh<double> triangle;
  triangle.points.resize(3, 3);
  triangle.points << -half, half, 0.0, 0.0, 0.0, std::sqrt(rest * rest - half * half), 0.0, 0.0, 0.0;
  triangle.triangles.resize(3, 1);
  triangle.triangles << 0, 1, 2;
  MassSpring<double, Law> tissue(triangle, {.link = law});
  tissue.nail(0);
  tissue.nail(1);
  SoftBody body(std::move(tissue));
  body.hold(2);
  double off = 0.0;
  for (int percent = -40; percent <= 40; percent += 2) {
    double const length = rest * (1.0 + percent / 100.0), height = std::sqrt(length * length - half * half), elongation = length - rest;
    body.drag(2, {0.0, height, 0.0});
    double const tension = body.reaction(2).y() * length / (2.0 * height);
    off = std::max(off, std::abs(tension - formula(elongation, rest)));
    drawing::add(line, percent, formula(elongation, rest));
    if (percent % 8 == 0) drawing::add(dots, percent, tension);
  }
  return off;
}

/// A sheet pressed in its middle: force on the finger over depth; returned at the deepest.
template <class Law>
double press_sheet(Law const& law, PlotSeries& curve) {
  constexpr int n = 13, middle = n / 2 * n + n / 2;
  auto const mesh = make_grid<double>(n, n, 0.005);
  MassSpring<double, Law> tissue(mesh, {.link = law, .link_prestrain = 0.05});
  tissue.nail(boundary_vertices(mesh));
  SoftBody body(std::move(tissue));
  body.hold(middle);
  double force = 0.0;
  for (int k = 0; k <= 15; ++k) {
    double const depth = 0.001 * k;
    body.drag(middle, body.reference_position(middle) - Vector3<double>(0.0, 0.0, depth));
    body.solve_statics(DynamicRelaxation{}, 1e-6);
    force = -body.reaction(middle).z();
    drawing::add(curve, 1e3 * depth, force);
  }
  return force;
}

struct Charts {
  drawing::Picture tension{"laws_tension", "Five laws with the same stiffness at rest: dots from a body, lines the formulas", "elongation [%]", "tension [N]"};
  drawing::Picture sheet{"laws_sheet", "A sheet of each, pressed in its middle", "depth [mm]", "force on the finger [N]"};
};

template <class Law>
void show(char const* name, drawing::Colour colour, Law const& law, double (*formula)(double, double), Charts& charts) {
  double const off = drag_tip(law, formula, charts.tension.line(colour, name), charts.tension.dots(colour, {}));
  double const force = press_sheet(law, charts.sheet.line(colour, name));
  std::printf("%-12s %12.4f %12.4f %18.1e %22.4f\n", name, formula(-0.004, 0.02), formula(0.004, 0.02), off, force);
}

drawing::Album laws() {
  using namespace drawing;
  Charts charts;
  std::printf("%-12s %12s %12s %18s %22s\n", "law", "T(-20 %) [N]", "T(+20 %) [N]", "off formula [N]", "sheet at 15 mm [N]");
  show("linear", blue, LinearSpring<double>{.stiffness = stiffness}, linear, charts);
  show("saturating", orange, SaturatingSpring<double>{.stiffness = stiffness, .largest_tension = largest}, saturating, charts);
  show("locking", green, LockingSpring<double>{.stiffness = stiffness, .largest_tension = lock}, locking, charts);
  show("cubic", pink, CubicSpring<double>{.stiffness = stiffness, .cubic = cubic}, third_order, charts);
  show("Fung", black, FungSpring{.stiffness = stiffness}, fung, charts);
  return {.charts = {charts.tension, charts.sheet}, .views = {}};
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("laws", argc, argv, laws); }
