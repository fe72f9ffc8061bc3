// SPDX-License-Identifier: MIT
// Yardsticks: by hand, a straight line between two numbers; the projection on planes that are known exactly; a step that is shared by the ticks.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/surface_proxy.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

using Wall = ContactPlane<double>;

PlaneSet<double> walls(std::vector<Wall> const& list) {
  PlaneSet<double> set;
  for (Wall const& wall : list) set.add({wall.normal.normalized(), wall.offset});
  return set;
}

}  // namespace

TEMPLATE_TEST_CASE("C4-L5 C4-L6: a plane goes evenly to where it is to be, and is there after N ticks", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const close = 64 * std::numeric_limits<S>::epsilon();
  for (int const ticks : {1, 2, 10, 33}) {
    PlaneHandover<S> handover({.ticks = ticks});
    Vector3<S> const tip(S(0.03), S(-0.02), S(-0.001));
    S const angle = S(0.5);
    PlaneSet<S> first, second;
    first.add({Vector3<S>::UnitZ(), S(0)});
    Vector3<S> const normal(std::sin(angle), 0, std::cos(angle));
    second.add({normal, normal.dot(tip) + S(0.004)});
    handover.take(first, 400, 1, tip);
    for (int k = 0; k < ticks; ++k) handover(tip);
    handover.take(second, 600, 2, tip);
    for (int k = 1; k <= ticks; ++k) {
      auto const now = handover(tip);
      S const share = S(k) / S(ticks), turn = share * angle;
      REQUIRE(now.count() == 1);
      CHECK(double(now[0].distance(tip)) == Approx(double(-S(0.001) - share * S(0.003))).margin(close * 0.03));
      CHECK((now[0].normal - Vector3<S>(std::sin(turn), 0, std::cos(turn))).norm() <= close);
      CHECK(double(handover.stiffness()) == Approx(double(400 + share * 200)).epsilon(close));
      CHECK(handover.blends() == (k < ticks));
    }
    auto const now = handover(tip);
    CHECK(now.count() == 1);
    CHECK((now[0].normal == second[0].normal && now[0].offset == second[0].offset));   // to the bit
  }
}

TEST_CASE("C4-L5: a tick that is late turns and lifts a plane as far as those that it stands for", "[haptics]") {
  Vector3<double> const tip(0.03, -0.02, -0.001);
  for (int const late : {1, 2, 5, 40}) {
    PlaneHandover<double> handover({.ticks = 20});
    PlaneSet<double> first, second;
    first.add({Vector3<double>::UnitZ(), 0});
    second.add({Vector3<double>(std::sin(0.5), 0, std::cos(0.5)), Vector3<double>(std::sin(0.5), 0, std::cos(0.5)).dot(tip) + 0.004});
    handover.take(first, 400, 1, tip);
    for (int k = 0; k < 20; ++k) handover(tip);
    handover.take(second, 600, 2, tip);
    for (int k = late; k <= 40; k += late) {
      auto const now = handover(tip, late);
      double const share = std::min(1.0, k / 20.0);
      CAPTURE(late, k);
      REQUIRE(now.count() == 1);
      CHECK(now[0].distance(tip) == Approx(-0.001 - share * 0.003));
      CHECK(now[0].normal.x() == Approx(std::sin(0.5 * share)));
      CHECK(handover.stiffness() == Approx(400 + share * 200));
    }
  }
}

TEST_CASE("a wall that comes rises from where it does not push, and one that leaves sinks to there", "[haptics]") {
  constexpr int ticks = 20;
  PlaneHandover<double> handover({.ticks = ticks});
  SurfaceProxy<double> proxy({.stiffness = 500});
  Vector3<double> const tip(0, 0, -0.001);
  auto const floor = walls({{{0, 0, 1}, 0.0}}), corner = walls({{{1, 0, 0}, 0.002}, {{0, 0, 1}, 0.0}});
  auto const force = [&] { return proxy(handover(tip), tip, handover.stiffness()); };
  handover.take(floor, 500, 1, {0, 0, 0.001});   // in front of it: at once
  CHECK((force() - Vector3<double>(0, 0, 0.5)).norm() < 1e-12);
  handover.take(corner, 500, 2, tip);
  for (int k = 1; k <= ticks; ++k) CHECK((force() - Vector3<double>(1.0 * k / ticks, 0, 0.5)).norm() < 1e-12);
  handover.take(floor, 500, 3, tip);
  for (int k = 1; k <= ticks; ++k) CHECK((force() - Vector3<double>(1.0 - 1.0 * k / ticks, 0, 0.5)).norm() < 1e-12);
  handover.take({}, 0, 4, tip);   // nothing is there any more
  for (int k = 1; k <= ticks; ++k) CHECK((force() - Vector3<double>(0, 0, 0.5 - 0.5 * k / ticks)).norm() < 1e-12);
  handover.take(floor, 500, 5, tip);   // there again, with the tip in it
  for (int k = 1; k <= ticks; ++k) CHECK((force() - Vector3<double>(0, 0, 0.5 * k / ticks)).norm() < 1e-12);
  handover.take(walls({{{0, 0, -1}, 0.002}}), 500, 6, tip);   // turned over: from 1 mm below one to 1 mm below the other
  for (int k = 1; k <= ticks; ++k) CHECK((force() - Vector3<double>(0, 0, 0.5 - 1.0 * k / ticks)).norm() < 1e-9);
}

// Yardstick: planes of a corner, nearly at right angles, move the point in front of them by about their own way each.
TEST_CASE("C4-L5: whenever newer planes come they take over from what there is: no step beyond their N-th part", "[haptics]") {
  Random random(Seed{1});
  constexpr int ticks = 33;
  for (int round = 0; round < 200; ++round) {
    PlaneHandover<double> handover({.ticks = ticks});
    std::uint64_t sequence = 0;
    Vector3<double> tip(-0.001, -0.001, -0.001);
    auto const some = [&] {
      std::vector<Wall> list;
      for (int k = 0; k < 3; ++k)
        if (random.below(3) > 0) {
          Vector3<double> const tilt(random.normal(), random.normal(), random.normal());
          Vector3<double> const n = Vector3<double>::Unit(k) + 0.1 * tilt.cwiseMin(1.5).cwiseMax(-1.5);
          list.push_back({n, random.uniform(-0.001, 0.001)});
        }
      if (list.size() > 1 && random.below(2) == 0) std::swap(list.front(), list.back());
      return walls(list);
    };
    Vector3<double> last = Vector3<double>::Zero();
    int next = 0;
    for (int k = 0; k < 500; ++k) {
      Vector3<double> const way = 2e-6 * Vector3<double>(random.normal(), random.normal(), random.normal());
      tip += way;
      if (k == next) {
        REQUIRE(handover.take(some(), 500, sequence += 1 + random.below(3), tip));
        REQUIRE_FALSE(handover.take(some(), 500, sequence, tip));
        REQUIRE_FALSE(handover.take(some(), 500, sequence - 1, tip));
        next = k + 1 + static_cast<int>(random.below(100));
      }
      Vector3<double> const now = handover(tip).project(tip).point - tip;
      // A plane goes at most from one end of the offsets and tilts to the other: 2 mm, and what a tilt of 0.3 to both sides moves it at 2 mm; three
      // of them at once.
      double const allowed = std::sqrt(3.0) * (0.002 + 0.6 * 0.002 + 0.001) / ticks + 8 * way.norm();
      if (k > 0 && !((now - last).norm() <= allowed)) FAIL("a step of " << (now - last).norm() << " m, round " << round << ", tick " << k);
      last = now;
    }
    REQUIRE(handover.dropped() > 0);
  }
}

// Yardstick: the bottom line of the wedge, which both planes hold the tip on; a tool that feels the plane it is deepest in alone is thrown from side
// to side.
TEST_CASE("C4-L9: in a wedge whose planes come in any order, trembling, the force does not change sides", "[haptics]") {
  Random random(Seed{2});
  PlaneHandover<double> handover({.ticks = 33});
  Vector3<double> const left(0.6, 0, 0.8), right(-0.6, 0, 0.8), end(0, 1, 0);
  auto const trembling = [&](Vector3<double> const& n) {
    return Wall{n + 1e-3 * Vector3<double>(random.normal(), random.normal(), random.normal()).cwiseMin(3).cwiseMax(-3),
        1e-5 * random.uniform(-1.0, 1.0)};
  };
  std::uint64_t sequence = 0;
  double aside = 0, step = 0, aside_alone = 0;
  Vector3<double> last = Vector3<double>::Zero();
  for (int k = 0; k < 3300; ++k) {
    Vector3<double> const tip(1e-4 * std::sin(0.05 * k), 0.001 + 0.002 * std::sin(0.002 * k), -0.002);   // end: in front of the wall, and behind
    if (k % 33 == 0) {
      std::vector<Wall> list{trembling(left), trembling(right), trembling(end)};
      for (std::size_t i = 2; i > 0; --i) std::swap(list[i], list[static_cast<std::size_t>(random.below(static_cast<std::uint32_t>(i + 1)))]);
      handover.take(walls(list), 500, ++sequence, tip);
    }
    auto const planes = handover(tip);
    Vector3<double> const force = 500 * (planes.project(tip).point - tip);
    int deepest = 0;
    for (int i = 1; i < planes.count(); ++i)
      if (planes[i].distance(tip) < planes[deepest].distance(tip)) deepest = i;
    Vector3<double> const alone = -500 * planes[deepest].distance(tip) * planes[deepest].normal;
    aside = std::max(aside, std::abs(force.x() + 500 * tip.x()));   // back to the bottom line
    aside_alone = std::max(aside_alone, std::abs(alone.x() + 500 * tip.x()));
    if (k > 33) step = std::max(step, (force - last).norm());
    last = force;
  }
  CHECK(aside < 500 * 1e-4);       // N: offsets of 10 µm and tilts of 3 mrad at 3 mm
  CHECK(aside_alone > 0.3);
  CHECK(step < 500 * (7e-6 + 1e-5));   // the tip's way in a tick, and a 33rd of the tremble
}

TEST_CASE("C4-L4: malformed planes and hand-overs are refused, the same planes change no bit, and a tick allocates nothing", "[haptics]") {
  using Handover = PlaneHandover<double>;
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(Handover({.ticks = 0}), says(".ticks is 0", "1 or more"));
  Handover handover({.ticks = 20}), once({.ticks = 20});
  Vector3<double> const tip(-0.001, -0.002, -0.003);
  CHECK(handover(tip).count() == 0);
  auto const corner = walls({{{1, 0, 0}, 0.0}, {{0, 1, 0}, 0.0}, {{0, 0, 1}, 0.0}}),
      four = walls({{{1, 0, 0}, 0.0}, {{0, 1, 0}, 0.0}, {{0, 0, 1}, 0.0}, {{1, 1, 1}, 0.0}});
  CHECK_FALSE(handover.take(four, 500, 1, tip));
  CHECK_FALSE(handover.take(corner, -1, 1, tip));
  CHECK_FALSE(handover.take(corner, 500, 1, {nan, 0, 0}));
  CHECK(handover.refused() == 3);
  bool same = true, finite = true;
  palpate_test::AllocationCount const allocations;
  for (std::uint64_t k = 1; k < 200; ++k) {
    Vector3<double> const at = tip + 1e-5 * double(k) * Vector3<double>(1, 2, 3);
    if (k == 1) once.take(corner, 500, k, at);
    if (k == 60) once.take(four, 500, k, at), once.take(PlaneSet<double>{}, 500, k, at), handover.take(PlaneSet<double>{}, 500, k, at);
    if (k < 60 && k % 7 == 1) handover.take(corner, 500, k, at);
    auto const a = handover(at).project(at), b = once(at).project(at);
    same = same && a.point == b.point && handover.stiffness() == once.stiffness();
    finite = finite && a.point.allFinite();
  }
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(same);
  CHECK(finite);
  CHECK(handover({nan, 0, 0}).count() == 0);
  handover.take(corner, 500, 1000, tip);
  handover.reset();
  CHECK(handover(tip).count() == 0);
  CHECK(handover.take(corner, 500, 1, tip));
  static_assert(noexcept(handover(tip)) && noexcept(handover.take(corner, 500.0, 1, tip)));
}

TEST_CASE("a plane is added in the servo tick without a word, and a proxy takes the tissue's stiffness", "[haptics]") {
  PlaneSet<double> set;
  CHECK_FALSE(set.try_add({{0, 0, 2}, 0.0}));
  CHECK_FALSE(set.try_add({{0, 0, 1}, std::numeric_limits<double>::quiet_NaN()}));
  CHECK(set.count() == 0);
  for (int k = 0; k < PlaneSet<double>::capacity; ++k) CHECK(set.try_add({{0, 0, 1}, -0.001 * k}));
  CHECK_FALSE(set.try_add({{0, 0, 1}, 0.0}));
  SurfaceProxy<double> proxy({.stiffness = 500, .static_friction = 0.5, .dynamic_friction = 0.3});
  CHECK(proxy(set, {0, 0, -0.001}, 800.0).z() == Approx(0.8));
  CHECK(proxy(set, {0.0002, 0, -0.001}, 100.0).x() == Approx(-0.02));   // it sticks, whatever the stiffness
  CHECK(proxy(set, {0, 0, -0.001}).z() == Approx(0.5));
  CHECK(proxy(set, {0, 0, -0.001}, -1.0).isZero(0));
}
