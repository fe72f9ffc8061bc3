// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

namespace palpate::detail {

inline std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view blank = " \t\r";
  auto const first = text.find_first_not_of(blank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blank) - first + 1);
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

/// The whole text as a number, whatever the locale says about decimal points; nothing if it holds anything else. "nan" and "inf" are numbers here.
template <class Number>
std::optional<Number> to_number(std::string_view text) {
  if (!std::unsigned_integral<Number> && text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  if (text.empty() || text.front() == '+') return std::nullopt;
  Number value{};
#if !defined(__cpp_lib_to_chars)   // a standard library without them for fractions: streams read numbers, but not these words
  if constexpr (std::floating_point<Number>) {
    constexpr Number infinity = std::numeric_limits<Number>::infinity();
    if (text == "nan") return std::numeric_limits<Number>::quiet_NaN();
    if (text == "inf" || text == "-inf") return text.front() == '-' ? -infinity : infinity;
    std::istringstream stream{std::string(text)};
    stream.imbue(std::locale::classic());
    stream >> value;
    if (stream.fail() || stream.peek() != std::istringstream::traits_type::eof()) return std::nullopt;
    return value;
  }
#endif
  auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Text of somebody else's as it can stand in a message: printable ASCII, not too long.
inline std::string legible(std::string_view text) {
  constexpr std::size_t most = 160;
  std::string result(text.substr(0, most));
  for (char& c : result)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > most ? result + " ..." : result;
}

/// The shortest text that reads back to the same double, with a decimal point in every locale.
inline void append_number(std::string& text, double value) {
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
    if (digits == std::numeric_limits<double>::max_digits10 || to_number<double>(stream.str()) == value) {
      text += stream.str();
      return;
    }
  }
#endif
}

}  // namespace palpate::detail
