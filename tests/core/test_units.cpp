// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/core/units.hpp>

#include <string>

using palpate::metres_per;
using palpate::organ_extent;
using palpate::unlikely_length;
using palpate::tool_depth;

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
      CHECK_THAT(error.what(), says("\"" + unit + "\"", "m, cm or mm"));
    }
  }
}

// Yardstick: by hand, from the prefixes: 208 mm is a liver, 208 cm is nobody's; 20.8 may be either.
TEST_CASE("a length that is none in its unit is explained by those in which it is one", "[core][units]") {
  CHECK(unlikely_length(208.0, "m", organ_extent) == "208 m, outside 0.001 … 2 m; in mm it would be 0.208 m");
  CHECK(unlikely_length(208.4375, "cm", organ_extent) == "2.08 m, outside 0.001 … 2 m; in mm it would be 0.208 m");
  CHECK(unlikely_length(20.8, "m", organ_extent) == "20.8 m, outside 0.001 … 2 m; in cm it would be 0.208 m, in mm it would be 0.0208 m");
  CHECK(unlikely_length(0.208, "mm", organ_extent) == "0.000208 m, outside 0.001 … 2 m; in m it would be 0.208 m, in cm it would be 0.00208 m");
  CHECK(unlikely_length(6.0, "m", tool_depth) == "6 m, outside 0 … 0.3 m; in cm it would be 0.06 m, in mm it would be 0.006 m");
  CHECK(unlikely_length(1e9, "m", organ_extent) == "1e+09 m, outside 0.001 … 2 m");
}
