// SPDX-License-Identifier: MIT
// Error over computing time of elastic solids, as a table and two charts:
//   solid_precision <folder>             two minutes; for numbers that count build with the preset release
//   solid_precision --quick <folder>     seconds, and checks that finer is nearer
// sag     a cantilever of 10 x 1 x 1 cm, 100 kPa, nu 0.49, under a twentieth of a m/s2: how far its end sinks, by mesh, balance and pressure. The reference is
//         extrapolated from the two finest meshes with nodal pressure, by the square of the edge; beside it stands Timoshenko's beam.
// swing   the same at nu 0.45, two cubes through its height, let go under 0.5 m/s2 for 0.3 s: how far its end is from that of RungeKutta4 in steps of a sixteenth
//         of its stable one, at most over 30 moments, over how far it swings.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/statics/direct_factorisation.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

constexpr double height = 0.01, length = 0.1, young = 1e5, density = 1000.0;   // m, Pa, kg/m³

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Beam {
  TetrahedralMesh<double> mesh;
  std::vector<int> end;

  explicit Beam(int through) : mesh(make_block<double>(10 * through + 1, through + 1, through + 1, height / through, BlockPattern::alternating)) {
    end = vertices_where(mesh, [](auto const& p) { return p.x() > length - 1e-6; });
  }
  template <class Integrator>
  auto body(double poisson, Pressure pressure, double gravity, Integrator const& integrator, RayleighDamping<double> const& damping = {}) const {
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = damping, .pressure = pressure});
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-6; }));
    SoftBody made(std::move(tissue), integrator);
    made.set_gravity({0, 0, -gravity});
    return made;
  }
  /// How far its end has sunk, a mean over the face [m].
  template <class Body>
  double sag(Body const& body) const {
    double sum = 0;
    for (int const i : end) sum += mesh.points(2, i) - body.positions()(2, i);
    return sum / static_cast<double>(end.size());
  }
};

struct Found {
  double sag, cost;   // m, s
};

template <class Solver>
Found balance(Beam const& beam, Pressure pressure, double gravity, Solver const& solver) {
  auto body = beam.body(0.49, pressure, gravity, BackwardEuler{});
  double const start = seconds();
  body.settle(solver, 1e-9);   // of an edge: each particle weighs little beside what its neighbours hold
  return {beam.sag(body), seconds() - start};
}
/// Drag at the first frequency, nearly critical; until a second changes the sag by a ten-thousandth.
Found steps_to_rest(Beam const& beam, Pressure pressure, double gravity) {
  auto body = beam.body(0.49, pressure, gravity, BackwardEuler{}, {.alpha = 10.0});
  double const start = seconds();
  double last = -1;
  for (int k = 0; k < 100; ++k) {
    for (int i = 0; i < 20; ++i) body.step(0.05);
    double const now = beam.sag(body);
    if (std::abs(now - last) <= 1e-4 * std::abs(now)) break;
    last = now;
  }
  return {beam.sag(body), seconds() - start};
}

/// Where the end is at each hundredth of a second, in steps of 0.01/parts s.
template <class Integrator>
std::pair<std::vector<double>, double> swing(Beam const& beam, Integrator const& integrator, int parts, int moments) {
  auto body = beam.body(0.45, Pressure::element, 0.5, integrator);
  std::vector<double> path;
  double const start = seconds();
  for (int k = 0; k < moments; ++k) {
    for (int i = 0; i < parts; ++i)
      if (!body.step(0.01 / parts)) return {{}, 0.0};
    path.push_back(beam.sag(body));
  }
  return {path, seconds() - start};
}

bool is_nearer_when_finer(PlotSeries const& one) { return one.y.size() > 1 && one.y.back() < one.y.front(); }

}  // namespace

int main(int count, char** arguments) {
  std::vector<std::string> words(arguments + 1, arguments + count);
  bool const quick = !words.empty() && words[0] == "--quick";
  if (quick) words.erase(words.begin());
  if (words.size() != 1 || words[0].starts_with('-')) {
    std::fprintf(stderr, "usage: solid_precision [--quick] <folder>\n");
    return 2;
  }
  try {
    std::filesystem::path const folder = words[0];
    std::filesystem::create_directories(folder);
    bool good = true;

    double const gravity = 0.05;
    std::vector<int> const meshes = quick ? std::vector<int>{1, 2} : std::vector<int>{1, 2, 3, 4, 6};
    auto const [coarse, fine] = quick ? std::pair{2, 3} : std::pair{6, 8};
    NewtonRaphson<DirectFactorisation> const direct;
    double const near = balance(Beam(coarse), Pressure::nodal, gravity, direct).sag, nearer = balance(Beam(fine), Pressure::nodal, gravity, direct).sag;
    double const reference = nearer + (nearer - near) * coarse * coarse / (fine * fine - coarse * coarse);
    double const load = density * gravity * height * height, inertia = std::pow(height, 4) / 12, shear = young / (2 * 1.49);
    double const timoshenko = load * std::pow(length, 4) / (8 * young * inertia) + load * length * length / (2 * 5.0 / 6 * shear * height * height);
    std::printf("sag of the end: %.4f mm, extrapolated; %.4f mm with %d cubes through the height, %.4f mm after Timoshenko\n\n", 1e3 * reference, 1e3 * nearer, fine, 1e3 * timoshenko);
    std::printf("%-44s %7s %10s %10s\n", "balance", "cubes", "error", "time [s]");
    std::vector<PlotSeries> sags;
    for (Pressure const pressure : {Pressure::element, Pressure::nodal}) {
      auto const add = [&](std::string const& name, auto const& find) {
        PlotSeries series{.label = name + (pressure == Pressure::nodal ? ", nodal" : ""), .x = {}, .y = {}};
        for (int const through : meshes) {
          Found const found = find(Beam(through));
          double const error = std::abs(found.sag / reference - 1);
          std::printf("%-44s %7d %10.4f %10.4f\n", series.label.c_str(), through, error, found.cost);
          std::fflush(stdout);
          series.x.push_back(found.cost), series.y.push_back(error);
        }
        good = good && is_nearer_when_finer(series);
        sags.push_back(std::move(series));
      };
      add("Newton, conjugate gradients", [&](Beam const& beam) { return balance(beam, pressure, gravity, NewtonRaphson{}); });
      add("Newton, sparse factorisation", [&](Beam const& beam) { return balance(beam, pressure, gravity, direct); });
      add("backward Euler to rest", [&](Beam const& beam) { return steps_to_rest(beam, pressure, gravity); });
    }

    Beam const beam(2);
    int const moments = quick ? 5 : 30;
    auto probe = beam.body(0.45, Pressure::element, 0.5, RungeKutta4{});
    int const exact = static_cast<int>(std::ceil(0.16 / probe.stable_step()));
    auto const path = swing(beam, RungeKutta4{}, exact, moments).first;
    double const widest = *std::max_element(path.begin(), path.end());
    std::printf("\n%-44s %10s %10s %10s\n", "swing", "step [ms]", "error", "time [s]");
    std::vector<PlotSeries> swings;
    auto const add = [&](std::string const& name, auto const& integrator) {
      PlotSeries series{.label = name, .x = {}, .y = {}};
      auto fresh = beam.body(0.45, Pressure::element, 0.5, integrator);
      double const stable = fresh.stable_step();
      for (int const parts : {1, 2, 5, 10, 20, 50, 100, 200, 400}) {
        if (0.01 / parts > stable || (quick && parts > 100)) continue;
        auto const [taken, cost] = swing(beam, integrator, parts, moments);
        if (taken.empty()) continue;
        double error = 0;
        for (std::size_t k = 0; k < taken.size(); ++k) error = std::max(error, std::abs(taken[k] - path[k]) / widest);
        std::printf("%-44s %10.4f %10.2e %10.4f\n", name.c_str(), 10.0 / parts, error, cost);
        std::fflush(stdout);
        series.x.push_back(cost), series.y.push_back(error);
        if (cost > 20) break;
      }
      swings.push_back(std::move(series));
    };
    add("LeapfrogVerlet", LeapfrogVerlet{});
    add("SymplecticEuler", SymplecticEuler{});
    add("RungeKutta4", RungeKutta4{});
    add("BackwardEuler", BackwardEuler{});
    add("BackwardEuler, to 1e-6, 3 iterations", BackwardEuler{.tolerance = 1e-6, .max_iterations = 1000, .newton_iterations = 3});
    add("CrankNicolson, 2 iterations", CrankNicolson{.tolerance = 1e-6, .max_iterations = 1000, .newton_iterations = 2});
    good = good && is_nearer_when_finer(swings[3]) && is_nearer_when_finer(swings[5]);

    VirtualDisplay const display;
    if (!display.ready()) {
      std::printf("\n%s\n", display.problem().c_str());
    } else {
      PlotStyle style{.title = "A cantilever at Poisson's ratio 0.49: 1 to 6 cubes through its height", .x = {"computing time [s]", true}, .y = {"error of the sag", true}};
      style.width = 1100, style.height = 700;
      write_plot(folder / "solid_precision_sag.png", sags, style);
      style.title = "A swinging cantilever: steps of 10 ms and less", style.x = {"computing time for 0.3 s [s]", true}, style.y = {"largest error / swing", true};
      write_plot(folder / "solid_precision_swing.png", swings, style);
    }
    if (!good) std::fprintf(stderr, "solid_precision: a finer mesh or a shorter step is not nearer\n");
    return good ? 0 : 1;
  } catch (std::exception const& error) {
    std::fprintf(stderr, "solid_precision: %s\n", error.what());
    return 1;
  }
}
