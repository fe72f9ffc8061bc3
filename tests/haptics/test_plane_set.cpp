// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/haptics/plane_set.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

using namespace palpate;

namespace {

template <RealScalar S>
Vector3<S> direction(Random& random) {
  Vector3<S> v;
  do v = {random.normal<S>(), random.normal<S>(), random.normal<S>()};
  while (!(v.norm() > S(0.1)));
  return v.normalized();
}
template <RealScalar S>
Eigen::Quaternion<S> rotation(Random& random) {
  return Eigen::Quaternion<S>(random.normal<S>(), random.normal<S>(), random.normal<S>(), random.normal<S>()).normalized();
}
template <RealScalar S>
PlaneSet<S> planes(std::initializer_list<ContactPlane<S>> list) {
  PlaneSet<S> set;
  for (auto const& plane : list) set.add(plane);
  return set;
}

}  // namespace

// Yardsticks by hand, in frames turned and moved at random: the foot of a perpendicular, a line of two planes, the corner of three.
TEMPLATE_TEST_CASE("C2-P1 C2-P2 C2-P3: a point is projected on a plane, an edge and a corner", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const close = std::numeric_limits<S>::epsilon() * S(64);
  Random random(Seed{1});
  for (int frame = 0; frame < 1000; ++frame) {
    auto const turn = rotation<S>(random);
    Vector3<S> const shift(random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)));
    auto const plane = [&](Vector3<S> const& n) {
      Vector3<S> const normal = (turn * n).normalized();
      return ContactPlane<S>{normal, normal.dot(shift)};
    };
    auto const check = [&](PlaneSet<S> const& set, Vector3<S> const& p, Vector3<S> const& expected, int active) {
      auto const found = set.project(turn * p + shift);
      REQUIRE((found.point - (turn * expected + shift)).norm() <= close * S(4));
      REQUIRE(found.count == active);
      for (int k = 0; k < found.count; ++k) REQUIRE(found.multiplier[static_cast<std::size_t>(k)] >= S(0));
    };
    Vector3<S> const x = Vector3<S>::UnitX(), y = Vector3<S>::UnitY(), z = Vector3<S>::UnitZ();
    S const mm = S(0.001);
    check(planes<S>({plane(z)}), {mm, 2 * mm, -3 * mm}, {mm, 2 * mm, S(0)}, 1);
    check(planes<S>({plane(z)}), {mm, 2 * mm, 3 * mm}, {mm, 2 * mm, 3 * mm}, 0);
    check(planes<S>({plane(z), plane(y)}), {mm, -2 * mm, -3 * mm}, {mm, S(0), S(0)}, 2);
    auto const corner = planes<S>({plane(x), plane(y), plane(z)});
    check(corner, {-mm, -2 * mm, -3 * mm}, {S(0), S(0), S(0)}, 3);
    check(corner, {mm, -2 * mm, -3 * mm}, {mm, S(0), S(0)}, 2);
    check(corner, {mm, 2 * mm, -3 * mm}, {mm, 2 * mm, S(0)}, 1);
  }
}

// Yardstick: the conditions of Karush, Kuhn and Tucker, and that no other point in front of all planes is nearer, of 2,000 drawn around.
TEST_CASE("C2-P4: the projection is the nearest point in front of all planes") {
  Random random(Seed{2});
  for (int round = 0; round < 500; ++round) {
    PlaneSet<double> set;
    int const count = 1 + static_cast<int>(random.below(8));
    for (int k = 0; k < count; ++k) set.add({direction<double>(random), random.uniform(-0.02, 0.0)});   // the origin is in front of all
    Vector3<double> const p = 0.05 * Vector3<double>(random.normal(), random.normal(), random.normal());
    auto const found = set.project(p);
    Vector3<double> sum = p;
    for (int k = 0; k < found.count; ++k) {
      auto const& plane = set[found.active[static_cast<std::size_t>(k)]];
      double const lambda = found.multiplier[static_cast<std::size_t>(k)];
      REQUIRE(lambda >= 0);
      REQUIRE(std::abs(lambda * plane.distance(found.point)) <= 1e-12);
      sum += lambda * plane.normal;
    }
    REQUIRE((sum - found.point).norm() <= 1e-12);
    for (int k = 0; k < count; ++k) REQUIRE(set[k].distance(found.point) >= -1e-12);
    double const nearest = (found.point - p).norm();
    for (int other = 0; other < 2000; ++other) {
      Vector3<double> const q = found.point + 0.01 * Vector3<double>(random.normal(), random.normal(), random.normal());
      bool in_front = true;
      for (int k = 0; k < count; ++k) in_front = in_front && set[k].distance(q) >= 0;
      if (in_front && !((q - p).norm() >= nearest - 1e-12)) FAIL("a nearer point in round " << round);
    }
  }
}

// Yardstick: a projection on a convex set: its residual never changes by more than the point moves, also where the planes that push change.
TEST_CASE("C2-P7: the way back to the surface has no step, whichever planes push") {
  Random random(Seed{3});
  for (int round = 0; round < 200; ++round) {
    PlaneSet<double> set;
    for (int k = 0; k < 6; ++k) set.add({direction<double>(random), random.uniform(-0.02, 0.0)});
    Vector3<double> p = 0.05 * direction<double>(random), last = set.project(p).point - p;
    for (int step = 0; step < 300; ++step) {
      Vector3<double> const way = 0.001 * direction<double>(random);
      p += way;
      Vector3<double> const now = set.project(p).point - p;
      if (!((now - last).norm() <= way.norm() + 1e-12)) FAIL("a step of " << (now - last).norm() << " m");
      last = now;
    }
  }
}

// Yardstick: where a set of planes pushes is convex, so along a straight line it is met in one piece and never again.
TEST_CASE("C2-P7: along a straight line the planes that push do not come back once they are left", "[haptics]") {
  Random random(Seed{5});
  int changes = 0;
  for (int round = 0; round < 300; ++round) {
    PlaneSet<double> set;
    for (int k = 0; k < 5; ++k) set.add({direction<double>(random), random.uniform(-0.02, 0.0)});
    Vector3<double> const from = 0.05 * direction<double>(random), to = 0.05 * direction<double>(random);
    std::vector<unsigned> met;   // one bit a plane
    for (int step = 0; step <= 500; ++step) {
      auto const found = set.project(from + (to - from) * (step / 500.0));
      unsigned pushing = 0;
      for (int k = 0; k < found.count; ++k) pushing |= 1u << static_cast<unsigned>(found.active[static_cast<std::size_t>(k)]);
      if (!met.empty() && met.back() == pushing) continue;
      if (std::find(met.begin(), met.end(), pushing) != met.end()) FAIL("a set came back in round " << round << ", step " << step);
      met.push_back(pushing);
    }
    changes += static_cast<int>(met.size()) - 1;
  }
  CHECK(changes > 300);
}

TEST_CASE("C2-P5: planes that are there twice, or nearly, count once; those that contradict give a finite point") {
  Random random(Seed{4});
  for (int round = 0; round < 1000; ++round) {
    Vector3<double> const n = direction<double>(random);
    Vector3<double> const nearly = (n + 1e-8 * direction<double>(random)).normalized();
    Vector3<double> const p = 0.01 * direction<double>(random) - 0.02 * n;
    auto const one = planes<double>({{n, 0.0}}).project(p), two = planes<double>({{n, 0.0}, {n, 0.0}}).project(p);
    auto const close = planes<double>({{n, 0.0}, {nearly, 0.0}}).project(p);
    REQUIRE(two.point == one.point);
    REQUIRE((close.point - one.point).norm() < 1e-6);
    auto const none = planes<double>({{n, 0.01}, {-n, 0.01}}).project(p);   // no point is in front of both
    REQUIRE(none.point.allFinite());
  }
}

TEST_CASE("malformed planes are refused, and a projection allocates nothing") {
  PlaneSet<double> set;
  CHECK_THROWS_WITH(set.add({{0, 0, 2}, 0.0}), says("the normal is (0, 0, 2)", "length one"));
  CHECK_THROWS_AS(set.add({{0, 0, 1}, std::numeric_limits<double>::infinity()}), InvalidArgument);
  for (int k = 0; k < PlaneSet<double>::capacity; ++k) set.add({{0, 0, 1}, 0.001 * k});
  CHECK_THROWS_WITH(set.add({{0, 0, 1}, 0.0}), says("there are 8 planes already", "nearest"));
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(set.project({nan, 0, 0}).count == 0);
  palpate_test::AllocationCount const allocations;
  auto const found = set.project({0.1, 0.2, -0.3});
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(found.point.z() == Approx(0.007));
}
