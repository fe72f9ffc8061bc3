// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// Why a training ended.
enum class TrainingStop {
  epochs,       ///< all epochs were used
  goal,         ///< the wanted error was reached
  no_progress,  ///< no step makes the error smaller, or the rate is so large that the error grew out of bounds
  held_out,     ///< the error over the samples held out fell no longer
  stopped       ///< whoever watches the training said so
};

constexpr char const* to_string(TrainingStop stop) noexcept {
  switch (stop) {
    case TrainingStop::epochs: return "epochs used";
    case TrainingStop::goal: return "goal reached";
    case TrainingStop::no_progress: return "no progress";
    case TrainingStop::held_out: return "held-out error rises";
    case TrainingStop::stopped: return "stopped";
  }
  return "unknown";
}

/// What a trainer says of its work. A trainer makes a sum of squared residuals small, which it sees as a problem:
///   sample_count()               how many samples there are
///   mean_square(p)               the mean square E of the residuals with the parameters p
///   gradient(p, g)               E, with g = ∂E/∂p
///   gradient(p, g, samples)      the same over the samples listed, numbers below sample_count()
///   normal_equations(p, A, b)    E, with A = JᵀJ/n and b = Jᵀr/n
///   goes_on(epoch, p)            to be asked after every epoch, counted from 1: false ends the training
/// A trainer of one's own is a type with `void validate() const` and
///   template <class Problem> TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const;
struct TrainingResult {
  int epochs = 0;
  TrainingStop stop = TrainingStop::epochs;
};

namespace detail {

inline void check_training(char const* who, int epochs, double goal) {
  OptionCheck const require{who};
  require(epochs >= 1, ".epochs", epochs, "give one or more");
  require(goal >= 0.0, ".goal", goal, "give zero or more");
}

inline void check_descent(char const* who, double rate, int epochs, double goal) {
  OptionCheck{who}.positive(".rate", rate);
  check_training(who, epochs, goal);
}

/// Epoch after epoch, of which the best parameters are kept. `measure(p)` is the error there, `advance(p)` makes one epoch.
template <class Problem, class Measure, class Advance>
TrainingResult descend(Problem const& problem, Eigen::VectorXd& parameters, int epochs, double goal, Measure measure, Advance advance) {
  Eigen::VectorXd best = parameters;
  double best_error = std::numeric_limits<double>::infinity();
  TrainingResult result{.epochs = 0, .stop = TrainingStop::epochs};
  for (;; ++result.epochs) {
    double const error = is_finite(parameters) ? measure(parameters) : std::numeric_limits<double>::infinity();
    if (!std::isfinite(error)) {
      result.stop = TrainingStop::no_progress;
      break;
    }
    if (error < best_error) {
      best_error = error;
      best = parameters;
    }
    bool const goes_on = result.epochs == 0 || problem.goes_on(result.epochs, std::as_const(parameters));
    if (error <= goal)
      result.stop = TrainingStop::goal;
    else if (!goes_on)
      result.stop = TrainingStop::stopped;
    if (result.stop != TrainingStop::epochs || result.epochs == epochs) break;
    advance(parameters);
  }
  parameters = best;
  return result;
}

}  // namespace detail

/// Gradient descent with momentum, all samples in every epoch:  v ← m v − rate ∂E/∂p,  p ← p + v.
/// Inputs and outputs are scaled to −1 … 1 first, so the rate has no unit.
/// Source     \cite polyak1964
/// Limits     Where the error is a parabola of curvature λ it converges for rate · λ < 2 (1 + m), and is 1/(1 − m) times as fast as plain
///            descent where that creeps. The best parameters met are kept, as `GradientDescent` does.
struct MomentumDescent {
  double rate = 0.001;
  double momentum = 0.9;   ///< m, 0 ≤ m < 1; 0 is `GradientDescent`
  int epochs = 100;
  double goal = 0.0;       ///< stop at this mean squared error in units of the scaled outputs

  void validate() const {
    detail::check_descent("MomentumDescent", rate, epochs, goal);
    detail::OptionCheck{"MomentumDescent"}(momentum >= 0.0 && momentum < 1.0, ".momentum", momentum, "give zero or more, below one");
  }

  template <class Problem>
  TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const {
    Eigen::VectorXd gradient(parameters.size());
    Eigen::VectorXd velocity = Eigen::VectorXd::Zero(parameters.size());
    auto const measure = [&](Eigen::VectorXd const& p) {
      double const error = problem.gradient(p, gradient);
      return is_finite(gradient) ? error : std::numeric_limits<double>::infinity();
    };
    return detail::descend(problem, parameters, epochs, goal, measure, [&](Eigen::VectorXd& p) {
      velocity = momentum * velocity - rate * gradient;
      p += velocity;
    });
  }
};

/// Plain gradient descent on the mean squared error, all samples in every epoch: p ← p − rate ∂E/∂p.
/// Inputs and outputs are scaled to −1 … 1 first, so the rate has no unit.
/// Source     \cite zheng2006 ch. 6.3, rate 0.001
/// Limits     At that rate the thesis's error for the liver is not reached in 20,000 epochs (benchmarks/force_training), let alone its 100;
///            `LevenbergMarquardt` needs tens. The best parameters met are kept, so a rate that is too large ends with `no_progress`,
///            never with a worse network.
struct GradientDescent {
  double rate = 0.001;
  int epochs = 100;
  double goal = 0.0;   ///< stop at this mean squared error in units of the scaled outputs

  void validate() const { detail::check_descent("GradientDescent", rate, epochs, goal); }

  template <class Problem>
  TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const {
    return MomentumDescent{.rate = rate, .momentum = 0.0, .epochs = epochs, .goal = goal}.minimise(problem, parameters);
  }
};

/// Stochastic gradient descent: an epoch goes once through all samples in random order, `batch` at a time, each with a step of
/// its own: p ← p − rate ∂E_batch/∂p. Inputs and outputs are scaled to −1 … 1 first, so the rate has no unit.
/// Source     \cite robbins1951
/// Invariant  The same seed gives the same order, with every standard library.
/// Limits     At a constant rate the error of noisy samples stays above its minimum by a share of the rate; the best parameters met at the
///            end of an epoch are kept.
struct StochasticDescent {
  double rate = 0.001;
  int batch = 1;       ///< samples a step; all of them or more: one step an epoch, as `GradientDescent`
  int epochs = 100;
  double goal = 0.0;   ///< stop at this mean squared error in units of the scaled outputs
  Seed seed{};         ///< of the order

  void validate() const {
    detail::check_descent("StochasticDescent", rate, epochs, goal);
    detail::OptionCheck{"StochasticDescent"}(batch >= 1, ".batch", batch, "give one sample or more");
  }

  template <class Problem>
  TrainingResult minimise(Problem const& problem, Eigen::VectorXd& parameters) const {
    Eigen::VectorXd gradient(parameters.size());
    std::vector<std::size_t> order(static_cast<std::size_t>(problem.sample_count()));
    std::iota(order.begin(), order.end(), std::size_t{0});
    Random random(seed);
    auto const measure = [&](Eigen::VectorXd const& p) { return problem.mean_square(p); };
    return detail::descend(problem, parameters, epochs, goal, measure, [&](Eigen::VectorXd& p) {
      std::span<std::size_t> left(order);
      shuffle(left, random);
      while (!left.empty() && is_finite(p)) {   // what grew out of bounds ends with the epoch
        std::span<std::size_t const> const part = left.first(std::min(left.size(), static_cast<std::size_t>(batch)));
        problem.gradient(p, gradient, part);
        p -= rate * gradient;
        left = left.subspan(part.size());
      }
    });
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
    detail::check_training("LevenbergMarquardt", epochs, goal);
    detail::OptionCheck{"LevenbergMarquardt"}.positive(".damping", damping);
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
        trial_error = is_finite(trial) ? problem.mean_square(trial) : std::numeric_limits<double>::infinity();
        if (trial_error < error) break;
      }
      if (!(trial_error < error)) {
        result.stop = TrainingStop::no_progress;
        return result;
      }
      parameters = trial;
      error = trial_error;
      mu = std::max(mu / 10.0, smallest_damping);
      if (!problem.goes_on(result.epochs, std::as_const(parameters)) && error > goal) {
        result.stop = TrainingStop::stopped;
        return result;
      }
    }
    if (error <= goal) result.stop = TrainingStop::goal;
    return result;
  }
};

}  // namespace palpate
