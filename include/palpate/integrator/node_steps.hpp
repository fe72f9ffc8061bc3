// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/solve_report.hpp>
#include <palpate/integrator/theta_scheme.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// A LinearisedSystem that computes some columns alone, at their cost; d is zero in the others, whose `out` stays as it is.
template <class S>
concept ComputesSome = LinearisedSystem<S> && requires(S& system, std::span<int const> some, typename S::Scalar factor) {
  system.acceleration_of(some, padded_view(system.scratch(0)), padded_view(system.scratch(1)), padded_view(system.scratch(2)));
  system.multiply_tangent_of(some, factor, factor, factor, padded_view(system.scratch(0)), padded_view(system.scratch(1)));
  system.tangent_diagonal_of(some, factor, factor, factor, padded_view(system.scratch(0)));
};
/// A System that has memory for a list of columns.
template <class S>
concept HasList = requires(S& system) { { system.list() } -> std::same_as<std::vector<int>&>; };

/// The θ-scheme with a time step per node: h_i = h/2^l, l = 0 … max_halvings.
///   M Δv = h_i ((1 − θ) f(x, v) + θ f(x⁺, v + Δv)),   x⁺ = x + h_i (v + θ Δv),   v⁺ = v + Δv
/// All nodes that are at the same time take a step together. Those whose speed |v| or |v⁺| is above 2^l · speed_bound go back and take it in two halves,
/// in which the others are known: their positions and velocities run evenly from the start of their step to its end. A step is doubled again where the
/// speed has fallen below half of what the longer one allows. So no node moves farther than h · speed_bound in a step, unless at max_halvings.
///
///   SoftBody body(std::move(tissue), NodeSteps{.theta = 0.5, .speed_bound = 0.2});
///   body.step(0.01);   // nodes below 0.2 m/s take 10 ms, below 0.4 m/s 5 ms, …
///
/// Each step is solved for as by ThetaScheme, without a first guess and without line search; the tangent is that of the start of h.
/// Memory     l travels with its node in previous_acceleration(), so it is saved, restored and cut with the body.
/// Order      1; 2 for θ = ½, with two Newton iterations where the tissue is not linear. What is known is wrong by O(h²) inside a step.
/// Momentum   kept to `tolerance` where all steps are equal. A node feels its slower neighbours on their even way; they felt it on the step that it took
///            back. What is lost at such a seam is of the order of the scheme's error there.
/// Stability  where all steps are equal that of ThetaScheme: any step with θ ≥ ½, which is what stable_step() says. With seams it is measured, not proven:
///            θ = 1 and 0.6 lose energy at 100 times the explicit limit, θ = ½ gains some slowly.
/// Cost       for a node of level l at most 2^(l + 1) − 1 solves, and 2^max_halvings with that step everywhere; SolveReport counts them as node_steps. A system
///            that is not ComputesSome computes all columns each time: the same result without the saving. Each step also copies all positions.
/// Errors     InvalidArgument as a body is made with it, and in step(), for θ outside 0 … 1, a speed_bound not above 0, max_halvings outside 0 … 20.
/// Source     \cite baraff1998; going back to halve a step is as in \cite savcenco2007.
struct NodeSteps {
  double theta = 1;
  double speed_bound = std::numeric_limits<double>::infinity();   ///< m/s
  int max_halvings = 4;
  double tolerance = 1e-6;   ///< of each solve, relative
  int max_iterations = 100;   ///< of conjugate gradients in each solve
  int newton_iterations = 1;

  template <LinearisedSystem S>
  void step(S& system, typename S::Scalar h) const {
    validate();
    if (h == 0) return;
    std::vector<int> own;
    if constexpr (HasList<S>)
      Walk<S>(*this, system, h).run(system.list());
    else
      Walk<S>(*this, system, h).run(own);
  }

  void validate() const {
    if (!(theta >= 0 && theta <= 1)) throw InvalidArgument(detail::message("NodeSteps: theta is ", theta, "; give 0 to 1"));
    if (!(speed_bound > 0)) throw InvalidArgument(detail::message("NodeSteps: the speed bound is ", speed_bound, " m/s; give one above zero"));
    if (max_halvings < 0 || max_halvings > 20)
      throw InvalidArgument(detail::message("NodeSteps: steps are halved up to ", max_halvings, " times; give 0 to 20"));
    detail::require_solver("NodeSteps", tolerance, max_iterations, newton_iterations);
  }
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return ThetaScheme{.theta = theta}.stable_step(modes);
  }

 private:
  /// A step of h. Times are shares of it.
  template <class S>
  class Walk {
    using Scalar = typename S::Scalar;
    using Columns = decltype(padded_view(std::declval<S&>().positions()));
    using Some = std::span<int const>;

   public:
    Walk(NodeSteps const& rule, S& system, Scalar h) : rule_(rule), system_(system), h_(h), theta_(static_cast<Scalar>(rule.theta)) {}

    void run(std::vector<int>& list) {
      list.resize(static_cast<std::size_t>(x_.cols()));
      std::iota(list.begin(), list.end(), 0);
      system_.linearise();
      system_.tangent_diagonal(Scalar(1), Scalar(0), Scalar(0), mass_);
      direction_.setZero(), times_.setZero();
      advance(list, 0, 0, false);
      if constexpr (TakesSolveReport<S>) system_.take(report_);
    }

   private:
    /// These, all at time t, by a step of level l or halves of it. `knows`: their accelerations there.
    void advance(std::span<int> some, Scalar t, int l, bool knows) {
      std::sort(some.begin(), some.end());
      Scalar const share = std::ldexp(Scalar(1), -l);
      report_.node_steps += static_cast<long long>(some.size());
      for (int const i : some) x0_.col(i) = x_.col(i), v0_.col(i) = v_.col(i);
      if (!knows && theta_ < 1) {
        place_others(some, t, t);
        for (int const i : some) at_x_.col(i) = x_.col(i), at_v_.col(i) = v_.col(i);
        accelerate(some, a_);
      }
      place_others(some, t, t + share);
      solve(some, share * h_);
      auto const is_slow = [this, l, bound = static_cast<Scalar>(std::ldexp(rule_.speed_bound, l))](int i) {
        Scalar const most = level_(0, i) > Scalar(l) ? bound / 2 : bound;
        return l == rule_.max_halvings || !(std::max(v0_.col(i).squaredNorm(), v_.col(i).squaredNorm()) > most * most);
      };
      auto const fast = std::partition(some.begin(), some.end(), is_slow);
      for (int const i : std::span(some.begin(), fast)) times_(0, i) = t, times_(1, i) = t + share, level_.col(i).setZero(), level_(0, i) = Scalar(l);
      std::span<int> const again(fast, some.end());
      if (again.empty()) return;
      for (int const i : again) x_.col(i) = x0_.col(i), v_.col(i) = v0_.col(i);
      advance(again, t, l + 1, true);
      advance(again, t + share / 2, l + 1, false);
    }

    /// Those whose step ends after t, which are all but some: where they are at `when`.
    void place_others(Some some, Scalar t, Scalar when) {
      if (static_cast<Eigen::Index>(some.size()) == x_.cols()) return;
      for (Eigen::Index i = 0; i < x_.cols(); ++i) {
        if (!(times_(1, i) > t)) continue;
        Scalar const part = (when - times_(0, i)) / (times_(1, i) - times_(0, i));
        at_x_.col(i) = x0_.col(i) + part * (x_.col(i) - x0_.col(i));
        at_v_.col(i) = v0_.col(i) + part * (v_.col(i) - v0_.col(i));
      }
    }

    /// Takes some from x0, v0 to x, v; the others are where they will be then.
    void solve(Some some, Scalar h) {
      Scalar const damping = h * theta_, stiffness = damping * damping;
      Scalar const least = std::max(static_cast<Scalar>(rule_.tolerance), 4 * std::numeric_limits<Scalar>::epsilon());
      diagonal(some, damping, stiffness);
      for (int const i : some) change_.col(i).setZero();
      Scalar first = 0;
      int left = rule_.max_iterations;
      for (int k = 0; k < rule_.newton_iterations; ++k) {
        for (int const i : some) at_x_.col(i) = x0_.col(i) + h * v0_.col(i) + damping * change_.col(i), at_v_.col(i) = v0_.col(i) + change_.col(i);
        if (theta_ > 0) accelerate(some, product_);
        Scalar size = 0;
        for (int const i : some) {
          if (theta_ == 0) product_.col(i) = a_.col(i);
          if (theta_ > 0 && theta_ < 1) product_.col(i) = (1 - theta_) * a_.col(i) + theta_ * product_.col(i);
          residual_.col(i) = mass_.col(i).cwiseProduct(h * product_.col(i) - change_.col(i));
          size += residual_.col(i).cwiseProduct(residual_.col(i)).cwiseProduct(inverse_.col(i)).sum();
        }
        if (!std::isfinite(size)) {   // so that the body sees it
          for (int const i : some) change_.col(i) = h * product_.col(i);
          report_.converged = false;
          break;
        }
        first = std::max(first, size);
        Scalar const enough = rule_.tolerance > 0 ? least * least * first : Scalar(0);
        int const before = left;
        Scalar const reached = conjugate_gradients(some, damping, stiffness, enough, left);
        report_.iterations += before - left, ++report_.newton_iterations;
        report_.residual = std::max(report_.residual, first > 0 ? std::sqrt(reached / first) : Scalar(0));
        report_.converged = report_.converged && reached <= enough;
      }
      for (int const i : some) {
        x_.col(i) = x0_.col(i) + h * v0_.col(i) + damping * change_.col(i);
        v_.col(i) = v0_.col(i) + change_.col(i);
      }
    }

    /// On the residual of some, into their change; what is left of its squared norm.
    Scalar conjugate_gradients(Some some, Scalar damping, Scalar stiffness, Scalar enough, int& left) {
      Scalar size = 0;
      for (int const i : some) {
        direction_.col(i) = inverse_.col(i).cwiseProduct(residual_.col(i));
        size += direction_.col(i).cwiseProduct(residual_.col(i)).sum();
      }
      for (; left > 0 && size > enough; --left) {
        multiply(some, damping, stiffness);
        Scalar curvature = 0;
        for (int const i : some) curvature += direction_.col(i).cwiseProduct(product_.col(i)).sum();
        if (!(curvature > 0)) {
          ++report_.negative_curvatures;
          break;
        }
        Scalar const length = size / curvature, last = size;
        size = 0;
        for (int const i : some) {
          change_.col(i) += length * direction_.col(i);
          residual_.col(i) -= length * product_.col(i);
          product_.col(i) = inverse_.col(i).cwiseProduct(residual_.col(i));
          size += product_.col(i).cwiseProduct(residual_.col(i)).sum();
        }
        for (int const i : some) direction_.col(i) = product_.col(i) + size / last * direction_.col(i);
      }
      for (int const i : some) direction_.col(i).setZero();
      return size;
    }

    void accelerate(Some some, Columns& out) {
      if constexpr (ComputesSome<S>)
        system_.acceleration_of(some, at_x_, at_v_, out);
      else
        system_.acceleration(at_x_, at_v_, out);
    }
    void multiply(Some some, Scalar damping, Scalar stiffness) {
      if constexpr (ComputesSome<S>)
        system_.multiply_tangent_of(some, Scalar(1), damping, stiffness, direction_, product_);
      else
        system_.multiply_tangent(Scalar(1), damping, stiffness, direction_, product_);
    }
    void diagonal(Some some, Scalar damping, Scalar stiffness) {
      if constexpr (ComputesSome<S>)
        system_.tangent_diagonal_of(some, Scalar(1), damping, stiffness, inverse_);
      else
        system_.tangent_diagonal(Scalar(1), damping, stiffness, inverse_);
      for (int const i : some) inverse_.col(i) = (inverse_.col(i).array() > 0).select(inverse_.col(i).array().inverse(), Scalar(0)).matrix();
    }

    NodeSteps const& rule_;
    S& system_;
    Scalar h_, theta_;
    SolveReport<Scalar> report_;
    Columns x_ = padded_view(system_.positions()), v_ = padded_view(system_.velocities());
    Columns level_ = padded_view(system_.previous_acceleration());   // its first row
    Columns x0_ = scratch(0), v0_ = scratch(1);       // at the start of each one's own step
    Columns at_x_ = scratch(2), at_v_ = scratch(3);   // what forces are asked for at
    Columns a_ = scratch(4), change_ = scratch(5), residual_ = scratch(6), direction_ = scratch(7), product_ = scratch(8), inverse_ = scratch(9);
    Columns mass_ = scratch(10), times_ = scratch(11);   // start and end of each one's own step
    Columns scratch(int k) { return padded_view(system_.scratch(k)); }
  };
};

static_assert(ImplicitIntegrator<NodeSteps>);

}  // namespace palpate
