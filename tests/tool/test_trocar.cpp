// SPDX-License-Identifier: MIT
// Yardstick: the angles of a tool on a sphere round the fixed point, and the law that of all rotations that take one direction to another the smallest has
// their angle.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/tool/trocar.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;
using namespace palpate_test;

TEMPLATE_TEST_CASE("Through a trocar: spherical angles and depth give the shaft, the turn stays", "[tool][trocar]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  using V = Vector3<S>;
  S const eps = std::numeric_limits<S>::epsilon();
  V const hole(S(0.1), S(-0.2), S(0.3));
  Trocar<S> const trocar({.point = hole});
  Random random(Seed{5});
  AllocationCount const allocations;
  S worst = 0, worst_turn = 0, worst_tip = 0;
  int lost = 0;
  for (int i = 0; i < 1000; ++i) {
    S const tilt = random.uniform<S>(0, S(1.4)), round = random.uniform<S>(0, S(6.28)), depth = random.uniform<S>(S(0.002), S(0.29)),
            turn = random.uniform<S>(-3, 3);
    // By hand: the shaft is z tilted about the horizontal axis (−sin, cos, 0), and the tool first turned about z.
    V const shaft(std::sin(tilt) * std::cos(round), std::sin(tilt) * std::sin(round), std::cos(tilt));
    Eigen::Quaternion<S> const tilted(Eigen::AngleAxis<S>(tilt, V(-std::sin(round), std::cos(round), 0))), turned(Eigen::AngleAxis<S>(turn, V::UnitZ()));
    auto const pose = trocar.find({.position = hole - depth * shaft, .orientation = turned});
    if (!pose) {
      ++lost;
      continue;
    }
    V const axis = pose->orientation * V::UnitZ();
    worst = std::max(worst, (hole - pose->position).cross(axis).norm());
    worst_tip = std::max(worst_tip, (pose->position - (hole - depth * shaft)).norm());
    worst_turn = std::max(worst_turn, pose->orientation.angularDistance(tilted * turned) * depth);
    worst = std::max(worst, std::abs((hole - pose->position).dot(axis) - depth));
  }
  long const made = allocations.count();
  CHECK(made == 0);
  CHECK(lost == 0);
  CHECK(worst_tip == 0);
  CHECK(worst < 8 * eps);        // m; 1e-12 of a metre is 4500 eps in double
  CHECK(worst_turn < 16 * eps);
}

TEST_CASE("Of a random commanded orientation a trocar takes the nearest that goes through", "[tool][trocar]") {
  Trocar<double> const trocar({.point = {0, 0, 0.05}, .shaft = {1, 2, -2}});
  Random random(Seed{6});
  int taken = 0, refused = 0;
  for (int i = 0; i < 1000; ++i) {
    ToolPose<double> commanded;
    for (int k = 0; k < 3; ++k) commanded.position[k] = random.uniform(-0.1, 0.1);
    commanded.orientation =
        Eigen::Quaternion<double>(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)).normalized();
    Vector3<double> const up = Vector3<double>(0, 0, 0.05) - commanded.position, shaft = commanded.orientation * Vector3<double>(1, 2, -2) / 3;
    auto const pose = trocar.find(commanded);
    REQUIRE(pose.has_value() == (up.dot(shaft) > 0));
    if (!pose) {
      ++refused;
      CHECK_THROWS_WITH(trocar(commanded), says("ahead of the tip"));
      continue;
    }
    ++taken;
    Vector3<double> const axis = pose->orientation * Vector3<double>(1, 2, -2) / 3;
    REQUIRE(axis.cross(up).norm() < 1e-14);
    REQUIRE(pose->orientation.angularDistance(commanded.orientation) == Approx(std::acos(shaft.dot(up) / up.norm())).margin(1e-7));
    REQUIRE((trocar(commanded).orientation.coeffs() - pose->orientation.coeffs()).norm() == 0);
  }
  CHECK((taken > 300 && refused > 300));
}

TEST_CASE("A trocar says why there is no pose", "[tool][trocar]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  Trocar<double> const trocar({.length = 0.2});
  CHECK_THROWS_WITH(trocar({.position = {0, 0, 1e-4}}), says("0.0001 m from the fixed point", "no direction"));
  CHECK_THROWS_WITH(trocar({.position = {0, 0, -0.25}}), says("0.25 m", "0.2 m long"));
  CHECK_THROWS_WITH(trocar({.position = {0, 0, 0.1}}), says("ahead of the tip"));
  CHECK_THROWS_WITH(trocar({.position = {0, 0, nan}}), says("not finite"));
  CHECK_THROWS_WITH(trocar({.position = {0, 0, -0.1}, .orientation = {0, 0, 0, 0}}), says("no unit quaternion"));
  CHECK_FALSE(trocar.find({.position = {0, nan, -0.1}}));
  CHECK_THROWS_WITH(Trocar<double>({.point = {nan, 0, 0}}), says(".point"));
  CHECK_THROWS_WITH(Trocar<double>({.shaft = {0, 0, 0}}), says(".shaft", "not zero"));
  CHECK_THROWS_WITH(Trocar<double>({.min_depth = 0}), says(".min_depth is 0 m"));
  CHECK_THROWS_WITH(Trocar<double>({.length = 1e-4}), says(".length is 0.0001 m", "0.001 m"));
}

TEMPLATE_TEST_CASE("A trocar's shaft may have any length that a number can say", "[tool][trocar]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  using V = Vector3<S>;
  S const most = std::numeric_limits<S>::max(), least = std::numeric_limits<S>::denorm_min();
  for (S const size : {least, std::sqrt(std::numeric_limits<S>::min()) / 10, S(1), std::sqrt(most) * 10, most}) {
    Trocar<S> const trocar({.point = V(0, 0, S(0.1)), .shaft = V(size, 0, size)});
    CHECK((trocar.options().shaft - V(1, 0, 1) / std::sqrt(S(2))).norm() < 4 * std::numeric_limits<S>::epsilon());
    auto const pose = trocar.find({.position = V::Zero()});
    REQUIRE(pose);
    CHECK((pose->orientation * trocar.options().shaft - V::UnitZ()).norm() < 8 * std::numeric_limits<S>::epsilon());
  }
  CHECK_THROWS_AS(Trocar<S>({.shaft = V::Zero()}), InvalidArgument);
}
