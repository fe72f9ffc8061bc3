// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>

#include <concepts>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace palpate {

namespace detail {

/// Is this one word that a line of text can hold?
inline bool is_word(std::string_view text) noexcept {
  if (text.empty()) return false;
  for (char const c : text)
    if (static_cast<unsigned char>(c) <= ' ' || c == '\x7f') return false;
  return true;
}

/// Is this a text that a line can end with, and that reads back as it was?
inline bool is_line(std::string_view text) noexcept {
  for (char const c : text)
    if ((static_cast<unsigned char>(c) < ' ') || c == '\x7f') return false;
  return text.empty() || (text.front() != ' ' && text.back() != ' ');
}

}  // namespace detail

/// How a simulation was set up, as keys and values: what a host wants to know again, and what must be equal for a replay.
///   configuration.set("tissue.stiffness_N_m", 80.0).set("cutter", "progressive").set("mesh", "liver.obj");
/// Invariant  a key is one word; a value is a line without control characters, without blanks at its ends. Numbers are kept as the shortest
///            text that reads back to the same double, so equal numbers are equal texts. Kept in the order of the keys: equal
///            configurations give equal bytes whatever they were set in.
/// Errors     `InvalidArgument` for a key or a value that can not be kept.
class Configuration {
 public:
  Configuration& set(std::string key, std::string value) {
    if (!detail::is_word(key))
      throw InvalidArgument(detail::message("Configuration: the key is \"", detail::legible(key), "\"; give one word without blanks, for example tissue.mass_kg"));
    if (!detail::is_line(value))
      throw InvalidArgument(detail::message("Configuration: the value of ", detail::legible(key), " is \"", detail::legible(value),
                                            "\"; give one line without control characters, without blanks at its ends"));
    values_.insert_or_assign(std::move(key), std::move(value));
    return *this;
  }
  Configuration& set(std::string key, char const* value) { return set(std::move(key), std::string(value)); }
  Configuration& set(std::string key, bool value) { return set(std::move(key), std::string(value ? "yes" : "no")); }
  Configuration& set(std::string key, std::floating_point auto value) {
    std::string text;
    detail::append_number(text, static_cast<double>(value));
    return set(std::move(key), std::move(text));
  }
  Configuration& set(std::string key, std::integral auto value) { return set(std::move(key), std::to_string(value)); }

  /// The value of a key; null when it was not set.
  std::string const* find(std::string const& key) const {
    auto const found = values_.find(key);
    return found == values_.end() ? nullptr : &found->second;
  }
  std::map<std::string, std::string> const& values() const noexcept { return values_; }
  std::size_t size() const noexcept { return values_.size(); }

  friend bool operator==(Configuration const&, Configuration const&) = default;

 private:
  std::map<std::string, std::string> values_;
};

}  // namespace palpate
