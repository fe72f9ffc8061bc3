// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/device/detail/csv_table.hpp>
#include <palpate/haptics/safety_event.hpp>
#include <palpate/simulator/tick.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::detail {

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
    table.fail_here(message("phase \"", legible(row[5]), "\" is unknown; it is \"", to_string(CuttingPhase::no_contact), "\", \"",
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

namespace palpate {

/// A session, tick by tick; what `Simulator::run` returns.
/// File       comma-separated text, one line a tick:
///            time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J
///            and cut_area_m2 where a solid was cut, torque_x_Nm,torque_y_Nm,torque_z_Nm where a torque was written.
///            Numbers are the shortest text that reads back to the same double, with a decimal point in every locale: equal recordings give equal
///            bytes, and `read_csv` gives back the recording that was written.
/// Cost       `append` allocates only beyond what `reserve` asked for; `try_append` never does: allowed in the servo tick.
class Recording {
 public:
  static constexpr std::string_view csv_header =
      "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J";

  static constexpr std::string_view area_column = ",cut_area_m2", torque_columns = ",torque_x_Nm,torque_y_Nm,torque_z_Nm";

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
    is_of_real_time_ = false;
  }

  /// Whether the limit of force cut off forces of this run, and how far: look there before `largest_force` is taken for the tissue's. A file does
  /// not keep it: a recording that was read has none.
  ForceSaturation const& saturation() const noexcept { return saturation_; }
  void set_saturation(ForceSaturation const& saturation) noexcept { saturation_ = saturation; }
  /// Whether its run was in real time, and so not one that lock-step repeats; its ticks' times do not say so. A file does not keep it, a session does.
  bool is_of_real_time() const noexcept { return is_of_real_time_; }
  void set_real_time() noexcept { is_of_real_time_ = true; }

  /// Whether a solid was cut.
  bool has_area() const noexcept {
    return std::ranges::any_of(ticks_, [](Tick const& tick) { return !(tick.cut_area == 0); });
  }
  /// N, the largest magnitude that was written; 0 for an empty recording. Ticks whose force is not finite do not count.
  double largest_force() const noexcept {
    double largest = 0.0;
    for (Tick const& tick : ticks_)
      if (is_finite(tick.force)) largest = std::max(largest, tick.force.norm());
    return largest;
  }

  /// N, the mean of what was written from one time to another [s], ends included; zero where no tick is between them.
  Vector3<double> mean_force(double from, double to) const noexcept {
    Vector3<double> sum = Vector3<double>::Zero();
    std::size_t count = 0;
    for (Tick const& tick : ticks_)
      if (tick.time >= from && tick.time <= to) sum += tick.force, ++count;
    return count > 0 ? Vector3<double>(sum / static_cast<double>(count)) : sum;
  }

  /// The text that `write_csv` puts into the file.
  std::string to_csv() const {
    bool const has_area = this->has_area();
    bool const has_torque = std::ranges::any_of(ticks_, [](Tick const& tick) { return !is_zero(tick.torque); });
    std::string text(csv_header);
    text.reserve(text.size() + 180 * ticks_.size());
    if (has_area) text += area_column;
    if (has_torque) text += torque_columns;
    text += '\n';
    for (Tick const& tick : ticks_) {
      detail::append_tick(text, tick);
      if (has_area) detail::append_number(text += ',', tick.cut_area);
      for (int k = 0; k < 3 && has_torque; ++k) detail::append_number(text += ',', tick.torque[k]);
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
    std::string header = detail::joined(row);
    bool const has_torque = header.ends_with(torque_columns);
    if (has_torque) header.resize(header.size() - torque_columns.size());
    bool const has_area = header == detail::message(csv_header, area_column);
    if (!has_area && header != csv_header) table.fail_here(detail::message("not the header of a recording; it must be ", csv_header));
    std::size_t const first_torque = detail::tick_columns + (has_area ? 1 : 0), columns = first_torque + (has_torque ? 3 : 0);
    Recording recording;
    while (table.next(row)) {
      if (row.size() != columns)
        table.fail_here(detail::message("there are ", row.size(), " cells instead of ", columns, "; the file may be cut short: write it again"));
      Tick tick = detail::tick_from(table, row);
      if (has_area) tick.cut_area = table.number(row, detail::tick_columns, area_column.substr(1));
      for (std::size_t k = 0; k < 3 && has_torque; ++k)
        tick.torque[static_cast<int>(k)] = table.number(row, first_torque + k, torque_columns.substr(1 + 12 * k, 11));
      recording.append(tick);
    }
    if (!table.ends_with_line()) table.fail_here("the last line does not end; the file is cut short: write it again");
    return recording;
  }

 private:
  std::vector<Tick> ticks_;
  std::size_t dropped_ = 0;
  ForceSaturation saturation_{};
  bool is_of_real_time_ = false;
};

/// One contact of a recording, from the tick before the touch to the one in which it ends, and what the hand put into it.
/// Units      s; energy [J]: above zero the hand gave it, as into a cut or a damper; below zero it came out of the rendering, which is what a passive one
///            never does but for the ½ K |Δx|² a tick that a sampled spring leaks.
struct ContactEnergy {
  double begin = 0.0, end = 0.0;
  double energy = 0.0;
  bool cut = false;   ///< the tool went through the surface
};

/// The contacts of a recording of one session, in the order of time; one that is still there at its end counts up to it.
inline std::vector<ContactEnergy> contact_energies(Recording const& recording) {
  std::vector<ContactEnergy> contacts;
  auto const& ticks = recording.ticks();
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    Tick const& before = ticks[k > 0 ? k - 1 : 0];
    bool const was = k > 0 && before.phase != CuttingPhase::no_contact, is = ticks[k].phase != CuttingPhase::no_contact;
    if (!was && !is) continue;
    if (!was) contacts.push_back({.begin = before.time, .energy = -before.energy});
    ContactEnergy& contact = contacts.back();
    contact.cut = contact.cut || ticks[k].phase == CuttingPhase::moving;
    if (!is || k + 1 == ticks.size()) {
      contact.end = ticks[k].time;
      contact.energy += ticks[k].energy;
    }
  }
  return contacts;
}

}  // namespace palpate
