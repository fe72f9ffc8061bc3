// SPDX-License-Identifier: MIT
// One and four tools at one solid, in lock-step: a probe that lies along the skin, two hooks, a blade that cuts; and the body alone, beside them in the
// same run.
//   bench_tools
// Argument: how many of the tools. Columns (a tick is 1 ms of simulated time):
//   tetrahedra                  of the uncut block
//   servo_p50_us, servo_p99_us  of a servo tick of the probe
//   body_p50_us, body_p99_us    of a body tick: contacts, cut, one implicit step
//   alone_p50_us                of a step of the body alone, at rest, without tools
//   body_over_alone             body_p50_us over alone_p50_us
//   touches                     triangles at the lying probe at the end
// `four_over_one` runs both and tells the ratios of their columns. Before the first two rows the budget of their ticks is printed, as budget_text has it.
#include <palpate/palpate.hpp>
#include <palpate/tool.hpp>

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <numbers>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

using Hand = ScriptedDevice<double>;

/// What turns each tool, always so.
ScriptedDeviceOptions turned(Eigen::Quaterniond const& orientation = Eigen::Quaterniond::Identity()) { return {.orientation = {{0.0, orientation}}}; }

constexpr double top = 0.020;   // m

auto block() {
  auto const mesh = make_block<double>(20, 11, 5, 0.005, BlockPattern::alternating);   // 3,800 tetrahedra
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1060.0, .material = {.young = 1e4, .poisson = 0.4}, .damping = {.alpha = 10.0}});
  tissue.nail(vertices_where(mesh, [](Vector3<double> const& p) { return p.z() < 1e-9; }));
  return SoftBody(std::move(tissue), BackwardEuler{.max_iterations = 20});
}

auto hook(double x, double way) {
  return Tool(Hand({{0.0, {x, 0.025, top + 0.004}}, {0.2, {x, 0.025, top - 0.003}}, {0.6, {x + way, 0.025, top - 0.003}}}, turned()), Hook<double>({.friction = 0.5}),
              TissueReaction{});
}
/// On its side: the rod lies along x, 40 mm of it on the skin.
auto probe() {
  Eigen::Quaterniond const lies(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3<double>::UnitY()));
  return Tool(Hand({{0.0, {0.028, 0.0081, top + 0.004}}, {0.2, {0.028, 0.0081, top}}, {0.6, {0.028, 0.0101, top}}}, turned(lies)),
              BluntTool<double>(make_probe_shape<double>({.radius = 0.003, .length = 0.04})), TissueReaction{});
}
auto blade() {
  return Tool(Hand({{0.0, {0.0463, -0.004, 0.04}}, {0.2, {0.0463, 0.012, 0.012}}, {0.6, {0.0463, 0.040, 0.012}}}, turned()),
              VolumeCutter<double>({.puncture_depth = 0.002, .toughness = 50.0, .lip_friction = 5.0}), TissueReaction{});
}

struct Times {
  double servo_p50 = 0, servo_p99 = 0, body_p50 = 0, body_p99 = 0, alone = 0;   // µs
  double touches = 0, tetrahedra = 0;
};
double us(DurationHistogram::Duration time) { return static_cast<double>(time.count()) / 1e3; }

double alone() {
  auto body = block();
  std::vector<double> ticks;
  for (int k = 0; k < 400; ++k) {
    auto const start = std::chrono::steady_clock::now();
    body.step(1e-3);
    ticks.push_back(1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(ticks.begin(), ticks.begin() + 200, ticks.end());
  return ticks[200];
}

template <class Simulator, std::size_t... I>
void print_budget(Simulator const& simulator, std::index_sequence<I...>) {
  std::printf("%zu tools in lock-step\n%s", sizeof...(I), budget_text(std::array{simulator.template statistics<I>()...}).c_str());
}

template <std::size_t tools, class Simulator>
Times times(Simulator& simulator, int tetrahedra, bool prints) {
  simulator.run(0.6);
  if (prints) print_budget(simulator, std::make_index_sequence<tools>{});
  auto const all = simulator.template statistics<0>();
  Times t{us(all.servo.compute().p50()), us(all.servo.compute().p99()), us(all.body.compute().p50()), us(all.body.compute().p99()), alone()};
  t.touches = static_cast<double>(simulator.template tool<0>().rods().touches().size()), t.tetrahedra = tetrahedra;
  return t;
}
Times times_of(std::int64_t tools, bool prints = false) {
  auto body = block();
  int const tetrahedra = body.tissue().tetrahedra();
  if (tools == 1) {
    Simulator one(std::move(body), probe());
    return times<1>(one, tetrahedra, prints);
  }
  Simulator four(std::move(body), probe(), hook(0.036, -0.008), hook(0.058, 0.008), blade());
  return times<4>(four, tetrahedra, prints);
}

void tools(benchmark::State& state) {
  for (auto _ : state) {
    Times const t = times_of(state.range(0), true);
    state.counters["tetrahedra"] = t.tetrahedra, state.counters["touches"] = t.touches;
    state.counters["servo_p50_us"] = t.servo_p50, state.counters["servo_p99_us"] = t.servo_p99;
    state.counters["body_p50_us"] = t.body_p50, state.counters["body_p99_us"] = t.body_p99;
    state.counters["alone_p50_us"] = t.alone, state.counters["body_over_alone"] = t.body_p50 / t.alone;
  }
}
void four_over_one(benchmark::State& state) {
  for (auto _ : state) {
    Times const one = times_of(1), four = times_of(4);
    state.counters["servo_p50"] = four.servo_p50 / one.servo_p50, state.counters["servo_p99"] = four.servo_p99 / one.servo_p99;
    state.counters["body_p50"] = four.body_p50 / one.body_p50, state.counters["body_p99"] = four.body_p99 / one.body_p99;
  }
}
BENCHMARK(tools)->Arg(1)->Arg(4)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(four_over_one)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
