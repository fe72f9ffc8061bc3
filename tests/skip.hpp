// SPDX-License-Identifier: MIT
#pragma once

#include "catch.hpp"

#include <string>

namespace palpate_test {

/// Notes that a case ended without its checks, and why; whoever counts on them (CI=true in the environment) gets a failure instead: false there.
/// A program that passes in the rest then returns `skip_code`, which ctest shows as Skipped.
bool may_skip(std::string const& reason);
int skipped();
constexpr int skip_code = 77;

}  // namespace palpate_test

/// Ends the case for what this machine lacks. SKIP of Catch2 3 has no equivalent in 2.13, and neither fails where CI is set.
#define PALPATE_SKIP(reason)                                                                         \
  do {                                                                                               \
    std::string const palpate_reason = (reason);                                                     \
    if (!palpate_test::may_skip(palpate_reason)) FAIL("must not be skipped in CI: " << palpate_reason); \
    return;                                                                                          \
  } while (false)
