// SPDX-License-Identifier: MIT
// Yardstick: Eigen's own functions, in whose place these stand.
#include <palpate/core/matrix.hpp>

#include "catch.hpp"

#include <cmath>
#include <limits>
#include <random>

using namespace palpate;

TEMPLATE_TEST_CASE("what stands for functions of Eigen says what they say", "", float, double) {
  using Scalar = TestType;
  using Limits = std::numeric_limits<Scalar>;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<Scalar> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(Limits::min_exponent, Limits::max_exponent - 2), odd(0, 9), place(0, 11);
  Scalar const special[] = {0, Limits::denorm_min(), Limits::max() / 4, Limits::infinity(), Limits::quiet_NaN()};
  for (int round = 0; round < 20000; ++round) {
    Matrix<Scalar, 3, 4> columns;
    int const size = exponent(random);
    for (Scalar& number : columns.reshaped()) number = std::ldexp(mantissa(random), size);
    if (int const which = odd(random); which < 5) columns.reshaped()[place(random)] = special[which];
    Vector3<Scalar> const first = columns.col(0);
    CHECK(is_finite(columns) == columns.allFinite());
    CHECK(is_finite(columns.col(1)) == columns.col(1).allFinite());
    CHECK(is_zero(first) == first.isZero(0));
    if (!columns.allFinite()) continue;
    auto const [low, high] = low_and_high(columns);
    CHECK(low == Vector3<Scalar>(columns.rowwise().minCoeff()));
    CHECK(high == Vector3<Scalar>(columns.rowwise().maxCoeff()));
    long double const length = std::hypot(static_cast<long double>(first[0]), static_cast<long double>(first[1]), static_cast<long double>(first[2]));
    CHECK(std::abs(static_cast<long double>(stable_norm(first)) - length) <= 4 * static_cast<long double>(Limits::epsilon()) * length + Limits::denorm_min());
  }
  CHECK(is_zero(Vector3<Scalar>(0, -Scalar(0), 0)));
  CHECK(stable_norm(Vector3<Scalar>(0, 0, 0)) == 0);
  CHECK(std::isinf(stable_norm(Vector3<Scalar>(0, Limits::infinity(), 1))));
  CHECK(std::isnan(stable_norm(Vector3<Scalar>(1, Limits::quiet_NaN(), 2))));
}
