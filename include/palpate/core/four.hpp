// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <cmath>
#include <cstring>

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace palpate::detail {

/// Four scalars that are added, multiplied and divided at once: a column (x, y, z, 0), or one number of four links.
/// A vector type of gcc and clang; without registers of that width the compiler takes it apart. Functions take it by reference:
/// how it is passed by value depends on the processor that is compiled for.
/// Not Eigen's arrays: those would not stay in registers through the force loop, and std::sqrt is not vectorised as long as it may set errno.
template <RealScalar Scalar>
struct FourOf {
  typedef Scalar Type __attribute__((vector_size(4 * sizeof(Scalar))));   // `using` takes no dependent attribute in clang
};
template <RealScalar Scalar>
using Four = typename FourOf<Scalar>::Type;

/// The widest register [bytes] that this program is compiled for.
#if defined(__AVX512F__)
inline constexpr int register_size = 64;
#elif defined(__AVX__)
inline constexpr int register_size = 32;
#else
inline constexpr int register_size = 16;
#endif

/// Two columns behind each other, for what is done to each number by itself; where a register holds them, else the compiler goes through memory.
template <RealScalar Scalar>
struct EightOf {
  typedef Scalar Type __attribute__((vector_size(8 * sizeof(Scalar))));
};
template <RealScalar Scalar>
using Eight = typename EightOf<Scalar>::Type;

template <class Columns, RealScalar Scalar>
inline void load(Columns& to, Scalar const* from) noexcept {
  std::memcpy(&to, from, sizeof(to));
}
template <RealScalar Scalar, class Columns>
inline void store(Scalar* to, Columns const& from) noexcept {
  std::memcpy(to, &from, sizeof(from));
}

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
  __m128d half[2];
  std::memcpy(half, &from, sizeof(half));
  for (__m128d& two : half) two = _mm_sqrt_pd(two);
  std::memcpy(&to, half, sizeof(half));
#else
  for (int k = 0; k < 4; ++k) to[k] = std::sqrt(from[k]);
#endif
}

/// sums[k] = the sum of the four of column k. Two shuffles for each pair of columns that are one instruction each.
inline void sum_each(Four<double>& sums, Four<double> const (&column)[4]) noexcept {
  Four<double> const left = __builtin_shufflevector(column[0], column[1], 0, 4, 2, 6) + __builtin_shufflevector(column[0], column[1], 1, 5, 3, 7);
  Four<double> const right = __builtin_shufflevector(column[2], column[3], 0, 4, 2, 6) + __builtin_shufflevector(column[2], column[3], 1, 5, 3, 7);
  sums = __builtin_shufflevector(left, right, 0, 1, 4, 5) + __builtin_shufflevector(left, right, 2, 3, 6, 7);
}
inline void sum_each(Four<float>& sums, Four<float> const (&column)[4]) noexcept {
  Four<float> const left = __builtin_shufflevector(column[0], column[1], 0, 4, 1, 5) + __builtin_shufflevector(column[0], column[1], 2, 6, 3, 7);
  Four<float> const right = __builtin_shufflevector(column[2], column[3], 0, 4, 1, 5) + __builtin_shufflevector(column[2], column[3], 2, 6, 3, 7);
  sums = __builtin_shufflevector(left, right, 0, 1, 4, 5) + __builtin_shufflevector(left, right, 2, 3, 6, 7);
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
#else
  return value[0] < bound && value[1] < bound && value[2] < bound && value[3] < bound;
#endif
}

}  // namespace palpate::detail
