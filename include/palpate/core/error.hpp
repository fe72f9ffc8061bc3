// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/requirements.hpp>

#include <cmath>
#include <concepts>
#include <cstdio>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>

namespace palpate {

/// What every exception of the library is. The text says what is wrong, where, which value, and what to do instead.
/// Exceptions belong to set-up calls only; nothing on the servo path throws.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An argument or option outside its meaning: a negative mass, a force that is not finite.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// An index of a particle, triangle or contact that does not exist.
class OutOfRange : public Error {
 public:
  using Error::Error;
};

/// A mesh the library can not work on.
class InvalidMesh : public Error {
 public:
  using Error::Error;
};

/// A file that can not be read, parsed or written.
class FileError : public Error {
 public:
  using Error::Error;
};

namespace detail {

/// A part of a message: a text, or a number as text.
class MessagePart {
 public:
  explicit MessagePart(std::string_view text) noexcept : text_(text) {}
  explicit MessagePart(std::signed_integral auto number) noexcept { print("%lld", static_cast<long long>(number)); }
  explicit MessagePart(std::unsigned_integral auto number) noexcept { print("%llu", static_cast<unsigned long long>(number)); }
  explicit MessagePart(std::floating_point auto number) noexcept { print("%.9g", static_cast<double>(number)); }

  std::string_view text() const noexcept { return text_.data() != nullptr ? text_ : std::string_view(number_); }

 private:
  template <class Number>
  void print(char const* format, Number number) noexcept { std::snprintf(number_, sizeof number_, format, number); }

  std::string_view text_;
  char number_[32] = "";
};

inline std::string joined(std::initializer_list<MessagePart> parts) {
  std::string text;
  for (MessagePart const& part : parts) text.append(part.text());
  return text;
}

inline std::string to_text(auto const& part) { return std::string(MessagePart(part).text()); }

/// The parts, one after the other: `message("particle ", 12, " is outside 0 … ", 9)`. One function writes every message, so that the
/// hundreds of places with one stay cheap to compile.
template <class... Parts>
std::string message(Parts const&... parts) {
  return joined({MessagePart(parts)...});
}

/// Throws `OutOfRange` unless 0 ≤ index < size. `what` names the kind: "particle", "triangle".
inline void check_index(std::string_view what, long long index, long long size) {
  if (index < 0 || index >= size)
    throw OutOfRange(message(what, " index ", index, " is outside 0 … ", size - 1, "; there are ", size));
}

template <std::floating_point Scalar>
void require_non_negative(std::string_view what, Scalar value, std::string_view unit) {
  if (!(value >= 0) || !std::isfinite(value)) throw InvalidArgument(message(what, " is ", value, " ", unit, "; it must be finite and not negative"));
}
template <std::floating_point Scalar>
void require_positive(std::string_view what, Scalar value, std::string_view unit) {
  if (!(value > 0) || !std::isfinite(value)) throw InvalidArgument(message(what, " is ", value, " ", unit, "; it must be finite and positive"));
}

/// Checks options of an owner, whose name opens each message. `finite`: all of them have to be finite as well.
struct OptionCheck {
  char const* owner;
  bool finite = false;

  void operator()(bool good, char const* what, double value, char const* unit, char const* advice) const {
    if (!good || (finite && !std::isfinite(value))) throw InvalidArgument(message(owner, ": ", what, " is ", value, unit, "; ", advice));
  }
  void operator()(bool good, char const* what, double value, char const* advice) const { (*this)(good, what, value, "", advice); }
  void positive(char const* what, double value, char const* unit = "") const {
    (*this)(value > 0.0 && std::isfinite(value), what, value, unit, "give a finite number above zero");
  }
  void not_negative(char const* what, double value, char const* unit = "") const {
    (*this)(value >= 0.0 && std::isfinite(value), what, value, unit, "give a finite number, zero or more");
  }
};

}  // namespace detail

}  // namespace palpate
