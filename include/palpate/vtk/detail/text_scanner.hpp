// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

namespace palpate::detail {

/// The bytes of a file. Throws `FileError` in one line: missing, a folder, unreadable, empty.
inline std::string read_bytes(std::filesystem::path const& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) throw FileError(message(file.string(), ": there is no such file"));
  if (std::filesystem::is_directory(file, ignored))
    throw FileError(message(file.string(), ": this is a folder, not a file"));
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.is_open() || stream.bad()) throw FileError(message(file.string(), ": the file can not be read"));
  if (bytes.find_first_not_of(" \t\r\n") == std::string::npos)
    throw FileError(message(file.string(), ": the file is empty"));
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

/// The whole word as a number, or nothing. "nan" and "inf" are numbers here: the caller says where they stand.
template <class Number>
std::optional<Number> parse_number(std::string_view word) noexcept {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number number{};
  auto const [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (word.empty() || error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return number;
}

}  // namespace palpate::detail
