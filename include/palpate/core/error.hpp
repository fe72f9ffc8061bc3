// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdio>
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

inline std::string to_text(std::string_view text) { return std::string(text); }
inline std::string to_text(std::integral auto number) { return std::to_string(number); }
inline std::string to_text(std::floating_point auto number) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", static_cast<double>(number));
  return buffer;
}

/// The parts, one after the other: `message("particle ", 12, " is outside 0 … ", 9)`.
template <class... Parts>
std::string message(Parts const&... parts) {
  std::string text;
  (text.append(to_text(parts)), ...);
  return text;
}

/// Throws `OutOfRange` unless 0 ≤ index < size. `what` names the kind: "particle", "triangle".
inline void check_index(std::string_view what, long long index, long long size) {
  if (index < 0 || index >= size)
    throw OutOfRange(message(what, " index ", index, " is outside 0 … ", size - 1, "; there are ", size));
}

}  // namespace detail

}  // namespace palpate
