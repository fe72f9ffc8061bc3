// SPDX-License-Identifier: MIT
// What a tick of a scalpel costs, without the step of the body, on grids of 10³ to 10⁶ triangles. The body is reserved beforehand.
//   crossing    ticks of a tenth of an edge on strokes of 16 edges. Those that cross one triangle (ProgressiveCutter) or open one edge
//               (SeparatingCutter) count: "median" and "p99" of them, the time is their mean. "begin" is the mean tick in which a stroke begins.
//   inside      a tick that stays in its triangle.
//   thousand    one tick of 450 edges on a grid of 10⁶, after a short stroke elsewhere: it crosses `triangles`, or opens `edges`.
//   leap        the same with the bound of a tick that is preset: the longest of the `ticks` that it takes.
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

namespace {

using namespace palpate;
using Clock = std::chrono::steady_clock;
using Vector = Vector3<double>;
using Body = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;

constexpr double edge = 0.005;    // m
constexpr double depth = 0.003;   // m, of the blade
Vector const along = Vector(1.0, 0.37, 0.0).normalized(), across = Vector(1.0, -0.62, 0.0).normalized();   // across the diagonals

/// A grid of about so many triangles, with room for a cut through a few thousand.
std::unique_ptr<Body> grid_of(long triangles) {
  int const n = 1 + static_cast<int>(std::sqrt(static_cast<double>(triangles) / 2));
  auto body = std::make_unique<Body>(MassSpring<double>(make_grid<double>(n, n, edge), {.mass = {.total = 3e-4 * n * n},
                                                                                        .link = {.stiffness = 100.0, .damping = 0.02},
                                                                                        .home = {.stiffness = 10.0, .damping = 0.05}}));
  body->reserve(body->size() + 10000, static_cast<int>(body->triangles().cols()) + 20000);
  return body;
}

template <class Cutter>
Cutter scalpel() {
  return Cutter({.puncture_depth = depth / 2});
}

/// A cutter that comes to the tip in the tick.
template <class Cutter>
Cutter unbounded_scalpel() {
  if constexpr (std::same_as<Cutter, ProgressiveCutter<double>>)
    return Cutter({.puncture_depth = depth / 2, .crossings_per_tick = std::numeric_limits<int>::max()});
  else
    return Cutter({.puncture_depth = depth / 2, .edges_per_tick = std::numeric_limits<int>::max()});
}

template <class Cutter>
constexpr char const* what_it_passes = std::same_as<Cutter, ProgressiveCutter<double>> ? "triangles" : "edges";

/// From above the surface to the blade's depth.
template <class Cutter>
void puncture(Cutter& cutter, Body& body, Vector const& at) {
  cutter.advance(body, at + Vector(0, 0, depth));
  cutter.advance(body, at - Vector(0, 0, depth));
}

template <class Cutter>
int passed(Cutter const& cutter) {
  auto const& report = cutter.report();
  return report.vertex_vertex + report.vertex_edge + report.edge_vertex + report.edge_edge;
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double quantile(std::vector<double>& values, double part) {
  auto const at = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

template <class Cutter>
void crossing(benchmark::State& state) {
  std::vector<double> ticks;
  double begin = 0, beginnings = 0;
  for (auto _ : state) {
    auto const body = grid_of(state.range(0));
    Cutter cutter = scalpel<Cutter>();
    double sum = 0;
    auto const before = ticks.size();
    for (int row = 0; row < 4; ++row) {
      Vector const from = edge * Vector(3.2, 2.3 + 3.3 * row, 0.0);
      cutter.advance(*body, from + Vector(0, 0, depth));
      auto const start = Clock::now();
      cutter.advance(*body, from - Vector(0, 0, depth));
      begin += seconds_since(start), ++beginnings;
      for (int k = 1; k <= 160; ++k) {
        int const passed_before = passed(cutter);
        Vector const tip = from + k * edge / 10 * along - Vector(0, 0, depth);
        auto const tick_start = Clock::now();
        cutter.advance(*body, tip);
        double const tick = seconds_since(tick_start);
        if (passed(cutter) == passed_before + 1) ticks.push_back(tick), sum += tick;
      }
      cutter.reset(*body);
    }
    state.SetIterationTime(sum / static_cast<double>(ticks.size() - before));
  }
  state.counters["median"] = quantile(ticks, 0.5);
  state.counters["p99"] = quantile(ticks, 0.99);
  state.counters["begin"] = begin / beginnings;
  state.counters["ticks"] = static_cast<double>(ticks.size());
}

template <class Cutter>
void inside(benchmark::State& state) {
  auto const body = grid_of(state.range(0));
  Cutter cutter = scalpel<Cutter>();
  Vector const from = edge * Vector(3.2, 2.3, -depth / edge);
  puncture(cutter, *body, edge * Vector(3.2, 2.3, 0.0));
  cutter.advance(*body, from + 4 * edge * along);
  Vector const in = edge * Vector(8.7, 4.3, -depth / edge);   // in the middle of a triangle
  cutter.advance(*body, in);
  int const passed_before = passed(cutter);
  int k = 0;
  for (auto _ : state) cutter.advance(*body, in + ++k % 10 * edge / 100 * along);
  if (passed(cutter) != passed_before) state.SkipWithError("the blade left its triangle");
}

/// Into the tissue of a grid of 10⁶ triangles after a short stroke elsewhere; the point `edges` of an edge farther is where the leap ends.
template <class Cutter>
Vector before_a_leap(Cutter& cutter, Body& body, double edges) {
  Vector const before = edge * Vector(50.0, 600.0, 0.0);
  puncture(cutter, body, before);
  for (int k = 1; k <= 100; ++k) cutter.advance(body, before + k * edge / 10 * along - Vector(0, 0, depth));
  cutter.reset(body);
  Vector const from = edge * Vector(50.2, 550.3, 0.0);
  puncture(cutter, body, from);
  return from + edges * edge * across - Vector(0, 0, depth);
}

template <class Cutter>
void thousand(benchmark::State& state) {
  double crossed = 0;
  for (auto _ : state) {
    auto const body = grid_of(1000000);
    Cutter cutter = unbounded_scalpel<Cutter>();
    Vector const tip = before_a_leap(cutter, *body, static_cast<double>(state.range(0)));
    auto const start = Clock::now();
    cutter.advance(*body, tip);
    state.SetIterationTime(seconds_since(start));
    crossed = passed(cutter);
  }
  state.counters[what_it_passes<Cutter>] = crossed;
}

template <class Cutter>
void leap(benchmark::State& state) {
  double crossed = 0, ticks = 0;
  for (auto _ : state) {
    auto const body = grid_of(1000000);
    auto cutter = scalpel<Cutter>();
    Vector const tip = before_a_leap(cutter, *body, static_cast<double>(state.range(0)));
    double longest = 0;
    ticks = 0;
    do {
      auto const start = Clock::now();
      cutter.advance(*body, tip);
      longest = std::max(longest, seconds_since(start));
      ++ticks;
    } while (cutter.is_behind());
    state.SetIterationTime(longest);
    crossed = passed(cutter);
  }
  state.counters[what_it_passes<Cutter>] = crossed;
  state.counters["ticks"] = ticks;
}

void grids(benchmark::internal::Benchmark* benchmark) {
  for (long triangles = 1000; triangles <= 1000000; triangles *= 10) benchmark->Arg(triangles);
}

BENCHMARK(crossing<ProgressiveCutter<double>>)->Apply(grids)->Iterations(20)->UseManualTime();
BENCHMARK(inside<ProgressiveCutter<double>>)->Apply(grids);
BENCHMARK(thousand<ProgressiveCutter<double>>)->Arg(450)->Iterations(5)->UseManualTime();
BENCHMARK(leap<ProgressiveCutter<double>>)->Arg(450)->Iterations(5)->UseManualTime();
BENCHMARK(crossing<SeparatingCutter<double>>)->Apply(grids)->Iterations(20)->UseManualTime();
BENCHMARK(inside<SeparatingCutter<double>>)->Apply(grids);
BENCHMARK(thousand<SeparatingCutter<double>>)->Arg(450)->Iterations(5)->UseManualTime();
BENCHMARK(leap<SeparatingCutter<double>>)->Arg(450)->Iterations(5)->UseManualTime();

}  // namespace
