// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace palpate::detail {

/// CRC-32 as in Ethernet and PNG (polynomial 0x04C11DB7, reflected): finds every change of up to 32 neighbouring bits.
/// Source     \cite iso3309
inline std::uint32_t crc32(std::string_view bytes) noexcept {
  static constexpr auto table = [] {
    std::array<std::uint32_t, 256> entries{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t word = n;
      for (int bit = 0; bit < 8; ++bit) word = (word & 1u) != 0 ? 0xEDB88320u ^ (word >> 1) : word >> 1;
      entries[n] = word;
    }
    return entries;
  }();
  std::uint32_t sum = 0xFFFFFFFFu;
  for (char const c : bytes) sum = table[(sum ^ static_cast<unsigned char>(c)) & 0xFFu] ^ (sum >> 8);
  return sum ^ 0xFFFFFFFFu;
}

/// Numbers as bytes, the lowest first on every machine.
class ByteWriter {
 public:
  template <std::unsigned_integral Word>
  void put(Word word) {
    for (std::size_t i = 0; i < sizeof(Word); ++i) bytes_ += static_cast<char>(static_cast<unsigned char>((word >> (8 * i)) & 0xFFu));
  }
  /// One pattern of bits for every NaN, as in the text.
  void put(double value) { put(std::bit_cast<std::uint64_t>(std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value)); }
  void put(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
  }
  void raw(std::string_view bytes) { bytes_ += bytes; }

  std::string& bytes() noexcept { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes bytes apart. `fail(where, what)` throws; it is called before anything beyond the end is touched.
template <class Fail>
class ByteReader {
 public:
  ByteReader(std::string_view bytes, Fail fail) : bytes_(bytes), fail_(fail) {}

  template <std::unsigned_integral Word>
  Word word(std::string_view what) {
    need(sizeof(Word), what);
    Word word = 0;
    for (std::size_t i = 0; i < sizeof(Word); ++i)
      word = static_cast<Word>(word | static_cast<Word>(static_cast<Word>(static_cast<unsigned char>(bytes_[at_ + i])) << (8 * i)));
    at_ += sizeof(Word);
    return word;
  }
  double number(std::string_view what) { return std::bit_cast<double>(word<std::uint64_t>(what)); }
  std::string text(std::string_view what) {
    auto const length = word<std::uint32_t>(what);
    need(length, what);
    std::string const text(bytes_.substr(at_, length));
    at_ += length;
    return text;
  }
  /// How many things of at least `least` bytes follow; checked against the bytes that are left, before anybody makes room for them.
  std::size_t count(std::size_t least, std::string_view what) {
    std::size_t const at = at_;
    auto const count = word<std::uint64_t>(what);
    if (count > (bytes_.size() - at_) / least) fail_(at, what);
    return static_cast<std::size_t>(count);
  }

  std::size_t at() const noexcept { return at_; }
  std::size_t left() const noexcept { return bytes_.size() - at_; }

 private:
  void need(std::size_t size, std::string_view what) {
    if (size > left()) fail_(at_, what);
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  Fail fail_;
};

}  // namespace palpate::detail
