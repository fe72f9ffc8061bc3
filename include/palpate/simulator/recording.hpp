// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/device/detail/csv_table.hpp>
#include <palpate/haptics/safety_event.hpp>
#include <palpate/simulator/detail/tick_text.hpp>
#include <palpate/simulator/tick.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// A session, tick by tick; what `Simulator::run` returns.
/// File       comma-separated text, one line a tick:
///            time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J
///            Numbers are the shortest text that reads back to the same double, with a decimal point in every locale: equal
///            recordings give equal bytes, and `read_csv` gives back the recording that was written.
/// Cost       `append` allocates only beyond what `reserve` asked for; `try_append` never does: allowed in the servo tick.
class Recording {
 public:
  static constexpr std::string_view csv_header =
      "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J";

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
    saturation_ = {};
  }

  /// Whether the limit of force cut off forces of this run, and how far: look there before `largest_force` is taken for the tissue's. A file does
  /// not keep it: a recording that was read has none.
  ForceSaturation const& saturation() const noexcept { return saturation_; }
  void set_saturation(ForceSaturation const& saturation) noexcept { saturation_ = saturation; }

  /// N, the largest magnitude that was written; 0 for an empty recording. Ticks whose force is not finite do not count.
  double largest_force() const noexcept {
    double largest = 0.0;
    for (Tick const& tick : ticks_)
      if (is_finite(tick.force)) largest = std::max(largest, tick.force.norm());
    return largest;
  }

  /// The text that `write_csv` puts into the file.
  std::string to_csv() const {
    std::string text(csv_header);
    text.reserve(text.size() + 160 * ticks_.size());
    text += '\n';
    for (Tick const& tick : ticks_) {
      detail::append_tick(text, tick);
      text += '\n';
    }
    return text;
  }

  /// Writes the whole file or none of it: a file beside `path` is written, then renamed.
  /// Throws `FileError` for a folder that is missing or may not be written, or a full disk; an older file then stays as it was.
  void write_csv(std::filesystem::path const& path) const { detail::write_whole_file(path, to_csv()); }

  /// Reads a file that `write_csv` wrote. Throws `FileError` with the line for anything else.
  static Recording read_csv(std::filesystem::path const& path) {
    detail::CsvTable table(path);
    detail::CsvTable::Row row;
    if (!table.next(row)) table.fail(detail::message("the file is empty; the first line must be ", csv_header));
    if (detail::joined(row) != csv_header) table.fail_here(detail::message("not the header of a recording; it must be ", csv_header));
    Recording recording;
    while (table.next(row)) {
      if (row.size() != detail::tick_columns)
        table.fail_here(detail::message("there are ", row.size(), " cells instead of ", detail::tick_columns,
                                        "; the file may be cut short: write it again"));
      recording.append(detail::tick_from(table, row));
    }
    if (!table.ends_with_line()) table.fail_here("the last line does not end; the file is cut short: write it again");
    return recording;
  }

 private:
  std::vector<Tick> ticks_;
  std::size_t dropped_ = 0;
  ForceSaturation saturation_{};
};

}  // namespace palpate
