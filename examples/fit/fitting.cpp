// SPDX-License-Identifier: MIT
#include "fitting.hpp"

#include <palpate/core/error.hpp>
#include <palpate/fitting/fit.hpp>
#include <palpate/fitting/fit_network.hpp>
#include <palpate/fitting/needle_model.hpp>
#include <palpate/json/force_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>

namespace fit_example {

namespace {

using namespace palpate;

template <class Found>
FittedModel common(std::string_view name, Found const& found) {
  std::ostringstream table;
  table << found;
  FittedModel result{.model = std::string(name), .table = table.str()};
  result.used = found.used;
  result.residuals = found.residuals;
  result.rms = found.rms;
  result.r_squared = found.r_squared;
  result.cross_validated_rms = found.cross_validated_rms;
  return result;
}

template <class Model>
FittedModel fit_formula(Model const& model, std::span<Measurement const> measurements, FitSettings const& settings) {
  auto const found = fit(measurements, model, {.confidence = settings.confidence, .seed = settings.seed, .solver = {.iterations = 5000}});
  FittedModel result = common(model.name(), found);
  result.coefficients = found.coefficients.size();
  for (FittedCoefficient const& c : found.coefficients) {
    if (c.determined) continue;
    result.undetermined += (result.undetermined.empty() ? "" : ", ") + c.name;
    result.comparable = result.comparable && std::isfinite(c.high);
  }
  result.converged = found.converged;
  result.preset = force_text(force_preset(found, settings.source));
  result.force = [model, p = found.parameters](Measurement const& m) { return model.force(p, m); };
  return result;
}

template <class Net>
FittedModel fit_depth_network(std::span<Measurement const> measurements, FitSettings const& settings) {
  NetworkFitOptions options;
  options.training.seed = Seed{settings.seed};
  auto const found = fit_network<Net>(measurements, options);
  FittedModel result = common("network", found);
  result.coefficients = static_cast<std::size_t>(Net::parameter_count);
  result.preset = force_text(found, settings.source);
  result.force = [law = found.law](Measurement const& m) {
    if constexpr (Net::inputs == 2)
      return law(m.depth, m.phase == MeasuredPhase::unloading ? Phase::unloading : Phase::loading);
    else
      return law(m.depth);
  };
  return result;
}

FittedModel fit_named(std::string_view name, std::span<Measurement const> measurements, FitSettings const& settings) {
  if (name == LinearModel{}.name()) return fit_formula(LinearModel{}, measurements, settings);
  if (name == PolynomialModel{}.name()) return fit_formula(PolynomialModel{}, measurements, settings);
  if (name == ExponentialModel{}.name()) return fit_formula(ExponentialModel{}, measurements, settings);
  if (name == HuntCrossleyModel{}.name()) return fit_formula(HuntCrossleyModel{}, measurements, settings);
  if (name == NeedleModel{}.name()) return fit_formula(NeedleModel{}, measurements, settings);
  bool const comes_back = std::any_of(measurements.begin(), measurements.end(), [](auto const& m) { return m.phase == MeasuredPhase::unloading; });
  return comes_back ? fit_depth_network<Network<double, 2, 5, 1>>(measurements, settings)
                    : fit_depth_network<Network<double, 1, 5, 1>>(measurements, settings);
}

/// "138 loading, unloading"
std::string what_is_used(std::vector<Measurement> const& used) {
  std::string text = std::to_string(used.size());
  char const* separator = " ";
  for (auto const phase : {MeasuredPhase::indenting, MeasuredPhase::loading, MeasuredPhase::unloading})
    if (std::any_of(used.begin(), used.end(), [&](auto const& m) { return m.phase == phase; })) {
      text += separator;
      text += to_string(phase);
      separator = ", ";
    }
  return text;
}

}  // namespace

FittedModel fit_model(std::string_view name, std::span<Measurement const> measurements, FitSettings const& settings) {
  FittedModel result = fit_named(name, measurements, settings);
  parse_force<double>(result.preset, "the preset of \"" + result.model + "\"");   // what no simulator takes is not written
  return result;
}

Comparison fit_all(std::span<Measurement const> measurements, FitSettings const& settings) {
  Comparison result;
  for (std::string_view const name : model_names) {
    try {
      FittedModel fitted = fit_model(name, measurements, settings);
      if (fitted.comparable)
        result.fits.push_back(std::move(fitted));
      else
        result.left_out.push_back(std::string(name) + ": the measurements do not say what " + fitted.undetermined + " is");
    } catch (Error const& error) {
      result.left_out.push_back(std::string(name) + ": " + error.what());
    }
  }
  if (result.fits.empty()) throw InvalidArgument("no model can be fitted: " + result.left_out.front());
  auto const error_of = [](FittedModel const& f) {
    return std::isnan(f.cross_validated_rms) ? std::numeric_limits<double>::infinity() : f.cross_validated_rms;
  };
  std::stable_sort(result.fits.begin(), result.fits.end(), [&](auto const& a, auto const& b) { return error_of(a) < error_of(b); });
  return result;
}

std::string comparison_table(Comparison const& comparison) {
  auto const row = [](char const* model, char const* left_out, char const* rms, char const* r_squared, char const* coefficients, char const* used) {
    char text[320];
    std::snprintf(text, sizeof text, "  %-14s %12s %10s %9s %13s  %s\n", model, left_out, rms, r_squared, coefficients, used);
    return std::string(text);
  };
  auto const number = [](double value, char const* format) {
    char text[48];
    std::snprintf(text, sizeof text, format, value);
    return std::isnan(value) ? std::string("-") : std::string(text);
  };
  std::string text = "Smallest error on measurements left out first:\n";
  text += row("model", "left out [N]", "rms [N]", "R^2", "coefficients", "measurements");
  bool comparable = true;
  for (FittedModel const& f : comparison.fits) {
    std::string const used = what_is_used(f.used);
    text += row(f.model.c_str(), number(f.cross_validated_rms, "%.4f").c_str(), number(f.rms, "%.4f").c_str(), number(f.r_squared, "%.4f").c_str(),
                std::to_string(f.coefficients).c_str(), used.c_str());
    comparable = comparable && used == what_is_used(comparison.fits.front().used);
  }
  if (!comparable) text += "Errors over different measurements are no contest: compare models whose last columns agree.\n";
  for (std::string const& reason : comparison.left_out) text += "Left out: " + reason + '\n';
  return text;
}

}  // namespace fit_example
