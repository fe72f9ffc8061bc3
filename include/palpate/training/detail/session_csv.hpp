// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/device/detail/csv_table.hpp>
#include <palpate/force/tissue_presets.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/training/session.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace palpate::detail {

inline constexpr std::string_view session_first_line = "# palpate session 1";
inline constexpr std::string_view hand_header = ",hand_x_m,hand_y_m,hand_z_m,hand_vx_m_s,hand_vy_m_s,hand_vz_m_s,buttons,read,written";
inline constexpr std::string_view turn_header = ",hand_qx,hand_qy,hand_qz,hand_qw";   // of a device that reports its orientation
inline constexpr std::string_view grip_header = ",hand_gripper";   // of one that reports its gripper
inline constexpr std::array<std::string_view, 6> hand_names = {"hand_x_m", "hand_y_m", "hand_z_m", "hand_vx_m_s", "hand_vy_m_s", "hand_vz_m_s"};
inline constexpr std::array<std::string_view, 4> turn_names = {"hand_qx", "hand_qy", "hand_qz", "hand_qw"};

inline void append_known(std::string& text, DeviceValue const& value) {
  if (value.known())
    append_number(text, value);
  else
    text += "unknown";
}

inline std::string session_text(Session const& session) {
  std::string text(session_first_line);
  auto const& ticks = session.recording.ticks();
  text.reserve(1024 + ticks.size() * (session.hand.empty() ? 160 : 300));
  (text += "\n# note ") += force_disclaimer;
  (text += "\n# version ") += session.version;
  (text += "\n# seed ") += std::to_string(session.seed.value);
  append_number(text += "\n# device ", session.device.max_force);
  append_number(text += " N ", session.device.rate);
  text += session.device.reports_velocity ? " Hz, reports velocity" : " Hz, reports no velocity";
  if (session.device.reports_orientation) text += ", reports orientation";
  if (session.device.reports_gripper) text += ", reports gripper";
  text += session.device.moves_a_hand ? "\n# motors hand " : "\n# motors simulated ";
  (text += std::to_string(session.device.buttons)) += " buttons ";
  append_known(text, session.device.continuous_force);
  append_known(text += " N ", session.device.max_damping);
  append_known(text += " N·s/m ", session.device.mass);
  text += " kg";
  if (session.device.max_torque > 0) append_number(text += ' ', session.device.max_torque), text += " N·m";
  for (std::size_t k = 0; k < stated_values.size(); ++k) {
    if (!states_more(session.device, k)) continue;
    DeviceValue const& value = session.device.*stated_values[k].value;
    append_number(((text += "\n# states ") += stated_values[k].name) += ' ', value);
    (text += ' ') += to_string(value.provenance);
  }
  for (auto const& [key, value] : session.configuration.values()) (((text += "\n# configuration ") += key) += ' ') += value;
  for (SessionEvent const& event : session.events) {
    append_number(text += "\n# event ", event.time);
    (text += ' ') += event.name;
  }
  (text += "\n# ticks ") += std::to_string(ticks.size());
  (text += '\n') += Recording::csv_header;
  bool const turns = !session.hand.empty() && session.device.reports_orientation, grips = !session.hand.empty() && session.device.reports_gripper;
  bool const has_area = session.recording.has_area();
  if (has_area) text += Recording::area_column;
  if (!session.hand.empty()) text += hand_header;
  if (turns) text += turn_header;
  if (grips) text += grip_header;
  if (session.device.max_torque > 0) text += Recording::torque_columns;
  text += '\n';
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    append_tick(text, ticks[i]);
    if (has_area) append_number(text += ',', ticks[i].cut_area);
    if (!session.hand.empty()) {
      HandSample const& hand = session.hand[i];
      for (double const coordinate : hand.position) append_number(text += ',', coordinate);
      for (double const component : hand.velocity) append_number(text += ',', component);
      (text += ',') += std::to_string(hand.buttons);
      ((text += ',') += to_string(hand.read)) += ',';
      text += to_string(hand.written);
      if (turns)
        for (double const component : hand.orientation.coeffs()) append_number(text += ',', component);
      if (grips) append_number(text += ',', hand.gripper);
    }
    if (session.device.max_torque > 0)
      for (double const component : ticks[i].torque) append_number(text += ',', component);
    text += '\n';
  }
  return text;
}

/// Reads the lines with # at the head of a file.
class SessionHead {
 public:
  explicit SessionHead(std::filesystem::path const& path) : path_(path) {
    std::ifstream file(path, std::ios::binary);
    for (std::string line; std::getline(file, line);) {
      ++line_;
      std::string_view content = trimmed(line);
      if (line_ == 1 && content.starts_with("\xEF\xBB\xBF")) content = trimmed(content.substr(3));
      if (line_ == 1) is_session_ = content.starts_with("# palpate session");
      if (!is_session_ || (!content.empty() && content.front() != '#')) break;
      if (line_ == 1 && content != session_first_line)
        fail(message("\"", legible(content), "\" is another format; this version reads \"", session_first_line, "\""));
      if (line_ > 1 && !content.empty()) take(trimmed(content.substr(1)));
    }
  }

  bool is_session() const noexcept { return is_session_; }
  /// What the head does not say and has to, or "".
  std::string_view missing() const noexcept {
    for (std::size_t k = 0; k < once_.size(); ++k)
      if (!seen_[k]) return once_[k];
    return {};
  }
  std::optional<std::uint64_t> ticks() const noexcept { return ticks_; }
  /// With the head's part filled in; the recording is still empty.
  Session& session() noexcept { return session_; }

 private:
  void take(std::string_view content) {
    std::string_view const rest = content;
    std::string_view const word = next(content);
    for (std::size_t k = 0; k < once_.size(); ++k)
      if (word == once_[k]) {
        if (seen_[k]) fail(message("there is a second line \"", word, "\"; remove one"));
        seen_[k] = true;
      }
    if (word == "version" && is_word(content)) {
      session_.version = content;
    } else if (word == "note") {   // for people
    } else if (word == "seed") {
      session_.seed.value = whole(content, "seed");
    } else if (word == "ticks") {
      ticks_ = whole(content, "number of ticks");
    } else if (word == "device") {
      session_.device.max_force = number(next(content), "device's force");
      if (next(content) != "N") fail_device();
      session_.device.rate = number(next(content), "device's rate");
      constexpr std::string_view turns = ", reports orientation", grips = ", reports gripper";
      session_.device.reports_gripper = content.ends_with(grips);
      if (session_.device.reports_gripper) content.remove_suffix(grips.size());
      session_.device.reports_orientation = content.ends_with(turns);
      if (session_.device.reports_orientation) content.remove_suffix(turns.size());
      if (content != "Hz, reports velocity" && content != "Hz, reports no velocity") fail_device();
      session_.device.reports_velocity = content == "Hz, reports velocity";
    } else if (word == "motors") {
      std::string_view const kind = next(content);
      if (kind != "hand" && kind != "simulated") fail_motors();
      session_.device.moves_a_hand = kind == "hand";
      auto const buttons = whole(next(content), "number of buttons");
      if (buttons > 32 || next(content) != "buttons") fail_motors();
      session_.device.buttons = static_cast<int>(buttons);
      session_.device.continuous_force = known(next(content), "continuous force");
      if (next(content) != "N") fail_motors();
      session_.device.max_damping = known(next(content), "device's damping");
      if (next(content) != "N·s/m") fail_motors();
      session_.device.mass = known(next(content), "device's mass");
      if (content != "kg") {
        if (next(content) != "kg") fail_motors();
        session_.device.max_torque = number(next(content), "device's torque");
        if (content != "N·m" || !(session_.device.max_torque > 0)) fail_motors();
      }
    } else if (word == "states") {
      std::string_view const name = next(content);
      auto const stated = std::ranges::find(stated_values, name, &StatedValue::name);
      double const value = number(next(content), "number that a device states");
      Provenance from = Provenance::reported;
      while (from != Provenance::unknown && content != to_string(from)) from = static_cast<Provenance>(static_cast<int>(from) - 1);
      if (stated == stated_values.end() || from == Provenance::unknown) fail("what a device states is, for example, \"states damping 0.05 datasheet\"");
      if (std::exchange(stated_[static_cast<std::size_t>(stated - stated_values.begin())], true)) fail(message("the device states its ", name, " twice; remove one"));
      session_.device.*stated->value = {value, from};
    } else if (word == "configuration") {
      std::string const key(next(content));
      if (session_.configuration.find(key)) fail(message("the key ", legible(key), " is there twice; remove one"));
      try {
        session_.configuration.set(key, std::string(content));
      } catch (InvalidArgument const& problem) {
        fail(problem.what());
      }
    } else if (word == "event") {
      double const time = number(next(content), "time of the event");
      if (!std::isfinite(time) || content.empty()) fail("an event is a finite time and a name");
      session_.events.push_back({time, std::string(content)});
    } else {
      fail(message("\"", legible(rest), "\" is no line of a session; it begins with note, version, seed, device, motors, states, configuration, event or ticks"));
    }
  }

  /// Cuts off the first word.
  static std::string_view next(std::string_view& text) noexcept {
    auto const blank = text.find(' ');
    std::string_view const word = text.substr(0, blank);
    text = blank == std::string_view::npos ? std::string_view() : trimmed(text.substr(blank));
    return word;
  }
  double number(std::string_view text, std::string_view what) const {
    if (auto const value = to_number<double>(text)) return *value;
    fail(message("the ", what, " is \"", legible(text), "\"; write a number with a decimal point"));
  }
  DeviceValue known(std::string_view text, std::string_view what) const { return text == "unknown" ? DeviceValue{} : DeviceValue(number(text, what)); }
  std::uint64_t whole(std::string_view text, std::string_view what) const {
    if (auto const value = to_number<std::uint64_t>(text)) return *value;
    fail(message("the ", what, " is \"", legible(text), "\"; write a whole number"));
  }
  [[noreturn]] void fail_device() const { fail("a device is, for example, \"device 3.3 N 1000 Hz, reports velocity\""); }
  [[noreturn]] void fail_motors() const { fail("motors are, for example, \"motors hand 2 buttons 0.88 N unknown N·s/m 0.045 kg\""); }
  [[noreturn]] void fail(std::string_view what) const { throw FileError(message(path_.string(), ", line ", line_, ": ", what)); }

  static constexpr std::array<std::string_view, 5> once_ = {"version", "seed", "device", "motors", "ticks"};
  std::filesystem::path path_;
  Session session_;
  std::array<bool, 5> seen_{};
  std::array<bool, stated_values.size()> stated_{};
  std::optional<std::uint64_t> ticks_;
  int line_ = 0;
  bool is_session_ = false;
};

inline std::optional<DeviceStatus> status_from(std::string_view text) noexcept {
  for (DeviceStatus const status : {DeviceStatus::ok, DeviceStatus::stale, DeviceStatus::disconnected, DeviceStatus::fault})
    if (text == to_string(status)) return status;
  return std::nullopt;
}

/// Its columns begin at `first`.
inline HandSample hand_from(CsvTable const& table, CsvTable::Row const& row, std::size_t first, Capabilities const& device) {
  HandSample hand;
  for (std::size_t i = 0; i < 3; ++i) {
    hand.position(static_cast<Eigen::Index>(i)) = table.number(row, first + i, hand_names[i]);
    hand.velocity(static_cast<Eigen::Index>(i)) = table.number(row, first + 3 + i, hand_names[3 + i]);
  }
  std::string_view const buttons = row[first + 6];
  auto const pressed = to_number<decltype(hand.buttons)>(buttons);
  if (!pressed) table.fail_here(message("the buttons are \"", legible(buttons), "\"; write a whole number, one bit a button"));
  hand.buttons = *pressed;
  for (std::size_t const column : {first + 7, first + 8}) {
    auto const status = status_from(row[column]);
    if (!status)
      table.fail_here(message("the device's status \"", legible(row[column]), "\" is unknown; it is \"ok\", \"stale\", \"disconnected\" or \"fault\""));
    (column == first + 7 ? hand.read : hand.written) = *status;
  }
  if (device.reports_orientation)
    for (std::size_t i = 0; i < 4; ++i) hand.orientation.coeffs()(static_cast<Eigen::Index>(i)) = table.number(row, first + 9 + i, turn_names[i]);
  if (device.reports_gripper) hand.gripper = table.number(row, first + 9 + (device.reports_orientation ? 4 : 0), grip_header.substr(1));
  return hand;
}

/// The rate of ticks that are 1 / rate apart; 1000 Hz where there are too few to tell.
inline double rate_of(Recording const& recording) noexcept {
  auto const& ticks = recording.ticks();
  if (ticks.size() < 2) return 1000.0;
  double const rate = static_cast<double>(ticks.size() - 1) / (ticks.back().time - ticks.front().time);
  double const whole = std::round(rate);
  if (!std::isfinite(rate) || !(rate > 0.0)) return 1000.0;
  return std::abs(rate - whole) <= 1e-6 * rate && whole > 0.0 ? whole : rate;
}

inline Session session_from_csv(std::filesystem::path const& path) {
  CsvTable table(path);   // says what is wrong with a file that is not there
  SessionHead head(path);
  Session session = std::move(head.session());
  CsvTable::Row row;
  if (!table.next(row)) table.fail(message("the table is missing; its first line must be ", Recording::csv_header));
  std::string const header = joined(row);
  bool const turns = session.device.reports_orientation, grips = session.device.reports_gripper;
  std::string const of_hand = message(hand_header, turns ? turn_header : "", grips ? grip_header : "");
  bool const has_torque = head.is_session() ? session.device.max_torque > 0 : header.ends_with(Recording::torque_columns);   // of a device that nothing is known of
  std::string_view const of_torque = has_torque ? Recording::torque_columns : std::string_view();
  bool has_area = false, has_hand = false, is_known = false;
  for (bool const with_area : {false, true})
    for (bool const with_hand : {false, true})
      if (header == message(Recording::csv_header, with_area ? Recording::area_column : "", with_hand ? std::string_view(of_hand) : "", of_torque))
        is_known = true, has_area = with_area, has_hand = with_hand;
  if (!is_known)
    table.fail_here(message("not the header of a session; it must be ", Recording::csv_header, of_torque, has_torque ? ", with " : ", and may go on with ", Recording::area_column.substr(1),
                            " and ", of_hand.substr(1), has_torque ? " before the torque or without" : ""));
  std::size_t const first_of_hand = tick_columns + (has_area ? 1 : 0);
  std::size_t const columns = first_of_hand + (has_hand ? hand_names.size() + 3 + (turns ? turn_names.size() : 0) + (grips ? 1 : 0) : 0) + (has_torque ? 3 : 0);
  while (table.next(row)) {
    if (row.size() != columns)
      table.fail_here(message("there are ", row.size(), " cells instead of ", columns, "; the file may be cut short: write it again"));
    Tick tick = tick_from(table, row);
    if (has_area) tick.cut_area = table.number(row, tick_columns, Recording::area_column.substr(1));
    for (std::size_t k = 0; k < 3 && has_torque; ++k)
      tick.torque[static_cast<Eigen::Index>(k)] = table.number(row, columns - 3 + k, Recording::torque_columns.substr(1 + 12 * k, 11));
    session.recording.append(tick);
    if (has_hand) session.hand.push_back(hand_from(table, row, first_of_hand, session.device));
  }
  if (!table.ends_with_line()) table.fail_here("the last line does not end; the file is cut short: write it again");
  if (head.is_session()) {
    if (!head.missing().empty()) table.fail(message("the line \"# ", head.missing(), "\" is missing; write the file again"));
    if (*head.ticks() != session.recording.ticks().size())
      table.fail(message("there are ", session.recording.ticks().size(), " ticks where the head says ", *head.ticks(),
                         "; the file is cut short: write it again"));
  } else {
    session.version = "recording";
    if (has_torque) session.device.max_torque = std::numeric_limits<double>::infinity();
    session.device.rate = rate_of(session.recording);
    session.events = phase_events(session.recording);
  }
  try {
    session.validate();
  } catch (InvalidArgument const& problem) {
    table.fail(problem.what());
  }
  return session;
}

}  // namespace palpate::detail
