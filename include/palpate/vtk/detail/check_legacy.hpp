// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/detail/text_scanner.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace palpate::detail {

/// Throws `FileError` when a list of cells in a legacy VTK file of version 1 … 4 is not as long as it announces: VTK would read
/// beyond its end. "POLYGONS cells size" is followed by `size` integers, each cell its number of corners and the corners.
class LegacyCheck {
 public:
  LegacyCheck(std::string_view bytes, std::string const& name) : bytes_(bytes), name_(name) {}

  void operator()() {
    std::string_view head = bytes_;
    constexpr std::string_view title = "# vtk DataFile Version ";
    if (!head.starts_with(title)) throw FileError(message(name_, ": a VTK file begins with \"", title, "\""));
    head.remove_prefix(title.size());
    auto const version = parse_number<double>(take_word(head));
    take_line(head);
    take_line(head);   // a title
    text_ = take_word(head) == "ASCII";
    if (version && *version >= 5.0) return;   // offsets and connectivity: VTK checks these itself
    for (std::string_view const list : {"VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS", "CELLS"}) check(list);
  }

 private:
  void check(std::string_view list) const {
    std::string const keyword = "\n" + std::string(list) + " ";
    auto const begin = bytes_.find(keyword);
    if (begin == std::string_view::npos) return;
    std::string_view rest = bytes_.substr(begin + keyword.size());
    std::string_view line = take_line(rest);
    auto const cells = parse_number<long long>(take_word(line)), size = parse_number<long long>(take_word(line));
    if (!cells || !size || *cells < 0 || *size < 0)
      throw FileError(message(name_, ": ", list, " announces no numbers; the file was cut short or is damaged"));
    long long used = 0;
    for (long long cell = 0; cell < *cells; ++cell) {
      auto const corners = take_integer(rest);
      bool complete = corners && *corners >= 0 && *corners < *size - used;
      for (long long i = 0; complete && i < *corners; ++i) complete = take_integer(rest).has_value();
      if (!complete)
        throw FileError(message(name_, ": ", list, " announces ", *cells, " cells, number ", cell,
                                " is not complete; the file was cut short or is damaged"));
      used += *corners + 1;
    }
    if (used != *size)
      throw FileError(message(name_, ": ", list, " announces ", *size, " integers and holds ", used, "; the file is damaged"));
  }

  std::optional<long long> take_integer(std::string_view& rest) const noexcept {
    if (text_) return parse_number<long long>(take_word(rest));
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
