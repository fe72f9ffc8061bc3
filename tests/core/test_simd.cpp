// SPDX-License-Identifier: MIT
#include <palpate/core/simd.hpp>

#include "catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

using namespace palpate;

namespace {

/// Roots and inverses of packs of random numbers and of some that are hard to round, beside those of the C library, which IEEE 754 has round
/// correctly.
template <class Pack, class Scalar, std::size_t count>
void compare_roots() {
  using Limits = std::numeric_limits<Scalar>;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<Scalar> mantissa(1, 2);
  std::uniform_int_distribution<int> exponent(Limits::min_exponent + 40, Limits::max_exponent - 1);
  int wrong_roots = 0, wrong_inverses = 0;
  for (int round = 0; round < 100000; ++round) {
    std::array<Scalar, count> from;
    for (Scalar& number : from) {
      number = std::ldexp(mantissa(random), exponent(random));
      if (round % 3 == 0) continue;
      Scalar const root = mantissa(random);
      number = root * root;   // its root is nearly a number of the type, or nearly between two
      if (round % 3 == 2) number = std::nextafter(number, random() % 2 == 0 ? Scalar(0) : Scalar(9));
    }
    Pack square, root, inverse;
    simd::load(square, from.data());
    simd::root_and_inverse(root, inverse, square);
    std::array<Scalar, count> roots, inverses;
    simd::store(roots.data(), root), simd::store(inverses.data(), inverse);
    for (std::size_t k = 0; k < count; ++k) {
      Scalar const expected = std::sqrt(from[k]);
      if (roots[k] != expected) ++wrong_roots;
      if (!(std::abs(inverses[k] * expected - 1) <= 2 * Limits::epsilon())) ++wrong_inverses;
    }
  }
  CHECK(wrong_roots == 0);
  CHECK(wrong_inverses == 0);
}

}  // namespace

TEMPLATE_TEST_CASE("roots of several numbers at once are rounded correctly", "", float, double) {
  compare_roots<simd::Pack<TestType, 4>, TestType, 4>();
  if constexpr (simd::row_width<TestType> == 8) compare_roots<simd::Pack<TestType, 8>, TestType, 8>();
}

TEMPLATE_TEST_CASE("logarithms of several numbers at once", "", float, double) {   // yardstick: the C library's in long double
  using Limits = std::numeric_limits<TestType>;
  constexpr std::size_t count = simd::row_width<TestType>;
  using Pack = simd::Pack<TestType, count>;
  auto const logarithms = [](std::array<TestType, count> const& from) {
    Pack numbers, found;
    simd::load(numbers, from.data()), simd::logarithm(found, numbers);
    std::array<TestType, count> all;
    simd::store(all.data(), found);
    return all;
  };
  std::mt19937_64 random(6);
  std::uniform_real_distribution<TestType> mantissa(1, 2);
  std::uniform_int_distribution<int> exponent(Limits::min_exponent, Limits::max_exponent - 1);
  double worst = 0;   // units in the last place
  for (int round = 0; round < 100000; ++round) {
    std::array<TestType, count> from;
    for (TestType& number : from) number = round % 2 == 0 ? std::ldexp(mantissa(random), exponent(random)) : 1 + (mantissa(random) - TestType(1.5)) * std::ldexp(TestType(1), -round % 30);
    auto const found = logarithms(from);
    for (std::size_t k = 0; k < count; ++k) {
      long double const expected = std::log(static_cast<long double>(from[k]));
      if (from[k] == 1) CHECK(found[k] == 0);
      if (from[k] != 1) worst = std::max(worst, static_cast<double>(std::abs(static_cast<long double>(found[k]) / expected - 1)) / static_cast<double>(Limits::epsilon()));
    }
  }
  CAPTURE(worst);
  CHECK(worst <= 3);

  std::array<TestType, count> odd;   // beside ordinary ones
  odd.fill(2);
  for (TestType const one : {TestType(0), TestType(-1), Limits::infinity(), Limits::quiet_NaN(), Limits::denorm_min()}) {
    odd[1] = one;
    TestType const found = logarithms(odd)[1], expected = std::log(one);
    CAPTURE(one, found);
    CHECK((std::isnan(expected) ? std::isnan(found) : found == expected));
  }
}

TEMPLATE_TEST_CASE("packs compute number by number what single numbers do", "", float, double) {   // yardstick: the loop over numbers
  using Scalar = TestType;
  constexpr std::size_t width = simd::row_width<Scalar>;
  using Wide = simd::Pack<Scalar, width>;
  std::array<std::array<Scalar, width>, 4> columns;
  std::array<Scalar, width> factors, out;
  Wide column[4], factor, scaled[4];
  std::mt19937_64 random(8);
  std::uniform_int_distribution<int> whole(-99, 99);   // sums of whole numbers are exact in any order
  for (std::size_t k = 0; k < 4; ++k) {
    for (Scalar& number : columns[k]) number = static_cast<Scalar>(whole(random));
    simd::load(column[k], columns[k].data());
  }
  for (Scalar& number : factors) number = static_cast<Scalar>(whole(random));
  simd::load(factor, factors.data());

  simd::scale_each(scaled, column, factor);
  for (std::size_t k = 0; k < 4; ++k) {
    simd::store(out.data(), scaled[k]);
    for (std::size_t i = 0; i < width; ++i) CHECK(out[i] == factors[k + i / 4 * 4] * columns[k][i]);
  }

  decltype(simd::fold(column[0])) folded[4] = {simd::fold(column[0]), simd::fold(column[1]), simd::fold(column[2]), simd::fold(column[3])};
  Wide sums;
  simd::sum_each(sums, folded);
  simd::store(out.data(), sums);
  for (std::size_t i = 0; i < width; ++i) {
    std::size_t const first = i / 4 * 4;
    CHECK(out[i] == columns[i % 4][first] + columns[i % 4][first + 1] + columns[i % 4][first + 2] + columns[i % 4][first + 3]);
  }

  if constexpr (width == 8) {
    simd::Pack<Scalar, 4> low, high;
    simd::split(low, high, column[1]);
    for (int i = 0; i < 4; ++i) CHECK((low[i] == columns[1][static_cast<std::size_t>(i)] && high[i] == columns[1][static_cast<std::size_t>(i) + 4]));
    Wide joined;
    simd::join(joined, high, low);
    simd::store(out.data(), joined);
    for (std::size_t i = 0; i < 8; ++i) CHECK(out[i] == columns[1][(i + 4) % 8]);
  }

  Wide const difference = Scalar(3) * column[0] - column[1] * factor, negative = -difference;
  simd::store(out.data(), negative);
  for (std::size_t i = 0; i < width; ++i) CHECK(out[i] == columns[1][i] * factors[i] - 3 * columns[0][i]);
}

TEMPLATE_TEST_CASE("a pack is below a bound if each number is, and is raised to it", "", float, double) {
  using Scalar = TestType;
  constexpr std::size_t width = simd::row_width<Scalar>;
  for (std::size_t k = 0; k < width; ++k)
    for (Scalar const odd : {Scalar(1), Scalar(2), Scalar(5), std::numeric_limits<Scalar>::quiet_NaN()}) {
      std::array<Scalar, width> numbers;
      numbers.fill(Scalar(0.5)), numbers[k] = odd;
      simd::Pack<Scalar, width> pack;
      simd::load(pack, numbers.data());
      CHECK(simd::all_below(pack, Scalar(2)) == (odd == 1));
      simd::raise_to(pack, Scalar(2));
      simd::store(numbers.data(), pack);
      for (std::size_t i = 0; i < width; ++i) CHECK(numbers[i] == (i == k && odd == 5 ? Scalar(5) : Scalar(2)));
    }
}
