// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/detail/network_problem.hpp>
#include <palpate/force/network.hpp>
#include <palpate/force/sample.hpp>
#include <palpate/force/trainer.hpp>

#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// Mean squared errors are over samples and outputs, in the square of the outputs' unit (N² for forces).
struct TrainingReport {
  double mean_squared_error = 0.0;            ///< of the trained network
  double initial_mean_squared_error = 0.0;    ///< before the first epoch
  int epochs = 0;                             ///< used
  TrainingStop stop = TrainingStop::epochs;
};

/// Mean squared error of a network over samples, in the square of the outputs' unit.
template <class Activation, RealScalar S, int... Sizes>
double mean_squared_error(BasicNetwork<Activation, S, Sizes...> const& network,
                          std::span<Sample<S, BasicNetwork<Activation, S, Sizes...>::inputs,
                                           BasicNetwork<Activation, S, Sizes...>::outputs> const> samples) {
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

/// Trains a network on samples, from its present weights on. A network without a scaling (made from a seed)
/// first gets one that maps the samples' ranges to −1 … 1; one that has a scaling keeps it, so a training can
/// be continued. Needs no data set to be shuffled or normalised. Throws `InvalidArgument` and leaves the
/// network as it was when there is no sample or a value is not finite.
/// Source     \cite zheng2006 ch. 6.3
/// Cost       Offline: allocates, and computes in double whatever the network's scalar.
template <class Activation, RealScalar S, int... Sizes, class Trainer>
TrainingReport train(BasicNetwork<Activation, S, Sizes...>& network,
                     std::type_identity_t<std::span<Sample<S, BasicNetwork<Activation, S, Sizes...>::inputs,
                                                           BasicNetwork<Activation, S, Sizes...>::outputs> const>> samples,
                     Trainer const& trainer) {
  using Wide = BasicNetwork<Activation, double, Sizes...>;
  using WideSample = Sample<double, Wide::inputs, Wide::outputs>;
  trainer.validate();
  if (samples.empty()) throw InvalidArgument("train: there are no samples; give at least one");

  std::vector<WideSample> wide(samples.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    for (std::size_t i = 0; i < samples[s].input.size(); ++i) {
      detail::check_sample_value("input", s, i, double(samples[s].input[i]));
      wide[s].input[i] = double(samples[s].input[i]);
    }
    for (std::size_t o = 0; o < samples[s].output.size(); ++o) {
      detail::check_sample_value("output", s, o, double(samples[s].output[o]));
      wide[s].output[o] = double(samples[s].output[o]);
    }
  }

  Wide start = network.template cast<double>();
  if (!start.has_scaling()) start.set_scaling(detail::scaling_of<Wide::inputs, Wide::outputs>(wide));
  detail::NetworkProblem<Wide> const problem(start, wide);
  auto const first = start.parameters();
  Eigen::VectorXd parameters = Eigen::Map<Eigen::VectorXd const>(first.data(), Wide::parameter_count);

  TrainingReport report;
  report.initial_mean_squared_error = mean_squared_error<Activation, double, Sizes...>(start, wide);
  TrainingResult const result = trainer.minimise(problem, parameters);
  start.set_parameters(std::span<double const, Wide::parameter_count>(parameters.data(), Wide::parameter_count));
  auto const trained = start.template cast<S>();
  report.mean_squared_error = mean_squared_error<Activation, S, Sizes...>(trained, samples);
  report.epochs = result.epochs;
  report.stop = result.stop;
  network = trained;
  return report;
}

}  // namespace palpate
