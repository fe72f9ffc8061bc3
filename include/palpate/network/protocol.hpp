// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/network/messages.hpp>

#include <Eigen/Geometry>

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>

namespace palpate {

/// Of the protocol; docs/network.md has it byte by byte. Both sides say in `Hello` and `Welcome` which they speak.
inline constexpr std::uint8_t protocol_version = 1;

/// What can be wrong with bytes that should be messages. Each ends the connection.
enum class ProtocolProblem {
  none,
  no_palpate,    ///< they do not begin with "PALP": another program is at the other end
  version,       ///< of the frame
  type,          ///< there is no such message
  size,          ///< longer or shorter than such a message is
  number,        ///< one that makes no sense: not finite, out of its range
  order          ///< a message that does not belong there
};

constexpr char const* to_string(ProtocolProblem problem) noexcept {
  switch (problem) {
    case ProtocolProblem::none: return "none";
    case ProtocolProblem::no_palpate: return "the bytes are none of this protocol";
    case ProtocolProblem::version: return "a version of the protocol that is not known";
    case ProtocolProblem::type: return "there is no message of this type";
    case ProtocolProblem::size: return "a message of another size than such a one has";
    case ProtocolProblem::number: return "a number in a message makes no sense";
    case ProtocolProblem::order: return "a message that does not belong there";
  }
  return "unknown";
}

/// A message as it came: its type and its bytes, which stay where they are until the stream is read on.
struct Frame {
  MessageType type = MessageType::keep_alive;
  std::span<std::byte const> body{};
};

/// Frame on the wire, all little-endian:
///   0   "PALP"
///   4   version of the protocol, 1 byte
///   5   type, 1 byte
///   6   0, 2 bytes
///   8   length of the body, 4 bytes, at most `max_body`
///   12  body
/// Integers are unsigned, numbers IEEE 754 of 8 bytes, of points that are drawn of 4; a vector is x, y, z, a rotation x, y, z, w; enumerations and truths are one byte.
struct FrameFormat {
  static constexpr std::array<std::uint8_t, 4> magic{'P', 'A', 'L', 'P'};
  static constexpr std::size_t header = 12;
  static constexpr std::size_t max_body = 1u << 16;
};

namespace detail::network {

static_assert(std::numeric_limits<double>::is_iec559 && std::numeric_limits<float>::is_iec559);

template <class Integer>
void put(std::byte* to, Integer value) noexcept {
  for (std::size_t k = 0; k < sizeof value; ++k) to[k] = static_cast<std::byte>(static_cast<std::uint8_t>(value >> (8 * k)));
}
template <class Integer>
Integer taken(std::byte const* from) noexcept {
  Integer value = 0;
  for (std::size_t k = 0; k < sizeof value; ++k) value = static_cast<Integer>(value | static_cast<Integer>(static_cast<Integer>(from[k]) << (8 * k)));
  return value;
}

template <class V>
concept IsRotation = requires(V& value) { value.coeffs(); };

/// What the three do alike: a vector, rotation, enumeration or truth as what it is made of.
template <class Derived>
class Fields {
 public:
  template <class... Values>
  void operator()(Values&... values) {
    (take(values), ...);
  }

 private:
  Derived& self() noexcept { return static_cast<Derived&>(*this); }
  template <class Value>
  void take(Value& value) {
    using Plain = std::remove_cv_t<Value>;
    if constexpr (std::same_as<Plain, double>)
      self().template integer<std::uint64_t>(value);
    else if constexpr (std::same_as<Plain, float>)
      self().template integer<std::uint32_t>(value);
    else if constexpr (std::same_as<Plain, bool> || std::is_enum_v<Plain>)
      self().byte(value);
    else if constexpr (std::unsigned_integral<Plain>)
      self().template integer<Plain>(value);
    else if constexpr (IsRotation<Plain>)
      for (Eigen::Index k = 0; k < 4; ++k) take(value.coeffs()[k]);
    else
      for (Eigen::Index k = 0; k < 3; ++k) take(value[k]);
  }
};

class Measure : public Fields<Measure> {
 public:
  std::size_t size = 0;
  template <class Integer, class Value>
  void integer(Value const&) noexcept {
    size += sizeof(Integer);
  }
  template <class Value>
  void byte(Value const&) noexcept {
    ++size;
  }
};

class Writer : public Fields<Writer> {
 public:
  explicit Writer(std::byte* to) noexcept : to_(to) {}
  template <class Integer, class Value>
  void integer(Value const& value) noexcept {
    put(to_, std::bit_cast<Integer>(value));
    to_ += sizeof(Integer);
  }
  template <class Value>
  void byte(Value const& value) noexcept {
    *to_++ = static_cast<std::byte>(static_cast<std::uint8_t>(value));
  }

 private:
  std::byte* to_;
};

class Reader : public Fields<Reader> {
 public:
  explicit Reader(std::byte const* from) noexcept : from_(from) {}
  template <class Integer, class Value>
  void integer(Value& value) noexcept {
    value = std::bit_cast<Value>(taken<Integer>(from_));
    from_ += sizeof(Integer);
  }
  template <class Value>
  void byte(Value& value) noexcept {
    auto const number = static_cast<std::uint8_t>(*from_++);
    if constexpr (std::same_as<Value, bool>) {
      value = number == 1;
      is_good_ = is_good_ && number <= 1;
    } else {
      value = static_cast<Value>(number);
    }
  }
  bool is_good() const noexcept { return is_good_; }

 private:
  std::byte const* from_;
  bool is_good_ = true;
};

inline void put_header(std::byte* to, MessageType type, std::size_t body) noexcept {
  for (std::size_t k = 0; k < 4; ++k) to[k] = static_cast<std::byte>(FrameFormat::magic[k]);
  to[4] = static_cast<std::byte>(protocol_version);
  to[5] = static_cast<std::byte>(type);
  put(to + 6, std::uint16_t{0});
  put(to + 8, static_cast<std::uint32_t>(body));
}

}  // namespace detail::network

/// A message of fixed size.
template <class M>
concept FixedMessage = requires(M& message, detail::network::Measure& wire) {
  { M::type } -> std::convertible_to<MessageType>;
  { message.valid() } noexcept -> std::same_as<bool>;
  M::layout(message, wire);
};

/// Bytes of its body.
template <FixedMessage M>
std::size_t body_size() noexcept {
  detail::network::Measure measure;
  M message{};
  M::layout(message, measure);
  return measure.size;
}

/// The largest frame of a message of fixed size.
inline constexpr std::size_t max_fixed_frame = 256;

/// The frame of a message, header included: into a buffer of at least `max_fixed_frame` bytes; its length is returned. noexcept, no allocation.
template <FixedMessage M>
std::size_t encode(M const& message, std::span<std::byte, max_fixed_frame> to) noexcept {
  std::size_t const size = body_size<M>();
  detail::network::put_header(to.data(), M::type, size);
  detail::network::Writer writer(to.data() + FrameFormat::header);
  M::layout(message, writer);
  return FrameFormat::header + size;
}

/// The message in a frame of its type; none where its size or a number in it is not as it must be, and `problem` says which.
template <FixedMessage M>
std::optional<M> decode(Frame const& frame, ProtocolProblem& problem) noexcept {
  if (frame.type != M::type || frame.body.size() != body_size<M>()) {
    problem = frame.type != M::type ? ProtocolProblem::type : ProtocolProblem::size;
    return std::nullopt;
  }
  M message{};
  detail::network::Reader reader(frame.body.data());
  M::layout(message, reader);
  if (!reader.is_good() || !message.valid()) {
    problem = ProtocolProblem::number;
    return std::nullopt;
  }
  return message;
}

/// Cuts a stream of bytes into frames. Bytes go into `room()`, `filled(n)` says how many came, then `next()` gives the frames until there is none.
///
/// Invariant  holds one frame of the largest size, never more; allocates once. After a problem it gives nothing more.
/// Errors     `problem()`; every byte of a header is checked before its length is believed.
class FrameStream {
 public:
  FrameStream() : bytes_(std::make_unique<std::byte[]>(capacity)) {}

  /// Where the next bytes go; never empty while `next()` was called until it gave none.
  std::span<std::byte> room() noexcept {
    if (read_ > 0) {   // what is left moves to the front
      std::memmove(bytes_.get(), bytes_.get() + read_, filled_ - read_);
      filled_ -= read_;
      read_ = 0;
    }
    return {bytes_.get() + filled_, capacity - filled_};
  }
  void filled(std::size_t count) noexcept { filled_ += count; }

  /// The next whole frame. Its bytes are valid until `room()` is called.
  std::optional<Frame> next() noexcept {
    if (problem_ != ProtocolProblem::none) return std::nullopt;
    std::byte const* const at = bytes_.get() + read_;
    std::size_t const there = filled_ - read_;
    for (std::size_t k = 0; k < FrameFormat::magic.size() && k < there; ++k)
      if (at[k] != static_cast<std::byte>(FrameFormat::magic[k])) return fail(ProtocolProblem::no_palpate);
    if (there > 4 && static_cast<std::uint8_t>(at[4]) != protocol_version) return fail(ProtocolProblem::version);
    if (there < FrameFormat::header) return std::nullopt;
    auto const type = static_cast<std::uint8_t>(at[5]);
    if (type < static_cast<std::uint8_t>(MessageType::hello) || type > static_cast<std::uint8_t>(MessageType::drawn)) return fail(ProtocolProblem::type);
    std::size_t const size = detail::network::taken<std::uint32_t>(at + 8);
    if (size > FrameFormat::max_body || detail::network::taken<std::uint16_t>(at + 6) != 0) return fail(ProtocolProblem::size);
    if (there < FrameFormat::header + size) return std::nullopt;
    read_ += FrameFormat::header + size;
    return Frame{static_cast<MessageType>(type), {at + FrameFormat::header, size}};
  }

  ProtocolProblem problem() const noexcept { return problem_; }
  /// Forgets all: another connection begins.
  void reset() noexcept {
    filled_ = read_ = 0;
    problem_ = ProtocolProblem::none;
  }

 private:
  static constexpr std::size_t capacity = FrameFormat::header + FrameFormat::max_body;

  std::optional<Frame> fail(ProtocolProblem problem) noexcept {
    problem_ = problem;
    return std::nullopt;
  }

  std::unique_ptr<std::byte[]> bytes_;
  std::size_t filled_ = 0, read_ = 0;
  ProtocolProblem problem_ = ProtocolProblem::none;
};

}  // namespace palpate
