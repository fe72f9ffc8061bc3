// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/force/detail/network_problem.hpp>
#include <palpate/force/network.hpp>
#include <palpate/force/trainer.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// Progress of a training after an epoch. Mean squared errors in the square of the outputs' unit (N² for forces).
struct TrainingProgress {
  int start = 0;                              ///< which start this is, the first is 0
  int epoch = 0;                              ///< of this start, counted from 1
  double mean_squared_error = 0.0;            ///< over the samples that are learnt
  double held_out_mean_squared_error = 0.0;   ///< over those held out; 0 where none are
};

/// Options of a training that do not depend on the trainer.
struct TrainingOptions {
  int starts = 1;          ///< the first from the network's weights, start k from those of Seed{seed + k}; the best network is kept
  double held_out = 0.0;   ///< share of the samples, drawn by the seed, that is not learnt but watched, 0 ≤ share < 1
  int patience = 20;       ///< a start ends after so many epochs without a smaller error over the held-out samples
  double goal = 0.0;       ///< stop at this mean squared error over the samples learnt, in the square of the outputs' unit
  Seed seed{};
  std::function<bool(TrainingProgress const&)> progress{};   ///< called after every epoch that moved the network; false ends the training

  void validate() const {
    detail::OptionCheck const require{"TrainingOptions"};
    require(starts >= 1, ".starts", starts, "give one or more");
    require(held_out >= 0.0 && held_out < 1.0, ".held_out", held_out, "give a share of the samples, zero or more, below one");
    require(patience >= 1, ".patience", patience, "give one epoch or more");
    require(goal >= 0.0, ".goal", goal, "give zero or more");
  }
};

/// Result of one start.
struct TrainingStart {
  Seed seed{};   ///< of its weights; for the first start the weights were the network's own
  double mean_squared_error = 0.0;
  double held_out_mean_squared_error = 0.0;
  int epochs = 0;
  TrainingStop stop = TrainingStop::epochs;
};

/// Mean squared errors are over samples and outputs, in the square of the outputs' unit (N² for forces).
struct TrainingReport {
  double mean_squared_error = 0.0;            ///< of the trained network over the samples learnt
  double initial_mean_squared_error = 0.0;    ///< before the first epoch of the first start
  double held_out_mean_squared_error = 0.0;   ///< of the trained network over the samples held out; 0 where none were
  int epochs = 0;                             ///< used by the start that is kept
  TrainingStop stop = TrainingStop::epochs;   ///< of that start
  int best_start = 0;                         ///< which one is kept
  std::vector<TrainingStart> starts{};        ///< all that were made
  std::vector<std::size_t> held_out{};        ///< which samples were held out, in rising order
};

/// Mean squared error of a network over samples, in the square of the outputs' unit.
template <class Activation, RealScalar S, int... Sizes>
double mean_squared_error(BasicNetwork<Activation, S, Sizes...> const& network,
                          std::type_identity_t<std::span<Sample<S, BasicNetwork<Activation, S, Sizes...>::inputs,
                                                                BasicNetwork<Activation, S, Sizes...>::outputs> const>> samples) {
  double sum = 0.0;
  for (auto const& sample : samples) {
    auto const y = network(sample.input);
    for (std::size_t o = 0; o < y.size(); ++o) {
      double const difference = double(y[o]) - double(sample.output[o]);
      sum += difference * difference;
    }
  }
  return samples.empty() ? 0.0 : sum / (double(samples.size()) * double(network.outputs));
}

namespace detail {

/// The numbers of the samples to hold out, in rising order: at least one where a share is asked for, never all.
inline std::vector<std::size_t> held_out_samples(std::size_t count, double share, Seed seed) {
  if (!(share > 0.0)) return {};
  if (count < 2) throw InvalidArgument("TrainingOptions: .held_out needs two samples or more, there is one; give more samples or leave it 0");
  std::vector<std::size_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), std::size_t{0});
  Random random(seed);
  shuffle(std::span(numbers), random);
  numbers.resize(std::clamp(static_cast<std::size_t>(std::llround(share * double(count))), std::size_t{1}, count - 1));
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

template <RealScalar S, int In, int Out>
std::vector<Sample<double, In, Out>> widened(std::vector<Sample<S, In, Out>> const& samples) {
  std::vector<Sample<double, In, Out>> wide(samples.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    for (std::size_t i = 0; i < std::size_t(In); ++i) wide[s].input[i] = double(samples[s].input[i]);
    for (std::size_t o = 0; o < std::size_t(Out); ++o) wide[s].output[o] = double(samples[s].output[o]);
  }
  return wide;
}

/// Follows one start of a training: the best network over the held-out samples, and when to end.
template <class Net>
class TrainingWatch {
 public:
  using Samples = std::vector<Sample<double, Net::inputs, Net::outputs>>;

  TrainingWatch(TrainingOptions const& options, Samples const& learnt, Samples const& held, int start)
      : options_(options), learnt_(learnt), held_(held), start_(start) {}

  /// To be asked at epoch 0 and after every epoch.
  bool goes_on(int epoch, Net const& network) {
    TrainingProgress now{.start = start_, .epoch = epoch};
    if (options_.goal > 0.0 || options_.progress) now.mean_squared_error = palpate::mean_squared_error(network, learnt_);
    if (!held_.empty()) {
      now.held_out_mean_squared_error = palpate::mean_squared_error(network, held_);
      if (now.held_out_mean_squared_error < best_error_) {
        best_error_ = now.held_out_mean_squared_error;
        best_epoch_ = epoch;
        best_ = network;
      }
    }
    if (options_.goal > 0.0 && now.mean_squared_error <= options_.goal)
      cause_ = TrainingStop::goal;
    else if (!held_.empty() && epoch - best_epoch_ >= options_.patience)
      cause_ = TrainingStop::held_out;
    if (epoch > 0 && options_.progress && !options_.progress(now)) {
      cause_ = TrainingStop::stopped;
      is_told_ = true;
    }
    return cause_ == TrainingStop::epochs;
  }

  /// The best network over the held-out samples, or where there are none, or the goal is reached, the last one.
  Net const& best(Net const& last) const noexcept { return held_.empty() || cause_ == TrainingStop::goal ? last : best_; }
  /// Why it said to end; `epochs` where it did not.
  TrainingStop cause() const noexcept { return cause_; }
  bool is_told() const noexcept { return is_told_; }

 private:
  TrainingOptions const& options_;
  Samples const& learnt_;
  Samples const& held_;
  int start_;
  Net best_{};
  double best_error_ = std::numeric_limits<double>::infinity();
  int best_epoch_ = 0;
  TrainingStop cause_ = TrainingStop::epochs;
  bool is_told_ = false;
};

}  // namespace detail

/// Trains a network on samples, from its present weights, with multiple starts and early stopping. A network without a scaling (made from
/// a seed) first gets one that maps the ranges of the training samples to −1 … 1. One that has a scaling keeps it, so a training can be
/// continued. The samples need neither shuffling nor normalising. Throws `InvalidArgument` and leaves the network as it was when there is
/// no sample or a value is not finite.
///   train(network, samples, LevenbergMarquardt{.epochs = 100});
///   train(network, samples, LevenbergMarquardt{}, {.starts = 5, .held_out = 0.2, .seed = Seed{7}});
/// With samples held out, a start gives its network of the smallest error over them, and the best start is the one with the smallest such
/// error. Without, the best start is the one with the smallest error over the samples. Once the goal is reached, or the callback says so,
/// no other start is made.
/// Source     \cite zheng2006 ch. 6.3
/// Invariant  Equal seeds, samples and options give equal bits.
/// Cost       Offline: allocates, and computes in double whatever the network's scalar.
template <class Activation, RealScalar S, int... Sizes, class Trainer>
TrainingReport train(BasicNetwork<Activation, S, Sizes...>& network,
                     std::type_identity_t<std::span<Sample<S, BasicNetwork<Activation, S, Sizes...>::inputs,
                                                           BasicNetwork<Activation, S, Sizes...>::outputs> const>> samples,
                     Trainer const& trainer, TrainingOptions const& options = {}) {
  using Net = BasicNetwork<Activation, S, Sizes...>;
  using Wide = BasicNetwork<Activation, double, Sizes...>;
  trainer.validate();
  options.validate();
  if (samples.empty()) throw InvalidArgument("train: there are no samples; give at least one");
  for (std::size_t s = 0; s < samples.size(); ++s) {
    for (std::size_t i = 0; i < samples[s].input.size(); ++i) detail::check_sample_value("input", s, i, double(samples[s].input[i]));
    for (std::size_t o = 0; o < samples[s].output.size(); ++o) detail::check_sample_value("output", s, o, double(samples[s].output[o]));
  }

  TrainingReport report;
  report.held_out = detail::held_out_samples(samples.size(), options.held_out, options.seed);
  std::vector<Sample<S, Net::inputs, Net::outputs>> learnt, held;
  for (std::size_t s = 0; s < samples.size(); ++s)
    (std::binary_search(report.held_out.begin(), report.held_out.end(), s) ? held : learnt).push_back(samples[s]);
  auto const wide_learnt = detail::widened(learnt);
  auto const wide_held = detail::widened(held);

  Wide own = network.template cast<double>();
  if (!own.has_scaling()) own.set_scaling(detail::scaling_of<Wide::inputs, Wide::outputs>(wide_learnt));
  report.initial_mean_squared_error = mean_squared_error(own, wide_learnt);

  Net best = network;
  double best_score = 0.0;
  for (int k = 0; k < options.starts; ++k) {
    Seed const seed{options.seed.value + std::uint64_t(k)};
    Wide wide = own;
    if (k > 0) wide.set_parameters(Wide(seed).parameters());
    detail::TrainingWatch<Wide> watch(options, wide_learnt, wide_held, k);
    TrainingResult result{.epochs = 0, .stop = TrainingStop::stopped};
    if (watch.goes_on(0, wide)) {
      detail::NetworkProblem<Wide> const problem(wide, wide_learnt,
                                                 [&](int epoch, Wide const& now) { return watch.goes_on(epoch, now); });
      auto const first = wide.parameters();
      Eigen::VectorXd parameters = Eigen::Map<Eigen::VectorXd const>(first.data(), Wide::parameter_count);
      result = trainer.minimise(problem, parameters);
      wide.set_parameters(std::span<double const, Wide::parameter_count>(parameters.data(), Wide::parameter_count));
    }
    if (watch.cause() != TrainingStop::epochs) result.stop = watch.cause();
    Net const trained = watch.best(wide).template cast<S>();
    report.starts.push_back({.seed = seed,
                             .mean_squared_error = mean_squared_error(trained, learnt),
                             .held_out_mean_squared_error = mean_squared_error(trained, held),
                             .epochs = result.epochs,
                             .stop = result.stop});
    TrainingStart const& start = report.starts.back();
    double const score = held.empty() ? start.mean_squared_error : start.held_out_mean_squared_error;
    if (k == 0 || score < best_score) {
      best_score = score;
      best = trained;
      report.best_start = k;
    }
    if (watch.is_told() || watch.cause() == TrainingStop::goal) break;
  }

  TrainingStart const& kept = report.starts[std::size_t(report.best_start)];
  report.mean_squared_error = kept.mean_squared_error;
  report.held_out_mean_squared_error = kept.held_out_mean_squared_error;
  report.epochs = kept.epochs;
  report.stop = kept.stop;
  network = best;
  return report;
}

}  // namespace palpate
