// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <cstdio>
#include <optional>
#include <string>
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

/// From the least to the largest length [m] that input can sensibly have.
struct LengthRange {
  double low, high;

  constexpr bool contains(double metres) const noexcept { return low <= metres && metres <= high; }
};

/// Diagonal of an organ's bounding box: from an insect's to a person's.
inline constexpr LengthRange organ_extent{0.001, 2.0};
/// Longest side of what is in a file whose unit nobody stated: more is no tissue, but a file in another unit. What is small has no other unit to be in.
inline constexpr LengthRange unstated_extent{0.0, 12.0};
/// Depth of a tool below the surface: up to a long needle's.
inline constexpr LengthRange tool_depth{0.0, 0.3};
/// Of a tool's parts, and of a ball at one's end.
inline constexpr LengthRange tool_length{0.0, 2.0}, tool_radius{0.0, 0.2};
/// How deep a tool may have to press before it cuts; one that shall not cut may have the largest.
inline constexpr LengthRange puncture_depth_range{0.0, 1.0};

/// For the message that refuses `number` [unit], a length outside `range`: "208 m, outside 0.001 … 2 m; in mm it would be 0.208 m", with every unit
/// in which it would be within.
inline std::string unlikely_length(double number, std::string_view unit, LengthRange range) {
  auto const metres = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return std::string(text) + " m";
  };
  std::string text = detail::message(metres(number * metres_per(unit)), ", outside ", range.low, " … ", metres(range.high));
  char const* separator = "; in ";
  for (std::string_view const other : {"m", "cm", "mm"}) {
    double const length = number * metres_per(other);
    if (other == unit || !range.contains(length)) continue;
    text += detail::message(separator, other, " it would be ", metres(length));
    separator = ", in ";
  }
  return text;
}

/// Throws InvalidArgument for a length [m] outside `range`.
inline void require_length(std::string_view what, double metres, LengthRange range) {
  if (!range.contains(metres)) throw InvalidArgument(detail::message(what, " is ", unlikely_length(metres, "m", range), "; give it in m"));
}

namespace detail {

/// Metres per unit of a file: as stated, else 1.
inline double stated_or_metres(std::optional<double> metres_per_unit) {
  double const metres = metres_per_unit.value_or(1.0);
  require_positive("metres per unit", metres, "m");
  return metres;
}

/// Throws `FileError` where nobody stated the unit and the longest side [m] says that it is another one.
inline void require_stated_unit(std::string const& name, double longest_side, std::optional<double> metres_per_unit) {
  if (metres_per_unit || unstated_extent.contains(longest_side)) return;
  throw FileError(message(name, ": read in metres, the longest side would be ", unlikely_length(longest_side, "m", unstated_extent),
                          "; say what the file is written in with metres_per_unit, as metres_per(\"mm\")"));
}

}  // namespace detail

}  // namespace palpate
