// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>

#include <cstddef>
#include <type_traits>

/// Columns (x, y, z, 0) that lie anywhere, as packs of their x, y and z: one lane for each column.
namespace palpate::simd {

/// As many numbers as a register holds; one without registers.
template <RealScalar Scalar>
inline constexpr int lanes = register_size > 0 ? register_size / int{sizeof(Scalar)} : 1;
template <RealScalar Scalar>
using Lanes = Pack<Scalar, lanes<Scalar>>;

#if defined(__GNUC__) && !defined(PALPATE_PLAIN_SIMD)
/// Rows become columns, in each group of four numbers of the four packs.
template <class Numbers>
inline void transpose(Numbers (&row)[4]) noexcept {
  constexpr int count = static_cast<int>(sizeof(Numbers) / sizeof(row[0][0]));
  Numbers const a = row[0], b = row[1], c = row[2], d = row[3];
  if constexpr (count == 4 && sizeof(row[0][0]) == 4) {
    Numbers const low = __builtin_shufflevector(a, b, 0, 4, 1, 5), low2 = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    Numbers const high = __builtin_shufflevector(a, b, 2, 6, 3, 7), high2 = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    row[0] = __builtin_shufflevector(low, low2, 0, 1, 4, 5), row[1] = __builtin_shufflevector(low, low2, 2, 3, 6, 7);
    row[2] = __builtin_shufflevector(high, high2, 0, 1, 4, 5), row[3] = __builtin_shufflevector(high, high2, 2, 3, 6, 7);
  } else if constexpr (count == 4) {   // within 128 bits first
    Numbers const even = __builtin_shufflevector(a, b, 0, 4, 2, 6), even2 = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    Numbers const odd = __builtin_shufflevector(a, b, 1, 5, 3, 7), odd2 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    row[0] = __builtin_shufflevector(even, even2, 0, 1, 4, 5), row[1] = __builtin_shufflevector(odd, odd2, 0, 1, 4, 5);
    row[2] = __builtin_shufflevector(even, even2, 2, 3, 6, 7), row[3] = __builtin_shufflevector(odd, odd2, 2, 3, 6, 7);
  } else if constexpr (count == 8 && sizeof(row[0][0]) == 4) {
    Numbers const low = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13), low2 = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
    Numbers const high = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15), high2 = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
    row[0] = __builtin_shufflevector(low, low2, 0, 1, 8, 9, 4, 5, 12, 13), row[1] = __builtin_shufflevector(low, low2, 2, 3, 10, 11, 6, 7, 14, 15);
    row[2] = __builtin_shufflevector(high, high2, 0, 1, 8, 9, 4, 5, 12, 13), row[3] = __builtin_shufflevector(high, high2, 2, 3, 10, 11, 6, 7, 14, 15);
  } else if constexpr (count == 8) {
    Numbers const even = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14), even2 = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14);
    Numbers const odd = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15), odd2 = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    row[0] = __builtin_shufflevector(even, even2, 0, 1, 8, 9, 4, 5, 12, 13), row[1] = __builtin_shufflevector(odd, odd2, 0, 1, 8, 9, 4, 5, 12, 13);
    row[2] = __builtin_shufflevector(even, even2, 2, 3, 10, 11, 6, 7, 14, 15), row[3] = __builtin_shufflevector(odd, odd2, 2, 3, 10, 11, 6, 7, 14, 15);
  } else {
    static_assert(count == 16);
    Numbers const low = __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    Numbers const low2 = __builtin_shufflevector(c, d, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    Numbers const high = __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    Numbers const high2 = __builtin_shufflevector(c, d, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    row[0] = __builtin_shufflevector(low, low2, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    row[1] = __builtin_shufflevector(low, low2, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
    row[2] = __builtin_shufflevector(high, high2, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    row[3] = __builtin_shufflevector(high, high2, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
  }
}
#endif

/// Columns of four beside each other: the n-th starts at columns[start[stride · n]].
template <class Numbers, RealScalar Scalar>
[[gnu::always_inline]] inline void load_beside(Numbers& to, Scalar const* columns, int const* start, int stride) noexcept {
  constexpr int count = static_cast<int>(sizeof(Numbers) / sizeof(Scalar));
  auto const column = [&](int n) { return columns + start[stride * n]; };
  if constexpr (count == 4) {
    load(to, column(0));
  } else {
    Pack<Scalar, 4> first, second;
    load(first, column(0)), load(second, column(1));
    if constexpr (count == 8) {
      join(to, first, second);
    } else {
      static_assert(count == 16);
      Pack<Scalar, 8> left, right;
      join(left, first, second);
      load(first, column(2)), load(second, column(3));
      join(right, first, second);
      join(to, left, right);
    }
  }
}
/// to = number c of each column, in all its places.
template <int c, class Numbers>
[[gnu::always_inline]] inline void spread(Numbers& to, Numbers const& from) noexcept {
  if constexpr (std::is_class_v<Numbers>)
    to = Numbers(from[c], from[c], from[c], from[c]);
#if defined(__GNUC__) && !defined(PALPATE_PLAIN_SIMD)
  else if constexpr (sizeof(Numbers) == 4 * sizeof(from[0]))
    to = __builtin_shufflevector(from, from, c, c, c, c);
  else if constexpr (sizeof(Numbers) == 8 * sizeof(from[0]))
    to = __builtin_shufflevector(from, from, c, c, c, c, c + 4, c + 4, c + 4, c + 4);
  else
    to = __builtin_shufflevector(from, from, c, c, c, c, c + 4, c + 4, c + 4, c + 4, c + 8, c + 8, c + 8, c + 8, c + 12, c + 12, c + 12, c + 12);
#endif
}
/// The sum of the columns.
template <class One, class Numbers>
[[gnu::always_inline]] inline void sum_beside(One& sum, Numbers const& columns) noexcept {
  if constexpr (sizeof(Numbers) == sizeof(One)) {
    sum = columns;
  } else if constexpr (sizeof(Numbers) == 2 * sizeof(One)) {
    One low, high;
    split(low, high, columns);
    sum = low + high;
  } else {
    Pack<float, 8> low, high;
    split(low, high, columns);
    sum_beside(sum, Pack<float, 8>(low + high));
  }
}

/// Lane k of (x, y, z) = the column that starts at columns[start[k]].
template <class Numbers, RealScalar Scalar>
[[gnu::always_inline]] inline void load_columns(Numbers& x, Numbers& y, Numbers& z, Scalar const* columns, int const* start) noexcept {
  constexpr int count = static_cast<int>(sizeof(Numbers) / sizeof(Scalar));
  auto const column = [&](int k) { return columns + start[k]; };
#if defined(__GNUC__) && !defined(PALPATE_PLAIN_SIMD)
  if constexpr (count >= 4) {
    Numbers row[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) load_beside(row[k], columns, start + k, 4);
    transpose(row);
    x = row[0], y = row[1], z = row[2];
  } else if constexpr (count == 2) {
    Numbers low[2], high[2];
    for (int k = 0; k < 2; ++k) load(low[k], column(k)), load(high[k], column(k) + 2);
    x = __builtin_shufflevector(low[0], low[1], 0, 2), y = __builtin_shufflevector(low[0], low[1], 1, 3), z = __builtin_shufflevector(high[0], high[1], 0, 2);
  } else
#endif
  {
    static_assert(count == 1);
    x = column(0)[0], y = column(0)[1], z = column(0)[2];
  }
}

/// Adds lane k of (x, y, z, 0) to the column at columns[start[k]], lane after lane: a column may be there twice. Those where `own(start)` is false are left out.
template <class Numbers, RealScalar Scalar, class Own>
[[gnu::always_inline]] inline void add_to_columns(Scalar* columns, int const* start, Numbers const& x, Numbers const& y, Numbers const& z, Own const& own) noexcept {
  constexpr int count = static_cast<int>(sizeof(Numbers) / sizeof(Scalar));
  auto const add = [&](int k, auto const& to_add) {
    if (!own(start[k])) return;
    Scalar* const at = columns + start[k];
    Pack<Scalar, 4> sum;
    load(sum, at);
    store(at, Pack<Scalar, 4>(sum + to_add));
  };
#if defined(__GNUC__) && !defined(PALPATE_PLAIN_SIMD)
  if constexpr (count >= 4) {
    Numbers row[4] = {x, y, z, Numbers{}};
    transpose(row);
    if constexpr (count == 4) {
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) add(k, row[k]);
    } else if constexpr (count == 8) {
      Pack<Scalar, 4> first[4], second[4];
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) split(first[k], second[k], row[k]);
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) add(k, first[k]);
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) add(k + 4, second[k]);
    } else {
      Pack<Scalar, 4> part[16];
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) {
        Pack<Scalar, 8> left, right;
        split(left, right, row[k]);
        split(part[k], part[k + 4], left), split(part[k + 8], part[k + 12], right);
      }
#pragma GCC unroll 16
      for (int k = 0; k < 16; ++k) add(k, part[k]);
    }
  } else if constexpr (count == 2) {
    Numbers const zero{};
    add(0, Pack<Scalar, 4>{__builtin_shufflevector(x, y, 0, 2), __builtin_shufflevector(z, zero, 0, 2)});
    add(1, Pack<Scalar, 4>{__builtin_shufflevector(x, y, 1, 3), __builtin_shufflevector(z, zero, 1, 3)});
  } else
#endif
  {
    static_assert(count == 1);
    if (!own(start[0])) return;
    Scalar* const at = columns + start[0];
    at[0] += x, at[1] += y, at[2] += z;
  }
}

}  // namespace palpate::simd
