// SPDX-License-Identifier: MIT
// Long elements in a liver of 2,000 vertices that is pressed with 0.5 N at its top: by spacing [mm], columns, what a step of 1 ms costs [us], what a contact
// asks for besides, and the statics [ms] with their iterations.
//   bench_long_elements
#include <palpate/mesh/organ.hpp>
#include <palpate/models.hpp>

#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

namespace {

using namespace palpate;

void long_elements(benchmark::State& state) {
  double const spacing = 1e-3 * static_cast<double>(state.range(0));
  LongElements<double> body(make_organ<double>({.vertices = 2000}), {.spacing = spacing, .young = 5000});
  int const top = body.nearest_vertex({0, 0, 1});
  double step = 1e9, contact = 1e9;
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    body.apply_force(top, {0, 0, -0.5});
    body.step(1e-3);
    double const stepped = benchmarks::thread_time();
    benchmark::DoNotOptimize(body.predicted_acceleration(top, 1e-3));
    benchmark::DoNotOptimize(body.mobility(top, top, 1e-3));
    step = std::min(step, stepped - start), contact = std::min(contact, benchmarks::thread_time() - stepped);
  }
  double const error = std::abs(body.volume() / body.kept_volume() - 1);
  body.reset();
  body.apply_force(top, {0, 0, -0.5});
  double const start = benchmarks::thread_time();
  auto const report = body.solve_statics();
  state.counters["statics_ms"] = 1e3 * (benchmarks::thread_time() - start);
  state.counters["iterations"] = report.iterations;
  state.counters["columns"] = body.columns();
  state.counters["step_us"] = 1e6 * step;
  state.counters["contact_us"] = 1e6 * contact;
  state.counters["volume_error"] = error;
  state.counters["uncovered"] = body.uncovered();
}
BENCHMARK(long_elements)->Name("long elements")->Arg(16)->Arg(12)->Arg(8)->Arg(6)->Unit(benchmark::kMicrosecond);

}  // namespace
