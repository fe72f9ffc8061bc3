// SPDX-License-Identifier: MIT
// What a leapfrog step of a whole body costs beside a plain Eigen loop over the same springs in the same run, by size and scalar: square
// grids with one diagonal a square (31 × 31 = 961 particles and 2,760 springs, 200 × 200, 1000 × 1000).
//   bench_step                        as it was compiled
//   sh benchmarks/step.sh             compiled with plain -O2, with AVX2 and for this processor, one after the other
// prints, for each, the median of plain time / library time over rounds that run both in turn (`plain/library`, above 1 the library is
// faster) and the best time of both per spring and step [ns]. Time is the thread's own: what other programs take of the core does not count, what
// they take of the caches does. Then what a step of a sheet at rest costs that is pressed in the middle, beside one in motion.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "plain_body.hpp"
#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace {

using namespace palpate;

/// The plain loop and the library in turn, enough steps each that what the other left in the caches is gone.
template <RealScalar S>
void step(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto grid = make_grid<S>(n, n, S(0.005));
  for (int i = 0; i < n * n; ++i) grid.points(2, i) = S(1e-3) * static_cast<S>(std::sin(0.7 * i));   // no motion is zero in one direction
  benchmarks::Coefficients const c{.mass_per_particle = 3e-4};
  benchmarks::PlainBody<S> peer(grid, c);
  SoftBody body(benchmarks::tissue_of(grid, c), LeapfrogVerlet{}, WholeBody{});
  auto const springs = static_cast<double>(edges(grid).size());
  S const h = S(1e-4);
  int const steps = std::max(10, 600000 / (n * n));
  // Every 61st particle is pushed at every step, to and fro, so that none comes so near to rest that its velocity loses its digits:
  // such numbers take a processor longer.
  int time = 0;
  auto const push = [&](auto apply) {
    S const force = S(0.03) * static_cast<S>(std::sin(0.05 * ++time));
    for (int i = 7; i < n * n; i += 61) apply(i, Vector3<S>(force, -force, force));
  };
  auto const plain_step = [&] {
    push([&](int i, Vector3<S> const& force) { peer.push(i, force); });
    peer.advance(h);
  };
  auto const library_step = [&] {
    push([&](int i, Vector3<S> const& force) { body.apply_force(i, force); });
    body.step(h);
  };
  plain_step();
  time = 0;
  library_step();   // finds its stable step and lays out its springs
  std::vector<double> ratios;
  double best_plain = 1e9, best_library = 1e9;
  for (auto _ : state) {
    int const first = time;
    double const start = benchmarks::thread_time();
    for (int k = 0; k < steps; ++k) plain_step();
    double const middle = benchmarks::thread_time();
    time = first;
    for (int k = 0; k < steps; ++k) library_step();
    double const end = benchmarks::thread_time();
    double const plain = middle - start, library = end - middle;
    ratios.push_back(plain / library);
    best_plain = std::min(best_plain, plain / steps / springs * 1e9);
    best_library = std::min(best_library, library / steps / springs * 1e9);
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters["plain/library"] = ratios[ratios.size() / 2];
  state.counters["plain_ns"] = best_plain;
  state.counters["library_ns"] = best_library;
  if ((peer.positions() - body.positions()).cwiseAbs().maxCoeff() > S(1e-4)) state.SkipWithError("the two bodies do not move alike");
}

/// A sheet at rest that is pressed in the middle, from the first step on, beside the same sheet in motion: `pressed/moving` above 1 says that
/// a sheet at rest costs more.
template <RealScalar S, class Integrator, class Region = WholeBody>
void pressed(benchmark::State& state) {
  constexpr int n = 31, steps = 2000;
  S const h = S(1e-4);
  benchmarks::Coefficients const c{.mass_per_particle = 3e-4};
  auto const grid = make_grid<S>(n, n, S(0.005));
  auto shaken = grid;
  for (int i = 0; i < n * n; ++i) shaken.points(2, i) = S(1e-3) * static_cast<S>(std::sin(0.7 * i));
  SoftBody const at_rest(benchmarks::tissue_of(grid, c), Integrator{}, Region{}), ready(benchmarks::tissue_of(shaken, c), Integrator{}, Region{});
  auto const seconds = [&](auto body, auto const& push) {
    push(body, 0);
    body.step(h);   // finds its stable step and lays out its springs
    double const start = benchmarks::thread_time();
    for (int k = 1; k < steps; ++k) push(body, k), body.step(h);
    return (benchmarks::thread_time() - start) / (steps - 1);
  };
  auto const press = [](auto& body, int) { body.apply_force(n * n / 2, Vector3<S>(0, 0, S(-0.03))); };
  auto const shake = [](auto& body, int k) {
    S const force = S(0.03) * static_cast<S>(std::sin(0.05 * k));
    if constexpr (std::same_as<Region, WholeBody>)
      for (int i = 7; i < n * n; i += 61) body.apply_force(i, Vector3<S>(force, -force, force));
    else
      body.apply_force(n * n / 2, Vector3<S>(force, -force, force));
  };
  std::vector<double> ratios;
  double best = 1e9;
  for (auto _ : state) {
    double const moving = seconds(ready, shake), still = seconds(at_rest, press);
    ratios.push_back(still / moving);
    best = std::min(best, still);
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters["pressed/moving"] = ratios[ratios.size() / 2];
  state.counters["pressed_us"] = 1e6 * best;
}

BENCHMARK(step<double>)->Arg(31)->Arg(200)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(step<float>)->Arg(31)->Arg(200)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(pressed<double, LeapfrogVerlet>)->Unit(benchmark::kMillisecond);
BENCHMARK(pressed<float, LeapfrogVerlet>)->Unit(benchmark::kMillisecond);
BENCHMARK(pressed<double, LeapfrogVerlet, ZoneOfInfluence>)->Unit(benchmark::kMillisecond);
BENCHMARK(pressed<double, SymplecticEuler>)->Unit(benchmark::kMillisecond);
BENCHMARK(pressed<double, RungeKutta4>)->Unit(benchmark::kMillisecond);
BENCHMARK(pressed<double, BackwardEuler>)->Unit(benchmark::kMillisecond);

}  // namespace
