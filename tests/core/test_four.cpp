// SPDX-License-Identifier: MIT
#include <palpate/core/four.hpp>

#include "catch.hpp"

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
    detail::load(square, from.data());
    detail::root_and_inverse(root, inverse, square);
    std::array<Scalar, count> roots, inverses;
    detail::store(roots.data(), root), detail::store(inverses.data(), inverse);
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
  compare_roots<detail::Four<TestType>, TestType, 4>();
  if constexpr (detail::register_holds_eight<TestType>) compare_roots<detail::Eight<TestType>, TestType, 8>();
}
