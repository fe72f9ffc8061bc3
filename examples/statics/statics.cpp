// SPDX-License-Identifier: MIT
// Where does a body rest? A square drum skin of 10 cm, stretched and held at its border, sags under its weight. Three solvers find the same balance, each
// in its own way, and it is that of membrane theory:
//   T ∇²w = −q,   w(middle) = 16 q a²/(π⁴ T) Σ ± 1/(m n (m² + n²)), m and n odd   = 0.0737 q a²/T      (Timoshenko)
// Under twenty times the load the skin stretches, and theory, which keeps the tension T, no longer holds.
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/statics/local_relaxation.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace {

using namespace palpate;

constexpr int n = 31, middle = n / 2 * n + n / 2;                                // particles along a side
constexpr double side = 0.1, spacing = side / (n - 1);                           // m
constexpr double stiffness = 100.0, prestrain = 0.5, tension = stiffness * prestrain;   // N/m: a link's force over the spacing
constexpr double mass = 0.07, gravity = 9.81;                                    // kg, m/s²
constexpr double load = mass / (n * n) * gravity / (spacing * spacing);          // N/m²

using Skin = decltype(SoftBody(std::declval<MassSpring<double>>()));

Skin drum() {
  auto const mesh = make_grid<double>(n, n, spacing);
  MassSpring<double> tissue(mesh, {.mass = {.total = mass, .lumping = Lumping::equal}, .link = {.stiffness = stiffness}, .link_prestrain = prestrain});
  for (int l = 0; l < tissue.links().size(); ++l) {   // theory knows no diagonals
    auto const& link = tissue.links()[l];
    if ((mesh.points.col(link.a) - mesh.points.col(link.b)).norm() > 1.2 * spacing) tissue.set_link(l, {.stiffness = 1e-9 * stiffness});
  }
  tissue.nail(boundary_vertices(mesh));
  return Skin(std::move(tissue));
}

/// Theory's sag [m] at a distance from the middle along a side's direction.
double theory(double x) {
  double sum = 0.0;
  for (int i = 1; i < 200; i += 2)
    for (int j = 1; j < 200; j += 2)
      sum += std::sin(i * std::numbers::pi * (0.5 + x / side)) * std::sin(j * std::numbers::pi / 2) / (i * j * (i * i + j * j));
  return 16.0 * load * side * side / (std::pow(std::numbers::pi, 4) * tension) * sum;
}

template <class Solver>
Skin solved(char const* name, Solver const& solver) {
  Skin skin = drum();
  skin.set_gravity({0.0, 0.0, -gravity});
  auto const start = std::chrono::steady_clock::now();
  auto const found = skin.solve_statics(solver);
  std::chrono::duration<double, std::milli> const cost = std::chrono::steady_clock::now() - start;
  double const sag = -skin.displacement(middle).z();
  std::printf("%-18s %10d %9.1f %12.6f %15.2f %%\n", name, found.iterations, cost.count(), 1e3 * sag, 100.0 * (sag / theory(0.0) - 1.0));
  return skin;
}

/// How far the sag is from the balance after so many iterations.
template <class At>
void converge(PlotSeries& series, double balance, int most, At solver) {
  series.marks = true;
  for (int k = 1; k <= most; k = k < 4 ? k + 1 : k * 5 / 4) {
    Skin skin = drum();
    skin.set_gravity({0.0, 0.0, -gravity});
    skin.relax(solver(k));
    double const off = std::abs(-skin.displacement(middle).z() / balance - 1.0);
    if (!series.y.empty() && off == series.y.back()) return;   // it has stopped
    if (off > 1e-8) drawing::add(series, k, off);
  }
}

drawing::Album statics() {
  using namespace drawing;
  std::printf("a skin of %.0f cm under %.1f N/m2, tension %.0f N/m: membrane theory says %.6f mm\n", 100.0 * side, load, tension, 1e3 * theory(0.0));
  std::printf("%-18s %10s %9s %12s %17s\n", "solver", "iterations", "[ms]", "sag [mm]", "beside theory");
  solved("DynamicRelaxation", DynamicRelaxation{});
  solved("LocalRelaxation", LocalRelaxation{});
  Skin const skin = solved("NewtonRaphson", NewtonRaphson<>{});

  Skin heavy = drum();
  heavy.set_gravity({0.0, 0.0, -20.0 * gravity});
  heavy.solve_statics();
  double const ratio = -heavy.displacement(middle).z() / (20.0 * theory(0.0));
  std::printf("under twenty times the load it sags %.2f mm, %.1f %% of what theory says\n", -1e3 * heavy.displacement(middle).z(), 100.0 * ratio);

  Album album;
  Picture profile("statics_profile", "A drum skin under its weight", "distance from the middle [mm]", "sag [mm]");
  sample(profile.line(blue, "membrane theory"), -side / 2, side / 2, 1e3, [](double x) { return -1e3 * theory(x); }, 100);
  PlotSeries& found = profile.dots(orange, "the body");
  for (int i = 0; i < n; i += 2) add(found, 1e3 * (i * spacing - side / 2), 1e3 * skin.displacement(n / 2 * n + i).z());
  album.charts.push_back(profile);

  Picture ways("statics_convergence", "How far from the balance", "iterations or sweeps", "error of the sag, relative");
  ways.x().logarithmic = ways.y().logarithmic = true;
  ways.x().from = 0.7, ways.x().to = 1000.0;
  double const balance = -skin.displacement(middle).z();
  converge(ways.line(blue, "DynamicRelaxation"), balance, 1000, [](int k) { return DynamicRelaxation{.iterations = k}; });
  converge(ways.line(orange, "LocalRelaxation"), balance, 1000, [](int k) { return LocalRelaxation{.sweeps = double(k)}; });
  converge(ways.line(green, "NewtonRaphson"), balance, 20, [](int k) { return NewtonRaphson<>{.iterations = k}; });
  album.charts.push_back(ways);
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("statics", argc, argv, statics); }
