// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/fitting/contact_models.hpp>
#include <palpate/fitting/detail/goodness.hpp>
#include <palpate/fitting/least_squares.hpp>
#include <palpate/fitting/measurements.hpp>
#include <palpate/force/tissue_presets.hpp>

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

struct FitOptions {
  double confidence = 0.95;      ///< of the intervals
  int folds = 5;                 ///< of the cross-validation; 0: none
  std::uint64_t seed = 0;        ///< of the way the measurements are divided for it
  LeastSquaresOptions solver{.iterations = 2000};
};

/// A fitted coefficient and the interval that holds the true one with the stated confidence, if the model is true and the errors are independent,
/// of one size and normal. [low, high] is [−∞, ∞] where others can take its place, nothing depends on it or the search did not converge, and
/// [value, value] at its bound.
struct FittedCoefficient {
  std::string name, unit;
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
  bool at_bound = false;     ///< it would be smaller if it might
  bool determined = true;    ///< false: others can take its place, nothing depends on it, or the search converged and the interval holds zero
};

/// What `fit` found. Residuals are measured minus model [N], in the order of `used`.
template <FittedModel Model>
struct Fit {
  using Law = decltype(std::declval<Model const&>().law(Eigen::VectorXd(), MeasuredRange{}));

  Model model;
  Law law;                                        ///< the force model, ready for `CuttingForce`
  Eigen::VectorXd parameters;
  std::vector<FittedCoefficient> coefficients{};
  std::vector<Measurement> used{};
  std::vector<double> residuals{};
  double rms = 0.0;                               ///< N
  double r_squared = 0.0;                         ///< see detail::Goodness
  double cross_validated_rms = std::numeric_limits<double>::quiet_NaN();   ///< N, on measurements that were left out; NaN without
  MeasuredRange depths{}, speeds{};               ///< of the measurements used
  bool converged = true;
  double confidence = 0.95;

  /// The force [N] that the model has there. Throws `OutOfRange` for a speed or depth outside the measurements: of those the fit knows nothing.
  double at(Measurement const& m) const {
    if (!speeds.contains(m.speed))
      throw OutOfRange(detail::message("the fit of \"", model.name(), "\": the speed is ", m.speed, " m/s, measured were ", speeds.low, " to ", speeds.high,
                                       " m/s; stay within, or measure there"));
    if (!depths.contains(m.depth))
      throw OutOfRange(detail::message("the fit of \"", model.name(), "\": the depth is ", m.depth, " m, measured were ", depths.low, " to ", depths.high,
                                       " m; stay within, or measure there"));
    return model.force(parameters, m);
  }
};

namespace detail {

template <class Model>
struct FitProblem {
  Model const& model;
  std::span<Measurement const> measurements;

  Eigen::Index residual_count() const noexcept { return static_cast<Eigen::Index>(measurements.size()); }
  void evaluate(Eigen::VectorXd const& p, Eigen::VectorXd& r, Eigen::MatrixXd& j) const {
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      auto const row = static_cast<Eigen::Index>(i);
      Eigen::RowVectorXd gradient(p.size());
      model.gradient(p, measurements[i], gradient);
      j.row(row) = gradient;
      r[row] = model.force(p, measurements[i]) - measurements[i].force;
    }
  }
};

template <class Model>
Eigen::VectorXd lower_bounds(Model const& model) {
  auto const parameters = model.parameters();
  Eigen::VectorXd lower(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) lower[static_cast<Eigen::Index>(k)] = parameters[k].lower;
  return lower;
}

template <class Model>
LeastSquares solve_fit(Model const& model, std::span<Measurement const> used, LeastSquaresOptions const& solver) {
  Eigen::VectorXd const lower = lower_bounds(model);
  return minimise_least_squares(FitProblem<Model>{model, used}, Eigen::VectorXd(model.start(used)).cwiseMax(lower), lower, solver);
}

/// NaN where a fit of the others does not converge.
template <class Model>
double cross_validate(Model const& model, std::span<Measurement const> used, FitOptions const& options) {
  return leave_out(used, options.folds, Seed{options.seed}, [&](std::span<Measurement const> kept) {
    LeastSquares solved = solve_fit(model, kept, options.solver);
    return [&model, solved = std::move(solved)](Measurement const& m) {
      return solved.converged ? model.force(solved.parameters, m) - m.force : std::numeric_limits<double>::quiet_NaN();
    };
  });
}

}  // namespace detail

/// Fits a model to measurements by least squares of the force.
///   auto const found = fit(read_measurements("needle.csv"), NeedleModel{});
///   CuttingForce force(found.law);
///   std::cout << found;
/// Source     Intervals: value ± t √(s² ((JᵀJ)⁻¹)ₖₖ), s² = Σ r²/(n − p), t Student's quantile; \cite bates1988.
/// Errors     InvalidArgument when there are fewer measurements that the model stands for than it has coefficients, plus one; when a value is not
///            finite; or for options out of their meaning.
/// Cost       Offline: allocates.
/// Limits     For a model that is not linear in its coefficients the intervals are those of its tangent. Measurements of one slow stroke have errors
///            that depend on each other: the intervals are then too narrow.
template <FittedModel Model>
Fit<Model> fit(std::span<Measurement const> measurements, Model const& model, FitOptions const& options = {}) {
  detail::OptionCheck const require{"fit"};
  require(options.confidence > 0.0 && options.confidence < 1.0, ".confidence", options.confidence, "give a share between 0 and 1, for example 0.95");
  require(options.folds == 0 || options.folds >= 2, ".folds", options.folds, "give two or more, or 0 for no cross-validation");
  detail::require_usable("fit", measurements);

  std::vector<Measurement> const used = model.takes(measurements);
  auto const parameters = model.parameters();
  if (used.size() < parameters.size() + 1)
    throw InvalidArgument(detail::message("fit: the model \"", model.name(), "\" has ", parameters.size(), " coefficients and stands for ", used.size(), " of the ",
                                          measurements.size(), " measurements; give at least ", parameters.size() + 1, " that it stands for"));

  LeastSquares const found = detail::solve_fit(model, used, options.solver);
  MeasuredRange const depths = depths_of(used);
  Fit<Model> result{.model = model, .law = model.law(found.parameters, depths), .parameters = found.parameters};
  result.used = used;
  result.depths = depths;
  result.speeds = speeds_of(used);
  result.converged = found.converged;
  result.confidence = options.confidence;

  for (Measurement const& m : used) result.residuals.push_back(m.force - model.force(found.parameters, m));
  detail::Goodness const goodness = detail::goodness(used, result.residuals);
  result.rms = goodness.rms, result.r_squared = goodness.r_squared;

  int const freedom = static_cast<int>(used.size()) - found.free_count();
  double const variance = found.sum_of_squares / freedom, t = student_quantile(options.confidence, freedom);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    auto const row = static_cast<Eigen::Index>(k);
    double const value = found.parameters[row];
    double const half = found.determined[k] && found.converged ? t * std::sqrt(variance * found.inverse_normal(row, row)) : std::numeric_limits<double>::infinity();
    bool const determined = found.determined[k] && !(found.converged && half > std::abs(value));
    result.coefficients.push_back({parameters[k].name, parameters[k].unit, value, value - half, value + half, found.at_bound[k], determined});
  }
  if (options.folds > 0 && used.size() >= 2 * static_cast<std::size_t>(options.folds) && used.size() > 2 * parameters.size())
    result.cross_validated_rms = detail::cross_validate(model, used, options);
  return result;
}

/// The fit as a table.
template <FittedModel Model>
std::ostream& operator<<(std::ostream& out, Fit<Model> const& fit) {
  out << fit.model.name() << ": " << fit.used.size() << " measurements, depth " << fit.depths.low * 1000 << " to " << fit.depths.high * 1000 << " mm, speed "
      << fit.speeds.low * 1000 << " to " << fit.speeds.high * 1000 << " mm/s\n";
  for (FittedCoefficient const& c : fit.coefficients) {
    out << "  " << c.name << std::string(c.name.size() < 10 ? 10 - c.name.size() : 1, ' ') << c.value << (c.unit.empty() ? "" : " ") << c.unit;
    if (!c.determined && !std::isfinite(c.high))
      out << ", not determined by these measurements\n";
    else if (c.at_bound)
      out << ", at its bound\n";
    else
      out << ", " << fit.confidence * 100 << " % between " << c.low << " and " << c.high << (c.determined ? "" : ": not determined by these measurements") << '\n';
  }
  out << "  residual  " << fit.rms << " N rms, R^2 " << fit.r_squared;
  if (!std::isnan(fit.cross_validated_rms)) out << "; on measurements left out " << fit.cross_validated_rms << " N rms";
  out << '\n';
  if (!fit.converged) out << "  not converged: give the solver more iterations\n";
  return out << "  " << force_disclaimer << '\n';
}

}  // namespace palpate
