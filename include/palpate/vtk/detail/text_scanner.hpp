// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>

namespace palpate::detail {

/// The bytes of a file. Throws `FileError` in one line: missing, a folder, unreadable, empty.
inline std::string read_bytes(std::filesystem::path const& file) {
  std::string bytes = read_whole_file(file);
  if (bytes.find_first_not_of(" \t\r\n") == std::string::npos) throw FileError(message(file.string(), ": the file is empty"));
  return bytes;
}

/// Takes the next word (no white space) from the front of `text`; empty at the end.
constexpr std::string_view take_word(std::string_view& text) noexcept {
  constexpr std::string_view space = " \t\r\n\v\f";
  auto const begin = text.find_first_not_of(space);
  if (begin == std::string_view::npos) {
    text = {};
    return {};
  }
  text.remove_prefix(begin);
  auto const length = std::min(text.find_first_of(space), text.size());
  std::string_view const word = text.substr(0, length);
  text.remove_prefix(length);
  return word;
}

/// Takes the next line, without its end.
constexpr std::string_view take_line(std::string_view& text) noexcept {
  auto const length = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, length);
  text.remove_prefix(std::min(length + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace palpate::detail
