// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <string_view>

namespace palpate {

/// Metres in one unit of length: "m", "cm", "mm". The library computes in SI units; files are converted here, at the border:
///   length [m] = length [unit] · metres_per(unit)
/// Throws `InvalidArgument` for any other text.
constexpr double metres_per(std::string_view unit) {
  if (unit == "m") return 1.0;
  if (unit == "cm") return 1e-2;
  if (unit == "mm") return 1e-3;
  throw InvalidArgument(detail::message("unknown unit of length \"", unit, "\"; write m, cm or mm"));
}

}  // namespace palpate
