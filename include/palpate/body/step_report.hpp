// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

namespace palpate {

enum class StepStatus {
  ok,
  above_stable_step,   ///< the step was taken; it is longer than stable_step()
  diverged,            ///< the step was not taken: the result was not finite or left all bounds
};

/// What a step did.
template <RealScalar Scalar>
struct StepReport {
  StepStatus status = StepStatus::ok;
  int moving = 0;              ///< particles computed
  int particle = -1;           ///< the first that diverged, or −1
  Scalar stable_step = 0;      ///< s, as last found by stable_step()
  explicit operator bool() const noexcept { return status != StepStatus::diverged; }
};

}  // namespace palpate
