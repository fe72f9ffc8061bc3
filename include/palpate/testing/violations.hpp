// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <string>
#include <vector>

namespace palpate::testing {

/// What a law battery found: one sentence for each law that is broken, with the values to repeat it. Empty: all laws hold.
/// No test framework is needed; with one, write `CHECK(check_spring_law(my_law, 0.01).empty())`, or compare `to_text` with "".
using Violations = std::vector<std::string>;

/// All violations, one a line.
inline std::string to_text(Violations const& violations) {
  std::string text;
  for (std::string const& violation : violations) text += violation + "\n";
  return text;
}

}  // namespace palpate::testing
