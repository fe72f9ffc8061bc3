// SPDX-License-Identifier: MIT
// A blade through a solid of finite elements or of springs: time for each tetrahedron that a cut makes, with topology, masses, border, search and neighbours; a
// tick with the blade inside that cuts nothing; and beside them, in the same run, the step that gathers the tetrahedra anew, and making tissue and body from the mesh.
//   bench_volume_cut
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

double microseconds_since(std::chrono::steady_clock::time_point start) {
  return 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}
double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

struct Elements {};
struct Springs {};
auto make_body(Elements, int n) {
  return SoftBody(FiniteElements<double, StableNeoHookean<double>>(make_block<double>(n, n, n, 0.005, BlockPattern::alternating),
                                                                   {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}}),
                  BackwardEuler{});
}

auto make_body(Springs, int n) {
  return SoftBody(MassSpring<double>(make_block<double>(n, n, n, 0.005, BlockPattern::alternating), {.mass = {.total = 1e-4 * n * n * n}, .link = {.stiffness = 50.0}}),
                  LeapfrogVerlet{});
}

/// Argument: vertices along each side of the block. 60 % of it is cut through, 40 ticks an edge, down to 40 % of its height.
template <class Kind>
void cut_block(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  double const side = 0.005 * (n - 1);
  for (auto _ : state) {
    auto const start = std::chrono::steady_clock::now();
    auto body = make_body(Kind{}, n);
    double const made_in = microseconds_since(start);
    auto const& topology = body.tissue().topology();
    int const tetrahedra = topology.tetrahedron_count();
    body.reserve(2 * body.size(), 20 * n * n);
    VolumeCutter<double> knife;
    std::vector<double> each, idle;
    for (int tick = 0; tick <= 40 * n; ++tick) {
      double const y = -0.002 + 0.6 * side * tick / (40.0 * n);
      int const before = topology.tetrahedron_count();
      auto const now = std::chrono::steady_clock::now();
      knife.advance(body, {{side / 2 + 0.0013, y, 0.4 * side}, {side / 2 + 0.0013, y, side + 0.01}});
      double const took = microseconds_since(now);
      if (int const made = topology.tetrahedron_count() - before; made > 0)
        each.push_back(took / made);
      else
        idle.push_back(took);
    }
    auto const now = std::chrono::steady_clock::now();
    body.step(1e-5);
    double const first = microseconds_since(now);
    state.counters["tetrahedra"] = tetrahedra;
    state.counters["made"] = topology.tetrahedron_count() - tetrahedra;
    state.counters["us_each"] = median(std::move(each));
    state.counters["us_idle_tick"] = median(std::move(idle));
    state.counters["ms_step_after"] = first / 1e3;
    state.counters["ms_made_anew"] = made_in / 1e3;
  }
}
BENCHMARK(cut_block<Elements>)->Arg(6)->Arg(12)->Arg(24)->Arg(48)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cut_block<Springs>)->Arg(6)->Arg(12)->Arg(24)->Arg(48)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
