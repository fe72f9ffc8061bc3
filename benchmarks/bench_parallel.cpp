// SPDX-License-Identifier: MIT
// What a leapfrog step of a whole body gains from two cores, by size and scalar: the same square grid on one and on two, in turn in the same run.
//   bench_parallel
// prints the median of the ratios of the times by the clock (`one/two`, above 1 two are faster), and the best time of both per spring and step [ns].
// What two cores of the machine can give at most is beside it: two bodies, each stepped by a thread of its own that waits for nothing, against one
// after the other (`two_bodies`). Memory that both share keeps that below 2 for large bodies.
// Numbers count on an idle machine only. The positions of both are compared to the bit.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/parallel/on_cores.hpp>
#include <palpate/region/whole_body.hpp>

#include "plain_body.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <thread>
#include <vector>

namespace {

using namespace palpate;
using Clock = std::chrono::steady_clock;

template <RealScalar S>
void two_cores(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto grid = make_grid<S>(n, n, S(0.005));
  for (int i = 0; i < n * n; ++i) grid.points(2, i) = S(1e-3) * static_cast<S>(std::sin(0.7 * i));
  benchmarks::Coefficients const c{.mass_per_particle = 3e-4};
  SoftBody one(benchmarks::tissue_of(grid, c), LeapfrogVerlet{}, WholeBody{}), left = one, right = one;
  SoftBody two(benchmarks::tissue_of(grid, c), LeapfrogVerlet{}, WholeBody{}, OnCores(2));
  auto const springs = static_cast<double>(edges(grid).size());
  int const steps = std::max(5, 2000000 / (n * n));
  auto const advance = [&](auto& body) {
    auto const start = Clock::now();
    for (int k = 0; k < steps; ++k) {
      for (int i = 7; i < n * n; i += 61) body.apply_force(i, Vector3<S>(S(0.01), S(-0.01), S(0.02)));
      body.step(S(1e-4));
    }
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  one.step(S(1e-4)), two.step(S(1e-4)), left.step(S(1e-4)), right.step(S(1e-4));   // finds the stable step and lays out the springs
  std::vector<double> ratios, bounds;
  double best_one = 1e9, best_two = 1e9;
  for (auto _ : state) {
    double const alone = advance(one), together = advance(two);
    ratios.push_back(alone / together);
    auto const start = Clock::now();
    std::thread beside([&] { advance(right); });
    advance(left);
    beside.join();
    bounds.push_back(2 * alone / std::chrono::duration<double>(Clock::now() - start).count());
    best_one = std::min(best_one, alone / steps / springs * 1e9);
    best_two = std::min(best_two, together / steps / springs * 1e9);
  }
  auto const median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  state.counters["one/two"] = median(ratios);
  state.counters["two_bodies"] = median(bounds);
  state.counters["one_ns"] = best_one;
  state.counters["two_ns"] = best_two;
  if (one.positions() != two.positions()) state.SkipWithError("one core and two do not give the same");
}

BENCHMARK(two_cores<double>)->Arg(100)->Arg(320)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(two_cores<float>)->Arg(100)->Arg(320)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
