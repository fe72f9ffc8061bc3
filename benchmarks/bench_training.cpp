// SPDX-License-Identifier: MIT
// What comparing two sessions costs offline, and guidance in the servo tick.
#include <palpate/core/random.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/training/comparison.hpp>
#include <palpate/training/guidance.hpp>
#include <palpate/training/session.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace {

using namespace palpate;

/// A hand that draws loops of some centimetres and trembles, at 1 kHz.
Session drawing(double seconds, double off, std::uint64_t seed) {
  Random random(Seed{seed});
  Session session;
  for (int k = 0; k < static_cast<int>(seconds * 1000); ++k) {
    double const t = k * 1e-3;
    session.recording.append({.time = t,
                              .tip = {0.04 * std::sin(0.7 * t) + off, 0.03 * std::cos(1.1 * t) + 3e-4 * std::sin(60 * t), 1e-4 * random.normal()},
                              .depth = 0.002,
                              .phase = CuttingPhase::moving,
                              .force = {0, 0, 0.3}});
  }
  return session;
}

void compare_sessions(benchmark::State& state) {
  auto const seconds = static_cast<double>(state.range(0));
  Session const expert = drawing(seconds, 0.0, 1), trainee = drawing(seconds, 0.002, 2);
  for (auto _ : state) benchmark::DoNotOptimize(compare(expert, trainee).mean_deviation);
}
BENCHMARK(compare_sessions)->Arg(6)->Arg(60)->Unit(benchmark::kMillisecond);

void guidance_tick(benchmark::State& state) {
  Session const expert = drawing(6.0, 0.0, 1);
  PathGuidance<double> guide(GuidePath<double>(expert.recording), {});
  auto const& ticks = expert.recording.ticks();
  std::size_t k = 0;
  for (auto _ : state) {
    ToolMotion<double> const motion{.tip = ticks[k % ticks.size()].tip + Vector3<double>(0.002, 0, 0), .continues = true};
    benchmark::DoNotOptimize(guide(motion));
    ++k;
  }
}
BENCHMARK(guidance_tick);

}  // namespace
