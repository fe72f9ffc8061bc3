// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/integrator/solve_report.hpp>

#include <concepts>

namespace palpate {

enum class StepStatus {
  ok,
  above_stable_step,   ///< the step was taken; it is longer than stable_step()
  behind,              ///< advance() took as many stable steps as allowed, which is less than the duration asked for
  diverged,            ///< the step was not taken: the result was not finite or left all bounds
};

/// What a step did.
template <RealScalar Scalar>
struct StepReport {
  StepStatus status = StepStatus::ok;
  int moving = 0;              ///< particles computed
  int steps = 1;               ///< taken by advance(); one that diverged counts
  int particle = -1;           ///< the first that diverged, or −1
  Scalar value = 0;            ///< what it came to: its first coordinate [m] or velocity [m/s] that is not finite or out of bounds
  int element = -1;            ///< of a solid: inverted, the one that is flat or turned over most after the step; after divergence the one nearest to it before.
                               ///< Explicit steps look at a 32nd of the elements each, in turn
  Scalar determinant = 1;      ///< its det F
  SolveReport<Scalar> solve{};   ///< of an implicit integrator, the last step's
  Scalar stable_step = 0;      ///< s, as last found by stable_step(); after divergence what is stable at the state that was kept
  explicit operator bool() const noexcept { return status != StepStatus::diverged; }
};

/// A body's report that says which element is inverted, as StepReport does: a simulator counts it.
template <class Report>
concept TellsInvertedElements = requires(Report const& report) {
  { report.element } -> std::convertible_to<int>;
  { report.determinant } -> std::convertible_to<double>;
};

}  // namespace palpate
