// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/fitting/detail/goodness.hpp>
#include <palpate/fitting/measurements.hpp>
#include <palpate/force/curve.hpp>
#include <palpate/force/network.hpp>
#include <palpate/force/network_training.hpp>
#include <palpate/force/speed_curve.hpp>
#include <palpate/force/tissue_presets.hpp>
#include <palpate/force/trainer.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <ostream>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

struct NetworkFitOptions {
  TrainingOptions training{.starts = 5};   ///< starts, samples held out, seed
  int epochs = 200;                        ///< of Levenberg and Marquardt's method, in each start
  int folds = 5;                           ///< of the cross-validation; 0: none
  double cap = 2.0;                        ///< outside the measured depths the force is at most this times the largest measured, or what it is at their ends
};

/// What `fit_network` found. Residuals are measured minus network [N], in the order of `used`.
/// Limits     A network's weights are no coefficients of the tissue, and many sets of them are one curve: they have no intervals. What it can be
///            trusted with is told by the error on measurements that were left out.
template <class NetworkLaw>
struct NetworkFit {
  NetworkLaw law;                       ///< a `NetworkCurve` or `SpeedCurve`
  TrainingReport training{};
  std::vector<Measurement> used{};
  std::vector<double> residuals{};
  double rms = 0.0;                     ///< N
  double r_squared = 0.0;
  double cross_validated_rms = std::numeric_limits<double>::quiet_NaN();   ///< N
  MeasuredRange depths{}, speeds{};
};

namespace detail {

/// What a network of this shape sees of a measurement.
template <class Net, bool by_speed>
typename Net::Input network_input(Measurement const& m) noexcept {
  typename Net::Input input{};
  input.front() = m.depth;
  if constexpr (Net::inputs == 2) input.back() = by_speed ? m.speed : m.phase == MeasuredPhase::unloading ? 1.0 : 0.0;
  return input;
}

template <class Net, bool by_speed>
std::vector<Measurement> network_measurements(std::span<Measurement const> measurements) {
  std::vector<Measurement> used;
  for (Measurement const& m : measurements)
    if (m.phase == MeasuredPhase::loading || (Net::inputs == 2 && !by_speed && m.phase == MeasuredPhase::unloading)) used.push_back(m);
  return used;
}

template <class Net, bool by_speed>
std::pair<Net, TrainingReport> train_on(std::span<Measurement const> used, NetworkFitOptions const& options) {
  std::vector<Sample<double, Net::inputs, 1>> samples;
  for (Measurement const& m : used) samples.push_back({network_input<Net, by_speed>(m), {m.force}});
  Net network(options.training.seed);
  TrainingReport report = train(network, samples, LevenbergMarquardt{.epochs = options.epochs}, options.training);
  return {std::move(network), std::move(report)};
}

template <class Net, bool by_speed, class MakeLaw>
auto fit_network(char const* who, std::span<Measurement const> measurements, NetworkFitOptions const& options, MakeLaw const& make_law) {
  if (options.folds < 0 || options.folds == 1) throw InvalidArgument(message(who, ": .folds is ", options.folds, "; give two or more, or 0 for no cross-validation"));
  if (!(options.cap >= 1.0)) throw InvalidArgument(message(who, ": .cap is ", options.cap, "; give one or more times the largest force measured"));
  require_usable(who, measurements);
  auto const used = network_measurements<Net, by_speed>(measurements);
  if (used.size() < static_cast<std::size_t>(Net::parameter_count))
    throw InvalidArgument(message(who, ": the network has ", Net::parameter_count, " weights and stands for ", used.size(), " of the ", measurements.size(),
                                  " measurements, those of loading", Net::inputs == 2 && !by_speed ? " and unloading" : "", "; give as many as it has weights, or more"));
  MeasuredRange const depths = depths_of(used), speeds = speeds_of(used);
  if (!(depths.low < depths.high))
    throw InvalidArgument(message(who, ": all ", used.size(), " measurements are at a depth of ", depths.low, " m; give some at other depths"));
  if (static_cast<std::size_t>(options.folds) > used.size())
    throw InvalidArgument(message(who, ": .folds is ", options.folds, " for ", used.size(), " measurements; give no more than there are"));
  if constexpr (Net::inputs == 2 && !by_speed)
    for (auto const& [phase, name] : {std::pair{MeasuredPhase::loading, "loading"}, std::pair{MeasuredPhase::unloading, "unloading"}})
      if (std::ranges::none_of(used, [phase](Measurement const& m) { return m.phase == phase; }))
        throw InvalidArgument(message(who, ": the network has an input for the phase, and none of the ", measurements.size(), " measurements is of ", name,
                                      "; give some, or a network of depth alone"));
  auto [network, report] = train_on<Net, by_speed>(used, options);
  double largest = 0.0;
  std::vector<double> residuals;
  for (Measurement const& m : used) {
    largest = std::max(largest, m.force);
    residuals.push_back(m.force - network(network_input<Net, by_speed>(m))[0]);
  }
  Goodness const good = goodness(used, residuals);
  double left_out_rms = std::numeric_limits<double>::quiet_NaN();
  if (options.folds > 0 && used.size() >= 2 * static_cast<std::size_t>(Net::parameter_count)) {
    NetworkFitOptions quiet = options;
    quiet.training.progress = {};
    left_out_rms = leave_out(used, options.folds, options.training.seed, [&](std::span<Measurement const> kept) {
      return [other = train_on<Net, by_speed>(kept, quiet).first](Measurement const& m) { return other(network_input<Net, by_speed>(m))[0] - m.force; };
    });
  }
  using Law = decltype(make_law(network, depths, speeds, CurveGuard<double>{}));
  double most = options.cap * std::max(largest, 1e-9);   // not below what the network has at its ends, noise and all
  for (double const depth : {depths.low, depths.high})
    for (double const other : {by_speed ? speeds.low : 0.0, by_speed ? speeds.high : 1.0}) {
      typename Net::Input end{};
      end.back() = other, end.front() = depth;   // of one input this is all
      most = std::max(most, network(end)[0]);
    }
  NetworkFit<Law> result{.law = make_law(std::move(network), depths, speeds, CurveGuard<double>{.largest_force = most})};
  result.training = std::move(report);
  result.used = used;
  result.residuals = std::move(residuals);
  result.rms = good.rms, result.r_squared = good.r_squared;
  result.cross_validated_rms = left_out_rms;
  result.depths = depths;
  result.speeds = speeds;
  return result;
}

}  // namespace detail

/// Trains a network on measurements: of depth alone on those of loading, of depth and phase on loading and unloading.
///   auto const found = fit_network<Network<double, 2, 5, 1>>(measurements);
///   CuttingForce force(found.law);
/// Errors     InvalidArgument for fewer measurements than the network has weights, none of a phase that it asks for, one depth alone, values that are not finite, negative depths and speeds, and options out of their meaning.
/// Cost       Offline: allocates.
template <class Net>
NetworkFit<NetworkCurve<Net>> fit_network(std::span<Measurement const> measurements, NetworkFitOptions const& options = {}) {
  return detail::fit_network<Net, false>("fit_network", measurements, options, [](Net network, MeasuredRange const& depths, MeasuredRange const&, CurveGuard<double> guard) {
    return NetworkCurve<Net>(std::move(network), {depths.low, depths.high}, guard);
  });
}

/// The same for a network of depth and speed, on the measurements of loading.
template <class Net>
NetworkFit<SpeedCurve<Net>> fit_speed_network(std::span<Measurement const> measurements, NetworkFitOptions const& options = {}) {
  return detail::fit_network<Net, true>("fit_speed_network", measurements, options,
                                        [](Net network, MeasuredRange const& depths, MeasuredRange const& speeds, CurveGuard<double> guard) {
                                          return SpeedCurve<Net>(std::move(network), {depths.low, depths.high}, {speeds.low, speeds.high}, guard);
                                        });
}

/// The fit as a table.
template <class NetworkLaw>
std::ostream& operator<<(std::ostream& out, NetworkFit<NetworkLaw> const& fit) {
  using Net = std::remove_cvref_t<decltype(fit.law.network())>;
  out << "network: " << fit.used.size() << " measurements, depth " << fit.depths.low * 1000 << " to " << fit.depths.high * 1000 << " mm, speed "
      << fit.speeds.low * 1000 << " to " << fit.speeds.high * 1000 << " mm/s\n  " << Net::parameter_count << " weights, " << fit.training.epochs
      << " epochs in the best of " << fit.training.starts.size() << " starts\n  residual  " << fit.rms << " N rms, R^2 " << fit.r_squared;
  if (!std::isnan(fit.cross_validated_rms)) out << "; on measurements left out " << fit.cross_validated_rms << " N rms";
  return out << "\n  " << force_disclaimer << '\n';
}

}  // namespace palpate
