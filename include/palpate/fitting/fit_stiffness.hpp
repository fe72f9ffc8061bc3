// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/fitting/detail/indentation_curve.hpp>
#include <palpate/fitting/detail/indentation_problem.hpp>
#include <palpate/fitting/indentation.hpp>
#include <palpate/fitting/least_squares.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/mass_spring_options.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

/// A coefficient of a spring law, by its member.
template <RealScalar Scalar, class Law>
struct LinkCoefficient {
  std::string name;
  std::string unit;
  Scalar Law::*member = nullptr;
};

/// Which coefficients of mass-spring tissue are found; the others stay as they are.
///   TissueCoefficients<double, SaturatingSpring<double>>{.link = {{"stiffness", "N/m", &SaturatingSpring<double>::stiffness},
///                                                                 {"largest_tension", "N", &SaturatingSpring<double>::largest_tension}}}
template <RealScalar Scalar, class Law>
struct TissueCoefficients {
  std::vector<LinkCoefficient<Scalar, Law>> link = its_stiffness();
  bool home_stiffness = true;

  static std::vector<LinkCoefficient<Scalar, Law>> its_stiffness() {
    if constexpr (HasStiffness<Law, Scalar>)
      return {{"stiffness", "N/m", &Law::stiffness}};
    else
      return {};
  }
};

/// How a fit is made.
template <class Solver = DynamicRelaxation>
struct StiffnessFitOptions {
  Solver solver{};              ///< of statics
  double confidence = 0.95;     ///< of the intervals
  int max_depths = 40;         ///< at so many the body is computed; between them the force is interpolated where more were measured
  LeastSquaresOptions search{.iterations = 100, .tolerance = 1e-8};
};

/// A coefficient that was found.
struct FittedStiffness {
  std::string name;
  std::string unit;
  double value = 0.0;
  double low = 0.0, high = std::numeric_limits<double>::infinity();   ///< of the confidence interval
  bool determined = false;        ///< the interval reaches less than a factor of two to either side
};

/// What `fit_stiffness` found.
struct StiffnessFit {
  std::vector<FittedStiffness> coefficients;
  std::vector<double> residuals;   ///< N, of the model − measured, in the order of the measurements
  double rms = 0.0;                ///< N, of the residuals
  double r_squared = 0.0;          ///< share of the forces' weighted variance that the model explains
  double confidence = 0.95;
  int freedom = 0;                 ///< measurements − coefficients, those at their lower bound not counted
  bool determined = false;         ///< all coefficients are
  bool converged = false;
  bool stable = false;             ///< the body rests stably at every depth with these coefficients; else it may rest elsewhere too
  int iterations = 0;              ///< of the search
  int static_solutions = 0;        ///< how often the body was brought to rest

  FittedStiffness const& operator[](std::string_view name) const {
    for (FittedStiffness const& found : coefficients)
      if (found.name == name) return found;
    throw InvalidArgument(detail::message("StiffnessFit: there is no coefficient ", name, "; the first is ",
                                          coefficients.empty() ? "none" : coefficients.front().name));
  }
};

/// The same, and options with the coefficients that were found: build the body from them.
template <RealScalar Scalar, class Law>
struct TissueFit : StiffnessFit {
  MassSpringOptions<Scalar, Law> options{};
};

/// Finds the coefficients of tissue with which a body answers an indentation as was measured: the least sum of squared differences of force.
/// The experiment is quasi-static. A point indenter sticks to one particle and holds it at X + d u; the others come to rest, each depth from the one
/// before; the force is what the hold does along u. Under pre-tension X is where the body rests undisturbed, as a SoftBody begins.
///
/// `build(values)`, values a span of doubles in the order of `guesses`, answers the tissue: for layers, supports, a cut body. What may be
/// fitted is positive; the search goes by logarithms, so units and guesses that are off by 100 do not matter.
/// Units      depth, X [m], force [N], coefficients as named.
/// Source     \cite deformable_survey for the idea; \cite marquardt1963. The derivatives are those of the adjoint of the balance, see IndentationProblem. The intervals are
///            those of linear regression in the logarithms, with Student's quantile.
/// Cost       offline: about iterations × depths static solutions, most of them from nearly at rest; many depths count as `max_depths`.
///            Allocates; memory of 1 + 2 × coefficients tissues.
/// Limits     the touched particle stands for the indenter: the indenter must be about as wide as the mesh around it, and the coefficients belong
///            to this mesh; another resolution needs another fit. No gravity, no speed, no friction or sliding of the indenter. What the
///            test does not stretch it does not tell: links of a flat sheet act in the third order of the depth, so small depths leave
///            link.stiffness not `determined`. One that the data do not ask for comes out near 0, with the interval from 0 to infinity.
///            The force does not resolve better than 1e-8 (float 1e-4) of the largest, and intervals say so.
/// Errors     InvalidArgument for measurements, a place or guesses that make no test, and where tissue refuses the guesses; Error where the body
///            does not come to rest with them. What happens farther on is in the result: `converged`, `determined`, `stable`.
template <class Build, RealScalar Scalar, class Solver = DynamicRelaxation>
  requires std::invocable<Build const&, std::span<double const>>
StiffnessFit fit_stiffness(Build const& build, std::vector<StiffnessGuess> const& guesses, IndentationTest<Scalar> const& test,
                           std::span<IndentationPoint const> measured, StiffnessFitOptions<Solver> const& options = {}) {
  detail::require_usable(measured, guesses);
  student_quantile(options.confidence, 1);   // throws for what is no confidence
  if (options.max_depths < 2)
    throw InvalidArgument(detail::message("fit_stiffness: .max_depths is ", options.max_depths, "; give 2 or more, 40 for a smooth curve"));

  auto const count = static_cast<Eigen::Index>(guesses.size());
  std::vector<double> values;
  Eigen::VectorXd start(count);
  for (StiffnessGuess const& guess : guesses) {
    start[static_cast<Eigen::Index>(values.size())] = std::log(guess.value);
    values.push_back(guess.value);
  }
  using Problem = detail::IndentationProblem<Build, Solver>;
  static_assert(std::same_as<typename Problem::Scalar, Scalar>,
                "fit_stiffness: the tissue of build() and the IndentationTest have different scalars.");
  auto const scene = detail::indentation_scene(build(std::span<double const>(values)), test);

  double largest = 0.0;
  Eigen::VectorXd force(static_cast<Eigen::Index>(measured.size())), weight(force.size());
  for (Eigen::Index i = 0; i < force.size(); ++i) {
    IndentationPoint const& point = measured[static_cast<std::size_t>(i)];
    largest = std::max(largest, point.force);
    force[i] = point.force, weight[i] = 1.0 / point.deviation;
  }
  weight /= weight.maxCoeff();   // first, or the square of a large one would be infinite
  weight *= std::sqrt(static_cast<double>(weight.size()) / weight.squaredNorm());

  detail::IndentationDepths const depths(measured, options.max_depths);
  typename Problem::Memory memory;
  Problem const problem(build, options.solver, scene, depths.depths(), memory);
  double const lost = scene.accuracy.force * largest;
  detail::IndentationResiduals<Problem> const residuals(problem, depths, force, weight, lost);
  Eigen::VectorXd r;
  Eigen::MatrixXd j;
  residuals.differences(start, r, j);   // throws where the search would only go astray
  // First all together: the force grows with the stiffness of the whole body. A step that divides it as well may leave what acts less behind.
  Eigen::VectorXd const together = start.array() - std::log(residuals.share_of_measured(r));
  if (is_finite(together) && residuals.is_computable(together)) start = together;
  Eigen::VectorXd const lower = start.array() - std::log(1e6);
  LeastSquares found = minimise_least_squares(residuals, start, lower, options.search);
  if (found.free_count() < count) {   // left behind? From above once more
    Eigen::VectorXd above = start;
    for (Eigen::Index k = 0; k < count; ++k)
      if (found.at_bound[static_cast<std::size_t>(k)]) above[k] += std::log(100.0);
    if (residuals.is_computable(above)) {
      LeastSquares again = minimise_least_squares(residuals, above, lower, options.search);
      again.iterations += found.iterations;
      if (again.sum_of_squares < found.sum_of_squares) found = std::move(again);
    }
  }
  memory.ask_stability = true;
  residuals.differences(found.parameters, r, j);

  StiffnessFit fit;
  fit.residuals.assign(r.data(), r.data() + r.size());
  fit.rms = std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
  fit.confidence = options.confidence;
  fit.freedom = static_cast<int>(r.size()) - found.free_count();
  fit.converged = found.converged, fit.iterations = found.iterations;
  fit.stable = memory.stable, fit.static_solutions = memory.static_solutions;
  Eigen::VectorXd const squared_weight = weight.cwiseAbs2();
  double const squares = squared_weight.dot(r.cwiseAbs2());
  double const mean = squared_weight.dot(force) / squared_weight.sum();
  double const spread = squared_weight.dot((force.array() - mean).square().matrix());
  fit.r_squared = spread > 0.0 ? 1.0 - squares / spread : 0.0;
  double const error = std::max(std::sqrt(squares / fit.freedom), lost) * student_quantile(options.confidence, fit.freedom);
  fit.determined = true;
  for (Eigen::Index k = 0; k < count; ++k) {
    auto const n = static_cast<std::size_t>(k);
    FittedStiffness one{.name = guesses[n].name, .unit = guesses[n].unit, .value = std::exp(found.parameters[k])};
    double const half = error * std::sqrt(found.inverse_normal(k, k));
    if (found.determined[n] && !found.at_bound[n] && std::isfinite(half) && half < 700.0) {
      one.low = one.value * std::exp(-half), one.high = one.value * std::exp(half);
      one.determined = half < std::log(2.0);
    }
    fit.determined = fit.determined && one.determined;
    fit.coefficients.push_back(std::move(one));
  }
  return fit;
}

/// The same for mass-spring tissue on a surface or volume that is alike everywhere: by default link.stiffness and home.stiffness are found. All
/// else, `guess` says: it is where the search begins.
///
///   auto const fit = fit_stiffness(mesh, MassSpringOptions<double, LinearSpring<double>>{.link = {.stiffness = 50.0}, .home = {.stiffness = 10.0}},
///                                  IndentationTest<double>{.particle = 112}, curve);
///   std::cout << fit;
///   SoftBody body(MassSpring<double>(mesh, fit.options));   // and nail it as in the test
template <class Mesh, RealScalar Scalar, SpringLaw<Scalar> Law, class Solver = DynamicRelaxation>
  requires std::constructible_from<MassSpring<Scalar, Law>, Mesh const&, MassSpringOptions<Scalar, Law> const&>
TissueFit<Scalar, Law> fit_stiffness(Mesh const& mesh, MassSpringOptions<Scalar, Law> const& guess, IndentationTest<Scalar> const& test,
                                     std::span<IndentationPoint const> measured, TissueCoefficients<Scalar, Law> const& coefficients = {},
                                     StiffnessFitOptions<Solver> const& options = {}) {
  std::vector<StiffnessGuess> guesses;
  for (auto const& [name, unit, member] : coefficients.link) {
    if (member == nullptr)
      throw InvalidArgument(detail::message("fit_stiffness: the coefficient link.", name,
                                            " names no member of the law; give one, as &LinearSpring<double>::stiffness is"));
    guesses.push_back({"link." + name, unit, static_cast<double>(guess.link.*member)});
  }
  if (coefficients.home_stiffness) guesses.push_back({"home.stiffness", "N/m", static_cast<double>(guess.home.stiffness)});
  auto const with = [&](auto const& value_of) {
    MassSpringOptions<Scalar, Law> changed = guess;
    std::size_t k = 0;
    for (auto const& link : coefficients.link) changed.link.*link.member = static_cast<Scalar>(value_of(k++));
    if (coefficients.home_stiffness) changed.home.stiffness = static_cast<Scalar>(value_of(k));
    return changed;
  };
  auto const build = [&](std::span<double const> values) { return MassSpring<Scalar, Law>(mesh, with([&](std::size_t k) { return values[k]; })); };
  TissueFit<Scalar, Law> fit{fit_stiffness(build, guesses, test, measured, options), {}};
  fit.options = with([&](std::size_t k) { return fit.coefficients[k].value; });
  return fit;
}

/// A table: coefficients with their intervals, how well the curve is met, and what to mind.
inline std::ostream& operator<<(std::ostream& out, StiffnessFit const& fit) {
  auto const column = [](auto const& value, std::size_t width) {
    std::string text;
    if constexpr (std::floating_point<std::remove_cvref_t<decltype(value)>>) {
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.5g", value);
      text = digits;
      return std::string(text.size() < width ? width - text.size() : 1, ' ') + text;
    } else {
      text = value;
      return text + std::string(text.size() < width ? width - text.size() : 1, ' ');
    }
  };
  out << column("coefficient", 24) << "       value        from          to  unit   (" << detail::to_text(100.0 * fit.confidence)
      << " % confidence)\n";
  for (FittedStiffness const& one : fit.coefficients)
    out << column(one.name, 24) << column(one.value, 12) << column(one.low, 12) << column(one.high, 12) << "  " << one.unit
        << (one.determined ? "\n" : "   not determined\n");
  out << "residual" << column(fit.rms, 1) << " N rms, R squared" << column(fit.r_squared, 1) << ", " << fit.residuals.size() << " measurements, "
      << fit.static_solutions << " static solutions\n";
  if (!fit.determined) out << "These measurements do not determine every coefficient: press deeper or elsewhere, measure more, or leave one out.\n";
  if (!fit.converged) out << "The search did not end: begin elsewhere, or allow more iterations.\n";
  if (!fit.stable) out << "The body does not rest stably at some depth: it may rest elsewhere too, with another force.\n";
  return out;
}

}  // namespace palpate
