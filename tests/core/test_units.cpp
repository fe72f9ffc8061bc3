// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/core/units.hpp>

#include <string>

using palpate::metres_per;

// Yardstick: the definition of the metric prefixes.
TEST_CASE("metres per unit of length", "[core][units]") {
  STATIC_REQUIRE(metres_per("m") == 1.0);
  STATIC_REQUIRE(metres_per("cm") == 0.01);
  STATIC_REQUIRE(metres_per("mm") == 0.001);
}

TEST_CASE("an unknown unit is named, with the choices", "[core][units]") {
  for (std::string const unit : {"inch", "", "M", "m ", "µm"}) {
    try {
      (void)metres_per(unit);
      FAIL("accepted \"" << unit << '"');
    } catch (palpate::InvalidArgument const& error) {
      CHECK(std::string(error.what()) == "unknown unit of length \"" + unit + "\"; write m, cm or mm");
    }
  }
}
