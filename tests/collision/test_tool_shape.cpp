// SPDX-License-Identifier: MIT
#include "brute_force.hpp"
#include "catch.hpp"

#include <palpate/collision/tool_shape.hpp>

#include <cmath>
#include <limits>

using namespace palpate;
using namespace palpate_test;

TEMPLATE_TEST_CASE("A ball over, on and under a plane, by hand", "[collision][tool_shape]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  Plane<TestType> const table{V(5, 5, 1), V(0, 0, 1)};
  CHECK(table.signed_distance(V(0, 0, 4)) == 3);
  CHECK(table.signed_distance(V(9, 9, 0)) == -1);
  SphereTip<TestType> const ball{2};
  CHECK(ball.signed_distance(V(0, 0, 4), table) == 1);
  CHECK(ball.signed_distance(V(0, 0, 3), table) == 0);
  CHECK(ball.signed_distance(V(0, 0, 2), table) == -1);
  CHECK(ball.signed_distance(V(0, 0, 4), V(0, 0, 9)) == 3);
  CHECK(ball.signed_distance(V(0, 0, 4), V(0, 1, 4)) == -1);
  CHECK(SphereTip<TestType>{}.signed_distance(V(0, 0, 4), table) == 3);   // a point
}

TEMPLATE_TEST_CASE("A rod is the union of the balls along its axis", "[collision][tool_shape]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  Random random(Seed{61});
  TestType const tolerance = TestType(2e-3);   // 1000 balls on an axis of length below 4: half a gap is 2e-3, less than that off
  for (int i = 0; i < 200; ++i) {
    Capsule<TestType> const rod{random_in_box<TestType>(random, 1), random_in_box<TestType>(random, 1), TestType(0.3)};
    V const position = random_in_box<TestType>(random, 2);
    Plane<TestType> const plane{random_in_box<TestType>(random, 1), random_in_box<TestType>(random, 1).normalized()};
    SphereTip<TestType> const ball{rod.radius};
    TestType nearest = std::numeric_limits<TestType>::infinity(), lowest = nearest;
    for (int k = 0; k <= 1000; ++k) {
      V const centre = rod.from + TestType(k) / 1000 * (rod.to - rod.from);
      nearest = std::min(nearest, ball.signed_distance(centre, position));
      lowest = std::min(lowest, ball.signed_distance(centre, plane));
    }
    REQUIRE(std::abs(rod.signed_distance(position) - nearest) <= tolerance);
    REQUIRE(std::abs(rod.signed_distance(plane) - lowest) <= tolerance);
  }
  Capsule<TestType> const point{V(1, 2, 3), V(1, 2, 3), 1};   // without length it is a ball
  CHECK(point.signed_distance(V(1, 2, 7)) == 3);
}

TEMPLATE_TEST_CASE("A placed rod moves as a rigid body", "[collision][tool_shape]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  Eigen::Transform<TestType, 3, Eigen::Isometry> pose = Eigen::Transform<TestType, 3, Eigen::Isometry>::Identity();
  pose.translate(V(1, 2, 3));
  pose.rotate(Eigen::AngleAxis<TestType>(TestType(1.5707963267948966), V::UnitZ()));
  Capsule<TestType> const blade{V(0, 0, 0), V(2, 0, 0), TestType(0.5)};
  Capsule<TestType> const placed = blade.placed(pose);   // a quarter turn about z: along y now
  CHECK((placed.from - V(1, 2, 3)).norm() <= TestType(1e-6));
  CHECK((placed.to - V(1, 4, 3)).norm() <= TestType(1e-6));
  CHECK(placed.radius == blade.radius);
}
