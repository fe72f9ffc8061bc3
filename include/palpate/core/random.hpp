// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

namespace palpate {

/// The start of a random sequence. The same seed gives the same numbers in every run.
struct Seed {
  std::uint64_t value = 0;
};

/// SplitMix64: a 64-bit counter with a mixing step. Good enough to fill the state of another generator, which
/// is its use here.
/// Source     \cite steele2014
class SplitMix64 {
 public:
  constexpr explicit SplitMix64(Seed seed) noexcept : state_(seed.value) {}

  constexpr std::uint64_t operator()() noexcept {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

 private:
  std::uint64_t state_;
};

/// Seeded random numbers: the generator xoshiro256**, its state filled by SplitMix64.
///   uniform()  k · 2^−p with the p upper bits of a word, p = 24 (float) or 53 (double)
///   normal()   polar method on a pair of 31-bit integers (u, v), q = (u² + v²) / 2^62 < 1:
///              (u, v) · 2^−31 · √(−2 ln q / q), two values a pair
/// Source     \cite blackman2021, \cite marsaglia1964
/// Invariant  The same seed gives the same numbers with gcc and clang, with or without fused multiply-add:
///            everything before the logarithm is integer arithmetic. (The standard's distributions differ
///            between libraries.) The logarithm is the C library's; another C library may change the last bit
///            of a normal number. normal<float>() is normal<double>() rounded, so both scalars follow the
///            same sequence.
/// Cost       About 1 ns a word and 10 ns a normal number; noexcept, no allocation: allowed in the servo tick.
/// Limits     Not for cryptography. A normal number is never larger than 9.3 in magnitude. One object serves
///            one thread.
///
/// Also a standard uniform random bit generator; `std::shuffle` takes it, and gives another order with another standard library: see `shuffle`.
class Random {
 public:
  using result_type = std::uint64_t;
  using State = std::array<std::uint64_t, 4>;

  constexpr explicit Random(Seed seed = {}) noexcept : state_{} {
    SplitMix64 fill(seed);
    for (auto& word : state_) word = fill();
  }

  /// Starts from a raw state, to continue a stored sequence. All four words zero would only give zeros: seed
  /// 0 is taken instead.
  constexpr explicit Random(State const& state) noexcept : Random() {
    if (state != State{}) state_ = state;
  }

  static constexpr result_type min() noexcept { return 0; }
  static constexpr result_type max() noexcept { return std::numeric_limits<result_type>::max(); }

  /// 64 random bits.
  constexpr result_type operator()() noexcept {
    std::uint64_t const result = std::rotl(state_[1] * 5, 7) * 9;
    std::uint64_t const shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1).
  template <RealScalar Scalar = double>
  constexpr Scalar uniform() noexcept {
    constexpr int bits = std::numeric_limits<Scalar>::digits;
    constexpr Scalar unit = Scalar(1) / Scalar(std::uint64_t{1} << bits);
    return Scalar((*this)() >> (64 - bits)) * unit;
  }

  /// Uniform in [low, high), up to rounding at the upper end.
  template <RealScalar Scalar>
  constexpr Scalar uniform(Scalar low, Scalar high) noexcept {
    return low + (high - low) * uniform<Scalar>();
  }

  /// Uniform in {0 … count − 1}, without bias. `count` 0 gives 0.
  constexpr std::uint64_t below(std::uint64_t count) noexcept {
    if (count < 2) return 0;
    std::uint64_t const fair = max() - max() % count;   // a multiple of count
    std::uint64_t word = (*this)();
    while (word >= fair) word = (*this)();
    return word % count;
  }

  /// Normal with mean 0 and variance 1.
  template <RealScalar Scalar = double>
  Scalar normal() noexcept {
    if (has_spare_) {
      has_spare_ = false;
      return Scalar(spare_);
    }
    constexpr std::uint64_t one = std::uint64_t{1} << 62;
    std::int64_t u = 0;
    std::int64_t v = 0;
    std::uint64_t square = 0;
    do {
      std::uint64_t const word = (*this)();
      u = signed_upper_half(word);
      v = signed_upper_half(word << 32);
      square = static_cast<std::uint64_t>(u * u) + static_cast<std::uint64_t>(v * v);
    } while (square >= one || square == 0);
    double const q = static_cast<double>(square) * 0x1p-62;
    double const stretch = std::sqrt(-2.0 * std::log(q) / q) * 0x1p-31;
    spare_ = static_cast<double>(v) * stretch;
    has_spare_ = true;
    return Scalar(static_cast<double>(u) * stretch);
  }

 private:
  /// The upper 32 bits of a word as an integer in [−2^31, 2^31).
  static constexpr std::int64_t signed_upper_half(std::uint64_t word) noexcept {
    return static_cast<std::int64_t>(word >> 32) - (std::int64_t{1} << 31);
  }

  State state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

/// Puts values into a random order, the same one with every standard library.
template <class T>
constexpr void shuffle(std::span<T> values, Random& random) noexcept {
  for (std::size_t left = values.size(); left > 1; --left) std::swap(values[left - 1], values[static_cast<std::size_t>(random.below(left))]);
}

}  // namespace palpate
