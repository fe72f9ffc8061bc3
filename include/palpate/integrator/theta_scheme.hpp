// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/conjugate_gradients.hpp>
#include <palpate/integrator/solve_report.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

template <class System>
class MotionForecast;

/// The θ-scheme: forces and velocities of a step are weighted means of its start and its end, θ the weight of the end.
///   M Δv = h ((1 − θ) f(x, v) + θ f(x⁺, v + Δv)),   x⁺ = x + h (v + θ Δv),   v⁺ = v + Δv
/// Newton's method with the tangent at x. Its first iteration is the linearised step of Baraff and Witkin,
///   (M + hθ C + h²θ² K) Δv = h f(x, v) − h²θ K v,
/// and further ones keep the tangent (modified Newton). Each is solved by matrix-free conjugate gradients with a diagonal preconditioner;
/// the first guess is the acceleration of the last step, by the factor at which it is best.
/// Line search where the system knows its potential W (HasPotential): a step never raises the incremental potential
///   Π(Δv) = ½ ΔvᵀMΔv − (1 − θ) h f(x, v)ᵀΔv + W(x⁺) + hθ/2 (v + Δv)ᵀC(v + Δv)
/// above its value at x⁺ = x; the way of each Newton iteration is halved until it does not, at most `halvings` times and then left out. So it is with
/// energies that are no numbers.
/// θ = 1 is BackwardEuler, θ = ½ CrankNicolson, θ = 0 explicit Euler.
/// Order      1; 2 for θ = ½, with two Newton iterations: K is made positive semidefinite and leaves out the rotation of dampers, so one
///            iteration alone is of first order.
/// Stability  θ ≥ ½: any step of the linearised body, stable_step() is infinite. θ < ½: h ≤ γ/(κ (1 − 2θ)) and hγ ≤ 2/(1 − 2θ).
///            The tangent is that of the start, so a step that moves particles by a large part of an edge overshoots, and near θ = ½ fast
///            modes ring instead of decaying. Measured on a stiff, lightly damped sheet under a sudden force: θ = 1 and 0.6 come to rest
///            at 100 times the explicit limit, θ = ½ at 10 times; at 30 times it does not stay bounded.
/// Budget     a step takes at most `max_iterations` of conjugate gradients, all Newton iterations together. When they are spent the step
///            is taken with the result so far: slow and soft motion has converged, stiff motion has not.
/// Precision  a body of doubles that has its tangent in float too iterates in that, corrected in double: see HasFloatTangentProduct.
/// Units      `tolerance` is relative: |residual| ≤ tolerance · |right-hand side|, both in the norm of the inverse diagonal; so is the
///            error of momentum. It is bounded below by rounding.
/// Source     \cite baraff1998.
/// Cost       a step: one evaluation of the forces for each Newton iteration, one tangent, and one product with it for each iteration of
///            conjugate gradients and two more, in float one more after each three digits. Nothing is allocated after the first step.
struct ThetaScheme {
  double theta = 1;
  double tolerance = 1e-6;
  int max_iterations = 100;
  int newton_iterations = 1;
  int halvings = 12;   ///< of the way of a Newton iteration; with 0 there is no line search

  template <LinearisedSystem S>
  void step(S& system, typename S::Scalar h) const {
    using Scalar = typename S::Scalar;
    validate();
    if (h == 0) return;
    Scalar const share = static_cast<Scalar>(theta), damping = h * share, stiffness = damping * damping;
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& memory = padded_view(system.previous_acceleration());
    auto&& change = padded_view(system.scratch(change_at));   // Δv
    auto&& residual = padded_view(system.scratch(residual_at));
    auto&& inverse = padded_view(system.scratch(inverse_at));
    auto&& product = padded_view(system.scratch(product_at));
    auto&& a = padded_view(system.scratch(acceleration_at));
    auto const norm = [&](auto const& r) { return r.cwiseProduct(r).cwiseProduct(inverse).sum(); };

    begin(system, h);
    Scalar size = norm(residual);
    change.setZero();
    if (!std::isfinite(size)) {
      change = h * a;   // so that the body sees it
    } else if (size > 0 && system.remembers()) {
      change = h * memory;
      system.multiply_tangent(Scalar(1), damping, stiffness, change, product);
      Scalar const curvature = change.cwiseProduct(product).sum(), best = residual.cwiseProduct(change).sum() / curvature;
      if (curvature > 0 && std::isfinite(best)) {
        change *= best;
        residual -= best * product;
      } else {
        change.setZero();
      }
    }
    Scalar const least = std::max(static_cast<Scalar>(tolerance), 4 * std::numeric_limits<Scalar>::epsilon());
    SolveReport<Scalar> report;
    report.converged = size == 0, report.residual = report.converged ? Scalar(0) : Scalar(1);   // without a budget
    int left = std::isfinite(size) ? max_iterations : 0;
    [[maybe_unused]] bool const searches = HasPotential<S> && halvings > 0 && share > 0;
    [[maybe_unused]] Scalar potential = 0, fallen = 0;   // W, and how far Π has fallen from its value at x⁺ = x
    if constexpr (HasPotential<S>)
      if (searches) potential = system.potential(x);
    for (int k = 0; k < newton_iterations && left > 0; ++k) {
      if constexpr (HasPotential<S>) {
        auto&& from = padded_view(system.scratch(from_at));
        if (k == 0)
          from.setZero();   // x⁺ = x
        else
          from = v + share * change;
      }
      if (k > 0) {
        auto&& later_x = padded_view(system.scratch(6));
        auto&& later_v = padded_view(system.scratch(7));
        later_x = x + h * v + damping * change;
        later_v = v + change;
        system.acceleration(later_x, later_v, product);
        product = h * ((1 - share) * a + share * product) - change;
        system.multiply_tangent(Scalar(1), Scalar(0), Scalar(0), product, residual);
        size = std::max(size, norm(residual));
      }
      Scalar const enough = tolerance > 0 ? least * least * size : Scalar(0);
      Scalar const reached = solve(system, damping, stiffness, enough, left, report);
      report.residual = size > 0 ? std::sqrt(reached / size) : Scalar(0);
      report.converged = reached <= enough;
      ++report.newton_iterations;
      if constexpr (HasPotential<S>)
        if (searches && !search(system, h, a, potential, fallen, report)) break;
    }
    report.iterations = max_iterations - left;
    if constexpr (TakesSolveReport<S>) system.take(report);
    memory = change / h;
    x += h * v + damping * change;
    v += change;
  }

  void validate() const {
    if (!(theta >= 0 && theta <= 1)) throw InvalidArgument(detail::message("ThetaScheme: theta is ", theta, "; give 0 to 1"));
    detail::require_solver("ThetaScheme", tolerance, max_iterations, newton_iterations, halvings);
  }
  double end_weight() const noexcept { return theta; }
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    Scalar const explicit_share = static_cast<Scalar>(1 - 2 * theta);
    constexpr Scalar any = std::numeric_limits<Scalar>::infinity();
    if (!(explicit_share > 0)) return any;
    Scalar const slow = modes.squared_frequency > 0 ? modes.min_decay_rate / (modes.squared_frequency * explicit_share) : any;
    Scalar const fast = modes.decay_rate > 0 ? 2 / (modes.decay_rate * explicit_share) : any;
    return std::min(slow, fast);
  }

 private:
  template <class System>
  friend class MotionForecast;
  static constexpr int change_at = 0, residual_at = 1, inverse_at = 2, product_at = 3, direction_at = 4, acceleration_at = 5, scaled_at = 8, from_at = 9, still_at = 10;

  /// What a step of h seconds begins with, in scratch(…_at): the acceleration at x, the inverse of the diagonal of A = M + hθ C + h²θ² K, and the residual
  /// h f(x, v) − h²θ K v of no change.
  template <LinearisedSystem S>
  void begin(S& system, typename S::Scalar h) const {
    using Scalar = typename S::Scalar;
    Scalar const damping = h * static_cast<Scalar>(theta);
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& residual = padded_view(system.scratch(residual_at));
    auto&& inverse = padded_view(system.scratch(inverse_at));
    auto&& product = padded_view(system.scratch(product_at));
    auto&& a = padded_view(system.scratch(acceleration_at));
    Scalar damped = 0;   // s, for which damping at v is not yet in a: where θ = 1 nothing else asks for a
    if constexpr (DampedByTangent<S>)
      if (theta == 1) damped = h;
    if (damped > 0) {
      auto&& still = padded_view(system.scratch(still_at));
      still.setZero();
      system.acceleration(x, still, a);
    } else {
      system.acceleration(x, v, a);
    }
    system.linearise();
    system.tangent_diagonal(Scalar(1), damping, damping * damping, inverse);
    inverse = (inverse.array() > 0).select(inverse.array().inverse(), Scalar(0)).matrix();
    system.multiply_tangent(h, Scalar(0), Scalar(0), a, residual);
    system.multiply_tangent(Scalar(0), damped, h * damping, v, product);
    residual -= product;
  }

  /// Halves the way that an iteration took the change, from the mean velocity in scratch(from_at), until the incremental potential is not above that
  /// there; with damping not above that at x⁺ = x, from where it has `fallen` to there: Π has the damping of the start, and further iterations come to where its least is not quite.
  /// W there is `potential`, and then where it went to. `a` is the acceleration at the start. False: no part of it is better.
  template <class S, class Columns, class Scalar = typename S::Scalar>
  bool search(S& system, Scalar h, Columns const& a, Scalar& potential, Scalar& fallen, SolveReport<Scalar>& report) const {
    auto&& x = padded_view(system.positions());
    auto&& v = padded_view(system.velocities());
    auto&& change = padded_view(system.scratch(change_at));
    auto&& product = padded_view(system.scratch(product_at));
    auto&& from = padded_view(system.scratch(from_at));
    auto&& way = padded_view(system.scratch(6));   // of q = v + θ Δv
    auto&& place = padded_view(system.scratch(7));
    Scalar const share = static_cast<Scalar>(theta), rest = 1 - share;
    way = v + share * change - from;
    system.multiply_tangent(Scalar(1), Scalar(0), Scalar(0), way, product);   // Π of q + s · way is a square in s, but for W
    Scalar square = way.cwiseProduct(product).sum() / (2 * share * share), line = (from - v).cwiseProduct(product).sum() / (share * share);
    line -= rest * h / share * a.cwiseProduct(product).sum();
    system.multiply_tangent(Scalar(0), Scalar(1), Scalar(0), way, product);
    Scalar const damped = way.cwiseProduct(product).sum();
    square += h / (2 * share) * damped, line += h / share * (from - rest * v).cwiseProduct(product).sum();
    Scalar const most = potential + (damped > 0 ? fallen : Scalar(0)) + system.potential_rounding() + 4 * std::numeric_limits<Scalar>::epsilon() * std::abs(potential);
    Scalar factor = 1;
    for (int halved = 0;; ++halved, factor /= 2) {
      place = x + h * from + (h * factor) * way;
      Scalar const there = system.potential(place);
      if (Scalar const here = there + factor * (factor * square + line); here <= most) {
        Scalar const fell = potential - here;   // from an energy that was no number to one that is: the bound is that of there
        fallen = std::isfinite(fell) ? fallen + fell : Scalar(0);
        potential = there;
        break;
      }
      if (halved == halvings) {
        factor = 0;
        break;
      }
      ++report.halvings;
    }
    if (factor < 1) change = (from + factor * way - v) / share;
    return factor > 0;
  }

  /// Conjugate gradients on the residual, into the change, until its squared norm is not above `enough` or none are `left`; that norm.
  template <class S, class Scalar = typename S::Scalar>
  static Scalar solve(S& system, Scalar damping, Scalar stiffness, Scalar enough, int& left, SolveReport<Scalar>& report) {
    auto&& change = padded_view(system.scratch(change_at));
    auto&& residual = padded_view(system.scratch(residual_at));
    auto&& inverse = padded_view(system.scratch(inverse_at));
    auto&& product = padded_view(system.scratch(product_at));
    auto&& direction = padded_view(system.scratch(direction_at));
    auto&& scaled = padded_view(system.scratch(scaled_at));
    return detail::conjugate_gradients<S>(system, [&](auto const& d, auto& out) { system.multiply_tangent(Scalar(1), damping, stiffness, d, out); },
                                               detail::GradientColumns{inverse, change, residual, direction, product, scaled}, enough, left, report.negative_curvatures);
  }
};

}  // namespace palpate
