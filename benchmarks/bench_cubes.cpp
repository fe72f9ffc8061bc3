// SPDX-License-Identifier: MIT
// Cubes: a block of n × n × n/2 that is nailed below, under a tool.
//   order    a force of 0.1 N on one vertex: visits of vertices, in thousands, until the touched vertex, and all vertices, are within 1 % of the touched one's
//            displacement of where they come to rest; `one_ms` is the largest error [%] after 1 ms of relaxation
//   tick     a probe in contact that slides at 20 mm/s, as a Simulator has it, six sweeps in a budget [us, median and p99]; `split`, `cut`: what one split, one cut through half the block takes
//   search   10^4 points near the surface: depth first through the octree, and the box tree [us each]; `fit`: of the trees after a step that moved all
// Processor time of the thread.
//   bench_cubes --benchmark_counters_tabular=true
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/body_loop.hpp>

#include "../tests/tissue/cube_octree.hpp"
#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

namespace {

using namespace palpate;
using Point = Vector3<double>;
using Body = Cubes<double>;
constexpr double edge = 0.005;   // m

Body block(int n, CubesOptions<double> options) {
  auto skin = surface(make_block<double>(n + 1, n + 1, n / 2 + 1, edge, BlockPattern::alternating));
  repair(skin);
  options.edge = edge, options.young = 5000;
  Body body(skin, options);
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i)[2] < edge / 10) body.nail(i);
  return body;
}

double quantile(std::vector<double>& values, double share) {
  auto const place = values.begin() + static_cast<std::ptrdiff_t>(share * double(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

void order(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const how = static_cast<VisitOrder>(state.range(1));
  Body body = block(n, {.order = how, .sweeps = 1});
  auto timed = block(n, {.order = how, .sweeps = 100000, .seconds = 1e-3, .clock = benchmarks::thread_time});
  Point const force(0, 0, -0.1);
  int const touched = body.nearest_vertex({edge * (n / 2), edge * (n / 2), 1.0});
  Body rest = body;
  rest.apply_force(touched, force);
  rest.solve_statics(1e-9);
  double const deep = rest.displacement(touched).norm();
  auto const largest_error = [&](Body const& now) { return (now.positions() - rest.positions()).colwise().norm().maxCoeff() / deep; };
  double here = 0, all = 0, one_ms = 0;
  for (auto _ : state) {
    auto const start = body.save();
    double visits = 0;
    here = all = 0;
    for (int k = 0; k < 3000 && all == 0; ++k) {
      body.apply_force(touched, force);
      visits += body.step(1e-3).visits;
      if (here == 0 && (body.positions().col(touched) - rest.positions().col(touched)).norm() < 0.01 * deep) here = visits;
      if (largest_error(body) < 0.01) all = visits;
    }
    body.restore(start);
    auto const timed_start = timed.save();
    timed.apply_force(touched, force);
    timed.step(1e-3);
    one_ms = 100 * largest_error(timed);
    timed.restore(timed_start);
  }
  state.counters["vertices"] = body.size();
  state.counters["touched_k"] = here / 1e3, state.counters["all_k"] = all / 1e3, state.counters["one_ms_%"] = one_ms;
}
BENCHMARK(order)->ArgNames({"n", "order"})->ArgsProduct({{8, 16, 24}, {int(VisitOrder::breadth_first), int(VisitOrder::index), int(VisitOrder::random)}})
    ->Iterations(1)->Unit(benchmark::kMillisecond);

void tick(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0)), levels = static_cast<int>(state.range(1));
  double const seconds = static_cast<double>(state.range(2)) * 1e-6;
  CubesOptions<double> const options{.levels = levels, .join_after = 50, .seconds = seconds, .clock = benchmarks::thread_time};
  BodyLoop loop(block(n, options), NoCutter<double>(), ContactCoupling{}, 100);
  std::vector<double> us;
  double const top = edge * (n / 2), side = edge * n;
  int k = 0;
  for (auto _ : state)
    for (int more = 0; more < 1500; ++more, ++k) {
      double const z = top - 0.0005 * std::min(1.0, (k - 20) / 50.0);
      Point const tip(side / 2 + 0.3 * side * std::sin(0.02 / (0.3 * side) * 1e-3 * k), 0.37 * side, z);
      double const start = benchmarks::thread_time();
      loop.tick({tip}, 1e-3);
      if (k > 100) us.push_back(1e6 * (benchmarks::thread_time() - start));
    }
  Body cut = block(n, {.levels = 1});
  double start = benchmarks::thread_time();
  int const splits = std::min(8, cut.cubes());
  for (int c = 0; c < splits; ++c) cut.split(c), cut.join(c);
  state.counters["split_us"] = 1e6 * (benchmarks::thread_time() - start) / (2 * splits);
  double const x = side / 2 + 1e-4;
  start = benchmarks::thread_time();
  state.counters["opened"] = cut.cut({x, -1, 0}, {x, -1, 1}, {x, side / 2, 0}, {x, side / 2, 1});
  state.counters["cut_ms"] = 1e3 * (benchmarks::thread_time() - start);
  state.counters["cubes"] = cut.cubes(), state.counters["vertices"] = cut.size();
  state.counters["tick_us"] = quantile(us, 0.5), state.counters["p99_us"] = quantile(us, 0.99);
}
BENCHMARK(tick)->ArgNames({"n", "levels", "budget_us"})->ArgsProduct({{8, 16, 24}, {0, 1, 2}, {400, 100000}})->Iterations(3)->Unit(benchmark::kMillisecond);

void search(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  Body body = block(n, {});
  body.set_gravity({3, 2, -5});
  std::srand(1);
  std::vector<Point> points(10000);
  for (Point& p : points) p = Point(edge * n, edge * n, edge * n / 2).cwiseProduct((Point::Random() + Point::Ones()) / 2) + 0.01 * Point::Random();
  palpate_test::CubeOctree octree(body);
  std::array<double, 2> best{1e9, 1e9}, fit{1e9, 1e9};
  for (auto _ : state) {
    body.step(1e-3);
    std::vector<double> found;
    for (int const way : {0, 1}) {
      auto const at = [&](Point const& p) { return way == 0 ? octree.nearest_point(body, p).distance : body.nearest_point(p).distance; };
      double const start = benchmarks::thread_time();
      if (way == 0) octree.fit(body);
      at(points[0]);
      double const middle = benchmarks::thread_time();
      for (std::size_t k = 0; k < points.size(); ++k) {
        double const distance = at(points[k]);
        if (way == 0) found.push_back(distance);
        else if (std::abs(distance - found[k]) > 1e-12) return state.SkipWithError("the two searches differ");
      }
      fit[std::size_t(way)] = std::min(fit[std::size_t(way)], 1e6 * (middle - start));
      best[std::size_t(way)] = std::min(best[std::size_t(way)], 1e6 * (benchmarks::thread_time() - middle) / double(points.size()));
    }
  }
  state.counters["octree_us"] = best[0], state.counters["boxes_us"] = best[1];
  state.counters["fit_octree_us"] = fit[0], state.counters["fit_boxes_us"] = fit[1];
}
BENCHMARK(search)->ArgName("n")->Arg(8)->Arg(16)->Arg(24)->Iterations(5)->Unit(benchmark::kMillisecond);

}  // namespace
