// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace palpate::detail {

/// The bytes of a file. Throws `FileError` in one line: missing, a folder, unreadable, empty.
inline std::string read_bytes(std::filesystem::path const& file) {
  std::string bytes = read_whole_file(file);
  if (bytes.find_first_not_of(" \t\r\n") == std::string::npos) throw FileError(message(file.string(), ": the file is empty"));
  return bytes;
}

/// Throws `FileError` when an STL file holds fewer triangles than it announces: VTK would read what is there.
/// A binary file announces its number of triangles (80 bytes of text, the number, 50 bytes each); a text file ends in "endsolid".
inline void check_stl_complete(std::string_view bytes, std::string const& name) {
  constexpr std::size_t header = 84, triangle = 50;
  std::uint32_t announced = 0;
  if (bytes.size() >= header) {
    std::memcpy(&announced, bytes.data() + 80, sizeof announced);   // the format is little-endian
    if constexpr (std::endian::native == std::endian::big)
      announced = (announced >> 24) | ((announced >> 8) & 0xff00u) | ((announced << 8) & 0xff0000u) | (announced << 24);
    if (bytes.size() == header + triangle * announced) return;
  }
  std::string_view text = bytes;
  bool const printable = bytes.find('\0') == std::string_view::npos;
  if (take_word(text) == "solid" && printable) {
    if (bytes.find("endsolid") == std::string_view::npos)
      throw FileError(message(name, ": there is no \"endsolid\"; the file was cut short"));
    return;
  }
  if (bytes.size() < header)
    throw FileError(message(name, ": ", bytes.size(), " bytes are too few for an STL file; was it cut short?"));
  if (bytes.size() < header + triangle * announced)
    throw FileError(message(name, ": the file announces ", announced, " triangles and holds ",
                            (bytes.size() - header) / triangle, "; it was cut short"));
}

/// Throws `FileError` when a legacy VTK file announces numbers that can not be, or a list of cells (before version 5.1) is not
/// as long as it announces: VTK would read beyond its end. "POLYGONS cells size" is followed by `size` integers, each cell its number of corners and the corners.
class LegacyCheck {
 public:
  LegacyCheck(std::string_view bytes, std::string const& name) : bytes_(bytes), name_(name) {}

  void operator()() {
    std::string_view head = bytes_;
    constexpr std::string_view title = "# vtk DataFile Version ";
    if (!head.starts_with(title)) throw FileError(message(name_, ": a VTK file begins with \"", title, "\""));
    head.remove_prefix(title.size());
    std::string_view const number = take_word(head);
    auto const version = to_number<double>(number);
    if (!version || number.find('.') == std::string_view::npos || !(*version >= 1.0 && *version < 6.0))
      throw FileError(message(name_, ": \"", number, "\" is not a known version of VTK files"));
    take_line(head);
    take_line(head);   // a title
    text_ = take_word(head) == "ASCII";
    counts("POINTS", 1);
    for (std::string_view const list : {"VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS", "CELLS"})
      if (auto const found = counts(list, 2); found && *version < 5.1) check(list, *found);   // later: offsets, which VTK checks
  }

 private:
  struct Counts {
    long long number, size;
    std::string_view rest;   // what follows their line
  };

  /// The one or two numbers in the line of a keyword; nothing if there is no such line.
  std::optional<Counts> counts(std::string_view list, int wanted) const {
    std::string const keyword = message("\n", list, " ");
    auto const begin = bytes_.find(keyword);
    if (begin == std::string_view::npos) return std::nullopt;
    std::string_view rest = bytes_.substr(begin + keyword.size());
    std::string_view line = take_line(rest);
    auto const most = static_cast<long long>(bytes_.size());   // a number of elements takes at least as many bytes
    std::array<long long, 2> values{};
    for (int i = 0; i < wanted; ++i) {
      auto const value = to_number<long long>(take_word(line));
      if (!value || *value < 0 || *value > most)
        throw FileError(message(name_, ": ", list, " announces no fitting numbers; the file was cut short or is damaged"));
      values[static_cast<std::size_t>(i)] = *value;
    }
    return Counts{values[0], values[1], rest};
  }

  void check(std::string_view list, Counts counts) const {
    long long used = 0;
    for (long long cell = 0; cell < counts.number; ++cell) {
      auto const corners = take_integer(counts.rest);
      bool complete = corners && *corners >= 0 && *corners < counts.size - used;
      for (long long i = 0; complete && i < *corners; ++i) complete = take_integer(counts.rest).has_value();
      if (!complete)
        throw FileError(message(name_, ": ", list, " announces ", counts.number, " cells, number ", cell,
                                " is not complete; the file was cut short or is damaged"));
      used += *corners + 1;
    }
    if (used != counts.size)
      throw FileError(message(name_, ": ", list, " announces ", counts.size, " integers and holds ", used, "; the file is damaged"));
  }

  std::optional<long long> take_integer(std::string_view& rest) const noexcept {
    if (text_) return to_number<long long>(take_word(rest));
    if (rest.size() < 4) return std::nullopt;
    std::uint32_t value = 0;   // binary files are big-endian
    for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(rest[static_cast<std::size_t>(i)]);
    rest.remove_prefix(4);
    return static_cast<std::int32_t>(value);
  }

  std::string_view bytes_;
  std::string const& name_;
  bool text_ = true;
};

}  // namespace palpate::detail
