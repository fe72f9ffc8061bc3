// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/device/detail/csv_table.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// One servo tick as it was: where the tip was, what it did, what the hand felt.
/// Units      time [s] since the start, tip [m] in the world frame, depth [m] below the home surface (0 without contact),
///            force [N] on the hand, as written to the device.
struct Tick {
  double time = 0.0;
  Vector3<double> tip = Vector3<double>::Zero();
  double depth = 0.0;
  CuttingPhase phase = CuttingPhase::no_contact;
  Vector3<double> force = Vector3<double>::Zero();
};

/// A session, tick by tick; what `Simulator::run` returns.
/// File       comma-separated text, one line a tick:
///            time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N
///            Numbers are the shortest text that reads back to the same double, with a decimal point in every locale: equal
///            recordings give equal bytes, and `read_csv` gives back the recording that was written.
/// Cost       `append` allocates only beyond what `reserve` asked for; `try_append` never does: allowed in the servo tick.
class Recording {
 public:
  static constexpr std::string_view csv_header =
      "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N";

  Recording() = default;
  explicit Recording(std::size_t capacity) { reserve(capacity); }

  /// Room for that many ticks in all.
  void reserve(std::size_t capacity) { ticks_.reserve(capacity); }
  std::size_t capacity() const noexcept { return ticks_.capacity(); }

  /// Adds a tick and grows when the room is used up: for lock-step runs.
  void append(Tick const& tick) { ticks_.push_back(tick); }

  /// Adds a tick if there is room, else counts it as dropped: for real-time runs.
  bool try_append(Tick const& tick) noexcept {
    if (ticks_.size() == ticks_.capacity()) {
      ++dropped_;
      return false;
    }
    ticks_.push_back(tick);
    return true;
  }

  /// Contiguous, in the order of time.
  std::vector<Tick> const& ticks() const noexcept { return ticks_; }
  /// How many ticks found no room.
  std::size_t dropped() const noexcept { return dropped_; }

  void clear() noexcept {
    ticks_.clear();
    dropped_ = 0;
  }

  /// N, the largest magnitude; 0 for an empty recording. Ticks whose force is not finite do not count.
  double largest_force() const noexcept {
    double largest = 0.0;
    for (Tick const& tick : ticks_)
      if (tick.force.allFinite()) largest = std::max(largest, tick.force.norm());
    return largest;
  }

  /// The text that `write_csv` puts into the file.
  std::string to_csv() const {
    std::string text(csv_header);
    text.reserve(text.size() + 160 * ticks_.size());
    text += '\n';
    for (Tick const& tick : ticks_) {
      put(text, tick.time);
      for (double const coordinate : tick.tip) put(text += ',', coordinate);
      put(text += ',', tick.depth);
      (text += ',') += to_string(tick.phase);
      for (double const component : tick.force) put(text += ',', component);
      text += '\n';
    }
    return text;
  }

  /// Writes the whole file or none of it: a file beside `path` is written, then renamed.
  /// Throws `FileError` for a folder that is missing or may not be written, or a full disk; an older file then stays as it was.
  void write_csv(std::filesystem::path const& path) const { detail::write_whole_file(path, to_csv()); }

  /// Reads a file that `write_csv` wrote. Throws `FileError` with the line for anything else.
  static Recording read_csv(std::filesystem::path const& path) {
    constexpr std::size_t columns = 9;
    detail::CsvTable table(path);
    detail::CsvTable::Row row;
    if (!table.next(row)) table.fail(detail::message("the file is empty; the first line must be ", csv_header));
    if (joined(row) != csv_header) table.fail_here(detail::message("not the header of a recording; it must be ", csv_header));
    Recording recording;
    std::array<std::string_view, columns> const names = {"time_s", "tip_x_m",   "tip_y_m",   "tip_z_m",  "depth_m",
                                                         "phase",  "force_x_N", "force_y_N", "force_z_N"};
    while (table.next(row)) {
      if (row.size() != columns)
        table.fail_here(detail::message("there are ", row.size(), " cells instead of ", columns,
                                        "; the file may be cut short: write it again"));
      auto const number = [&](std::size_t column) { return table.number(row, column, names[column]); };
      auto const phase = phase_from(row[5]);
      if (!phase)
        table.fail_here(detail::message("phase \"", row[5], "\" is unknown; it is \"", to_string(CuttingPhase::no_contact),
                                        "\", \"", to_string(CuttingPhase::indenting), "\" or \"",
                                        to_string(CuttingPhase::moving), "\""));
      recording.append({.time = number(0),
                        .tip = {number(1), number(2), number(3)},
                        .depth = number(4),
                        .phase = *phase,
                        .force = {number(6), number(7), number(8)}});
    }
    if (!table.ends_with_line()) table.fail_here("the last line does not end; the file is cut short: write it again");
    return recording;
  }

 private:
  static void put(std::string& text, double value) {
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
      if (digits == std::numeric_limits<double>::max_digits10 || detail::to_number(stream.str()) == value) {
        text += stream.str();
        return;
      }
    }
#endif
  }

  static std::optional<CuttingPhase> phase_from(std::string_view text) noexcept {
    for (CuttingPhase const phase : {CuttingPhase::no_contact, CuttingPhase::indenting, CuttingPhase::moving})
      if (text == to_string(phase)) return phase;
    return std::nullopt;
  }

  static std::string joined(detail::CsvTable::Row const& row) {
    std::string text;
    for (std::string_view const cell : row) {
      if (!text.empty()) text += ',';
      text += cell;
    }
    return text;
  }

  std::vector<Tick> ticks_;
  std::size_t dropped_ = 0;
};

}  // namespace palpate
