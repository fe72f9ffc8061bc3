// SPDX-License-Identifier: MIT
// Numbers below the normal range within the scope and after it. Yardstick: IEEE 754, by std::fpclassify.
#include <palpate/core/flush_denormals.hpp>

#include "catch.hpp"

#include <cmath>
#include <limits>

using namespace palpate;

namespace {

/// The least normal number halved, computed now.
template <class S>
S half_of_least() {
  S volatile least = std::numeric_limits<S>::min();
  S volatile half = least / 2;
  return half;
}
template <class S>
S least_times(S factor) {
  S volatile least = std::numeric_limits<S>::min(), by = factor;
  return least * by;
}

}  // namespace

#if defined(__SSE2__) || defined(__aarch64__)
TEMPLATE_TEST_CASE("results below the normal range are zero in the scope, and denormal numbers again after it", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(std::fpclassify(half_of_least<S>()) == FP_SUBNORMAL);
  {
    FlushDenormals const flush;
    CHECK(flush.active());
    CHECK(half_of_least<S>() == 0);
    CHECK(least_times<S>(S(1.5)) > 0);   // normal numbers stay
    {
      FlushDenormals const again;
      CHECK(half_of_least<S>() == 0);
    }
    CHECK(half_of_least<S>() == 0);
  }
  CHECK(std::fpclassify(half_of_least<S>()) == FP_SUBNORMAL);
}
#endif
