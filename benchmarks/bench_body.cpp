// SPDX-License-Identifier: MIT
// What a step of a heart-sized body costs (961 particles, whole body or zone, leapfrog), beside a plain Eigen loop over the same springs.
//   bench_body --benchmark_repetitions=21 --benchmark_report_aggregates_only=true
// prints medians; "steps/s" is the rate. `ratio` runs both in turn and reports the median of plain time / library time: above 1
// the library is faster. `plain steps` is the time of an implicit step in steps of the plain loop.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/heart.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "plain_body.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

constexpr benchmarks::Coefficients coefficients{.mass_per_particle = 0.3 / 961};
constexpr double step = 1e-4;   // s

template <RealScalar S>
MassSpring<S> heart() {
  return benchmarks::tissue_of(make_heart<S>(), coefficients);
}

Vector3<double> const push(0.0, 0.2, -0.3);

template <RealScalar S>
void plain(benchmark::State& state) {
  benchmarks::PlainBody<S> body(make_heart<S>(), coefficients);
  body.push(100, push.cast<S>());
  for (auto _ : state) {
    body.advance(S(step));
    benchmark::DoNotOptimize(body.positions().data());
  }
  state.counters["steps/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

template <RealScalar S, class I, class R>
void soft_body(benchmark::State& state) {
  SoftBody body(heart<S>(), I{}, R{});
  int moving = 0;
  for (auto _ : state) {
    body.apply_force(100, push.cast<S>());
    moving = body.step(S(step)).moving;
  }
  state.counters["moving"] = moving;
  state.counters["steps/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

/// The touch wanders from particle to particle every 20 steps, so that the zone is chosen anew and what it leaves relaxes.
template <RealScalar S>
void wandering_zone(benchmark::State& state) {
  SoftBody body(heart<S>(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  int k = 0, touched = 100;
  double moving = 0;
  for (auto _ : state) {
    if (++k % 20 == 0) {
      int next = touched;
      body.tissue().for_each_neighbour(touched, [&](int neighbour) { next = std::max(next, neighbour); });
      touched = next == touched ? 100 : next;
    }
    body.apply_force(touched, push.cast<S>());
    moving += body.step(S(step)).moving;
  }
  state.counters["moving"] = moving / std::max(1, k);
  state.counters["steps/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

/// Both in turn, 100 steps each, so that the machine treats them alike.
template <RealScalar S>
void ratio(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  benchmarks::PlainBody<S> peer(make_heart<S>(), coefficients);
  SoftBody body(heart<S>(), LeapfrogVerlet{}, WholeBody{});
  peer.push(100, push.cast<S>());
  std::vector<double> ratios;
  for (auto _ : state) {
    auto const start = Clock::now();
    for (int k = 0; k < 100; ++k) peer.advance(S(step));
    auto const middle = Clock::now();
    for (int k = 0; k < 100; ++k) {
      body.apply_force(100, push.cast<S>());
      body.step(S(step));
    }
    auto const end = Clock::now();
    ratios.push_back(std::chrono::duration<double>(middle - start) / std::chrono::duration<double>(end - middle));
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters["plain/library"] = ratios[ratios.size() / 2];
  if ((peer.positions() - body.positions()).cwiseAbs().maxCoeff() > S(1e-4)) state.SkipWithError("the two bodies do not move alike");
}

/// One step of backward Euler with 25 iterations of conjugate gradients, no less, counted in steps of the plain loop; both in turn.
template <RealScalar S>
void backward_euler_25(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  benchmarks::PlainBody<S> peer(make_heart<S>(), coefficients);
  SoftBody body(heart<S>(), BackwardEuler{.tolerance = 0, .max_iterations = 25}, WholeBody{});
  peer.push(100, push.cast<S>());
  std::vector<double> ratios;
  for (auto _ : state) {
    auto const start = Clock::now();
    for (int k = 0; k < 100; ++k) peer.advance(S(step));
    auto const middle = Clock::now();
    for (int k = 0; k < 10; ++k) {
      body.apply_force(100, push.cast<S>());
      body.step(S(100 * step));
    }
    auto const end = Clock::now();
    ratios.push_back(10 * std::chrono::duration<double>(end - middle) / std::chrono::duration<double>(middle - start));
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters["plain steps"] = ratios[ratios.size() / 2];
}

/// A two-ring zone in the middle of a grid of n × n: the cost of a step does not depend on the size of the body.
void two_ring_zone(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  MassSpring<double> tissue(make_grid<double>(n, n, 0.005), {.mass = {.total = 3e-4 * n * n, .lumping = Lumping::equal},
                                                             .link = {.stiffness = 100.0, .damping = 0.02},
                                                             .home = {.stiffness = 10.0, .damping = 0.05}});
  SoftBody body(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  int moving = 0;
  auto const one_step = [&] {
    body.apply_force(n * (n / 2) + n / 2, {0.0, 0.02, -0.03});
    moving = body.step(1e-4).moving;
  };
  one_step();   // finds the stable step
  for (auto _ : state) one_step();
  state.counters["moving"] = moving;
}

BENCHMARK(plain<double>);
BENCHMARK(soft_body<double, LeapfrogVerlet, WholeBody>);
BENCHMARK(ratio<double>);
BENCHMARK(plain<float>);
BENCHMARK(soft_body<float, LeapfrogVerlet, WholeBody>);
BENCHMARK(ratio<float>);
BENCHMARK(soft_body<double, RungeKutta4, WholeBody>);
BENCHMARK(soft_body<double, LeapfrogVerlet, ZoneOfInfluence>);
BENCHMARK(soft_body<float, LeapfrogVerlet, ZoneOfInfluence>);
BENCHMARK(wandering_zone<double>);
BENCHMARK(two_ring_zone)->Arg(31)->Arg(200)->Arg(1000)->Iterations(100000);   // so that a body is made once
BENCHMARK(backward_euler_25<double>);
BENCHMARK(backward_euler_25<float>);

}  // namespace
