// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <cmath>
#include <concepts>
#include <cstring>
#include <type_traits>

#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>   // a fifth of the parsing
#endif

namespace palpate::detail {

/// The widest register [bytes] that this program is compiled for.
#if defined(__AVX512F__)
inline constexpr int register_size = 64;
#elif defined(__AVX__)
inline constexpr int register_size = 32;
#else
inline constexpr int register_size = 16;
#endif

/// So many scalars that are added, multiplied and divided at once.
/// A vector type of gcc and clang. Functions take it by reference: how it is passed by value depends on the processor that is compiled for.
/// Not Eigen's arrays: those would not stay in registers through the force loop, and std::sqrt is not vectorised as long as it may set errno.
template <RealScalar Scalar, int Count>
struct PackOf {
  typedef Scalar Type __attribute__((vector_size(Count * sizeof(Scalar))));   // `using` takes no dependent attribute in clang
};

/// Four doubles where a register holds two: a vector type of that width would be taken apart into single numbers.
struct TwoPairs {
  typedef double Pair __attribute__((vector_size(16)));
  Pair low, high;

  TwoPairs() = default;
  TwoPairs(Pair const& first, Pair const& second) noexcept : low(first), high(second) {}
  TwoPairs(double x, double y, double z, double w) noexcept : low{x, y}, high{z, w} {}

  template <std::integral Index>
  double operator[](Index k) const noexcept {
    return k < 2 ? low[k] : high[k - 2];
  }

  friend TwoPairs operator+(TwoPairs const& a, TwoPairs const& b) noexcept { return {a.low + b.low, a.high + b.high}; }
  friend TwoPairs operator-(TwoPairs const& a, TwoPairs const& b) noexcept { return {a.low - b.low, a.high - b.high}; }
  friend TwoPairs operator*(TwoPairs const& a, TwoPairs const& b) noexcept { return {a.low * b.low, a.high * b.high}; }
  friend TwoPairs operator/(TwoPairs const& a, TwoPairs const& b) noexcept { return {a.low / b.low, a.high / b.high}; }
  friend TwoPairs operator*(double a, TwoPairs const& b) noexcept { return {a * b.low, a * b.high}; }
  friend TwoPairs operator*(TwoPairs const& a, double b) noexcept { return {a.low * b, a.high * b}; }
  friend TwoPairs operator/(double a, TwoPairs const& b) noexcept { return {a / b.low, a / b.high}; }
  friend TwoPairs operator/(TwoPairs const& a, double b) noexcept { return {a.low / b, a.high / b}; }
  TwoPairs operator-() const noexcept { return {-low, -high}; }
  TwoPairs& operator+=(TwoPairs const& b) noexcept { return *this = *this + b; }
  TwoPairs& operator-=(TwoPairs const& b) noexcept { return *this = *this - b; }
  TwoPairs& operator*=(TwoPairs const& b) noexcept { return *this = *this * b; }
  TwoPairs& operator*=(double b) noexcept { return *this = *this * b; }
  TwoPairs& operator/=(TwoPairs const& b) noexcept { return *this = *this / b; }
  TwoPairs& operator/=(double b) noexcept { return *this = *this / b; }
};

/// A column (x, y, z, 0), or one number of four links.
template <RealScalar Scalar>
using Four = std::conditional_t<(4 * sizeof(Scalar) > register_size), TwoPairs, typename PackOf<Scalar, 4>::Type>;

/// Two columns behind each other, or one number of eight links; for where a register holds them, else the compiler goes through memory.
template <RealScalar Scalar>
using Eight = typename PackOf<Scalar, 8>::Type;
template <RealScalar Scalar>
inline constexpr bool register_holds_eight = 8 * sizeof(Scalar) <= register_size;

/// As many columns behind each other as a register holds; one where it does not hold that.
template <RealScalar Scalar>
inline constexpr int columns_in_register = register_holds_eight<Scalar> ? register_size / static_cast<int>(4 * sizeof(Scalar)) : 1;
template <RealScalar Scalar>
using ColumnsInRegister = std::conditional_t<(columns_in_register<Scalar> > 1), typename PackOf<Scalar, 4 * columns_in_register<Scalar>>::Type, Four<Scalar>>;

template <class Columns, RealScalar Scalar>
inline void load(Columns& to, Scalar const* from) noexcept {
  std::memcpy(&to, from, sizeof(to));
}
template <RealScalar Scalar, class Columns>
inline void store(Scalar* to, Columns const& from) noexcept {
  std::memcpy(to, &from, sizeof(from));
}

inline void load(TwoPairs& to, double const* from) noexcept {   // pair by pair: an object that is copied as a whole stays in memory
  load(to.low, from), load(to.high, from + 2);
}
inline void store(double* to, TwoPairs const& from) noexcept {
  store(to, from.low), store(to + 2, from.high);
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
// Where a register holds both, as one instruction each, which takes its second operand from memory: gcc makes shuffles of registers otherwise.
#ifdef __AVX__
inline void join(Eight<float>& to, Four<float> const& low, Four<float> const& high) noexcept {
  to = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
}
inline void split(Four<float>& low, Four<float>& high, Eight<float> const& from) noexcept {
  low = _mm256_castps256_ps128(from), high = _mm256_extractf128_ps(from, 1);
}
#endif
#ifdef __AVX512F__
inline void join(Eight<double>& to, Four<double> const& low, Four<double> const& high) noexcept {
  to = _mm512_insertf64x4(_mm512_castpd256_pd512(low), high, 1);
}
inline void split(Four<double>& low, Four<double>& high, Eight<double> const& from) noexcept {
  low = _mm512_castpd512_pd256(from), high = _mm512_extractf64x4_pd(from, 1);
}
#endif

/// to = √from, each correctly rounded.
inline void square_root(Four<float>& to, Four<float> const& from) noexcept {
#ifdef __SSE2__
  to = _mm_sqrt_ps(from);
#else
  for (int k = 0; k < 4; ++k) to[k] = std::sqrt(from[k]);
#endif
}
inline void square_root(Four<double>& to, Four<double> const& from) noexcept {
#if defined(__AVX__)
  to = _mm256_sqrt_pd(from);
#elif defined(__SSE2__)
  to = {_mm_sqrt_pd(from.low), _mm_sqrt_pd(from.high)};
#else
  to = {std::sqrt(from[0]), std::sqrt(from[1]), std::sqrt(from[2]), std::sqrt(from[3])};
#endif
}

#ifdef __AVX__
inline void square_root(Eight<float>& to, Eight<float> const& from) noexcept { to = _mm256_sqrt_ps(from); }
#endif
#ifdef __AVX512F__
inline void square_root(Eight<double>& to, Eight<double> const& from) noexcept { to = _mm512_sqrt_pd(from); }
#endif

/// root = √from, each correctly rounded, and inverse = 1/root, to a unit in the last place; 0 < from < ∞.
template <class Columns>
inline void root_and_inverse(Columns& root, Columns& inverse, Columns const& from) noexcept {
  square_root(root, from);
  inverse = 1 / root;
}
#ifdef __AVX512F__
/// Without the unit that takes roots and divides, for which eight doubles would wait. Goldschmidt's iteration doubles the digits of √from and
/// 1/(2√from) twice, from 14 binary ones; then what is left of from − root² and 1 − root · inverse, which a fused multiplication has exactly,
/// rounds both as they should be \cite markstein2004, the inverse but for a root whose digits are all ones.
inline void root_and_inverse(Eight<double>& root, Eight<double>& inverse, Eight<double> const& from) noexcept {
  __m512d const half = _mm512_set1_pd(0.5), one = _mm512_set1_pd(1.0);
  __m512d const guess = _mm512_maskz_rsqrt14_pd(255, from);   // without the mask gcc 12 warns of its own header
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

/// What sum_each() needs of a column: of two pairs their sum, which is half as many registers.
template <class Columns>
inline Columns fold(Columns const& column) noexcept {
  return column;
}
inline TwoPairs::Pair fold(TwoPairs const& column) noexcept { return column.low + column.high; }
inline void sum_each(TwoPairs& sums, TwoPairs::Pair const (&half)[4]) noexcept {
  sums = {__builtin_shufflevector(half[0], half[1], 0, 2) + __builtin_shufflevector(half[0], half[1], 1, 3),
          __builtin_shufflevector(half[2], half[3], 0, 2) + __builtin_shufflevector(half[2], half[3], 1, 3)};
}

/// sums[k] = the sum of the four of column k. Two shuffles for each pair of columns that are one instruction each.
inline void sum_each(Four<double>& sums, Four<double> const (&column)[4]) noexcept {
#if defined(__AVX__)
  Four<double> const left = __builtin_shufflevector(column[0], column[1], 0, 4, 2, 6) + __builtin_shufflevector(column[0], column[1], 1, 5, 3, 7);
  Four<double> const right = __builtin_shufflevector(column[2], column[3], 0, 4, 2, 6) + __builtin_shufflevector(column[2], column[3], 1, 5, 3, 7);
  sums = __builtin_shufflevector(left, right, 0, 1, 4, 5) + __builtin_shufflevector(left, right, 2, 3, 6, 7);
#else
  TwoPairs::Pair half[4];
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) half[k] = fold(column[k]);
  sum_each(sums, half);
#endif
}
inline void sum_each(Four<float>& sums, Four<float> const (&column)[4]) noexcept {
  Four<float> const left = __builtin_shufflevector(column[0], column[1], 0, 4, 1, 5) + __builtin_shufflevector(column[0], column[1], 2, 6, 3, 7);
  Four<float> const right = __builtin_shufflevector(column[2], column[3], 0, 4, 1, 5) + __builtin_shufflevector(column[2], column[3], 2, 6, 3, 7);
  sums = __builtin_shufflevector(left, right, 0, 1, 4, 5) + __builtin_shufflevector(left, right, 2, 3, 6, 7);
}

/// sums[k] and sums[4 + k] = the sums of both columns in column[k].
inline void sum_each(Eight<float>& sums, Eight<float> const (&column)[4]) noexcept {
  using Sums = Eight<float>;
  Sums const left = __builtin_shufflevector(column[0], column[1], 0, 8, 1, 9, 4, 12, 5, 13) +
                    __builtin_shufflevector(column[0], column[1], 2, 10, 3, 11, 6, 14, 7, 15);
  Sums const right = __builtin_shufflevector(column[2], column[3], 0, 8, 1, 9, 4, 12, 5, 13) +
                     __builtin_shufflevector(column[2], column[3], 2, 10, 3, 11, 6, 14, 7, 15);
  sums = __builtin_shufflevector(left, right, 0, 1, 8, 9, 4, 5, 12, 13) + __builtin_shufflevector(left, right, 2, 3, 10, 11, 6, 7, 14, 15);
}
inline void sum_each(Eight<double>& sums, Eight<double> const (&column)[4]) noexcept {
  using Sums = Eight<double>;
  Sums const left = __builtin_shufflevector(column[0], column[1], 0, 8, 2, 10, 4, 12, 6, 14) +
                    __builtin_shufflevector(column[0], column[1], 1, 9, 3, 11, 5, 13, 7, 15);
  Sums const right = __builtin_shufflevector(column[2], column[3], 0, 8, 2, 10, 4, 12, 6, 14) +
                     __builtin_shufflevector(column[2], column[3], 1, 9, 3, 11, 5, 13, 7, 15);
  sums = __builtin_shufflevector(left, right, 0, 1, 8, 9, 4, 5, 12, 13) + __builtin_shufflevector(left, right, 2, 3, 10, 11, 6, 7, 14, 15);
}

/// to[k] = column[k] times number k of `factor`; with two columns each, the second times number 4 + k.
template <class Columns>
inline void scale_each(Columns (&to)[4], Columns const* column, Columns const& factor) noexcept {
  if constexpr (sizeof(Columns) == 8 * sizeof(factor[0])) {
    to[0] = __builtin_shufflevector(factor, factor, 0, 0, 0, 0, 4, 4, 4, 4) * column[0];
    to[1] = __builtin_shufflevector(factor, factor, 1, 1, 1, 1, 5, 5, 5, 5) * column[1];
    to[2] = __builtin_shufflevector(factor, factor, 2, 2, 2, 2, 6, 6, 6, 6) * column[2];
    to[3] = __builtin_shufflevector(factor, factor, 3, 3, 3, 3, 7, 7, 7, 7) * column[3];
  } else {
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) to[k] = factor[k] * column[k];
  }
}

/// Each of the four that is below the bound, or NaN, becomes the bound.
template <class Columns, RealScalar Scalar>
inline void raise_to(Columns& value, Scalar bound) noexcept {
  value = value > bound ? value : bound + Columns{};
}
inline void raise_to(TwoPairs& value, double bound) noexcept {
  raise_to(value.low, bound), raise_to(value.high, bound);
}

/// Whether each of the four is below the bound; a NaN is not.
inline bool all_below(Four<float> const& value, float bound) noexcept {
#ifdef __SSE2__
  return _mm_movemask_ps(_mm_cmplt_ps(value, _mm_set1_ps(bound))) == 15;
#else
  return value[0] < bound && value[1] < bound && value[2] < bound && value[3] < bound;
#endif
}
inline bool all_below(Four<double> const& value, double bound) noexcept {
#ifdef __AVX__
  return _mm256_movemask_pd(_mm256_cmp_pd(value, _mm256_set1_pd(bound), _CMP_LT_OQ)) == 15;
#elif defined(__SSE2__)
  __m128d const most = _mm_set1_pd(bound);
  return _mm_movemask_pd(_mm_and_pd(_mm_cmplt_pd(value.low, most), _mm_cmplt_pd(value.high, most))) == 3;
#else
  return value[0] < bound && value[1] < bound && value[2] < bound && value[3] < bound;
#endif
}

#ifdef __AVX__
inline bool all_below(Eight<float> const& value, float bound) noexcept {
  return _mm256_movemask_ps(_mm256_cmp_ps(value, _mm256_set1_ps(bound), _CMP_LT_OQ)) == 255;
}
#endif
#ifdef __AVX512F__
inline bool all_below(Eight<double> const& value, double bound) noexcept {
  return _mm512_cmp_pd_mask(value, _mm512_set1_pd(bound), _CMP_LT_OQ) == 255;
}
inline bool all_below(ColumnsInRegister<float> const& value, float bound) noexcept {
  return _mm512_cmp_ps_mask(value, _mm512_set1_ps(bound), _CMP_LT_OQ) == 65535;
}
#endif

}  // namespace palpate::detail
