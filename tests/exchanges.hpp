// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace palpate_test {

/// How many values are handed from thread to thread in each test of that: PALPATE_EXCHANGES, else as many as take a fraction of a second.
///   PALPATE_EXCHANGES=100000000 test_core '[exchanges]'   under the preset tsan, also test_simulator: an hour or so
inline std::uint64_t exchanges(std::uint64_t otherwise) {
  char const* const asked = std::getenv("PALPATE_EXCHANGES");
  return asked != nullptr ? std::stoull(asked) : otherwise;
}

/// After so many values a writer lets the other threads run, so that they take turns on one core too; a thousand times in all, as a turn can
/// last for milliseconds.
inline std::uint64_t pause_of(std::uint64_t exchanged) { return std::max<std::uint64_t>(64, exchanged / 1000); }

}  // namespace palpate_test
