// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

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

}  // namespace palpate
