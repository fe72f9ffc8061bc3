// SPDX-License-Identifier: MIT
#pragma once

#include "catch.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

namespace palpate_test {

/// One of our numbers beside what it has to be: a closed form, or what was computed independently for the same mesh. Units in brackets in `what`.
struct Yardstick {
  std::string what, source;
  double expected, ours, within;   // what the difference has to be smaller than
  bool relative = false;           // ... as a part of what is expected
};

inline std::string text(double number, char const* format = "%.6g") {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, format, number);
  return buffer;
}

/// The larger of two, or the one that is not a number.
inline double worse(double a, double b) { return a > b || std::isnan(a) ? a : b; }

/// Checks a number; where PALPATE_YARDSTICKS names a file, the number's row of the table in docs/solids.md goes to its end.
inline void check_yardstick(Yardstick const& it) {
  double const difference = (it.ours - it.expected) / (it.relative ? std::abs(it.expected) : 1.0);
  INFO(it.what << " is " << it.ours << ", expected " << it.expected);
  CHECK(std::abs(difference) < it.within);
  char const* const path = std::getenv("PALPATE_YARDSTICKS");
  if (path == nullptr) return;
  std::ofstream file(path, std::ios::app | std::ios::ate);
  if (file.tellp() == 0) file << "| what | source | expected | ours | difference | allowed |\n|---|---|---|---|---|---|\n";
  auto const part = [&](double number) { return it.relative ? text(100 * number, "%.2g %%") : text(number, "%.2g"); };
  file << "| " << it.what << " | " << it.source << " | " << text(it.expected) << " | "
       << text(it.ours, it.expected == 0 ? "%.2g" : "%.6g") << " | " << part(difference) << " | " << part(it.within) << " |\n";
}

}  // namespace palpate_test
