// SPDX-License-Identifier: MIT
// What a force costs in the servo tick [ns], and what training one costs offline.
//   bench_force --benchmark_repetitions=20 --benchmark_report_aggregates_only=true    prints medians
// The peer of each evaluation is the same formula in plain loops, in the same run.
#include <palpate/core/random.hpp>
#include <palpate/device/hand_tremor.hpp>
#include <palpate/fitting/fitted_force.hpp>
#include <palpate/force/band_limited_noise.hpp>
#include <palpate/force/blade.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/needle_force.hpp>
#include <palpate/force/network_training.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

namespace {

using namespace palpate;

/// Depths of a stroke, so that no evaluation can be foreseen.
template <RealScalar S>
std::vector<S> depths() {
  Random random(Seed{1});
  std::vector<S> result(1024);
  for (S& depth : result) depth = random.uniform(S(0), S(0.0228));
  return result;
}

template <RealScalar S>
void network_1_5_1(benchmark::State& state) {
  auto const curve = liver_loading<S>();
  auto const input = depths<S>();
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(curve(input[i++ % 1024]));
}
BENCHMARK(network_1_5_1<float>);
BENCHMARK(network_1_5_1<double>);

template <RealScalar S>
void network_2_5_1(benchmark::State& state) {
  auto const curve = liver_hysteresis<S>();
  auto const input = depths<S>();
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(curve(input[i % 1024], i % 2 == 0 ? Phase::loading : Phase::unloading));
    ++i;
  }
}
BENCHMARK(network_2_5_1<float>);
BENCHMARK(network_2_5_1<double>);

/// The peer: sizes known at run time, weights on the heap.
template <RealScalar S>
void network_2_5_1_plain_loops(benchmark::State& state) {
  auto const network = liver_hysteresis<S>().network();
  auto const parameters = network.parameters();
  std::vector<S> const weights(parameters.begin(), parameters.end());
  std::vector<int> const sizes{2, 5, 1};
  auto const input = depths<S>();
  std::size_t i = 0;
  for (auto _ : state) {
    std::vector<S> x{S(1000) * input[i % 1024], S(i % 2)};
    ++i;
    std::size_t k = 0;
    for (std::size_t l = 0; l + 1 < sizes.size(); ++l) {
      std::vector<S> y(std::size_t(sizes[l + 1]), S(0));
      for (S& value : y)
        for (S const in : x) value += weights[k++] * in;
      for (S& value : y) value += weights[k++];
      if (l + 2 < sizes.size())
        for (S& value : y) value = std::tanh(value);
      x = y;
    }
    benchmark::DoNotOptimize(x[0]);
  }
}
BENCHMARK(network_2_5_1_plain_loops<float>);
BENCHMARK(network_2_5_1_plain_loops<double>);

/// Ticks of a stroke.
template <RealScalar S, class Force>
void ticks(benchmark::State& state, Force& force) {
  auto const input = depths<S>();
  ToolContact<S> contact{.phase = CuttingPhase::moving, .velocity = {S(0.02), S(0), S(-0.01)}};
  std::size_t i = 0;
  for (auto _ : state) {
    contact.previous_depth = contact.depth;
    contact.depth = input[i++ % 1024];
    benchmark::DoNotOptimize(force(contact));
  }
}

/// A whole tick of golden program 04's force: spring, hysteresis, organ, noise.
template <RealScalar S>
void cutting_force_tick(benchmark::State& state) {
  CuttingForce force(liver_hysteresis<S>(), OrganForce<S>{.coefficient = S(2)}, WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7}));
  ticks<S>(state, force);
}
BENCHMARK(cutting_force_tick<float>);
BENCHMARK(cutting_force_tick<double>);

/// A tick with every part there is: no one composes that, and it stays within what a servo has.
template <RealScalar S>
void every_part_tick(benchmark::State& state) {
  CuttingForce force(HuntCrossleyContact<S>{.stiffness = S(900), .damping = S(2)}, bladed(liver_hysteresis<S>(), BladeFactors<S>{.width_ratio = S(1.5)}),
                     OrganWalls<S>({{S(2), {S(1), S(0), S(0)}}, {S(3), {S(0), S(1), S(0)}}}), OrganFriction<S>{},
                     NeedleForce<S>({.cutting = 0.9, .friction = {.dynamic = 10.0, .viscous = 100.0, .holding = 15.0}}),
                     BandLimitedNoise<S>({.snr_db = 30.0, .seed = 7}), WhiteGaussianNoise<S>({.snr_db = 40.0, .seed = 8}));
  ticks<S>(state, force);
}
BENCHMARK(every_part_tick<float>);
BENCHMARK(every_part_tick<double>);

/// The tick of a force that was chosen at run time.
void fitted_force_tick(benchmark::State& state) {
  FittedForce<double> force({"needle", {{"a1", 100.0}, {"a2", 0.0}, {"cutting", 0.9}, {"dynamic", 10.0}, {"viscous", 100.0}}, {0.0, 0.03}, {0.0, 0.1}, ""});
  ticks<double>(state, force);
}
BENCHMARK(fitted_force_tick);

template <class Noise>
void noise_tick(benchmark::State& state) {
  Noise noise;
  for (auto _ : state) benchmark::DoNotOptimize(noise.draw({0.0, 0.0, 1.0}));
}
BENCHMARK(noise_tick<WhiteGaussianNoise<double>>);
BENCHMARK(noise_tick<BandLimitedNoise<double>>);

void tremor_tick(benchmark::State& state) {
  HandTremor<double> tremor;
  for (auto _ : state) benchmark::DoNotOptimize(tremor.step());
}
BENCHMARK(tremor_tick);

void normal_number(benchmark::State& state) {
  Random random(Seed{1});
  for (auto _ : state) benchmark::DoNotOptimize(random.normal());
}
BENCHMARK(normal_number);

/// A hundred epochs on the 46 samples of golden program 04.
template <class Trainer>
void training_100_epochs(benchmark::State& state) {
  auto const curve = liver_loading<double>();
  std::vector<Sample<double, 1, 1>> samples;
  for (int i = 0; i <= 45; ++i) samples.push_back({{i * 0.0005}, {curve(i * 0.0005)}});
  for (auto _ : state) {
    Network<double, 1, 5, 1> network(Seed{1});
    benchmark::DoNotOptimize(train(network, samples, Trainer{.epochs = 100}).mean_squared_error);
  }
  state.counters["epochs/s"] = benchmark::Counter(100.0 * double(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(training_100_epochs<GradientDescent>)->Unit(benchmark::kMillisecond);
BENCHMARK(training_100_epochs<LevenbergMarquardt>)->Unit(benchmark::kMillisecond);

}  // namespace
