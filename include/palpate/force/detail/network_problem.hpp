// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/force/network.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>

namespace palpate::detail {

/// The network's errors at samples, in units of its scaled outputs. Always in double: a Jacobian in float
/// loses the last decimals.
template <class Net>
class NetworkProblem {
 public:
  using NetSample = Sample<double, Net::inputs, Net::outputs>;
  static constexpr int parameter_count = Net::parameter_count;

  /// `goes_on(epoch, network)` is asked after every epoch of the training; false ends it.
  NetworkProblem(Net const& network, std::span<NetSample const> samples, std::function<bool(int, Net const&)> goes_on)
      : network_(network), samples_(samples), goes_on_(std::move(goes_on)) {}

  std::size_t sample_count() const noexcept { return samples_.size(); }

  bool goes_on(int epoch, Eigen::VectorXd const& parameters) const { return goes_on_(epoch, at(parameters)); }

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
    return gradient_of(parameters, gradient, samples_.size(), [](std::size_t k) { return k; });
  }

  double gradient(Eigen::VectorXd const& parameters, Eigen::VectorXd& gradient, std::span<std::size_t const> samples) const {
    return gradient_of(parameters, gradient, samples.size(), [&](std::size_t k) { return samples[k]; });
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
  template <class Pick>
  double gradient_of(Eigen::VectorXd const& parameters, Eigen::VectorXd& gradient, std::size_t samples, Pick pick) const {
    Net const network = at(parameters);
    double const values = double(samples) * Net::outputs;
    typename Net::Parameters part{};
    double sum = 0.0;
    for (std::size_t k = 0; k < samples; ++k) {
      auto const& sample = samples_[pick(k)];
      auto weight = residual(network, sample);
      for (std::size_t o = 0; o < weight.size(); ++o) {
        sum += weight[o] * weight[o];
        weight[o] *= 2.0 / (values * network.scaling().output_gain[o]);
      }
      network.add_parameter_gradient(sample.input, weight, part);
    }
    gradient = Eigen::Map<Eigen::VectorXd const>(part.data(), parameter_count);
    return sum / values;
  }

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
  std::function<bool(int, Net const&)> goes_on_;
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

}  // namespace palpate::detail
