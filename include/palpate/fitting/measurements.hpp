// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/units.hpp>
#include <palpate/device/detail/csv_table.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace palpate {

/// What the tool did when a force was measured.
enum class MeasuredPhase {
  indenting,   ///< went deeper into tissue that was not punctured yet
  loading,     ///< went deeper: after the puncture, or in a test that has none
  unloading    ///< came back
};

constexpr char const* to_string(MeasuredPhase phase) noexcept {
  switch (phase) {
    case MeasuredPhase::indenting: return "indenting";
    case MeasuredPhase::loading: return "loading";
    case MeasuredPhase::unloading: return "unloading";
  }
  return "unknown";
}

/// One measured force on a tool.
/// Units      depth [m] below the undeformed surface, speed [m/s] without sign, force [N] along the outward normal: it pushes the tool out.
struct Measurement {
  double depth = 0.0;
  double speed = 0.0;
  MeasuredPhase phase = MeasuredPhase::loading;
  double force = 0.0;

  /// Speed into the tissue [m/s].
  double inward_speed() const noexcept { return phase == MeasuredPhase::unloading ? -speed : speed; }
};

/// From the least to the largest value.
struct MeasuredRange {
  double low = 0.0;
  double high = 0.0;

  bool contains(double value) const noexcept { return low <= value && value <= high; }
};

inline MeasuredRange depths_of(std::span<Measurement const> measurements) {
  auto const [low, high] = std::minmax_element(measurements.begin(), measurements.end(), [](auto const& a, auto const& b) { return a.depth < b.depth; });
  return measurements.empty() ? MeasuredRange{} : MeasuredRange{low->depth, high->depth};
}
inline MeasuredRange speeds_of(std::span<Measurement const> measurements) {
  auto const [low, high] = std::minmax_element(measurements.begin(), measurements.end(), [](auto const& a, auto const& b) { return a.speed < b.speed; });
  return measurements.empty() ? MeasuredRange{} : MeasuredRange{low->speed, high->speed};
}

namespace detail {

/// Throws `InvalidArgument`, in the name of who is to fit them, for a value that is not finite, and a negative depth or speed.
inline void require_usable(char const* who, std::span<Measurement const> measurements) {
  for (std::size_t k = 0; k < measurements.size(); ++k)
    for (double const value : {measurements[k].depth, measurements[k].speed, measurements[k].force})
      if (!std::isfinite(value)) throw InvalidArgument(message(who, ": measurement ", k, " holds ", value, "; give finite numbers"));
  for (std::size_t k = 0; k < measurements.size(); ++k)
    if (measurements[k].depth < 0.0 || measurements[k].speed < 0.0)
      throw InvalidArgument(message(who, ": measurement ", k, " is at ", measurements[k].depth, " m and ", measurements[k].speed,
                                    " m/s; give both zero or more, the phase says which way"));
}

}  // namespace detail

/// Reads a file of comma-separated text with the header depth_m,speed_m_s,phase,force_N, a measurement a line; lines that start with # are
/// comments. The phase is "indenting", "loading" or "unloading".
/// Errors     FileError with the line for anything else, for a value that is not finite, a negative depth or speed, a depth outside `tool_depth`
///            (a file in millimetres), and a file without measurements.
inline std::vector<Measurement> read_measurements(std::filesystem::path const& path) {
  constexpr std::array<std::string_view, 4> columns = {"depth_m", "speed_m_s", "phase", "force_N"};
  detail::CsvTable table(path);
  detail::CsvTable::Row row;
  if (!table.next(row)) table.fail("the file is empty; the first line must be depth_m,speed_m_s,phase,force_N");
  if (!std::equal(row.begin(), row.end(), columns.begin(), columns.end()))
    table.fail_here("not the header of measurements; it must be depth_m,speed_m_s,phase,force_N");
  std::vector<Measurement> measurements;
  while (table.next(row)) {
    if (row.size() != columns.size()) table.fail_here(detail::message("there are ", row.size(), " cells instead of ", columns.size()));
    auto const number = [&](std::size_t column) {
      double const value = table.number(row, column, columns[column]);
      if (!std::isfinite(value)) table.fail_here(detail::message("column ", columns[column], " holds ", row[column], "; it must be finite"));
      return value;
    };
    Measurement measurement{.depth = number(0), .speed = number(1), .force = number(3)};
    if (measurement.depth < 0.0) table.fail_here(detail::message("the depth is ", row[0], " m; depths are counted from the surface, zero or more"));
    if (!tool_depth.contains(measurement.depth))
      table.fail_here(detail::message("the depth is ", unlikely_length(measurement.depth, "m", tool_depth), "; write depths in metres, speeds in m/s"));
    if (measurement.speed < 0.0)
      table.fail_here(detail::message("the speed is ", row[1], " m/s; give it without sign, the phase \"unloading\" says that the tool comes back"));
    bool known = false;
    for (auto const phase : {MeasuredPhase::indenting, MeasuredPhase::loading, MeasuredPhase::unloading})
      if (row[2] == to_string(phase)) measurement.phase = phase, known = true;
    if (!known) table.fail_here(detail::message("the phase is \"", detail::legible(row[2]), "\"; it must be \"indenting\", \"loading\" or \"unloading\""));
    measurements.push_back(measurement);
  }
  if (measurements.empty()) table.fail("there is no measurement after the header");
  return measurements;
}

}  // namespace palpate
