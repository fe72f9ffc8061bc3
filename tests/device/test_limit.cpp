// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/device/limit.hpp>

#include <limits>
#include <random>
#include <utility>

using namespace palpate;

static_assert(noexcept(limited(std::declval<Vector3<double> const&>(), 1.0)));
static_assert(noexcept(limited(std::declval<Wrench<float> const&>(), std::declval<Capabilities const&>())));

TEMPLATE_TEST_CASE("C9-X2: a force within the limit is not touched, a larger one keeps its direction", "[device]", PALPATE_TEST_SCALARS) {
  // Yardstick: the norm and the direction, computed in long double.
  using Scalar = TestType;
  Scalar const epsilon = std::numeric_limits<Scalar>::epsilon();
  std::mt19937 generator(11);
  std::uniform_real_distribution<Scalar> uniform(Scalar(-10), Scalar(10));
  Scalar const maximum = Scalar(3.3);
  int shortened = 0;
  for (int i = 0; i < 1000; ++i) {
    Vector3<Scalar> const force(uniform(generator), uniform(generator), uniform(generator));
    Vector3<Scalar> const felt = limited(force, maximum);
    Eigen::Matrix<long double, 3, 1> const exact = force.template cast<long double>();
    if (exact.norm() <= static_cast<long double>(maximum) * (1 - 4 * epsilon)) {
      REQUIRE(felt == force);
    } else if (exact.norm() > static_cast<long double>(maximum)) {
      ++shortened;
      auto const expected = (exact / exact.norm() * static_cast<long double>(maximum)).eval();
      REQUIRE(static_cast<double>((felt.template cast<long double>() - expected).norm()) <= 8 * epsilon * maximum);
    }
  }
  CHECK(shortened > 500);
}

TEMPLATE_TEST_CASE("C9-X1: what is not a number is not felt", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  Scalar const nan = std::numeric_limits<Scalar>::quiet_NaN();
  Scalar const infinity = std::numeric_limits<Scalar>::infinity();
  for (Scalar const bad : {nan, infinity, -infinity})
    for (int axis = 0; axis < 3; ++axis) {
      Vector3<Scalar> force(1, 2, 3);
      force(axis) = bad;
      CHECK(limited(force, Scalar(3.3)).isZero(Scalar(0)));
    }
  Vector3<Scalar> const force(1, 2, 3);
  CHECK(limited(force, nan).isZero(Scalar(0)));
  CHECK(limited(force, Scalar(0)).isZero(Scalar(0)));
  CHECK(limited(force, Scalar(-1)).isZero(Scalar(0)));
  CHECK(limited(force, infinity) == force);
}

TEMPLATE_TEST_CASE("forces whose squares overflow or vanish keep their direction", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  Scalar const epsilon = std::numeric_limits<Scalar>::epsilon();
  Scalar const huge = std::numeric_limits<Scalar>::max() / 2;
  Vector3<Scalar> const felt = limited(Vector3<Scalar>(huge, -huge, huge), Scalar(3));
  CHECK((felt - Vector3<Scalar>(1, -1, 1) * std::sqrt(Scalar(3))).norm() <= 8 * epsilon);
  Vector3<Scalar> const tiny = Vector3<Scalar>::Constant(std::numeric_limits<Scalar>::min());
  CHECK(limited(tiny, Scalar(3)) == tiny);
  CHECK(limited(Vector3<Scalar>(Vector3<Scalar>::Zero()), Scalar(3)).isZero(Scalar(0)));
}

TEST_CASE("a wrench is limited in force and torque, each by its own maximum", "[device]") {
  Wrench<double> const wrench{.force = {0.0, 8.0, 0.0}, .torque = {0.0, 0.0, -1.0}};
  auto const felt = limited(wrench, {.max_force = 2.0, .rate = 1000.0, .max_torque = 0.25});
  CHECK((felt.force - Vector3<double>(0.0, 2.0, 0.0)).norm() <= 1e-15);
  CHECK((felt.torque - Vector3<double>(0.0, 0.0, -0.25)).norm() <= 1e-15);
  CHECK(limited(wrench, {.max_force = 9.0, .rate = 1000.0}).torque.isZero(0.0));   // a device without torque
}
