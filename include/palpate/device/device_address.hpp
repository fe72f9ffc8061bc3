// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace palpate {

/// Which device, in one line that a user can type:   scheme:path?option=value&option=value
///   null:     script:strokes/first.csv?quantum=5.5e-5     sim:touch?hand=light     hd:Default Device
/// The scheme is two or more letters, digits, + - or . and begins with a letter; capitals do not count. Path and values may hold anything but control
/// characters; in them %25, %26 and %3F stand for % & ?, and any other byte for itself, as in a web address.
struct DeviceAddress {
  std::string scheme;
  std::string path;
  std::map<std::string, std::string, std::less<>> options;

  bool operator==(DeviceAddress const&) const = default;

  bool has(std::string_view option) const { return options.find(option) != options.end(); }
  std::string text(std::string_view option, std::string_view otherwise) const {
    auto const found = options.find(option);
    return found == options.end() ? std::string(otherwise) : found->second;
  }
  /// A finite number.
  double number(std::string_view option, double otherwise) const {
    auto const found = options.find(option);
    if (found == options.end()) return otherwise;
    std::optional<double> const value = detail::to_number<double>(found->second);
    if (!value || !std::isfinite(*value)) refuse(option, found->second, "give a number");
    return *value;
  }
  /// A whole number, zero or more, and at most `most`.
  std::uint64_t count(std::string_view option, std::uint64_t otherwise, std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) const {
    auto const found = options.find(option);
    if (found == options.end()) return otherwise;
    std::optional<std::uint64_t> const value = detail::to_number<std::uint64_t>(found->second);
    if (!value) refuse(option, found->second, "give a whole number, zero or more");
    if (*value > most) refuse(option, found->second, detail::message("give at most ", most));
    return *value;
  }
  /// Which of the words; the first one if nothing is said.
  std::size_t choice(std::string_view option, std::initializer_list<std::string_view> words) const {
    auto const found = options.find(option);
    if (found == options.end()) return 0;
    std::string all;
    std::size_t index = 0;
    for (std::string_view const word : words) {
      if (found->second == word) return index;
      ((all += index++ == 0 ? "" : ", ") += word);
    }
    refuse(option, found->second, "give one of " + all);
  }
  /// Three numbers with commas [m].
  Vector3<double> point(std::string_view option, Vector3<double> const& otherwise) const {
    auto const found = options.find(option);
    if (found == options.end()) return otherwise;
    Vector3<double> value = Vector3<double>::Zero();
    std::string_view rest = found->second;
    for (int axis = 0; axis < 3; ++axis) {
      std::size_t const comma = rest.find(',');
      std::optional<double> const number = detail::to_number<double>(detail::trimmed(rest.substr(0, comma)));
      bool const ends_right = (comma == std::string_view::npos) == (axis == 2);
      if (!number || !std::isfinite(*number) || !ends_right) refuse(option, found->second, "give x,y,z in metres");
      value[axis] = *number;
      rest.remove_prefix(axis == 2 ? 0 : comma + 1);
    }
    return value;
  }

 private:
  [[noreturn]] void refuse(std::string_view option, std::string_view value, std::string_view advice) const {
    throw InvalidArgument(detail::message("device option ", option, "=", value, " of ", scheme, ":", path, " makes no sense; ", advice));
  }
};

namespace detail {

inline bool is_lower(char c) noexcept { return c >= 'a' && c <= 'z'; }
inline bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// A part of an address with its %XX put back.
inline std::string decoded(std::string_view text, std::string_view whole) {
  auto const digit = [](char c) { return is_digit(c) ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1; };
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = static_cast<unsigned char>(text[i]);
    if (text[i] == '%') {
      int const high = i + 2 < text.size() ? digit(text[i + 1]) : -1, low = i + 2 < text.size() ? digit(text[i + 2]) : -1;
      if (high < 0 || low < 0)
        throw InvalidArgument(message("device address \"", whole, "\" has a % without two hexadecimal digits; write %25 for a percent sign"));
      byte = static_cast<unsigned char>(16 * high + low);
      i += 2;
    }
    if (byte < 0x20 || byte == 0x7f)
      throw InvalidArgument(message("device address \"", whole, "\" has a control character, byte ", int{byte}, "; take it out"));
    result += static_cast<char>(byte);
  }
  return result;
}

/// For messages: what can not be shown is a dot, and what is long is cut.
inline std::string shown(std::string_view text) {
  std::string result(text.substr(0, 200));
  for (char& c : result)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '.';
  return text.size() > 200 ? result + "..." : result;
}

}  // namespace detail

/// Throws `InvalidArgument` for text that is no address.
inline DeviceAddress parse_device_address(std::string_view text) {
  std::string const whole = detail::shown(text);
  auto const refuse = [&](auto const&... parts) { throw InvalidArgument(detail::message("device address \"", whole, "\" ", parts...)); };
  std::size_t const colon = text.find(':');
  if (colon == std::string_view::npos) refuse("has no colon; write scheme:path?option=value, for example sim:touch?hand=light");
  DeviceAddress address;
  for (char c : text.substr(0, colon)) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    bool const first = address.scheme.empty();
    if (!detail::is_lower(c) && (first || (!detail::is_digit(c) && c != '+' && c != '-' && c != '.')))
      refuse("has a scheme that is no name; it begins with a letter and goes on with letters, digits, +, - and .");
    address.scheme += c;
  }
  if (address.scheme.size() < 2) refuse("has no scheme of two letters or more; a file of a drive is script:C:/strokes.csv");
  text.remove_prefix(colon + 1);
  std::size_t const question = text.find('?');
  address.path = detail::decoded(text.substr(0, question), whole);
  if (question == std::string_view::npos) return address;
  text.remove_prefix(question + 1);
  while (!text.empty()) {
    std::size_t const ampersand = text.find('&');
    std::string_view const pair = text.substr(0, ampersand);
    text.remove_prefix(ampersand == std::string_view::npos ? text.size() : ampersand + 1);
    std::size_t const equals = pair.find('=');
    if (equals == std::string_view::npos || equals == 0)
      refuse("has an option \"", detail::shown(pair), "\" without name or value; write option=value and join them with &");
    std::string_view const name = pair.substr(0, equals);
    for (char const c : name)
      if (!detail::is_lower(c) && !detail::is_digit(c) && c != '_')
        refuse("has an option \"", detail::shown(name), "\"; names are small letters, digits and _");
    if (!address.options.emplace(name, detail::decoded(pair.substr(equals + 1), whole)).second) refuse("has the option ", name, " twice; keep one");
    if (ampersand != std::string_view::npos && text.empty()) refuse("ends with &; take it off");
  }
  return address;
}

/// The address as text, which `parse_device_address` takes back.
inline std::string to_string(DeviceAddress const& address) {
  auto const encoded = [](std::string_view text) {
    std::string result;
    for (char const c : text) {
      if (c == '%')
        result += "%25";
      else if (c == '&')
        result += "%26";
      else if (c == '?')
        result += "%3F";
      else
        result += c;
    }
    return result;
  };
  std::string text = address.scheme + ":" + encoded(address.path);
  char separator = '?';
  for (auto const& [option, value] : address.options) {
    text += separator + option + "=" + encoded(value);
    separator = '&';
  }
  return text;
}

}  // namespace palpate
