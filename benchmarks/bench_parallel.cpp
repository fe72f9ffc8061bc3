// SPDX-License-Identifier: MIT
// What a step of a whole body gains from two cores, by size and scalar: the same square grid, or block of tetrahedra, on one and on two, in turn in
// the same run; leapfrog steps, and of solids implicit ones of 10 ms with 25 iterations.
//   bench_parallel
// prints the median of the ratios of the times by the clock (`one/two`, above 1 two are faster), and the best time of both per spring or tetrahedron and step [ns].
// What two cores of the machine can give at most is beside it: two bodies, each stepped by a thread of its own that waits for nothing, against one
// after the other (`two_bodies`). Memory that both share keeps that below 2 for large bodies.
// Numbers count on an idle machine only. The positions of both are compared to the bit.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/parallel/on_cores.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/finite_elements.hpp>

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

/// The same body on one core and on two, pushed at some particles, in steps of h seconds.
template <class One, class Two>
void compare(benchmark::State& state, One one, Two two, double parts, int steps, typename One::Scalar h) {
  using S = typename One::Scalar;
  One left = one, right = one;
  auto const advance = [&](auto& body) {
    auto const start = Clock::now();
    for (int k = 0; k < steps; ++k) {
      for (int i = 7; i < body.size(); i += 61) body.apply_force(i, Vector3<S>(S(0.01), S(-0.01), S(0.02)));
      body.step(h);
    }
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  one.step(h), two.step(h), left.step(h), right.step(h);   // finds the stable step and lays out the springs
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
    best_one = std::min(best_one, alone / steps / parts * 1e9);
    best_two = std::min(best_two, together / steps / parts * 1e9);
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

template <RealScalar S>
void two_cores(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto grid = make_grid<S>(n, n, S(0.005));
  for (int i = 0; i < n * n; ++i) grid.points(2, i) = S(1e-3) * static_cast<S>(std::sin(0.7 * i));
  benchmarks::Coefficients const c{.mass_per_particle = 3e-4};
  compare(state, SoftBody(benchmarks::tissue_of(grid, c), LeapfrogVerlet{}, WholeBody{}), SoftBody(benchmarks::tissue_of(grid, c), LeapfrogVerlet{}, WholeBody{}, OnCores(2)),
          static_cast<double>(edges(grid).size()), std::max(5, 2000000 / (n * n)), S(1e-4));
}
template <RealScalar S>
void two_cores_of_solids(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<S>(n + 1, n + 1, n + 1, S(0.005), BlockPattern::alternating);
  FiniteElements<S, StableNeoHookean<S>> const tissue(mesh, {.density = S(1000), .material = {S(5000), S(0.45)}});
  compare(state, SoftBody(tissue, LeapfrogVerlet{}, WholeBody{}), SoftBody(tissue, LeapfrogVerlet{}, WholeBody{}, OnCores(2)), static_cast<double>(mesh.tetrahedra.cols()),
          std::max(3, static_cast<int>(2000000 / mesh.tetrahedra.cols())), S(1e-4));
}

template <Stiffness stiffness>
void two_cores_of_implicit_steps(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<double>(n + 1, n + 1, n + 1, 0.007, BlockPattern::alternating);
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {5000, 0.45}, .stiffness = stiffness});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 1e-6; }));
  BackwardEuler const rule{.tolerance = 0, .max_iterations = 25};
  compare(state, SoftBody(tissue, rule, WholeBody{}), SoftBody(tissue, rule, WholeBody{}, OnCores(2)), static_cast<double>(mesh.tetrahedra.cols()), 5, 0.01);
}

BENCHMARK(two_cores<double>)->Arg(100)->Arg(320)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(two_cores<float>)->Arg(100)->Arg(320)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(two_cores_of_solids<double>)->Arg(16)->Arg(27)->Arg(58)->Unit(benchmark::kMillisecond);
BENCHMARK(two_cores_of_solids<float>)->Arg(16)->Arg(27)->Unit(benchmark::kMillisecond);
BENCHMARK(two_cores_of_implicit_steps<Stiffness::matrix_free>)->Arg(16)->Arg(27)->Unit(benchmark::kMillisecond);
BENCHMARK(two_cores_of_implicit_steps<Stiffness::assembled>)->Arg(16)->Arg(27)->Unit(benchmark::kMillisecond);

}  // namespace
