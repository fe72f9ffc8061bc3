// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/network.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// One measured pair, in the caller's units.
template <RealScalar S, int In, int Out>
struct Sample {
  std::array<S, In> input{};
  std::array<S, Out> output{};
};

/// Why a training ended.
enum class TrainingStop {
  epochs,       ///< all epochs were used
  goal,         ///< the wanted error was reached
  no_progress   ///< no step makes the error smaller, or the rate is so large that the error grew out of bounds
};

constexpr char const* to_string(TrainingStop stop) noexcept {
  switch (stop) {
    case TrainingStop::epochs: return "epochs used";
    case TrainingStop::goal: return "goal reached";
    case TrainingStop::no_progress: return "no progress";
  }
  return "unknown";
}

/// Mean squared errors are over samples and outputs, in the square of the outputs' unit (N² for forces).
struct TrainingReport {
  double mean_squared_error = 0.0;            ///< of the trained network
  double initial_mean_squared_error = 0.0;    ///< before the first epoch
  int epochs = 0;                             ///< used
  TrainingStop stop = TrainingStop::epochs;
};

/// A sum of squared residuals to be made small, as the trainers see it: parameters in, error and derivatives
/// out. `mean_square(p)`; `gradient(p, g)` with g = ∂(mean square)/∂p; `normal_equations(p, A, b)` with A =
/// JᵀJ/n, b = Jᵀr/n. Each returns the mean square. A trainer of one's own is a type with
///   template <class Problem> TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const;
struct TrainingResult {
  int epochs = 0;
  TrainingStop stop = TrainingStop::epochs;
};

/// Plain gradient descent on the mean squared error, all samples in every epoch: p ← p − rate ∂E/∂p.
/// Inputs and outputs are scaled to −1 … 1 first, so the rate has no unit.
/// Source     \cite zheng2006 ch. 6.3, rate 0.001
/// Limits     At that rate the thesis's error for the liver needs more than 200,000 epochs, not its 100;
///            `LevenbergMarquardt` needs tens. The best parameters met are kept, so a rate that is too large ends with `no_progress`,
///            never with a worse network.
struct GradientDescent {
  double rate = 0.001;
  int epochs = 100;
  double goal = 0.0;   ///< stop at this mean squared error in units of the scaled outputs

  void validate() const {
    if (!std::isfinite(rate) || !(rate > 0.0))
      throw InvalidArgument(detail::message("GradientDescent: .rate is ", rate, "; give a finite number above zero"));
    if (epochs < 1)
      throw InvalidArgument(detail::message("GradientDescent: .epochs is ", epochs, "; give one or more"));
    if (!(goal >= 0.0))
      throw InvalidArgument(detail::message("GradientDescent: .goal is ", goal, "; give zero or more"));
  }

  template <class Problem>
  TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const {
    Eigen::VectorXd best = parameters;
    Eigen::VectorXd gradient(parameters.size());
    double best_error = std::numeric_limits<double>::infinity();
    TrainingResult result{.epochs = 0, .stop = TrainingStop::epochs};
    for (;; ++result.epochs) {
      double const error = parameters.allFinite() ? problem.gradient(parameters, gradient)
                                                  : std::numeric_limits<double>::infinity();
      if (!std::isfinite(error) || !gradient.allFinite()) {
        result.stop = TrainingStop::no_progress;
        break;
      }
      if (error < best_error) {
        best_error = error;
        best = parameters;
      }
      if (error <= goal) result.stop = TrainingStop::goal;
      if (error <= goal || result.epochs == epochs) break;
      parameters -= rate * gradient;
    }
    parameters = best;
    return result;
  }
};

/// Levenberg–Marquardt: (JᵀJ/n + μ I) δ = −Jᵀr/n, μ smaller after a step that helps, larger until one does.
/// Source     \cite hagan1994
/// Cost       An epoch is one Jacobian, O(samples · parameters²), and one or more solutions, O(parameters³).
struct LevenbergMarquardt {
  int epochs = 100;
  double goal = 0.0;       ///< stop at this mean squared error in units of the scaled outputs
  double damping = 1e-3;   ///< the first μ

  void validate() const {
    if (epochs < 1)
      throw InvalidArgument(detail::message("LevenbergMarquardt: .epochs is ", epochs, "; give one or more"));
    if (!(goal >= 0.0))
      throw InvalidArgument(detail::message("LevenbergMarquardt: .goal is ", goal, "; give zero or more"));
    if (!std::isfinite(damping) || !(damping > 0.0))
      throw InvalidArgument(detail::message("LevenbergMarquardt: .damping is ", damping, "; give a finite number above zero"));
  }

  template <class Problem>
  TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const {
    constexpr double largest_damping = 1e10;
    constexpr double smallest_damping = 1e-15;
    auto const n = parameters.size();
    Eigen::MatrixXd normal(n, n);
    Eigen::VectorXd slope(n);
    Eigen::VectorXd trial(n);
    double mu = damping;
    TrainingResult result{.epochs = 0, .stop = TrainingStop::epochs};
    double error = problem.mean_square(parameters);
    while (error > goal && result.epochs < epochs) {
      problem.normal_equations(parameters, normal, slope);
      ++result.epochs;
      double trial_error = std::numeric_limits<double>::infinity();
      for (; mu <= largest_damping; mu *= 10.0) {
        Eigen::MatrixXd damped = normal;
        damped.diagonal().array() += mu;
        trial = parameters - damped.ldlt().solve(slope);
        trial_error = trial.allFinite() ? problem.mean_square(trial) : std::numeric_limits<double>::infinity();
        if (trial_error < error) break;
      }
      if (!(trial_error < error)) {
        result.stop = TrainingStop::no_progress;
        return result;
      }
      parameters = trial;
      error = trial_error;
      mu = std::max(mu / 10.0, smallest_damping);
    }
    if (error <= goal) result.stop = TrainingStop::goal;
    return result;
  }
};

namespace detail {

/// The network's errors at samples, in units of its scaled outputs. Always in double: a Jacobian in float
/// loses the last decimals.
template <class Net>
class NetworkProblem {
 public:
  using NetSample = Sample<double, Net::inputs, Net::outputs>;
  static constexpr int parameter_count = Net::parameter_count;

  NetworkProblem(Net const& network, std::span<NetSample const> samples) : network_(network), samples_(samples) {}

  double mean_square(Eigen::VectorXd const& parameters) const {
    Net const network = at(parameters);
    double sum = 0.0;
    for (auto const& sample : samples_) {
      auto const r = residual(network, sample);
      for (double const value : r) sum += value * value;
    }
    return sum / count();
  }

  double gradient(Eigen::VectorXd const& parameters, Eigen::VectorXd& gradient) const {
    Net const network = at(parameters);
    typename Net::Parameters part{};
    double sum = 0.0;
    for (auto const& sample : samples_) {
      auto weight = residual(network, sample);
      for (std::size_t o = 0; o < weight.size(); ++o) {
        sum += weight[o] * weight[o];
        weight[o] *= 2.0 / (count() * network.scaling().output_gain[o]);
      }
      network.add_parameter_gradient(sample.input, weight, part);
    }
    gradient = Eigen::Map<Eigen::VectorXd const>(part.data(), parameter_count);
    return sum / count();
  }

  double normal_equations(Eigen::VectorXd const& parameters, Eigen::MatrixXd& normal, Eigen::VectorXd& slope) const {
    Net const network = at(parameters);
    normal.setZero();
    slope.setZero();
    double sum = 0.0;
    for (auto const& sample : samples_) {
      auto const r = residual(network, sample);
      for (std::size_t o = 0; o < r.size(); ++o) {
        typename Net::Output pick{};
        pick[o] = 1.0 / network.scaling().output_gain[o];
        typename Net::Parameters row{};
        network.add_parameter_gradient(sample.input, pick, row);
        Eigen::Map<Eigen::VectorXd const> const j(row.data(), parameter_count);
        normal.selfadjointView<Eigen::Lower>().rankUpdate(j, 1.0 / count());
        slope += (r[o] / count()) * j;
        sum += r[o] * r[o];
      }
    }
    normal.template triangularView<Eigen::StrictlyUpper>() = normal.transpose();
    return sum / count();
  }

 private:
  double count() const { return double(samples_.size()) * Net::outputs; }

  Net at(Eigen::VectorXd const& parameters) const {
    Net network = network_;
    network.set_parameters(std::span<double const, parameter_count>(parameters.data(), parameter_count));
    return network;
  }

  static typename Net::Output residual(Net const& network, NetSample const& sample) {
    auto r = network(sample.input);
    for (std::size_t o = 0; o < r.size(); ++o) r[o] = (r[o] - sample.output[o]) / network.scaling().output_gain[o];
    return r;
  }

  Net network_;
  std::span<NetSample const> samples_;
};

/// Maps the samples' ranges to −1 … 1; a value that never changes keeps the gain one.
template <int In, int Out>
NetworkScaling<double, In, Out> scaling_of(std::span<Sample<double, In, Out> const> samples) {
  NetworkScaling<double, In, Out> scaling;
  auto const range = [&](auto member, std::size_t k, double& middle, double& half) {
    double low = (samples.front().*member)[k];
    double high = low;
    for (auto const& sample : samples) {
      low = std::min(low, (sample.*member)[k]);
      high = std::max(high, (sample.*member)[k]);
    }
    middle = low + (high - low) / 2.0;
    half = high > low ? (high - low) / 2.0 : 1.0;
  };
  for (std::size_t i = 0; i < std::size_t(In); ++i) {
    double half = 1.0;
    range(&Sample<double, In, Out>::input, i, scaling.input_offset[i], half);
    scaling.input_gain[i] = 1.0 / half;
  }
  for (std::size_t o = 0; o < std::size_t(Out); ++o)
    range(&Sample<double, In, Out>::output, o, scaling.output_offset[o], scaling.output_gain[o]);
  return scaling;
}

inline void check_sample_value(char const* what, std::size_t sample, std::size_t index, double value) {
  if (!std::isfinite(value))
    throw InvalidArgument(message("train: ", what, " ", index, " of sample ", sample, " is ", value, "; give finite numbers"));
}

}  // namespace detail

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
