// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// How SoftBody::advance may split a duration.
struct Substeps {
  int most = 100;   ///< steps, at least 1
};

/// Equal steps that make up a duration, or as much of it as is allowed.
template <RealScalar Scalar>
struct EqualSteps {
  int count = 1;
  Scalar each = 0;        ///< s
  bool capped = false;    ///< more steps were wanted than allowed
  int wanted = 1;         ///< 1e9 where no step is stable
};

/// The fewest equal steps not above the stable one; a hair above counts as not above. Where that is more than `most`, `most` steps: stable
/// ones, which leave a rest of the duration, or the duration's equal parts where no step is stable.
template <RealScalar Scalar>
EqualSteps<Scalar> split_duration(Scalar duration, Scalar stable_step, int most) noexcept {
  constexpr Scalar limit = Scalar(1e9);
  Scalar const least = stable_step > 0 ? std::ceil(duration / stable_step * (1 - Scalar(1e-6))) : limit;
  EqualSteps<Scalar> steps;
  steps.wanted = std::max(1, static_cast<int>(std::min(limit, least)));
  steps.count = std::min(steps.wanted, most);
  steps.each = duration / Scalar(steps.count);
  steps.capped = steps.wanted > most;
  if (steps.capped && stable_step > 0) steps.each = std::min(steps.each, stable_step);
  return steps;
}

}  // namespace palpate
