// SPDX-License-Identifier: MIT
// What it costs to find where a touched body rests. A skin of n × n particles on home springs, pushed at its middle.
//   bench_statics --benchmark_filter=solve      every solver to an imbalance of 1e-8 edges; `iterations` are the solver's own
//   bench_statics --benchmark_filter=touch      sweeps until the largest error is 10 % and 1 % of what it was, for each order of visiting
#include <palpate/mesh/grid.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/statics/local_relaxation.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include <benchmark/benchmark.h>

#include <numeric>
#include <vector>

namespace {

using namespace palpate;

struct Pushed {
  MassSpring<double> tissue;
  std::vector<int> free;
  Matrix3X<double> applied;

  Pushed(int n, double home)
      : tissue(make_grid<double>(n, n, 0.01), {.link = {.stiffness = 50.0}, .home = {.stiffness = home}}),
        free(static_cast<std::size_t>(n * n)),
        applied(Matrix3X<double>::Zero(3, n * n)) {
    std::iota(free.begin(), free.end(), 0);
    applied.col(n * n / 2) << 0.05, 0.02, -0.1;
  }
  StaticProblem<MassSpring<double>> problem(double tolerance) const { return {tissue, free, Vector3<double>::Zero(), applied, tolerance, {}}; }
};

template <class Solver>
void solve(benchmark::State& state, Solver const& solver) {
  Pushed const scene(static_cast<int>(state.range(0)), 2.0);
  auto const problem = scene.problem(1e-10);
  Equilibrium<double> found;
  for (auto _ : state) {
    Matrix3X<double> x = scene.tissue.rest_positions();
    found = solver.solve(problem, x);
    benchmark::DoNotOptimize(x.data());
  }
  if (!found.converged) state.SkipWithError("no balance");
  state.counters["iterations"] = found.iterations;
}

void touch(benchmark::State& state, VisitOrder order) {
  Pushed const scene(31, static_cast<double>(state.range(0)));
  auto const problem = scene.problem(1e-13);
  Matrix3X<double> const rest = scene.tissue.rest_positions();
  Matrix3X<double> balance = rest;
  NewtonRaphson<>{}.solve(problem, balance);
  auto const error = [&](double sweeps) {
    Matrix3X<double> x = rest;
    LocalRelaxation{.order = order, .sweeps = sweeps}.solve(problem, x);
    return (x - balance).colwise().norm().maxCoeff() / (rest - balance).colwise().norm().maxCoeff();
  };
  double tenth = 0.25, hundredth = 0;
  for (auto _ : state) {
    for (tenth = 0.25; error(tenth) > 0.1; tenth *= 1.05) {}
    for (hundredth = tenth; error(hundredth) > 0.01; hundredth *= 1.05) {}
  }
  state.counters["sweeps_to_10%"] = tenth;
  state.counters["sweeps_to_1%"] = hundredth;
}

/// What support springs add to the forces of a whole body.
template <class Tissue>
void forces(benchmark::State& state, Tissue const& tissue) {
  std::vector<int> all(static_cast<std::size_t>(tissue.size()));
  std::iota(all.begin(), all.end(), 0);
  StaticProblem<Tissue> const problem{tissue, all, Vector3<double>::Zero(), Matrix3X<double>(3, 0), 1e-9, {}};
  palpate::detail::NetForces<Tissue> net(problem);
  Matrix3X<double> const x = 1.01 * tissue.rest_positions();
  for (auto _ : state) benchmark::DoNotOptimize(net.at(x).data());
}

MassSpring<double> sheet() { return {make_grid<double>(31, 31, 0.01), {.link = {.stiffness = 50.0}}}; }

BENCHMARK_CAPTURE(solve, dynamic_relaxation, DynamicRelaxation{})->Arg(31)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(solve, local_relaxation, LocalRelaxation{})->Arg(31)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(solve, local_relaxation_index, LocalRelaxation{.order = VisitOrder::index})->Arg(31)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(solve, newton, NewtonRaphson<>{})->Arg(31)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(solve, newton_over_relaxation, NewtonRaphson<TangentOverRelaxation>{})->Arg(31)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(solve, modified_newton, NewtonRaphson<>{.tangent = Tangent::modified})->Arg(31)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(touch, index, VisitOrder::index)->Arg(50)->Arg(10)->Arg(2)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(touch, breadth_first, VisitOrder::breadth_first)->Arg(50)->Arg(10)->Arg(2)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(touch, random, VisitOrder::random)->Arg(50)->Arg(10)->Arg(2)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(forces, plain, sheet())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(forces, supported, Supported(sheet(), LinearSpring<double>{.stiffness = 5.0}, {0.15, 0.15, -0.1}))->Unit(benchmark::kMicrosecond);

}  // namespace
