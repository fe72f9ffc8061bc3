// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <cstdio>
#include <exception>

/// What `run` returns, or the exit code of its failure, which is told in one line on standard error: 2 for what the library refuses, 1 for anything else.
template <class Run>
int exit_code_of(char const* program, Run const& run) {
  try {
    return run();
  } catch (palpate::Error const& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 2;
  } catch (std::exception const& error) {
    std::fprintf(stderr, "%s: stopped: %s\n", program, error.what());
    return 1;
  }
}
