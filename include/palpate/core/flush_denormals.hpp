// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#if defined(__SSE2__) || defined(_M_X64)
#include <xmmintrin.h>
#endif

namespace palpate {

/// Numbers too small for a normal exponent (below 2.2e-308, as float below 1.2e-38) are zero in this thread for as long as it lives.
/// A filter's tail or a force that fades ends in such numbers, and on many processors one operation with them takes a hundred times as long.
///   x86: FTZ (results) and DAZ (operands) of MXCSR. 64-bit ARM: FZ of FPCR, which is both.
/// Threads    of the calling thread alone, and to be destroyed by it; a thread started meanwhile may inherit it.
/// Cost       one register read and written; noexcept. The bits that were set before are set again at the end.
/// Limits     not IEEE 754 any more: x − y may be zero where x ≠ y. Other processors: `active()` is false and nothing has changed.
class FlushDenormals {
 public:
  FlushDenormals() noexcept : before_(mode()) {
    set_mode(before_ | flush);
    active_ = flush != 0 && (mode() & flush) == flush;
  }
  ~FlushDenormals() { set_mode((mode() & ~flush) | (before_ & flush)); }
  FlushDenormals(FlushDenormals const&) = delete;
  FlushDenormals& operator=(FlushDenormals const&) = delete;

  /// True where the processor has taken it over: read back, not assumed.
  bool active() const noexcept { return active_; }
  static constexpr bool available() noexcept { return flush != 0; }

 private:
#if defined(__SSE2__) || defined(_M_X64)
  static constexpr std::uint64_t flush = 0x8040;   // bit 15 FTZ, bit 6 DAZ
  static std::uint64_t mode() noexcept { return _mm_getcsr(); }
  static void set_mode(std::uint64_t mode) noexcept { _mm_setcsr(static_cast<unsigned>(mode)); }
#elif defined(__aarch64__) && defined(__GNUC__)
  static constexpr std::uint64_t flush = std::uint64_t{1} << 24;   // FZ
  static std::uint64_t mode() noexcept {
    std::uint64_t value;
    asm volatile("mrs %0, fpcr" : "=r"(value));
    return value;
  }
  static void set_mode(std::uint64_t mode) noexcept { asm volatile("msr fpcr, %0" : : "r"(mode)); }
#else
  static constexpr std::uint64_t flush = 0;
  static std::uint64_t mode() noexcept { return 0; }
  static void set_mode(std::uint64_t) noexcept {}
#endif

  std::uint64_t before_;
  bool active_ = false;
};

}  // namespace palpate
