// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/integrator/concept.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace detail {

/// Dormand and Prince's coefficients, and their squares: a stage's velocity is V_i = v + h Σ_j a_ij A_j, so its position is
/// X_i = x + h c_i v + h² Σ_l ā_il A_l with ā = a·a. Stage 7 is the step's end.
struct DormandPrinceTableau {
  static constexpr int stages = 7;

  double a[stages][stages] = {{},
                              {1.0 / 5},
                              {3.0 / 40, 9.0 / 40},
                              {44.0 / 45, -56.0 / 15, 32.0 / 9},
                              {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                              {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                              {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
  double c[stages] = {0.0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1.0, 1.0};
  /// Fifth order less fourth: the error of the velocity is h Σ e_j A_j, that of the position h² Σ ē_l A_l with ē = e·a.
  double e[stages] = {71.0 / 57600, 0.0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
  double squared_a[stages][stages] = {};
  double squared_e[stages] = {};

  constexpr DormandPrinceTableau() {
    for (int l = 0; l < stages; ++l)
      for (int j = 0; j < stages; ++j) {
        squared_e[l] += e[j] * a[j][l];
        for (int i = 0; i < stages; ++i) squared_a[i][l] += a[i][j] * a[j][l];
      }
  }
};

inline constexpr DormandPrinceTableau dormand_prince{};

}  // namespace detail

/// Dormand and Prince's embedded pair of orders 5 and 4 with step-size control: a step of h is covered exactly, by as many inner steps as
/// the tolerances ask for. The library's own reference for trajectories.
/// In an inner step of τ no particle's error of position, nor τ times its error of velocity, exceeds
///   absolute + relative · τ · (largest speed) + 16 ε · (largest coordinate)   [m],
/// the last term because of rounding. Errors of inner steps add up: relative 1e-9 gives some eight digits of a path.
/// Order      5. Six evaluations of the forces an inner step, and one at the start of each step.
/// Stability  any step: inner steps shrink to what is stable; stable_step() is infinite.
/// Source     \cite dormand1980.
/// Limits     where the inner step falls below 1e-10 of h (float: 1e-5), or more than `max_inner_steps` are needed, it gives up: the
///            particle with the largest error gets a position that is not a number, so the body reports divergence and keeps its last
///            state. Each step tries an inner step of h first: nothing is remembered between steps.
struct DormandPrince {
  double relative = 1e-6;
  double absolute = 1e-12;   // m
  int max_inner_steps = 1000000;

  void validate() const {
    if (!(relative >= 0 && absolute >= 0) || max_inner_steps < 1)
      throw InvalidArgument(detail::message("DormandPrince: the tolerances are ", relative, " and ", absolute, " m, the inner steps ", max_inner_steps,
                                            " at most; give zero or more, and 1 step or more"));
  }
  template <System S>
  void step(S& system, typename S::Scalar h) const {
    validate();
    using Scalar = typename S::Scalar;
    constexpr auto const& table = detail::dormand_prince;
    constexpr double min_share = std::same_as<Scalar, float> ? 1e-5 : 1e-10;
    if (h == 0) return;
    auto&& x = padded_view(system.scratch(7));   // at the start of the inner step; scratch 0 … 6 are the stages' accelerations
    auto&& v = padded_view(system.scratch(8));
    auto&& change_x = padded_view(system.scratch(9));
    auto&& change_v = padded_view(system.scratch(10));
    auto&& first_a = padded_view(system.scratch(0));
    x = padded_view(system.positions());
    v = padded_view(system.velocities());
    system.acceleration(x, v, first_a);
    Scalar const digits = 16 * std::numeric_limits<Scalar>::epsilon() * largest(x);
    double done = 0, share = 1;   // of h
    for (int tries = 1; done < 1; ++tries) {
      if (done + 1.01 * share >= 1) share = 1 - done;
      Scalar const t = static_cast<Scalar>(share) * h;
      for (int i = 1; i < table.stages; ++i) {
        change_x = static_cast<Scalar>(table.c[i]) * t * v;
        change_v.setZero();
        add(system, table.squared_a[i], i, t * t, change_x);
        add(system, table.a[i], i, t, change_v);
        padded_view(system.positions()) = x + change_x;
        padded_view(system.velocities()) = v + change_v;
        auto&& a = padded_view(system.scratch(i));
        system.acceleration(padded_view(system.positions()), padded_view(system.velocities()), a);
      }
      change_x.setZero();   // from here on the errors
      change_v.setZero();
      add(system, table.squared_e, table.stages, t * t, change_x);
      add(system, table.e, table.stages, t, change_v);
      Scalar const speed = std::max(largest(v), largest(padded_view(system.velocities())));
      Scalar const allowed = static_cast<Scalar>(absolute) + static_cast<Scalar>(relative) * std::abs(t) * speed + digits;
      Scalar const found = std::max(largest(change_x), std::abs(t) * largest(change_v));
      double const excess = allowed > 0 ? static_cast<double>(found / allowed) : static_cast<double>(found) > 0 ? 1e9 : 0.0;
      bool const accepted = excess <= 1 && std::isfinite(speed);
      if (accepted) {
        done = share == 1 - done ? 1.0 : done + share;
        x = padded_view(system.positions());
        v = padded_view(system.velocities());
        first_a = padded_view(system.scratch(table.stages - 1));
      }
      double const factor = std::isfinite(excess) && std::isfinite(speed) ? 0.9 * std::pow(std::max(excess, 1e-9), -0.2) : 0.1;
      share *= std::clamp(factor, 0.1, accepted ? 5.0 : 0.9);
      if (done < 1 && (!(share > min_share) || tries >= max_inner_steps)) {
        Eigen::Index worst = 0;
        for (Eigen::Index i = 1; i < x.cols(); ++i)
          if (!(largest(change_x.col(i)) <= largest(change_x.col(worst)))) worst = i;
        padded_view(system.positions()) = x;
        padded_view(system.velocities()) = v;
        system.positions().col(worst).setConstant(std::numeric_limits<Scalar>::quiet_NaN());
        return;
      }
    }
  }

  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const&) const {
    return std::numeric_limits<Scalar>::infinity();
  }

 private:
  /// sum += factor Σ_j weights[j] A_j
  template <class S, class Columns, class Scalar = typename S::Scalar>
  static void add(S& system, double const (&weights)[detail::DormandPrinceTableau::stages], int stages, Scalar factor, Columns& sum) {
    for (int j = 0; j < stages; ++j)
      if (weights[j] != 0) sum += static_cast<Scalar>(weights[j]) * factor * padded_view(system.scratch(j));
  }

  /// The largest absolute value; a value that is not a number makes it infinite.
  template <class Columns>
  static auto largest(Columns const& columns) {
    using Scalar = typename Columns::Scalar;
    if (columns.size() == 0) return Scalar(0);
    Scalar const value = columns.cwiseAbs().maxCoeff();
    return is_finite(columns) ? value : std::numeric_limits<Scalar>::infinity();
  }
};

}  // namespace palpate
