// SPDX-License-Identifier: MIT
// Models of the same solid beside each other: a leapfrog step [ns a tetrahedron], a backward-Euler step of 1 ms with 25 iterations [ms], the largest stable
// step [ms], and what each tetrahedron costs that a blade makes, without a step between [us]. Then a time step per node, where it is wanted or everywhere [ms],
// and a leapfrog step of springs of one law and in two layers [ns a link].
//   bench_models
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/models.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/fill.hpp>

#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

/// Argument: cubes along each side.
template <class Tissue>
void model(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<double>(n + 1, n + 1, n + 1, 0.005, BlockPattern::alternating);
  double const side = 0.005 * n, tetrahedra = static_cast<double>(mesh.tetrahedra.cols());
  auto const make = [&](auto integrator) {
    Tissue tissue(mesh, {.density = 1000.0, .material = {.young = 5000.0, .poisson = 0.45}});
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(2, i) < 1e-6) tissue.nail(i);
    return SoftBody(std::move(tissue), integrator);
  };
  auto explicitly = make(LeapfrogVerlet{});
  auto implicitly = make(BackwardEuler{.tolerance = 0, .max_iterations = 25});
  explicitly.set_gravity({0, 0, -9.81}), implicitly.set_gravity({0, 0, -9.81});
  double const stable = explicitly.stable_step();
  double best_explicit = 1e9, best_implicit = 1e9;
  int const rounds = std::max(2, static_cast<int>(4e5 / tetrahedra));
  implicitly.step(1e-3);   // gathers
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    for (int k = 0; k < rounds; ++k) explicitly.step(0.3 * stable);
    double const middle = benchmarks::thread_time();
    implicitly.step(1e-3);
    best_explicit = std::min(best_explicit, (middle - start) / rounds), best_implicit = std::min(best_implicit, benchmarks::thread_time() - middle);
  }
  auto cut = make(BackwardEuler{});
  cut.reserve(cut.size() + cut.size() / 3, 30 * n * n);
  VolumeCutter<double> knife;
  std::vector<double> each;
  for (int tick = 0; tick <= 20 * n; ++tick) {
    double const y = -0.002 + 0.6 * side * tick / (20.0 * n);
    int const before = cut.tissue().tetrahedra();
    cut.nearest_vertex({side / 2, y, side});   // fits the search tree
    double const start = benchmarks::thread_time();
    knife.advance(cut, {{side / 2 + 0.0013, y, 0.4 * side}, {side / 2 + 0.0013, y, side + 0.01}});
    if (int const made = cut.tissue().tetrahedra() - before; made > 0) each.push_back(1e6 * (benchmarks::thread_time() - start) / made);
  }
  std::nth_element(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(each.size() / 2), each.end());
  state.counters["tetrahedra"] = tetrahedra;
  state.counters["explicit_ns"] = 1e9 * best_explicit / tetrahedra;
  state.counters["implicit_ms"] = 1e3 * best_implicit;
  state.counters["stable_ms"] = 1e3 * stable;
  state.counters["cut_us"] = each[each.size() / 2];
}
BENCHMARK(model<FiniteElements<double, LinearElastic<double>>>)->Name("linear finite elements")->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(model<TensorMass<double>>)->Name("tensor mass")->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(model<CorotatedTensorMass<double>>)->Name("corotated tensor mass")->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(model<FiniteElements<double, Corotational<double>>>)->Name("corotational finite elements")->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);

/// A block of cubes whose top corner is pushed hard for 20 ms, in steps of 2 ms that are halved up to four times: where a node is fast, or everywhere.
void node_steps(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  bool const everywhere = state.range(1) != 0;
  auto const mesh = make_block<double>(n + 1, n + 1, n + 1, 0.005, BlockPattern::alternating);
  double best = 1e9;
  for (auto _ : state) {
    TensorMass<double> tissue(mesh, {.density = 1000.0, .material = {.young = 5000.0, .poisson = 0.45}});
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(2, i) < 1e-6) tissue.nail(i);
    SoftBody body(std::move(tissue), NodeSteps{.theta = 0.6, .speed_bound = everywhere ? 1e-9 : 0.05, .tolerance = 1e-3});
    body.stable_step();
    double const start = benchmarks::thread_time();
    for (int step = 0; step < 10; ++step) {
      body.apply_force(body.size() - 1, {0, 0, -0.2});
      body.step(2e-3);
    }
    best = std::min(best, benchmarks::thread_time() - start);
    state.counters["solves_a_node"] = static_cast<double>(body.solve_statistics().node_steps) / body.size() / 10;
  }
  state.counters["step_ms"] = 1e2 * best;
}
BENCHMARK(node_steps)->Name("a step per node")->Args({9, 0})->Args({9, 1})->Args({16, 0})->Args({16, 1})
    ->ArgNames({"cubes", "everywhere"})->Unit(benchmark::kMillisecond);

/// A thigh of springs, all of one law or in two layers: a leapfrog step [ns a link].
template <bool in_layers>
void thigh(benchmark::State& state) {
  auto const mesh = fill(make_thigh<double>(), {.edge = 0.02}).mesh;
  auto const make = [&] {
    if constexpr (in_layers)
      return two_layers(mesh, LinearSpring<double>{.stiffness = 200.0}, LockingSpring<double>{.stiffness = 80.0, .largest_tension = 1.6},
                        {.mass = {.total = 4.0}});
    else
      return MassSpring<double>(mesh, {.mass = {.total = 4.0}, .link = {.stiffness = 100.0}});
  };
  auto tissue = make();
  tissue.nail(thigh_bone(mesh));
  SoftBody body(std::move(tissue), LeapfrogVerlet{});
  body.set_gravity({0, -9.81, 0});
  double const h = 0.2 * body.stable_step();
  double best = 1e9;
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    for (int k = 0; k < 100; ++k) body.step(h);
    best = std::min(best, (benchmarks::thread_time() - start) / 100);
  }
  state.counters["links"] = body.tissue().links().size();
  state.counters["explicit_ns"] = 1e9 * best / body.tissue().links().size();
}
BENCHMARK(thigh<false>)->Name("a thigh of linear springs")->Unit(benchmark::kMillisecond);
BENCHMARK(thigh<true>)->Name("a thigh of springs in two layers")->Unit(benchmark::kMillisecond);

}  // namespace
