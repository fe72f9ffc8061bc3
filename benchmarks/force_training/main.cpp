// SPDX-License-Identifier: MIT
// What each trainer makes of the published liver curves, as a table:
//   force_training [most epochs] [seeds]    20000 and 11 without arguments, about a minute in the preset release
// The samples are not the thesis's measurements, which are not published: they are regenerated from its printed weights, once without noise and
// once with white noise whose variance is the error that the thesis reports, as measurements may have had.
#include <palpate/core/random.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/network_training.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace palpate;

template <int In>
using Samples = std::vector<Sample<double, In, 1>>;

/// A network of the thesis and what it is to learn.
template <int In>
struct Task {
  using Net = Network<double, In, 5, 1>;

  std::string name;
  Samples<In> samples;   ///< without noise
  double goal;           ///< N², to be reached
  double reported;       ///< N², the thesis's error, the variance of the noise

  /// The same with noise of a variance [N²].
  Samples<In> with_noise(double variance, Seed seed) const {
    Samples<In> noisy = samples;
    Random random(seed);
    for (auto& sample : noisy) sample.output[0] += std::sqrt(variance) * random.normal();
    return noisy;
  }
};

Task<1> loading() {
  auto const curve = liver_loading<double>();
  Task<1> task{.name = "1-5-1", .samples = {}, .goal = 5.0e-5, .reported = 5.018e-5};
  for (int i = 0; i <= 45; ++i) task.samples.push_back({{i * 5e-4}, {curve(i * 5e-4)}});
  return task;
}

Task<2> hysteresis() {
  auto const curve = liver_hysteresis<double>();
  Task<2> task{.name = "2-5-1", .samples = {}, .goal = 1.2e-4, .reported = 1.232e-4};
  for (int i = 0; i <= 57; ++i)
    for (Phase const phase : {Phase::loading, Phase::unloading})
      task.samples.push_back({{i * 4e-4, phase == Phase::loading ? 0.0 : 1.0}, {curve(i * 4e-4, phase)}});
  return task;
}

double median(std::vector<double> values) {
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Effort {
  int epochs;
  int seeds;
};

template <int In, class Trainer>
void row(Task<In> const& task, double variance, std::string const& name, Trainer trainer, Effort effort) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> error, true_error, milliseconds, epochs;
  int reached = 0;
  for (int seed = 0; seed < effort.seeds; ++seed) {
    auto const samples = task.with_noise(variance, Seed{2006 + static_cast<std::uint64_t>(seed)});
    typename Task<In>::Net network(Seed{static_cast<std::uint64_t>(seed)}), patient = network;
    trainer.epochs = 100;
    auto const start = Clock::now();
    error.push_back(train(network, samples, trainer).mean_squared_error);
    milliseconds.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    true_error.push_back(mean_squared_error(network, task.samples));

    trainer.epochs = effort.epochs;
    TrainingReport const report = train(patient, samples, trainer, {.goal = task.goal});
    bool const is_there = report.stop == TrainingStop::goal;
    reached += is_there ? 1 : 0;
    epochs.push_back(is_there ? report.epochs : std::numeric_limits<double>::infinity());
  }
  double const needed = median(epochs);
  std::string const needed_text = std::isfinite(needed) ? std::to_string(static_cast<int>(needed)) : "not in " + std::to_string(effort.epochs);
  std::printf("| %s | %s | %s | %.2e | %.2e | %.2e | %s | %d of %d | %.2f |\n", task.name.c_str(), variance > 0 ? "reported" : "none", name.c_str(),
              median(error), *std::max_element(error.begin(), error.end()), median(true_error), needed_text.c_str(), reached, effort.seeds,
              median(milliseconds));
  std::fflush(stdout);
}

template <int In>
void rows(Task<In> const& task, double variance, Effort effort) {
  row(task, variance, "`GradientDescent{.rate = 0.001}`, the thesis's", GradientDescent{.rate = 0.001}, effort);
  row(task, variance, "`GradientDescent{.rate = 0.1}`", GradientDescent{.rate = 0.1}, effort);
  row(task, variance, "`MomentumDescent{.rate = 0.001, .momentum = 0.9}`", MomentumDescent{.rate = 0.001, .momentum = 0.9}, effort);
  row(task, variance, "`MomentumDescent{.rate = 0.05, .momentum = 0.9}`", MomentumDescent{.rate = 0.05, .momentum = 0.9}, effort);
  row(task, variance, "`StochasticDescent{.rate = 0.001}`", StochasticDescent{.rate = 0.001}, effort);
  row(task, variance, "`StochasticDescent{.rate = 0.02}`", StochasticDescent{.rate = 0.02}, effort);
  row(task, variance, "`LevenbergMarquardt{}`", LevenbergMarquardt{}, effort);
}

}  // namespace

int main(int count, char** arguments) {
  Effort const effort{.epochs = count > 1 ? std::atoi(arguments[1]) : 20000, .seeds = count > 2 ? std::atoi(arguments[2]) : 11};
  if (effort.epochs < 1 || effort.seeds < 1 || count > 3) {
    std::fprintf(stderr, "usage: force_training [most epochs, 20000] [seeds, 11]\n");
    return 2;
  }
  auto const one = loading();
  auto const two = hysteresis();
  std::printf("Samples regenerated from the printed weights: 1-5-1 loading, %zu depths, every 0.5 mm; 2-5-1 loading and unloading,\n"
              "%zu samples, every 0.4 mm. Noise: none, or white with the variance of the error that the thesis reports, %.4g and %.4g N^2.\n"
              "Medians over %d starts, each with noise of its own. The goal is a mean squared error over the samples of %.2g (1-5-1) and\n"
              "%.2g N^2 (2-5-1).\n\n"
              "| network | noise | trainer | N^2 after 100 epochs | worst start | N^2 to the curve without noise | epochs to the goal | "
              "starts that reach it | ms for 100 epochs |\n"
              "|---|---|---|---|---|---|---|---|---|\n",
              one.samples.size(), two.samples.size(), one.reported, two.reported, effort.seeds, one.goal, two.goal);
  for (bool const is_noisy : {false, true}) {
    rows(one, is_noisy ? one.reported : 0.0, effort);
    rows(two, is_noisy ? two.reported : 0.0, effort);
  }
}
