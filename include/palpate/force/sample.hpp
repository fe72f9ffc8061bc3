// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <array>

namespace palpate {

/// One measured pair, in the caller's units.
template <RealScalar S, int In, int Out>
struct Sample {
  std::array<S, In> input{};
  std::array<S, Out> output{};
};

}  // namespace palpate
