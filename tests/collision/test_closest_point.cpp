// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "brute_force.hpp"
#include "catch.hpp"

#include <palpate/collision/closest_point.hpp>

#include <cmath>
#include <limits>

using namespace palpate;
using namespace palpate_test;

namespace {

/// The law of the nearest point f of a convex set to p, checked in long double: (p − f)·(v − f) ≤ g for all corners v implies
/// |p − f|² − d² ≤ 2 g for the true distance d. With g = 0 it holds for the nearest point and for no other. A foot that is off by
/// rounding, a few ε times the farthest corner, makes g as large as that times the size of the triangle.
template <class Scalar>
void check_nearest(Vector3<Scalar> const& query, Vector3<Scalar> const& a, Vector3<Scalar> const& b, Vector3<Scalar> const& c) {
  auto const nearest = closest_point_on_triangle<Scalar>(query, a, b, c);
  CAPTURE(query.transpose(), a.transpose(), b.transpose(), c.transpose(), nearest.barycentric.transpose());
  Scalar const eps = std::numeric_limits<Scalar>::epsilon();
  Scalar const farthest = std::max({(a - query).norm(), (b - query).norm(), (c - query).norm()});
  long double const tolerance = 64 * eps * farthest;
  REQUIRE(nearest.barycentric.minCoeff() >= 0);
  REQUIRE(nearest.barycentric.maxCoeff() <= 1);
  REQUIRE(std::abs(nearest.barycentric.sum() - 1) <= 4 * eps);

  Long3 const p = query.template cast<long double>();
  Long3 const corner[] = {a.template cast<long double>(), b.template cast<long double>(), c.template cast<long double>()};
  Long3 const u = nearest.barycentric.template cast<long double>() / nearest.barycentric.template cast<long double>().sum();
  Long3 const foot = u.x() * corner[0] + u.y() * corner[1] + u.z() * corner[2];
  long double const distance = (p - foot).norm();
  for (Long3 const& v : corner) REQUIRE((p - foot).dot(v - foot) <= tolerance * farthest);
  REQUIRE(std::abs(std::sqrt(static_cast<long double>(nearest.squared_distance)) - distance) <= tolerance);
  REQUIRE((nearest.point.template cast<long double>() - foot).norm() <= tolerance + 2 * eps * query.norm());
}

}  // namespace

TEMPLATE_TEST_CASE("The foot on a triangle is the nearest point, in all seven regions", "[collision][closest_point]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  V const a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  struct Region {
    V query, foot, barycentric;
    TestType squared;
  };
  // By hand, on a right triangle in the plane z = 0.
  Region const regions[] = {{V(1, 1, 3), V(1, 1, 0), V(0.5, 0.25, 0.25), 9},   {V(2, -1, 0), V(2, 0, 0), V(0.5, 0.5, 0), 1},
                            {V(-2, 1, 2), V(0, 1, 0), V(0.75, 0, 0.25), 8},    {V(3, 3, 0), V(2, 2, 0), V(0, 0.5, 0.5), 2},
                            {V(-1, -2, 2), V(0, 0, 0), V(1, 0, 0), 9},         {V(6, -1, 0), V(4, 0, 0), V(0, 1, 0), 5},
                            {V(-1, 6, 2), V(0, 4, 0), V(0, 0, 1), 9}};
  for (Region const& region : regions) {
    auto const nearest = closest_point_on_triangle<TestType>(region.query, a, b, c);
    CAPTURE(region.query.transpose());
    CHECK((nearest.point - region.foot).norm() <= 4 * std::numeric_limits<TestType>::epsilon());
    CHECK((nearest.barycentric - region.barycentric).norm() <= 4 * std::numeric_limits<TestType>::epsilon());
    CHECK(nearest.squared_distance == Approx(region.squared));
    // On an edge the opposite coordinate is exactly zero, at a corner the point is exactly the corner.
    for (int k = 0; k < 3; ++k)
      if (region.barycentric[k] == 0) CHECK(nearest.barycentric[k] == 0);
  }
}

TEMPLATE_TEST_CASE("Random triangles and queries satisfy the law of the nearest point in long double", "[collision][closest_point]", PALPATE_TEST_SCALARS) {
  Random random(Seed{11});
  for (int i = 0; i < 20000; ++i) {
    auto const a = random_in_box<TestType>(random, 1), b = random_in_box<TestType>(random, 1), c = random_in_box<TestType>(random, 1);
    check_nearest<TestType>(random_in_box<TestType>(random, i % 3 == 0 ? 0.5f : i % 3 == 1 ? 2.0f : 100.0f), a, b, c);
  }
}

TEMPLATE_TEST_CASE("Thin and degenerate triangles satisfy the law of the nearest point in long double", "[collision][closest_point]", PALPATE_TEST_SCALARS) {
  Random random(Seed{12});
  using V = Vector3<TestType>;
  for (int i = 0; i < 20000; ++i) {
    V const a = random_in_box<TestType>(random, 1), b = random_in_box<TestType>(random, 1);
    V const query = random_in_box<TestType>(random, 2);
    TestType const along = 2 * random.uniform<TestType>() - TestType(0.5);
    TestType const height = std::pow(TestType(10), -TestType(10) * random.uniform<TestType>());
    V const c = a + along * (b - a) + random_in_box<TestType>(random, height);
    check_nearest<TestType>(query, a, b, c);          // needles, caps and collinear corners of all heights
    check_nearest<TestType>(query, b, c, a);
    check_nearest<TestType>(query, a, b, b);          // two equal corners, in all places
    check_nearest<TestType>(query, b, a, b);
    check_nearest<TestType>(query, b, b, a);
    check_nearest<TestType>(query, a, a, a);          // a point
    check_nearest<TestType>(query, a, b, (a + b) / 2);
    check_nearest<TestType>(b, a, b, c);              // the query is a corner
    // A query on the triangle: by construction at distance zero, up to the rounding of its own coordinates.
    TestType const u = random.uniform<TestType>(), w = (1 - u) * random.uniform<TestType>();
    V const on = a + u * (b - a) + w * (c - a);
    check_nearest<TestType>(on, a, b, c);
    REQUIRE(std::sqrt(closest_point_on_triangle<TestType>(on, a, b, c).squared_distance) <=
            64 * std::numeric_limits<TestType>::epsilon());
  }
}

TEMPLATE_TEST_CASE("The nearest point of a segment", "[collision][closest_point]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  V const a(1, 0, 0), b(3, 0, 0);
  auto const middle = closest_point_on_segment<TestType>(V(2, 1, 0), a, b);
  CHECK(middle.parameter == Approx(0.5));
  CHECK(middle.point == V(2, 0, 0));
  CHECK(middle.squared_distance == 1);
  CHECK(closest_point_on_segment<TestType>(V(0, 2, 0), a, b).point == a);
  CHECK(closest_point_on_segment<TestType>(V(9, 2, 0), a, b).point == b);
  CHECK(closest_point_on_segment<TestType>(V(9, 2, 0), a, b).parameter == 1);
  CHECK(closest_point_on_segment<TestType>(V(1, 0, 5), a, a).squared_distance == 25);   // no length
}

TEST_CASE("A query that is not finite does no harm", "[collision][closest_point]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  Vector3<double> const a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  CHECK(std::isnan(closest_point_on_triangle<double>({nan, 0, 0}, a, b, c).squared_distance));
  CHECK(std::isnan(closest_point_on_segment<double>({nan, 0, 0}, a, b).squared_distance));
}
