// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/karnopp_friction.hpp>
#include <palpate/force/needle_force.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;

static_assert(ContactLaw<NeedleForce<float>, float> && !ContactLaw<NeedleForce<float>, double> && ForceModel<KarnoppFriction<float>, float>);

namespace {

/// A needle on a way in depth, a tick of 1 ms at a time.
template <class Model>
struct Insertion {
  using S = typename Model::Scalar;
  Model model;
  S depth = S(0);
  double work = 0;   // J, of the hand, by the trapezium rule
  S last = S(0);

  S to(S next) {
    ToolContact<S> const contact{.phase = CuttingPhase::moving,
                                 .depth = next,
                                 .previous_depth = depth,
                                 .velocity = Vector3<S>(S(0.3), S(0), (depth - next) / S(0.001))};
    Vector3<S> const force = model(contact);
    if (force.x() != S(0) || force.y() != S(0)) FAIL("not along the normal alone");
    work += double(last + force.z()) / 2 * double(next - depth);
    depth = next;
    return last = force.z();
  }
  /// At a constant speed [m/s]; returns the last force.
  S go(S end, S speed) {
    S force = S(0);
    int const ticks = std::max(1, static_cast<int>(std::lround(std::abs(end - depth) / (speed * S(0.001)))));
    S const from = depth;
    for (int k = 1; k <= ticks; ++k) force = to(from + (end - from) * S(k) / S(ticks));
    return force;
  }
};

KarnoppFrictionOptions const rubber{.dynamic = 10.0, .viscous = 100.0, .holding = 15.0, .stick_speed = 0.002, .stick_stiffness = 300.0};

}  // namespace

// Yardstick: the closed forms by hand. At 20 mm/s the force is (C + b ḋ) d = (10 + 2) d; held still after a stop it is what it was, up to D d.
TEMPLATE_TEST_CASE("a shaft slides at its dynamic friction and sticks up to its static one", "[force]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Insertion<KarnoppFriction<S>> shaft{KarnoppFriction<S>(rubber)};
  shaft.to(S(0.01));
  CHECK(double(shaft.go(S(0.03), S(0.02))) == Approx(12 * 0.03).epsilon(1e-3));
  CHECK(double(shaft.go(S(0.01), S(0.02))) == Approx(-12 * 0.01).epsilon(1e-3));
  shaft.go(S(0.03), S(0.02));
  for (int k = 0; k < 100; ++k) CHECK(double(shaft.to(S(0.03))) == Approx(12 * 0.03).epsilon(1e-3));   // at rest the spring stays drawn
  // Crept on at 1 mm/s, below v₀: up to D d = 0.45 N, 0.30 mm further, and no more.
  CHECK(double(shaft.go(S(0.0302), S(0.001))) == Approx(0.36 + 300 * 0.0002).epsilon(1e-3));
  CHECK(double(shaft.go(S(0.032), S(0.001))) == Approx(15 * 0.032).epsilon(1e-3));
  CHECK(double(shaft.model.limit(S(0.02), S(0.003))) == Approx(0.02 * (15 + 10.3) / 2).epsilon(1e-5));   // halfway between the two speeds
  CHECK(shaft.model.limit(S(-0.01), S(0)) == S(0));
}

// Yardstick: by hand, a₁ d + a₂ d² before; f_c + friction after, the friction alone on the way back.
TEMPLATE_TEST_CASE("a needle's three parts", "[force]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Insertion<NeedleForce<S>> needle{NeedleForce<S>({.linear = 100.0, .quadratic = 5000.0, .cutting = 0.9, .friction = rubber})};
  ToolContact<S> contact{.phase = CuttingPhase::indenting, .depth = S(0.006)};
  CHECK(double(needle.model(contact).z()) == Approx(0.6 + 0.18).epsilon(1e-5));
  contact.phase = CuttingPhase::no_contact;
  CHECK(needle.model(contact).norm() == S(0));
  needle.to(S(0.006));
  CHECK(double(needle.go(S(0.03), S(0.02))) == Approx(0.9 + 12 * 0.03).epsilon(1e-3));
  CHECK(double(needle.go(S(0.015), S(0.02))) == Approx(-12 * 0.015).epsilon(1e-3));
  CHECK(double(needle.go(S(0.025), S(0.02))) == Approx(12 * 0.025).epsilon(1e-3));        // in its own channel
  CHECK(double(needle.go(S(0.0295), S(0.02))) == Approx(0.45 + 12 * 0.0295).epsilon(1e-2));   // half of tip_depth before the end of it
  CHECK(double(needle.go(S(0.031), S(0.02))) == Approx(0.9 + 12 * 0.031).epsilon(1e-3));
  needle.model.reset();
  needle.depth = S(0.01);
  CHECK(double(needle.to(S(0.01))) == Approx(0.9));   // the next insertion: the tip alone, the shaft's spring slack
}

// Yardstick: the work of the hand over closed ways in depth, at random speeds that stick, slip and jump; and no step larger than the stiffness
// of its springs and of the tip times the way, and the fall of the limit with speed.
TEMPLATE_TEST_CASE("a needle takes energy on every closed way, and its force has no step on the way", "[force]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{8});
  for (int way = 0; way < 100; ++way) {
    Insertion<NeedleForce<S>> needle{NeedleForce<S>({.cutting = 0.9, .friction = rubber})};
    S const start = random.uniform(S(0.005), S(0.02));
    needle.to(start);
    auto const round = [&] {
      for (int leg = 0; leg < 6; ++leg) {
        S const end = leg == 5 ? start : random.uniform(S(0.003), S(0.03));
        S const speed = random.uniform(S(0), S(1)) < S(0.4) ? S(0.0015) : random.uniform(S(0.005), S(0.2));
        S const from = needle.depth;
        int const ticks = std::max(1, static_cast<int>(std::abs(end - from) / (speed * S(0.001))));
        for (int k = 1; k <= ticks; ++k) {
          S const before = needle.depth, last = needle.last, now = needle.to(k == ticks ? end : from + (end - from) * S(k) / S(ticks));
          // 300 N/m + 0.9 N/mm along the way; the limit falls by 5 N/m · depth where it begins to slide, grows by b |v| d.
          if (!(std::abs(now - last) <= S(1200 + 40) * std::abs(needle.depth - before) + S((5 + 100 * 0.4) * 0.03) + S(1e-4)))
            FAIL("from " << last << " N to " << now << " N at " << needle.depth << " m");
        }
      }
    };
    round();   // what the drawn spring may hold from it, 0.34 mJ at most, is far less than a round takes
    needle.work = 0;
    round();
    REQUIRE(needle.work > 0);
  }
}

TEST_CASE("in a cutting force the needle takes the place of the spring, and malformed ones are refused") {
  CuttingForce force(NeedleForce<double>({.linear = 100.0, .cutting = 0.5}));
  CHECK(force(ToolContact<double>{.phase = CuttingPhase::indenting, .depth = 0.01, .previous_depth = 0.01}).z() == Approx(1.0));
  double const nan = std::numeric_limits<double>::quiet_NaN();
  ToolContact<double> bad{.phase = CuttingPhase::moving, .depth = nan};
  CHECK(NeedleForce<double>({.cutting = 1.0})(bad).norm() == 0.0);
  using Needle = NeedleForce<double>;
  CHECK_THROWS_WITH(Needle({.cutting = -1.0}), says(".cutting is -1 N", "zero or more"));
  CHECK_THROWS_WITH(Needle({.friction = {.dynamic = 2.0, .holding = 1.0}}), says(".holding is 1 N/m", "not below .dynamic"));
  CHECK_THROWS_AS(Needle({.linear = nan}), InvalidArgument);
  CHECK_THROWS_AS(Needle({.tip_depth = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(KarnoppFriction<double>({.stick_speed = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(KarnoppFriction<double>({.stick_stiffness = nan}), InvalidArgument);

  ToolContact<double> const contact{.phase = CuttingPhase::moving, .depth = 0.01, .previous_depth = 0.01};
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) force(contact);
  long const counted = allocations.count();
  CHECK(counted == 0);
}
