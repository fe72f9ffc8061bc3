// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/training/detail/session_binary.hpp>
#include <palpate/training/detail/session_csv.hpp>
#include <palpate/training/session.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// The text that `write_session_csv` puts into the file: lines that begin with # say what was done, then a recording's columns follow:
///   # palpate session 1
///   # version 0.1.0
///   # seed 7
///   # device 3.3 N 1000 Hz, reports no velocity
///   # motors hand 2 buttons 0.88 N unknown N·s/m 0.045 kg
///   # configuration tissue.mass_kg 0.1
///   # event 0.512 puncture
///   # ticks 3600
///   time_s,tip_x_m,…,force_z_N,energy_J
/// A session that has its hand's samples has these columns more: hand_x_m … hand_z_m, hand_vx_m_s … hand_vz_m_s, buttons, read, written.
/// `read_trajectory` reads both, since it skips such lines and finds columns by name, and `Recording::read_csv` what has no samples.
/// Equal sessions give equal bytes.
/// Errors     `InvalidArgument` for a session that is not `valid`.
inline std::string to_csv(Session const& session) {
  session.validate();
  return detail::session_text(session);
}

/// The bytes that `write_session` puts into the file: about half of the text. Equal sessions give equal bytes.
///   a magic number, a format number, the length, the content, a checksum; the lowest byte of a number first on every machine
/// Errors     `InvalidArgument` for a session that is not valid.
inline std::string to_bytes(Session const& session) {
  session.validate();
  return detail::session_bytes(session);
}

/// Writes the whole file or none of it; see `Recording::write_csv`.
inline void write_session_csv(std::filesystem::path const& path, Session const& session) { detail::write_whole_file(path, to_csv(session)); }
inline void write_session(std::filesystem::path const& path, Session const& session) { detail::write_whole_file(path, to_bytes(session)); }

/// Reads what `write_session_csv` wrote, and any file of `Recording::write_csv`: that is a session of an unknown version "recording", without
/// seed, configuration and hand, its events those of the phases, its rate that of its times.
/// Errors     `FileError` with the line for anything else, and for a file that has lost lines.
inline Session read_session_csv(std::filesystem::path const& path) { return detail::session_from_csv(path); }

/// Reads what `write_session` wrote, and what `read_session_csv` reads if the name ends in .csv.
/// Errors     `FileError` with the byte for anything else: damaged, cut short, or of another format. Lengths and the checksum are looked at
///            before anything is made of them.
inline Session read_session(std::filesystem::path const& path) {
  if (path.extension() == ".csv") return read_session_csv(path);
  return detail::session_from_bytes(detail::read_whole_file(path), path);
}

/// The same from bytes in memory; `name` stands in the errors.
inline Session session_from_bytes(std::string_view bytes, std::string const& name = "session") { return detail::session_from_bytes(bytes, name); }

}  // namespace palpate
