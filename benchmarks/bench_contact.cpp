// SPDX-License-Identifier: MIT
// Two surfaces in one another, and two bodies that press each other.
//   surfaces   two balls that overlap by a tenth: search, volume in common and its gradient [us], a pair of triangles that cross [us]; beside it FCL's mesh against mesh,
//              which finds the same pairs and nothing else; `fit` of the trees at all vertices
//   bodies     two solids on one another, of so many cells an edge, explicit (0) or implicit (1) steps of 1 ms: BodyContact::apply, and a step of both [us]
//   folded     a coil that lies on itself: the contact [us]
//   scene      two solids of 3,840 tetrahedra on one another and on a table, with four tools, a thousand ticks of 1 ms: a tick of the body [us]; where asked
//              for, each solid is watched for contact with itself, too
// Processor time of the thread; of a tick, the clock.
//   bench_contact --benchmark_counters_tabular=true
#include <palpate/body/soft_body.hpp>
#include <palpate/collision/fcl_surface.hpp>
#include <palpate/contact/body_contact.hpp>
#include <palpate/contact/obstacle.hpp>
#include <palpate/contact/self_contact.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/scene/scene_tool.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace {

using namespace palpate;

void surfaces(benchmark::State& state) {
  auto const one = make_sphere<double>(0.05, static_cast<int>(state.range(0)));
  auto other = one;
  other.points.colwise() += Vector3<double>(0.09, 0.0011, 0.0013);
  SurfaceTopology const first(static_cast<int>(one.points.cols()), one.triangles), second(static_cast<int>(other.points.cols()), other.triangles);
  SurfaceTree<double> tree(one), other_tree(other);
  FclSurface fcl(one), other_fcl(other);
  SurfaceIntersection<double> common;
  double find = 1e9, fit = 1e9, peer = 1e9, peer_fit = 1e9;
  std::size_t pairs = 0;
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    tree.refit(one.points), other_tree.refit(other.points);
    double const fitted = benchmarks::thread_time();
    common.find(MovingSurface<double>{first, tree, one.points}, MovingSurface<double>{second, other_tree, other.points});
    double const found = benchmarks::thread_time();
    fcl.refit(one.points), other_fcl.refit(other.points);
    double const fcl_fitted = benchmarks::thread_time();
    pairs = fcl.collide(other_fcl).size();
    double const end = benchmarks::thread_time();
    fit = std::min(fit, fitted - start), find = std::min(find, found - fitted);
    peer_fit = std::min(peer_fit, fcl_fitted - found), peer = std::min(peer, end - fcl_fitted);
  }
  if (pairs != static_cast<std::size_t>(common.pairs())) state.SkipWithError("FCL finds other pairs");
  state.counters["triangles"] = 2.0 * static_cast<double>(one.triangles.cols());
  state.counters["pairs"] = common.pairs(), state.counters["looked_at"] = common.visited();
  state.counters["us_find"] = 1e6 * find, state.counters["us_a_pair"] = 1e6 * find / common.pairs(), state.counters["us_fit"] = 1e6 * fit;
  state.counters["us_fcl"] = 1e6 * peer, state.counters["us_fcl_fit"] = 1e6 * peer_fit;
}
BENCHMARK(surfaces)->ArgName("frequency")->Arg(8)->Arg(16)->Arg(32)->Arg(64)->Arg(128)->Iterations(20)->Unit(benchmark::kMillisecond);

template <class Integrator>
void press(benchmark::State& state, Integrator integrator) {
  int const n = static_cast<int>(state.range(0));
  double const edge = 0.05 / n;
  auto const solid = [&](Vector3<double> const& low) {
    auto mesh = make_block<double>(n + 1, n + 1, n + 1, edge, BlockPattern::alternating);
    mesh.points.colwise() += low;
    SoftBody body(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000.0, .material = {.young = 3e3, .poisson = 0.3}, .damping = {.alpha = 1.0}}), integrator);
    for (int i = 0; i < body.size(); ++i)
      if (low[2] < 0 && mesh.points(2, i) < low[2] + 0.1 * edge) body.nail(i);
    return body;
  };
  auto lower = solid({0, 0, -0.05}), upper = solid({0.0113, 0.0071, -0.0001});
  upper.set_gravity({0, 0, -9.81});
  BodyContact contact(upper, lower);
  double applied = 0, stepped = 0;
  int ticks = 0;
  for (auto _ : state)
    for (int k = 0; k < 100; ++k) {
      double const start = benchmarks::thread_time();
      contact.apply(upper, lower, 1e-3);
      double const found = benchmarks::thread_time();
      upper.advance(1e-3), lower.advance(1e-3);
      if (k >= 50) applied += found - start, stepped += benchmarks::thread_time() - found, ++ticks;
    }
  state.counters["tetrahedra"] = 2.0 * upper.tissue().tetrahedra();
  state.counters["pairs"] = contact.intersection().pairs(), state.counters["regions"] = static_cast<double>(contact.regions().size());
  state.counters["us_contact"] = 1e6 * applied / ticks, state.counters["us_steps"] = 1e6 * stepped / ticks;
}
void bodies(benchmark::State& state) { state.range(1) == 0 ? press(state, LeapfrogVerlet{}) : press(state, BackwardEuler{}); }
BENCHMARK(bodies)->ArgNames({"cells", "implicit"})->ArgsProduct({{5, 9}, {0, 1}})->Iterations(2)->Unit(benchmark::kMillisecond);

/// A coil whose turns lie on each other: the search, and how many pairs are watched.
void folded(benchmark::State& state) {
  int const along = static_cast<int>(state.range(0));
  auto bar = make_block<double>(along + 1, 5, 5, 1.0, BlockPattern::alternating);
  for (auto p : bar.points.colwise()) {
    double const turn = 2 * std::numbers::pi * 2.5 * p.x() / along, out = 0.06 + 0.003 * (2 - p.y());
    p = Vector3<double>(out * std::cos(turn), out * std::sin(turn), 0.0119 * turn / (2 * std::numbers::pi) + 0.003 * p.z());
  }
  SoftBody body(FiniteElements<double, StableNeoHookean<double>>(bar, {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.3}}), LeapfrogVerlet{});
  SelfContact contact(body);
  double found = 1e9;
  for (auto _ : state) {
    body.step(1e-5);
    double const start = benchmarks::thread_time();
    contact.apply(body, 1e-5);
    found = std::min(found, benchmarks::thread_time() - start);
  }
  state.counters["triangles"] = body.tissue().surface().triangle_count(), state.counters["pairs"] = contact.intersection().pairs();
  state.counters["looked_at"] = contact.intersection().visited(), state.counters["us_contact"] = 1e6 * found;
}
BENCHMARK(folded)->ArgName("along")->Arg(60)->Arg(240)->Arg(960)->Iterations(20)->Unit(benchmark::kMillisecond);

template <class Integrator>
void four_tools(benchmark::State& state, Integrator integrator) {
  auto const solid = [&](double low) {
    auto mesh = make_block<double>(13, 9, 9, 0.005, BlockPattern::alternating);
    mesh.points.colwise() += Vector3<double>(-0.03, -0.02, low);
    SoftBody body(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000.0, .material = {.young = 5e3, .poisson = 0.3}, .damping = {.alpha = 5.0, .beta = 2e-4}}), integrator);
    body.set_gravity({0, 0, -9.81});
    return body;
  };
  auto slab = make_block<double>(2, 2, 2, 0.3);
  slab.points.colwise() += Vector3<double>(-0.15, -0.15, -0.3);
  auto skin = surface(slab);
  repair(skin);
  auto const tool = [](double x, double y) {
    auto path = Trajectory<double>::start({x, y, 0.09});
    path.line({x, y, 0.08}, 0.3).line({x + 0.004, y, 0.079}, 1.0);
    return Tool(ScriptedDevice<double>(std::move(path), {.max_force = 3.3, .rate = 1000.0}), NoCutter<double>({.tip_radius = 0.004}), TissueReaction{});
  };
  for (auto _ : state) {
    Scene scene(solid(-1e-5), solid(0.04 - 2e-5), Obstacle<double>(skin));
    BodyContactOptions<double> const options{.pressure = 5e3, .depth = 3e-3};
    scene.template touch<0, 2>(options), scene.template touch<1, 0>(options);
    if (state.range(1) != 0) scene.template touch<0, 0>(), scene.template touch<1, 1>();
    Simulator simulator(std::move(scene), SimulatorOptions{.coupling = {.stiffness = 300.0}}, tool(-0.02, -0.01), tool(-0.02, 0.011), tool(0.013, -0.012), tool(0.011, 0.009));
    simulator.run(1.0);
    auto const all = simulator.template statistics<0>();
    auto const us = [](auto duration) { return 1e-3 * static_cast<double>(std::chrono::nanoseconds(duration).count()); };
    state.counters["tetrahedra"] = 2 * 3840, state.counters["us_p50"] = us(all.body.compute().p50()), state.counters["us_p99"] = us(all.body.compute().p99());
    state.counters["steps_a_tick"] = static_cast<double>(simulator.body().template counts<0>().steps) / 1000;
    state.counters["pairs"] = simulator.body().template contact<1, 0>().intersection().pairs();
  }
}
void scene(benchmark::State& state) { state.range(0) == 0 ? four_tools(state, LeapfrogVerlet{}) : four_tools(state, BackwardEuler{}); }
BENCHMARK(scene)->ArgNames({"implicit", "in_itself"})->ArgsProduct({{0, 1}, {0, 1}})->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
