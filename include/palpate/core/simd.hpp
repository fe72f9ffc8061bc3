// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>
#include <limits>
#include <type_traits>

/// PALPATE_PLAIN_SIMD, defined for all units of a program, computes without vector types, as where the compiler has none.
#if defined(__GNUC__) && !defined(PALPATE_PLAIN_SIMD)
#define PALPATE_SIMD_REGISTERS 1
#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>   // a fifth of the parsing
#endif
#endif

/// Numbers that are added, multiplied and divided at once. Pack<S, 4> is a column (x, y, z, 0), or one number of four links; Pack<S, 8> is two of
/// either, where a register holds them.
/// Calling    functions take packs by reference: how they are passed by value depends on the processor that is compiled for.
/// Not Eigen's arrays: those would not stay in registers through the force loop, and std::sqrt is not vectorised as long as it may set errno.
namespace palpate::simd {

/// The widest register [bytes] that this program is compiled for.
#if !defined(PALPATE_SIMD_REGISTERS)
inline constexpr int register_size = 0;
#elif defined(__AVX512F__)
inline constexpr int register_size = 64;
#elif defined(__AVX__)
inline constexpr int register_size = 32;
#else
inline constexpr int register_size = 16;
#endif

/// Twice as many numbers as a register holds, or two numbers: a vector type that is wider than a register would be taken apart into single numbers.
template <class Half, class Scalar>
struct Halves {
  Half low, high;

  Halves() = default;
  Halves(Half const& first, Half const& second) noexcept : low(first), high(second) {}
  Halves(Scalar x, Scalar y, Scalar z, Scalar w) noexcept : low{x, y}, high{z, w} {}

  template <std::integral Index>
  Scalar operator[](Index k) const noexcept {
    if constexpr (std::same_as<Half, Scalar>)
      return k == 0 ? low : high;
    else
      return k < 2 ? low[k] : high[k - 2];
  }

  friend Halves operator+(Halves const& a, Halves const& b) noexcept { return {a.low + b.low, a.high + b.high}; }
  friend Halves operator-(Halves const& a, Halves const& b) noexcept { return {a.low - b.low, a.high - b.high}; }
  friend Halves operator*(Halves const& a, Halves const& b) noexcept { return {a.low * b.low, a.high * b.high}; }
  friend Halves operator/(Halves const& a, Halves const& b) noexcept { return {a.low / b.low, a.high / b.high}; }
  friend Halves operator*(Scalar a, Halves const& b) noexcept { return {a * b.low, a * b.high}; }
  friend Halves operator*(Halves const& a, Scalar b) noexcept { return {a.low * b, a.high * b}; }
  friend Halves operator/(Scalar a, Halves const& b) noexcept { return {a / b.low, a / b.high}; }
  friend Halves operator/(Halves const& a, Scalar b) noexcept { return {a.low / b, a.high / b}; }
  Halves operator-() const noexcept { return {-low, -high}; }
  template <class Other>
  Halves& operator+=(Other const& b) noexcept { return *this = *this + b; }
  template <class Other>
  Halves& operator-=(Other const& b) noexcept { return *this = *this - b; }
  template <class Other>
  Halves& operator*=(Other const& b) noexcept { return *this = *this * b; }
  template <class Other>
  Halves& operator/=(Other const& b) noexcept { return *this = *this / b; }
};

#if defined(PALPATE_SIMD_REGISTERS)
template <RealScalar Scalar, int Count>
struct VectorOf {
  typedef Scalar type __attribute__((vector_size(Count * sizeof(Scalar))));   // `using` takes no dependent attribute in clang
};
#else
template <RealScalar Scalar, int Count>
struct VectorOf {
  using type = Scalar;   // one number
};
#endif
template <RealScalar Scalar, int Count, bool register_holds_it = (Count == 1 || Count * int{sizeof(Scalar)} <= register_size)>
struct PackOf : VectorOf<Scalar, Count> {};
template <RealScalar Scalar, int Count>
struct PackOf<Scalar, Count, false> {
  using type = Halves<typename PackOf<Scalar, Count / 2>::type, Scalar>;
};

template <RealScalar Scalar, int Count>
using Pack = typename PackOf<Scalar, Count>::type;

/// Numbers of links in a row: eight where a register holds them, else four.
template <RealScalar Scalar>
inline constexpr int row_width = 8 * int{sizeof(Scalar)} <= register_size ? 8 : 4;
/// As many columns behind each other as a register holds; one where it does not hold two.
template <RealScalar Scalar>
inline constexpr int columns_in_register = row_width<Scalar> == 8 ? register_size / (4 * int{sizeof(Scalar)}) : 1;

template <class Numbers, RealScalar Scalar>
inline void load(Numbers& to, Scalar const* from) noexcept {
  std::memcpy(&to, from, sizeof(to));
}
template <RealScalar Scalar, class Numbers>
inline void store(Scalar* to, Numbers const& from) noexcept {
  std::memcpy(to, &from, sizeof(from));
}
template <class Half, RealScalar Scalar>
inline void load(Halves<Half, Scalar>& to, Scalar const* from) noexcept {   // half by half: an object that is copied as a whole stays in memory
  load(to.low, from), load(to.high, from + sizeof(Half) / sizeof(Scalar));
}
template <RealScalar Scalar, class Half>
inline void store(Scalar* to, Halves<Half, Scalar> const& from) noexcept {
  store(to, from.low), store(to + sizeof(Half) / sizeof(Scalar), from.high);
}

/// Two columns as one, and back.
template <class Two, class One>
inline void join(Two& to, One const& low, One const& high) noexcept {
  std::memcpy(&to, &low, sizeof(low)), std::memcpy(reinterpret_cast<char*>(&to) + sizeof(low), &high, sizeof(high));
}
template <class One, class Two>
inline void split(One& low, One& high, Two const& from) noexcept {
  std::memcpy(&low, &from, sizeof(low)), std::memcpy(&high, reinterpret_cast<char const*>(&from) + sizeof(low), sizeof(high));
}

/// to = √from, each correctly rounded.
template <class Numbers>
inline void square_root(Numbers& to, Numbers const& from) noexcept {
  if constexpr (std::floating_point<Numbers>)
    to = std::sqrt(from);
  else
    for (int k = 0; k < static_cast<int>(sizeof(to) / sizeof(to[0])); ++k) to[k] = std::sqrt(from[k]);
}

/// Whether each is below the bound; a NaN is not.
template <class Numbers, class Scalar>
inline bool all_below(Numbers const& value, Scalar bound) noexcept {
  if constexpr (std::floating_point<Numbers>) {
    return value < bound;
  } else {
    bool all = true;
    for (int k = 0; k < static_cast<int>(sizeof(value) / sizeof(value[0])); ++k) all = all && value[k] < bound;
    return all;
  }
}

// What the instruction set has by itself; before what calls it, since the names of built-in types are looked up where a template is written.
#if defined(PALPATE_SIMD_REGISTERS) && defined(__SSE2__)
inline void square_root(Pack<float, 4>& to, Pack<float, 4> const& from) noexcept { to = _mm_sqrt_ps(from); }
inline void square_root(Pack<double, 2>& to, Pack<double, 2> const& from) noexcept { to = _mm_sqrt_pd(from); }
inline bool all_below(Pack<float, 4> const& value, float bound) noexcept { return _mm_movemask_ps(_mm_cmplt_ps(value, _mm_set1_ps(bound))) == 15; }
inline bool all_below(Pack<double, 2> const& value, double bound) noexcept { return _mm_movemask_pd(_mm_cmplt_pd(value, _mm_set1_pd(bound))) == 3; }
#endif
#if defined(PALPATE_SIMD_REGISTERS) && defined(__SSE2__) && !defined(__AVX__)
inline bool all_below(Pack<double, 4> const& value, double bound) noexcept {   // one branch: two cost a tenth of a step
  __m128d const most = _mm_set1_pd(bound);
  return _mm_movemask_pd(_mm_and_pd(_mm_cmplt_pd(value.low, most), _mm_cmplt_pd(value.high, most))) == 3;
}
#endif
#if defined(PALPATE_SIMD_REGISTERS) && defined(__AVX__)
inline void square_root(Pack<double, 4>& to, Pack<double, 4> const& from) noexcept { to = _mm256_sqrt_pd(from); }
inline void square_root(Pack<float, 8>& to, Pack<float, 8> const& from) noexcept { to = _mm256_sqrt_ps(from); }
inline bool all_below(Pack<double, 4> const& value, double bound) noexcept {
  return _mm256_movemask_pd(_mm256_cmp_pd(value, _mm256_set1_pd(bound), _CMP_LT_OQ)) == 15;
}
inline bool all_below(Pack<float, 8> const& value, float bound) noexcept {
  return _mm256_movemask_ps(_mm256_cmp_ps(value, _mm256_set1_ps(bound), _CMP_LT_OQ)) == 255;
}
// One instruction each, which takes its second operand from memory: gcc makes shuffles of registers otherwise.
inline void join(Pack<float, 8>& to, Pack<float, 4> const& low, Pack<float, 4> const& high) noexcept {
  to = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
}
inline void split(Pack<float, 4>& low, Pack<float, 4>& high, Pack<float, 8> const& from) noexcept {
  low = _mm256_castps256_ps128(from), high = _mm256_extractf128_ps(from, 1);
}
#endif
#if defined(PALPATE_SIMD_REGISTERS) && defined(__AVX512F__)
// With masks of ones, which cost nothing: without them gcc 12 warns of its own header.
inline void square_root(Pack<double, 8>& to, Pack<double, 8> const& from) noexcept { to = _mm512_maskz_sqrt_pd(255, from); }
inline bool all_below(Pack<double, 8> const& value, double bound) noexcept {
  return _mm512_cmp_pd_mask(value, _mm512_set1_pd(bound), _CMP_LT_OQ) == 255;
}
inline bool all_below(Pack<float, 16> const& value, float bound) noexcept {
  return _mm512_cmp_ps_mask(value, _mm512_set1_ps(bound), _CMP_LT_OQ) == 65535;
}
inline void join(Pack<double, 8>& to, Pack<double, 4> const& low, Pack<double, 4> const& high) noexcept {
  to = _mm512_maskz_insertf64x4(255, _mm512_castpd256_pd512(low), high, 1);
}
inline void join(Pack<float, 16>& to, Pack<float, 8> const& low, Pack<float, 8> const& high) noexcept {
  to = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}
inline void split(Pack<float, 8>& low, Pack<float, 8>& high, Pack<float, 16> const& from) noexcept {
  low = __builtin_shufflevector(from, from, 0, 1, 2, 3, 4, 5, 6, 7), high = __builtin_shufflevector(from, from, 8, 9, 10, 11, 12, 13, 14, 15);
}
inline void split(Pack<double, 4>& low, Pack<double, 4>& high, Pack<double, 8> const& from) noexcept {
  low = _mm512_maskz_extractf64x4_pd(15, from, 0), high = _mm512_maskz_extractf64x4_pd(15, from, 1);
}
#endif

template <class Half, class Scalar>
inline void square_root(Halves<Half, Scalar>& to, Halves<Half, Scalar> const& from) noexcept {
  square_root(to.low, from.low), square_root(to.high, from.high);
}
template <class Half, class Scalar>
inline bool all_below(Halves<Half, Scalar> const& value, Scalar bound) noexcept {
  return all_below(value.low, bound) && all_below(value.high, bound);
}

/// root = √from, each correctly rounded, and inverse = 1/root, to a unit in the last place; 0 < from < ∞.
template <class Numbers>
inline void root_and_inverse(Numbers& root, Numbers& inverse, Numbers const& from) noexcept {
  square_root(root, from);
  inverse = 1 / root;
}

#if defined(PALPATE_SIMD_REGISTERS) && defined(__AVX512F__)
/// Without the unit that takes roots and divides, for which eight doubles would wait. Goldschmidt's iteration doubles the digits of √from and
/// 1/(2√from) twice, from 14 binary ones; then what is left of from − root² and 1 − root · inverse, which a fused multiplication has exactly,
/// rounds both as they should be \cite markstein2004, the inverse but for a root whose digits are all ones.
inline void root_and_inverse(Pack<double, 8>& root, Pack<double, 8>& inverse, Pack<double, 8> const& from) noexcept {
  __m512d const half = _mm512_set1_pd(0.5), one = _mm512_set1_pd(1.0);
  __m512d const guess = _mm512_maskz_rsqrt14_pd(255, from);
  __m512d r = from * guess, h = half * guess;
  for (int k = 0; k < 2; ++k) {
    __m512d const rest = _mm512_fnmadd_pd(r, h, half);
    r = _mm512_fmadd_pd(r, rest, r), h = _mm512_fmadd_pd(h, rest, h);
  }
  r = _mm512_fmadd_pd(_mm512_fnmadd_pd(r, r, from), h, r);
  __m512d const twice = h + h;
  root = r, inverse = _mm512_fmadd_pd(_mm512_fnmadd_pd(r, twice, one), twice, twice);
}
#endif

/// to = ln from, to three units in the last place. Of from = m 2ᵉ, √½ ≤ m < √2, it is e ln 2 + 2 artanh((m − 1)/(m + 1)), by its series; where one of them
/// is no normal number above zero that of the standard library.
template <class Numbers>
inline void logarithm(Numbers& to, Numbers const& from) noexcept {
  if constexpr (std::floating_point<Numbers>) {
    to = std::log(from);
  } else {
#if defined(PALPATE_SIMD_REGISTERS)
    using Scalar = std::remove_cvref_t<decltype(from[0])>;
    if (!(all_below(Numbers(-from), -std::numeric_limits<Scalar>::min()) && all_below(from, std::numeric_limits<Scalar>::max()))) {
      for (int k = 0; k < static_cast<int>(sizeof(to) / sizeof(to[0])); ++k) to[k] = std::log(from[k]);
      return;
    }
    using Bits = std::conditional_t<sizeof(Scalar) == 8, long long, int>;
    typedef Bits Whole __attribute__((vector_size(sizeof(Numbers))));
    constexpr int digits = std::numeric_limits<Scalar>::digits - 1, terms = sizeof(Scalar) == 8 ? 11 : 5;
    constexpr Scalar shift = Scalar(3) * static_cast<Scalar>(Bits(1) << (digits - 1));   // added to a small whole number, that is in its last digits
    Whole const bits = std::bit_cast<Whole>(from), one = std::bit_cast<Whole>(Numbers{} + Scalar(1)), zero = std::bit_cast<Whole>(Numbers{} + shift);
    Numbers m = std::bit_cast<Numbers>((bits & ((Bits(1) << digits) - 1)) | one), e = std::bit_cast<Numbers>(((bits - one) >> digits) + zero) - shift;
    auto const large = m > Scalar(1.4142135623730951);
    m = large ? Scalar(0.5) * m : m, e = large ? e + Scalar(1) : e;
    Numbers const f = (m - Scalar(1)) / (m + Scalar(1)), square = f * f;
    Numbers sum = Numbers{} + Scalar(1) / Scalar(2 * terms - 1);
    for (int k = terms - 1; k > 0; --k) sum = sum * square + Scalar(1) / Scalar(2 * k - 1);
    to = e * Scalar(0.69314718055994531) + Scalar(2) * f * sum;
#endif
  }
}
template <class Half, class Scalar>
inline void logarithm(Halves<Half, Scalar>& to, Halves<Half, Scalar> const& from) noexcept {
  logarithm(to.low, from.low), logarithm(to.high, from.high);
}

/// Each that is below the bound, or NaN, becomes the bound: one number for all, or a pack of them.
template <class Numbers, class Bound>
inline void raise_to(Numbers& value, Bound const& bound) noexcept {
  value = value > bound ? value : bound + Numbers{};
}
template <class Half, class Scalar, class Bound>
inline void raise_to(Halves<Half, Scalar>& value, Bound const& bound) noexcept {
  if constexpr (std::same_as<Bound, Scalar>)
    raise_to(value.low, bound), raise_to(value.high, bound);
  else
    raise_to(value.low, bound.low), raise_to(value.high, bound.high);
}

/// What sum_each() needs of a column: of one in halves their sum, which is half as many registers.
template <class Numbers>
inline Numbers fold(Numbers const& column) noexcept {
  return column;
}
template <class Half, class Scalar>
inline Half fold(Halves<Half, Scalar> const& column) noexcept {
  return column.low + column.high;
}

/// sums[k] = the sum of the four of column k. Two shuffles for each pair of columns that are one instruction each.
template <class Pair, class Scalar>
inline void sum_each(Halves<Pair, Scalar>& sums, Pair const (&half)[4]) noexcept {
#if defined(PALPATE_SIMD_REGISTERS)
  sums = {__builtin_shufflevector(half[0], half[1], 0, 2) + __builtin_shufflevector(half[0], half[1], 1, 3),
          __builtin_shufflevector(half[2], half[3], 0, 2) + __builtin_shufflevector(half[2], half[3], 1, 3)};
#else
  sums = {fold(half[0]), fold(half[1]), fold(half[2]), fold(half[3])};
#endif
}
template <class Pair, class Scalar>
inline void sum_each(Halves<Pair, Scalar>& sums, Halves<Pair, Scalar> const (&column)[4]) noexcept {
  Pair const half[4] = {fold(column[0]), fold(column[1]), fold(column[2]), fold(column[3])};
  sum_each(sums, half);
}
#if defined(PALPATE_SIMD_REGISTERS)
inline void sum_each(Pack<float, 4>& sums, Pack<float, 4> const (&column)[4]) noexcept {
  Pack<float, 4> const left = __builtin_shufflevector(column[0], column[1], 0, 4, 1, 5) + __builtin_shufflevector(column[0], column[1], 2, 6, 3, 7);
  Pack<float, 4> const right = __builtin_shufflevector(column[2], column[3], 0, 4, 1, 5) + __builtin_shufflevector(column[2], column[3], 2, 6, 3, 7);
  sums = __builtin_shufflevector(left, right, 0, 1, 4, 5) + __builtin_shufflevector(left, right, 2, 3, 6, 7);
}
#endif
#if defined(PALPATE_SIMD_REGISTERS) && defined(__AVX__)
inline void sum_each(Pack<double, 4>& sums, Pack<double, 4> const (&column)[4]) noexcept {
  using Sums = Pack<double, 4>;
  Sums const left = __builtin_shufflevector(column[0], column[1], 0, 4, 2, 6) + __builtin_shufflevector(column[0], column[1], 1, 5, 3, 7);
  Sums const right = __builtin_shufflevector(column[2], column[3], 0, 4, 2, 6) + __builtin_shufflevector(column[2], column[3], 1, 5, 3, 7);
  sums = __builtin_shufflevector(left, right, 0, 1, 4, 5) + __builtin_shufflevector(left, right, 2, 3, 6, 7);
}
/// sums[k] and sums[4 + k] = the sums of both columns in column[k].
inline void sum_each(Pack<float, 8>& sums, Pack<float, 8> const (&column)[4]) noexcept {
  using Sums = Pack<float, 8>;
  Sums const left = __builtin_shufflevector(column[0], column[1], 0, 8, 1, 9, 4, 12, 5, 13) +
                    __builtin_shufflevector(column[0], column[1], 2, 10, 3, 11, 6, 14, 7, 15);
  Sums const right = __builtin_shufflevector(column[2], column[3], 0, 8, 1, 9, 4, 12, 5, 13) +
                     __builtin_shufflevector(column[2], column[3], 2, 10, 3, 11, 6, 14, 7, 15);
  sums = __builtin_shufflevector(left, right, 0, 1, 8, 9, 4, 5, 12, 13) + __builtin_shufflevector(left, right, 2, 3, 10, 11, 6, 7, 14, 15);
}
#endif
#if defined(PALPATE_SIMD_REGISTERS) && defined(__AVX512F__)
inline void sum_each(Pack<double, 8>& sums, Pack<double, 8> const (&column)[4]) noexcept {
  using Sums = Pack<double, 8>;
  Sums const left = __builtin_shufflevector(column[0], column[1], 0, 8, 2, 10, 4, 12, 6, 14) +
                    __builtin_shufflevector(column[0], column[1], 1, 9, 3, 11, 5, 13, 7, 15);
  Sums const right = __builtin_shufflevector(column[2], column[3], 0, 8, 2, 10, 4, 12, 6, 14) +
                     __builtin_shufflevector(column[2], column[3], 1, 9, 3, 11, 5, 13, 7, 15);
  sums = __builtin_shufflevector(left, right, 0, 1, 8, 9, 4, 5, 12, 13) + __builtin_shufflevector(left, right, 2, 3, 10, 11, 6, 7, 14, 15);
}
#endif

/// to[k] = column[k] times number k of `factor`; with two columns each, the second times number 4 + k.
template <class Numbers>
inline void scale_each(Numbers (&to)[4], Numbers const* column, Numbers const& factor) noexcept {
#if defined(PALPATE_SIMD_REGISTERS)
  if constexpr (sizeof(Numbers) == 8 * sizeof(factor[0])) {
    to[0] = __builtin_shufflevector(factor, factor, 0, 0, 0, 0, 4, 4, 4, 4) * column[0];
    to[1] = __builtin_shufflevector(factor, factor, 1, 1, 1, 1, 5, 5, 5, 5) * column[1];
    to[2] = __builtin_shufflevector(factor, factor, 2, 2, 2, 2, 6, 6, 6, 6) * column[2];
    to[3] = __builtin_shufflevector(factor, factor, 3, 3, 3, 3, 7, 7, 7, 7) * column[3];
    return;
  }
#endif
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) to[k] = factor[k] * column[k];
}

}  // namespace palpate::simd

#undef PALPATE_SIMD_REGISTERS
