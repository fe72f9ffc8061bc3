// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace palpate {

namespace detail {

/// P(|t| < x) of Student's distribution with a whole number of degrees of freedom: the finite sums of \cite abramowitz1964 26.7.3 and 26.7.4.
inline double student_probability(double x, int freedom) noexcept {
  double const angle = std::atan(x / std::sqrt(static_cast<double>(freedom)));
  double const cosine = std::cos(angle), square = cosine * cosine;
  if (freedom % 2 == 1) {
    double term = cosine, sum = freedom > 1 ? cosine : 0.0;
    for (int k = 3; k <= freedom - 2; k += 2) sum += term *= square * (k - 1) / k;
    return 2.0 / std::numbers::pi * (angle + std::sin(angle) * sum);
  }
  double term = 1.0, sum = 1.0;
  for (int k = 2; k <= freedom - 2; k += 2) sum += term *= square * (k - 1) / k;
  return std::sin(angle) * sum;
}

}  // namespace detail

/// How many standard errors to either side hold a mean with this probability, when the standard error is estimated from the same data:
/// P(|t| < result) = confidence for Student's t. With 95 % and many degrees of freedom 1.96.
/// Errors     InvalidArgument unless 0 < confidence < 1 and freedom ≥ 1.
inline double student_quantile(double confidence, int freedom) {
  if (!(confidence > 0.0 && confidence < 1.0))
    throw InvalidArgument(detail::message("student_quantile: the confidence is ", confidence, "; give a share between 0 and 1, for example 0.95"));
  if (freedom < 1) throw InvalidArgument(detail::message("student_quantile: there are ", freedom, " degrees of freedom; give one or more"));
  int const counted = freedom < 2000 ? freedom : 2000;   // beyond, the quantile changes by less than 1e-3 of itself
  double low = 0.0, high = 2.0;
  while (detail::student_probability(high, counted) < confidence && high < 1e9) high *= 2.0;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    double const middle = low + (high - low) / 2.0;
    (detail::student_probability(middle, counted) < confidence ? low : high) = middle;
  }
  return low + (high - low) / 2.0;
}

/// A model and its data: evaluates the residuals r(p) and their Jacobian ∂r/∂p at parameters p, both already of the right size.
template <class Problem>
concept ResidualProblem = requires(Problem const& problem, Eigen::VectorXd const& p, Eigen::VectorXd& r, Eigen::MatrixXd& j) {
  { problem.residual_count() } -> std::convertible_to<Eigen::Index>;
  problem.evaluate(p, r, j);
};

struct LeastSquaresOptions {
  int iterations = 200;
  double tolerance = 1e-12;   ///< done when a step makes the sum of squares smaller by less than this share of it
};

/// What `minimise_least_squares` found.
struct LeastSquares {
  Eigen::VectorXd parameters;
  double sum_of_squares = 0.0;
  Eigen::MatrixXd inverse_normal;       ///< (JᵀJ)⁻¹ of the parameters that are free and determined; zero rows and columns for the others
  std::vector<bool> at_bound;           ///< a parameter that would be smaller if it might
  std::vector<bool> determined;         ///< false: others can take its place, or nothing depends on it; the data do not say what it is
  bool converged = false;               ///< false too where the way to less ends at parameters that the model is not finite at
  int iterations = 0;

  int free_count() const noexcept { return static_cast<int>(std::count(at_bound.begin(), at_bound.end(), false)); }
};

namespace detail {

/// What the data say of each parameter. With the columns of J of length one, a direction in which all parameters together can go with next to
/// no change of the residuals is an eigenvector of JᵀJ with an eigenvalue near 0: what takes part in it is not determined.
template <class Jacobian>   // a template, so that who does not fit does not compile it
void find_determined(Jacobian const& j, LeastSquares& found) {
  Eigen::Index const count = j.cols();
  Eigen::VectorXd const length = j.colwise().norm();
  Eigen::VectorXd const scale = length.unaryExpr([](double value) { return value > 0.0 ? 1.0 / value : 1.0; });
  Jacobian const columns = j * scale.asDiagonal();
  Eigen::SelfAdjointEigenSolver<Jacobian> const all(columns.transpose() * columns);
  constexpr double vanishing = 1e-12, takes_part = 1e-4;
  found.determined.assign(static_cast<std::size_t>(count), true);
  for (Eigen::Index e = 0; e < count; ++e)
    if (all.eigenvalues()[e] <= vanishing)
      for (Eigen::Index k = 0; k < count; ++k)
        if (std::abs(all.eigenvectors()(k, e)) > takes_part) found.determined[static_cast<std::size_t>(k)] = false;

  std::vector<Eigen::Index> counted;
  for (Eigen::Index k = 0; k < count; ++k)
    if (found.determined[static_cast<std::size_t>(k)] && !found.at_bound[static_cast<std::size_t>(k)]) counted.push_back(k);
  Jacobian const part = columns(Eigen::all, counted);
  auto const size = static_cast<Eigen::Index>(counted.size());
  Jacobian const inverse = Jacobian(part.transpose() * part).ldlt().solve(Jacobian::Identity(size, size));
  found.inverse_normal = Jacobian::Zero(count, count);
  for (Eigen::Index a = 0; a < size; ++a)
    for (Eigen::Index b = 0; b < size; ++b) {
      Eigen::Index const row = counted[static_cast<std::size_t>(a)], column = counted[static_cast<std::size_t>(b)];
      found.inverse_normal(row, column) = scale[row] * scale[column] * inverse(a, b);
    }
}

}  // namespace detail

/// Makes Σ r² small over parameters that are not below `lower`, by damped Gauss–Newton steps; each parameter is damped by its own curvature, so
/// units do not matter. A parameter whose step would leave the bounds rests there until the slope points inward again.
/// Source     \cite marquardt1963; bounds as in \cite bertsekas1982, a projected Newton step.
/// Errors     InvalidArgument for a start below its bound or not finite, for residuals that are not finite there, and for options out of their meaning.
/// Cost       Offline: allocates. A problem that is linear in its parameters takes a few iterations.
template <ResidualProblem Problem>
LeastSquares minimise_least_squares(Problem const& problem, Eigen::VectorXd start, Eigen::VectorXd const& lower, LeastSquaresOptions const& options = {}) {
  detail::OptionCheck const require{"LeastSquaresOptions"};   // else the measurements get the blame for what is not found
  require(options.iterations >= 1, ".iterations", options.iterations, "give one or more");
  require(options.tolerance >= 0.0 && options.tolerance < 1.0, ".tolerance", options.tolerance, "give a share from 0 to below 1, for example 1e-12");
  auto const count = start.size();
  if (lower.size() != count) throw InvalidArgument(detail::message("least squares: there are ", lower.size(), " bounds for ", count, " parameters; give one for each"));
  for (Eigen::Index k = 0; k < count; ++k)
    if (!std::isfinite(start[k]) || !(start[k] >= lower[k]))
      throw InvalidArgument(detail::message("least squares: parameter ", k, " starts at ", start[k], " and may not be below ", lower[k], "; start it there or above"));

  Eigen::Index const rows = problem.residual_count();
  Eigen::VectorXd r(rows), trial_r(rows);
  Eigen::MatrixXd j(rows, count), trial_j(rows, count);
  problem.evaluate(start, r, j);
  if (!is_finite(r) || !is_finite(j)) throw InvalidArgument("least squares: the model is not finite at the parameters it starts from; start elsewhere");

  LeastSquares found{.parameters = std::move(start), .sum_of_squares = r.squaredNorm(), .inverse_normal = {}, .at_bound = {}, .determined = {}};
  found.at_bound.assign(static_cast<std::size_t>(count), false);
  constexpr double least_damping = 1e-12;
  auto const rest_at_bounds = [&](Eigen::VectorXd const& slope) {
    for (Eigen::Index k = 0; k < count; ++k) found.at_bound[static_cast<std::size_t>(k)] = found.parameters[k] <= lower[k] && slope[k] >= 0.0;
  };
  auto const normal_of_free = [&](Eigen::MatrixXd normal) {
    for (Eigen::Index k = 0; k < count; ++k)
      if (found.at_bound[static_cast<std::size_t>(k)]) {
        normal.row(k).setZero(), normal.col(k).setZero();
        normal(k, k) = 1.0;
      }
    return normal;
  };

  auto const step_of = [&](Eigen::MatrixXd const& normal, Eigen::VectorXd const& slope, double damping) {
    Eigen::MatrixXd damped = normal;
    damped.diagonal() += damping * normal.diagonal();
    for (Eigen::Index k = 0; k < count; ++k)
      if (!(damped(k, k) > 0.0)) damped(k, k) = 1.0;   // a parameter that nothing depends on
    return Eigen::VectorXd(damped.ldlt().solve(slope));
  };
  auto const is_least = [&](Eigen::MatrixXd const& normal, Eigen::VectorXd const& slope) {   // else the full step would gain something
    return slope.dot(step_of(normal, slope, least_damping)) <= options.tolerance * found.sum_of_squares;
  };

  double damping = 1e-3;
  bool has_ended = false;
  while (!has_ended && found.iterations < options.iterations) {
    ++found.iterations;
    Eigen::MatrixXd const jj = j.transpose() * j;
    Eigen::VectorXd slope = j.transpose() * r;
    rest_at_bounds(slope);
    Eigen::MatrixXd const normal = normal_of_free(jj);
    for (Eigen::Index k = 0; k < count; ++k)
      if (found.at_bound[static_cast<std::size_t>(k)]) slope[k] = 0.0;
    for (bool is_blocked = false;;) {
      Eigen::VectorXd const trial = (found.parameters - step_of(normal, slope, damping)).cwiseMax(lower);
      problem.evaluate(trial, trial_r, trial_j);
      double const sum = trial_r.squaredNorm();
      bool const is_computable = is_finite(trial) && is_finite(trial_r) && is_finite(trial_j);
      if (is_computable && sum <= found.sum_of_squares) {
        has_ended = found.sum_of_squares - sum <= options.tolerance * found.sum_of_squares;
        if (has_ended) found.converged = !is_blocked || is_least(normal, slope);
        found.parameters = trial;
        found.sum_of_squares = sum;
        r.swap(trial_r), j.swap(trial_j);
        damping = std::max(damping / 10.0, least_damping);
        break;
      }
      is_blocked = is_blocked || !is_computable;
      damping *= 10.0;
      if (damping > 1e16) {   // no step, however small, is an improvement
        has_ended = true;
        found.converged = !is_blocked || is_least(normal, slope);
        break;
      }
    }
  }

  rest_at_bounds(j.transpose() * r);
  detail::find_determined(j, found);
  return found;
}

}  // namespace palpate
