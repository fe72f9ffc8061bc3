// SPDX-License-Identifier: MIT
// Yardsticks: by hand, a straight line between two numbers; a step bounded by what changes, shared by the ticks.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/patch_handover.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

using namespace palpate;

namespace {

using Patch = SurfacePatch<double>;

Vector3<double> handed_direction(Random& random) {
  Vector3<double> v;
  do v = {random.normal(), random.normal(), random.normal()};
  while (!(v.norm() > 0.1));
  return v.normalized();
}

/// Something like a surface at the origin.
Patch some_patch(Random& random, double tilt = 0.3) {
  Vector3<double> const n = (Vector3<double>::UnitZ() + tilt * handed_direction(random)).normalized();
  return {.point = 0.001 * handed_direction(random), .normal = n, .curvature = random.uniform(-40.0, 40.0),
      .stiffness = random.uniform(200.0, 800.0)};
}

}  // namespace

TEMPLATE_TEST_CASE("C4-L5 C4-L6: height, normal, curvature and stiffness go evenly from one patch to the next, and are its own after N ticks", "[haptics]",
    PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const close = 64 * std::numeric_limits<S>::epsilon();
  for (int const ticks : {1, 2, 10, 33}) {
    PatchHandover<S> handover({.ticks = ticks});
    Vector3<S> const tip(S(0.003), S(-0.002), S(-0.001));
    SurfacePatch<S> const first{.stiffness = 400};
    S const angle = S(0.5);
    SurfacePatch<S> const second{.point = tip + S(0.004) * Vector3<S>(std::sin(angle), 0, std::cos(angle)),
                                 .normal = Vector3<S>(std::sin(angle), 0, std::cos(angle)), .curvature = 20, .stiffness = 600};
    handover.take(first, 1, tip);
    for (int k = 0; k < ticks; ++k) handover(tip);
    CHECK(handover(tip).force(tip) == first.force(tip));   // to the bit
    handover.take(second, 2, tip);
    for (int k = 1; k <= ticks; ++k) {
      auto const now = handover(tip);
      S const share = S(k) / S(ticks), turn = share * angle;
      CHECK(double(now.distance(tip)) == Approx(double(-S(0.001) - share * S(0.003))).epsilon(close));
      CHECK((now.normal_at(tip) - Vector3<S>(std::sin(turn), 0, std::cos(turn))).norm() <= close);
      CHECK(double(now.curvature) == Approx(double(share * 20)).margin(close));
      CHECK(double(now.stiffness) == Approx(double(400 + share * 200)).epsilon(close));
      CHECK(handover.blends() == (k < ticks));
    }
    CHECK(handover(tip) == second);
  }
}

TEST_CASE("C4-L3 C4-L4: patches of the same ball hand over without a step, the same plane too, and the same patch again changes no bit", "[haptics]") {
  Random random(Seed{1});
  for (double const curvature : {50.0, -50.0, 0.0}) {
    PatchHandover<double> handover({.ticks = 20}), once({.ticks = 20});
    Patch const whole{.point = {0.01, 0.02, 0.03}, .normal = Vector3<double>(1, 2, 3).normalized(), .curvature = curvature, .stiffness = 500};
    Vector3<double> const start = whole.point - 0.001 * whole.normal;
    Vector3<double> tip = start;
    std::uint64_t sequence = 0;
    double worst = 0;
    handover.take(whole, ++sequence, whole.point + 0.001 * whole.normal);   // in front of it: at once
    once.take(whole, 1, whole.point + 0.001 * whole.normal);
    for (int k = 0; k < 5000; ++k) {
      tip = start + 0.003 * Vector3<double>(std::sin(0.003 * k), std::sin(0.0017 * k), 0.1 * std::sin(0.011 * k));
      if (random.below(15) == 0) handover.take(whole.anchored_at(whole.point + 0.004 * handed_direction(random)), ++sequence, tip);
      worst = std::max(worst, (handover(tip).force(tip) - whole.force(tip)).norm());
    }
    CHECK(worst <= 1e-12);
  }
  // Again and again, while one patch hands over to another and after.
  PatchHandover<double> twice({.ticks = 20}), once({.ticks = 20});
  bool same = true;
  for (int k = 0; k < 2000; ++k) {
    Vector3<double> const tip(0.001 * std::sin(0.01 * k), 0, -0.001);
    if (k % 100 == 0) {
      Patch const patch = some_patch(random);
      twice.take(patch, static_cast<std::uint64_t>(2 * k + 1), tip);
      once.take(patch, static_cast<std::uint64_t>(2 * k + 1), tip);
    } else if (k % 7 == 0) {
      twice.take(twice.told(), static_cast<std::uint64_t>(2 * k + 1), tip);
    }
    same = same && twice(tip).force(tip) == once(tip).force(tip);
  }
  CHECK(same);
}

// Yardstick: at a tip that rests nothing but the hand-over changes the force: in a tick by the height's, the stiffness' and the turn's N-th part.
TEST_CASE("C4-L5: whenever a newer patch comes it takes over from what there is: no step beyond its N-th part", "[haptics]") {
  Random random(Seed{2});
  constexpr int ticks = 33;
  for (int round = 0; round < 200; ++round) {
    PatchHandover<double> handover({.ticks = ticks});
    Vector3<double> const tip(0, 0, -0.004);
    std::uint64_t sequence = 10;
    handover.take(some_patch(random), sequence, tip);
    Patch last = handover(tip);
    int next = 1 + static_cast<int>(random.below(100));
    double allowed = 0;
    auto const allow = [&](Patch const& from, Patch const& to) {
      double const deep = std::max(std::abs(from.distance(tip)), std::abs(to.distance(tip))), stiff = std::max(from.stiffness, to.stiffness);
      double const turn = std::acos(std::min(1.0, from.normal_at(tip).dot(to.normal_at(tip))));
      return (stiff * std::abs(from.distance(tip) - to.distance(tip)) + deep * std::abs(from.stiffness - to.stiffness) + stiff * deep * turn) / ticks;
    };
    for (int k = 0; k < 1000; ++k) {
      if (k == next) {
        Patch const patch = some_patch(random);
        allowed = allow(last, patch);
        REQUIRE(handover.take(patch, sequence += 1 + random.below(3), tip));
        next = k + 1 + static_cast<int>(random.below(100));
        REQUIRE_FALSE(handover.take(some_patch(random), sequence, tip));       // the same number
        REQUIRE_FALSE(handover.take(some_patch(random), sequence - 1, tip));   // an older one
      }
      Patch const now = handover(tip);
      if (k > ticks) {
        double const step = (now.force(tip) - last.force(tip)).norm();
        if (!(step <= allowed * (1 + 1e-9) + 1e-12))
            FAIL("a step of " << step << " N where " << allowed << " N are its share, round " << round << ", tick " << k);
      }
      last = now;
    }
    REQUIRE(handover.dropped() > 0);
  }
}

TEST_CASE("C4-L6: a surface turned over is another contact: what was there fades, then the new one rises", "[haptics]") {
  PatchHandover<double> handover({.ticks = 40});
  Vector3<double> const tip(0, 0, -0.001);
  handover.take({.stiffness = 500}, 1, {0, 0, 0.001});
  handover(tip);
  // 2 mm deep from its side
  handover.take({.point = {0, 0, -0.003}, .normal = Vector3<double>(1e-3, 0, -1).normalized(), .stiffness = 500}, 2, tip);
  double last = 0.5;
  for (int k = 1; k <= 40; ++k) {
    Vector3<double> const force = handover(tip).force(tip);
    double const expected = k < 20 ? 0.5 * (1 - k / 20.0) : -1.0 * (k / 20.0 - 1);
    CHECK(force.z() == Approx(expected).margin(1e-5));
    CHECK(std::abs(force.z() - last) <= 1.0 / 20 + 1e-6);
    CHECK(std::abs(force.x()) <= 1.1e-3);   // never to the side
    last = force.z();
  }
  CHECK_FALSE(handover.blends());
}

// Yardstick: |ΔF| ≤ K |Δp| and an N-th part of the force for what comes and goes.
TEST_CASE("C4-L8: a contact that comes under the tip and one that is lost give no step", "[haptics]") {
  constexpr int ticks = 25;
  Random random(Seed{3});
  for (int round = 0; round < 100; ++round) {
    PatchHandover<double> handover({.ticks = ticks});
    double height = 0.001;
    bool there = false;
    double last = 0;
    std::uint64_t sequence = 0;
    for (int k = 0; k < 1000; ++k) {
      double const way = 1e-5 * random.normal();
      height = std::clamp(height + way, -0.002, 0.002);
      Vector3<double> const tip(0, 0, height);
      if (random.below(60) == 0) {
        there = !there;
        // where nothing is, it does not matter where
        handover.take({.point = {0, 0, there ? 0 : 0.3}, .stiffness = there ? 500.0 : 0.0}, ++sequence, tip);
      }
      double const now = handover(tip).force(tip).z();
      REQUIRE(std::abs(now - last) <= 500 * (std::abs(way) + 0.002 / ticks) + 1e-12);
      last = now;
    }
  }
  // Where the tip is in front of it, a new surface is as stiff as it is at once.
  PatchHandover<double> handover({.ticks = ticks});
  handover.take({.stiffness = 500}, 1, {0, 0, 1e-6});
  CHECK(handover({0, 0, -0.001}).force({0, 0, -0.001}).z() == Approx(0.5));
}

// Yardstick: a surface that rises evenly: with its velocity told the error between two patches is that of a tick, not of a frame.
TEST_CASE("a patch goes on with its velocity until the next one comes, but no longer than it may", "[haptics]") {
  PatchHandover<double> follows({.ticks = 10, .moves_for = 0.05}), rests({.ticks = 10});
  double worst = 0, worst_at_rest = 0;
  for (int k = 0; k < 600; ++k) {
    double const rise = 20e-6 * k;   // 20 mm/s
    Vector3<double> const tip(0, 0, rise - 0.002);
    if (k % 50 == 0)
      for (auto* const one : {&follows, &rests})
        one->take({.point = {0, 0, rise}, .stiffness = 500, .velocity = {0, 0, 0.02}}, static_cast<std::uint64_t>(k + 1), tip);
    double const wanted = 500 * 0.002, error = std::abs(follows(tip).force(tip).z() - wanted),
        error_at_rest = std::abs(rests(tip).force(tip).z() - wanted);
    if (k > 60) worst = std::max(worst, error), worst_at_rest = std::max(worst_at_rest, error_at_rest);
  }
  CHECK(worst <= 500 * 20e-6 * 1.001);
  CHECK(worst_at_rest > 0.4);
  auto const stopped = [&] {
    for (int k = 0; k < 200; ++k) follows({0, 0, 0});
    return follows({0, 0, 0}).point.z();
  };
  double const there = stopped();
  CHECK(there == stopped());
  CHECK(there == Approx(550 * 20e-6 + 0.05 * 0.02));
}

// Yardstick: where the surface is by its velocity and by a straight line, after the time that has passed.
TEST_CASE("C4-L5: a tick that is late goes as far as those that it stands for", "[haptics]") {
  Vector3<double> const tip(0, 0, -0.002);
  for (int const late : {1, 2, 5, 40}) {
    PatchHandover<double> handover({.ticks = 20, .moves_for = 0.05});
    Patch const first{.stiffness = 400}, second{.point = {0, 0, 0.004}, .stiffness = 600, .velocity = {0, 0, 0.02}};
    handover.take(first, 1, tip), handover(tip);
    for (int k = 0; k < 100; ++k) handover(tip);
    handover.take(second, 2, tip);
    for (int k = late; k <= 120; k += late) {
      Patch const now = handover(tip, late);
      double const share = std::min(1.0, k / 20.0);
      CAPTURE(late, k);
      CHECK(-now.distance(tip) == Approx(0.002 + share * (0.004 + 0.02 * 1e-3 * std::min(k, 50))).epsilon(1e-9));
      CHECK(now.stiffness == Approx(400 + 200 * share));
    }
  }
}

TEST_CASE("malformed hand-overs and patches are refused, what is no number is not felt, and a tick allocates nothing", "[haptics]") {
  using Handover = PatchHandover<double>;
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(Handover({.ticks = 0}), says(".ticks is 0", "1 or more"));
  CHECK_THROWS_WITH(Handover({.period = 0.0}), says(".period is 0 s", "0.001"));
  CHECK_THROWS_AS(Handover({.moves_for = nan}), InvalidArgument);
  CHECK_THROWS_AS(Handover({.moves_for = 1e300}), InvalidArgument);
  Handover handover;
  Vector3<double> const tip(0, 0, -0.001);
  CHECK(handover(tip).force(tip).isZero(0));   // nothing was told
  CHECK_FALSE(handover.take({.normal = {0, 0, 2}, .stiffness = 500}, 1, tip));
  CHECK_FALSE(handover.take({.stiffness = 500}, 1, {nan, 0, 0}));
  CHECK(handover.refused() == 2);
  CHECK(handover.take({.stiffness = 500}, 1, tip));   // the number is not used up
  for (int k = 0; k < 50; ++k) handover(tip);
  CHECK(handover({nan, 0, 0}).force({nan, 0, 0}).isZero(0));
  CHECK(handover(tip).force(tip).z() == Approx(0.5));
  palpate_test::AllocationCount const allocations;
  for (std::uint64_t k = 2; k < 100; ++k) {
    handover.take({.point = {0, 0, 1e-5 * double(k)}, .curvature = double(k), .stiffness = 500, .velocity = {0, 0, 1}}, k, tip);
    handover(tip);
  }
  long const counted = allocations.count();
  CHECK(counted == 0);
  handover.reset();
  CHECK(handover(tip).force(tip).isZero(0));
  CHECK(handover.take({.stiffness = 500}, 1, tip));
  static_assert(noexcept(handover(tip)) && noexcept(handover.take(handover.told(), 1, tip)));
}
