// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/phase.hpp>
#include <palpate/device/detail/csv_table.hpp>
#include <palpate/simulator/tick.hpp>

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

namespace palpate::detail {

/// The shortest text that reads back to the same double, with a decimal point in every locale.
inline void append_number(std::string& text, double value) {
  if (std::isnan(value)) {   // one spelling: the sign of a NaN differs between machines
    text += "nan";
    return;
  }
#if defined(__cpp_lib_to_chars)
  std::array<char, 32> buffer;
  auto const result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  text.append(buffer.data(), result.ptr);
#else
  for (int digits = 1; digits <= std::numeric_limits<double>::max_digits10; ++digits) {
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    stream.precision(digits);
    stream << value;
    if (digits == std::numeric_limits<double>::max_digits10 || to_number<double>(stream.str()) == value) {
      text += stream.str();
      return;
    }
  }
#endif
}

inline constexpr std::size_t tick_columns = 10;
inline constexpr std::array<std::string_view, tick_columns> tick_names = {"time_s", "tip_x_m",   "tip_y_m",   "tip_z_m",  "depth_m",
                                                                          "phase",  "force_x_N", "force_y_N", "force_z_N", "energy_J"};

/// One row, without the end of the line.
inline void append_tick(std::string& text, Tick const& tick) {
  append_number(text, tick.time);
  for (double const coordinate : tick.tip) append_number(text += ',', coordinate);
  append_number(text += ',', tick.depth);
  (text += ',') += to_string(tick.phase);
  for (double const component : tick.force) append_number(text += ',', component);
  append_number(text += ',', tick.energy);
}

inline std::optional<CuttingPhase> phase_from(std::string_view text) noexcept {
  for (CuttingPhase const phase : {CuttingPhase::no_contact, CuttingPhase::indenting, CuttingPhase::moving})
    if (text == to_string(phase)) return phase;
  return std::nullopt;
}

/// The tick in the first columns of a row, which has at least as many; throws with the line for what is none.
inline Tick tick_from(CsvTable const& table, CsvTable::Row const& row) {
  auto const number = [&](std::size_t column) { return table.number(row, column, tick_names[column]); };
  auto const phase = phase_from(row[5]);
  if (!phase)
    table.fail_here(message("phase \"", row[5], "\" is unknown; it is \"", to_string(CuttingPhase::no_contact), "\", \"",
                            to_string(CuttingPhase::indenting), "\" or \"", to_string(CuttingPhase::moving), "\""));
  return {
      .time = number(0), .tip = {number(1), number(2), number(3)}, .depth = number(4), .phase = *phase, .force = {number(6), number(7), number(8)}, .energy = number(9)};
}

inline std::string joined(CsvTable::Row const& row) {
  std::string text;
  for (std::string_view const cell : row) {
    if (!text.empty()) text += ',';
    text += cell;
  }
  return text;
}

}  // namespace palpate::detail
