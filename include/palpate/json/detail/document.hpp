// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Where a JSON parser is, as a path "/layers/0/bias/2", and which keys it has met.
class JsonTrail {
 public:
  using Event = nlohmann::json::parse_event_t;

  /// The path of the key that is there twice, else "".
  std::string follow(Event event, nlohmann::json const& parsed) {
    switch (event) {
      case Event::object_start:
      case Event::array_start: levels_.push_back({.is_list = event == Event::array_start}); break;
      case Event::key: {
        levels_.back().key = parsed.get_ref<std::string const&>();
        if (!levels_.back().keys.insert(levels_.back().key).second) return path();
        break;
      }
      case Event::object_end:
      case Event::array_end: levels_.pop_back(); [[fallthrough]];
      case Event::value:
        if (!levels_.empty()) ++levels_.back().index;
        break;
    }
    return {};
  }

  std::string path() const {
    std::string text;
    for (Level const& level : levels_)
      if (level.is_list || !level.key.empty()) text += "/" + (level.is_list ? std::to_string(level.index) : level.key);
    return text;
  }

 private:
  struct Level {
    bool is_list = false;
    std::size_t index = 0;
    std::string key{};
    std::set<std::string> keys{};
  };
  std::vector<Level> levels_;
};

/// The document that a text holds. Throws `FileError` with line, column and path for what is no JSON and for a key that is there twice.
inline nlohmann::json parse_json(std::string const& text, std::string const& name) {
  using nlohmann::json;
  JsonTrail trail;
  auto const place = [&] { return trail.path().empty() ? std::string() : message(", near ", legible(trail.path())); };
  try {
    return json::parse(text, [&](int depth, json::parse_event_t event, json& parsed) {
      constexpr int most = 16;
      if (depth > most) throw FileError(message(name, place(), ": more than ", most, " levels, which no file of palpate has; give a file that palpate wrote"));
      if (auto const twice = trail.follow(event, parsed); !twice.empty())
        throw FileError(message(name, ": the key ", legible(twice), " is there twice; remove one of them"));
      return true;
    });
  } catch (json::parse_error const& error) {
    std::size_t const byte = std::min(error.byte > 0 ? error.byte - 1 : 0, text.size());
    auto const begin = text.begin(), end = begin + static_cast<std::ptrdiff_t>(byte);
    auto const line = std::count(begin, end, '\n') + 1;
    std::size_t const start = byte == 0 ? 0 : text.rfind('\n', byte - 1) + 1;   // npos + 1 is 0
    std::string_view reason = error.what();
    if (auto const after = reason.find("column "); after != std::string_view::npos) {
      reason.remove_prefix(after);
      reason.remove_prefix(std::min(reason.find(": ") + 2, reason.size()));
    }
    throw FileError(message(name, ", line ", line, ", column ", byte - start + 1, place(), ": this is no JSON: ", legible(reason),
                            "; give a file that palpate wrote"));
  } catch (json::exception const& error) {   // a number that no double holds
    std::string_view reason = error.what();
    reason.remove_prefix(std::min(reason.find("] ") + 2, reason.size()));
    throw FileError(message(name, place(), ": ", legible(reason), "; give numbers that a double can hold"));
  }
}

/// A value in a document with its path, for messages that say where.
class JsonValue {
 public:
  using Json = nlohmann::json;

  JsonValue(Json const& value, std::string const& name, std::string path = {}) : value_(&value), name_(&name), path_(std::move(path)) {}

  [[noreturn]] void fail(std::string_view what) const {
    throw FileError(message(*name_, ": ", path_.empty() ? "the document" : path_, " ", what));
  }
  [[noreturn]] void fail_as(std::string_view wanted) const { fail(message("is ", shown(), "; give ", wanted)); }

  /// The value as JSON text, shortened.
  std::string shown() const { return legible(value_->dump(-1, ' ', true, Json::error_handler_t::replace)); }

  bool is_null() const noexcept { return value_->is_null(); }
  bool is_text(std::string_view text) const { return value_->is_string() && value_->get_ref<std::string const&>() == text; }
  bool is_integer(long long number) const { return value_->is_number_integer() && *value_ == number; }

  void require_object() const {
    if (!value_->is_object()) fail_as("an object, { ... }");
  }
  bool has(char const* key) const { return value_->is_object() && value_->contains(key); }

  /// Member of an object.
  JsonValue at(char const* key) const {
    require_object();
    auto const found = value_->find(key);
    if (found == value_->end()) fail(message("has no key \"", key, "\"; add it"));
    return {*found, *name_, path_ + "/" + key};
  }

  /// All keys are among these; `at` finds those that are missing.
  void require_keys(std::initializer_list<char const*> keys) const {
    require_object();
    for (auto const& item : value_->items()) {
      if (std::any_of(keys.begin(), keys.end(), [&](char const* key) { return item.key() == key; })) continue;
      std::string known;
      for (char const* key : keys) known += (known.empty() ? "" : ", ") + std::string(key);
      fail(message("has a key \"", legible(item.key()), "\" that means nothing here; remove it, the keys are ", known));
    }
  }

  std::string text() const {
    if (!value_->is_string()) fail_as("a text in quotes");
    return value_->get<std::string>();
  }
  /// The keys of an object, in the order of the alphabet.
  std::vector<std::string> keys() const {
    require_object();
    std::vector<std::string> result;
    for (auto const& item : value_->items()) result.push_back(item.key());
    return result;
  }

  bool is_list(std::size_t size) const noexcept { return value_->is_array() && value_->size() == size; }
  void require_list(std::size_t size) const {
    if (!value_->is_array()) fail_as(message("a list of ", size));
    if (value_->size() != size) fail(message("has ", value_->size(), " entries; give ", size));
  }
  /// Entry of a list that `require_list` has seen.
  JsonValue at(std::size_t index) const { return {(*value_)[index], *name_, message(path_, "/", index)}; }

  template <class Scalar>
  Scalar number() const {
    if (!value_->is_number()) fail_as("a number");
    double const number = value_->get<double>();
    if (!std::isfinite(number) || std::abs(number) > double(std::numeric_limits<Scalar>::max()))
      fail_as(message("a number of at most ", double(std::numeric_limits<Scalar>::max()), " in magnitude, which the scalar asked for can hold"));
    return static_cast<Scalar>(number);
  }

  template <class Numbers>
  void read(Numbers& numbers) const {
    require_list(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = at(i).template number<std::remove_cvref_t<decltype(numbers[i])>>();
  }

 private:
  Json const* value_;
  std::string const* name_;
  std::string path_;
};

}  // namespace palpate::detail
