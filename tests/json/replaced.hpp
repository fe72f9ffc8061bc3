// SPDX-License-Identifier: MIT
#pragma once

#include "catch.hpp"

#include <string>

/// A text with one part of it exchanged, which has to be there.
inline std::string replaced(std::string text, std::string const& what, std::string const& by) {
  auto const at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}
