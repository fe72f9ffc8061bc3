// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/safety_chain.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace palpate;

namespace {

Capabilities const touch_like{.max_force = datasheet(3.3),
                              .rate = 1000.0,
                              .buttons = 2,
                              .continuous_force = datasheet(0.88),
                              .max_damping = datasheet(3.0),
                              .mass = datasheet(0.045)};

/// A chain, the hand at a button, and what came of each tick.
struct Bench {
  SafetyOptions options{};
  Capabilities device = touch_like;
  SafetyChain<double> chain{};
  SafetyReading<double> reading{.buttons = 1};
  WantedForce<double> wanted{};
  WorkspaceMapping<double> mapping{};
  std::vector<SafetyEvent> events{};

  void begin() { chain.begin(options, device, 500.0), events.clear(), wanted.force.setZero(); }
  /// Begins and lets the chain arm.
  void begin_armed() {
    begin();
    ticks(5);
    REQUIRE(chain.stage() == DeviceStage::running);
    events.clear();
  }
  Vector3<double> tick() {
    chain.read(reading);
    Vector3<double> const out = chain(wanted, mapping);
    while (auto const event = chain.pop_event()) events.push_back(*event);
    return out;
  }
  Vector3<double> tick(Vector3<double> const& force) {
    wanted.force = force;
    return tick();
  }
  void ticks(int count) {
    for (int k = 0; k < count; ++k) tick();
  }
  int told(SafetyEvent event) const { return static_cast<int>(std::count(events.begin(), events.end(), event)); }
};

/// Nothing but what a test is about.
SafetyOptions unlimited() {
  constexpr double none = std::numeric_limits<double>::infinity();
  return {.max_force = none, .slew = none, .thermal_time = 0.0, .arm_force = none, .arm_ticks = 1, .overspeed = none, .jump = none, .dead_man = 0u, .damping = 0.0};
}

}  // namespace

TEST_CASE("what is left out is careful for a hand and nothing for a simulated device", "[haptics][safety]") {
  constexpr double none = std::numeric_limits<double>::infinity();
  SafetyLimits const hand = limits_for({}, touch_like, 500.0);
  CHECK(hand.max_force == 0.88);
  CHECK(hand.slew == 500.0);
  CHECK(hand.thermal_time == 10.0);
  CHECK(hand.arm_force == 0.2);
  CHECK(hand.overspeed == 1.0);
  CHECK(hand.jump == 0.005);
  CHECK(hand.dead_man == 3u);
  CHECK(hand.damping == 3.0);   // 11.25 for 45 g, the device's own 3
  CHECK(hand.stale_after == 0.1);
  Capabilities stronger = touch_like;
  stronger.continuous_force = datasheet(1.75);
  stronger.buttons = 0;
  CHECK(limits_for({}, stronger, 500.0).max_force == 1.0);
  CHECK(limits_for({}, stronger, 500.0).dead_man == 0u);
  CHECK(limits_for({.max_force = 10.0}, stronger, 500.0).max_force == 3.3);
  CHECK(limits_for({}, stronger, 20.0).stale_after == Approx(0.15));   // three frames of a slow body
  Capabilities simulated = touch_like;
  simulated.moves_a_hand = false;
  SafetyLimits const free = limits_for({}, simulated, 500.0);
  CHECK(free.max_force == 3.3);
  CHECK((free.slew == none && free.overspeed == none && free.jump == none && free.arm_force == none && free.gap == none && free.stale_after == none));
  CHECK((free.thermal_time == 0.0 && free.damping == 0.0 && free.dead_man == 0u));
  CHECK(limits_for({.protects_a_hand = true}, simulated, 500.0).max_force == 0.88);
}

TEST_CASE("C9-X1: a force that is no number becomes zero, and a fault when it goes on", "[haptics][safety]") {
  Bench bench{.options = {.max_not_finite = 3}};
  bench.begin_armed();
  CHECK(bench.tick({0, 0, 0.1}) == Vector3<double>(0, 0, 0.1));
  for (double const bad : {std::nan(""), std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) CHECK(bench.tick({0, bad, 0}).isZero(0));
  CHECK(bench.told(SafetyEvent::not_finite) == 1);
  CHECK(bench.tick({0, 0, 0.1}) == Vector3<double>(0, 0, 0.1));   // a good one begins the count anew
  for (int k = 0; k < 4; ++k) CHECK(bench.tick({0, std::nan(""), 0}).isZero(0));
  CHECK(bench.chain.faulted());
  CHECK(bench.told(SafetyEvent::fault) == 1);
  CHECK(bench.chain.counts().not_finite == 7);
  CHECK(bench.tick({0, 0, 0.1}).isZero(0));
  bench.begin_armed();   // every state can be restarted
  CHECK(bench.tick({0, 0, 0.1}) == Vector3<double>(0, 0, 0.1));
}

// By counting: one in p ticks of 1 ms is 1000/p a second.
TEST_CASE("forces that are no numbers now and then are a fault where there are too many in a second", "[haptics][safety]") {
  auto const ticks_to_fault = [](SafetyOptions const& options, int every, bool positions = false) {
    Bench bench{.options = options};
    bench.begin_armed();
    for (int k = 1; k <= 20000; ++k) {
      bool const bad = k % every == 0;
      bench.reading.usable = !(bad && positions);
      Vector3<double> const out = bench.tick({0, bad && !positions ? std::nan("") : 0.0, 0.1});
      REQUIRE(out.isZero(0) == (bad || bench.chain.faulted()));
      if (bench.chain.faulted()) return k;
    }
    return 0;
  };
  for (bool const positions : {false, true}) {
    CAPTURE(positions);
    CHECK(ticks_to_fault({}, 2, positions) == 2 * 21);   // one more than twenty
    CHECK(ticks_to_fault({}, 49, positions) == 49 * 21);   // from the first to the 21st are 980 ms
    CHECK(ticks_to_fault({}, 51, positions) == 0);         // 1,020 ms
  }
  CHECK(ticks_to_fault({.max_not_finite_in_window = 5, .not_finite_window = 0.1}, 19) == 19 * 6);
  CHECK(ticks_to_fault({.max_not_finite_in_window = 5, .not_finite_window = 0.1}, 21) == 0);
  CHECK(ticks_to_fault({.max_not_finite_in_window = 64, .not_finite_window = 1.0}, 2) == 2 * 65);
  CHECK(ticks_to_fault({.max_not_finite_in_window = 0}, 7) == 7);
  Bench simulated;
  simulated.device.moves_a_hand = false;
  simulated.begin_armed();
  for (int k = 0; k < 3000; ++k) CHECK(simulated.tick({0, k % 2 == 0 ? std::nan("") : 0.0, 0.1}).isZero(0) == (k % 2 == 0));
}

// Closed form: per-axis clipping of (10, 1, 0) N at 3 N would turn it by 12.7 degrees.
TEST_CASE("C9-X2: shortening a force keeps its direction", "[haptics][safety]") {
  Bench bench{.options = unlimited()};
  bench.options.max_force = 3.0;
  bench.begin_armed();
  Vector3<double> const wanted{10, 1, 0}, out = bench.tick(wanted);
  CHECK(out.norm() == Approx(3.0).epsilon(1e-14));
  CHECK(out.cross(wanted).norm() / (out.norm() * wanted.norm()) < 1e-12);
  CHECK(bench.chain.counts().limited == 1);
}

TEST_CASE("C9-X3: no step above the slew limit, but to zero", "[haptics][safety]") {
  Bench bench{.options = {.max_force = 3.3, .thermal_time = 0.0, .damping = 0.0}};
  bench.begin_armed();
  Random random(Seed{3});
  Vector3<double> before = Vector3<double>::Zero();
  double largest = 0.0;
  for (int k = 0; k < 20000; ++k) {
    if (random.uniform<double>() < 0.02) bench.reading.seconds = 0.005 + 0.05 * random.uniform<double>();   // gaps: ramps, disarming
    bench.wanted.age = std::fmod(k, 700.0) > 450.0 ? 0.2 : 0.0;                                              // stale for a while
    bench.wanted.quiet = std::fmod(k, 1100.0) > 1000.0;
    double const size = k % 2000 < 200 ? 0.05 : 4.0;
    Vector3<double> const out = bench.tick(size * Vector3<double>(random.normal<double>(), random.normal<double>(), random.normal<double>()));
    bench.reading.seconds = 0.001;
    REQUIRE(out.norm() <= 3.3 * (1 + 1e-12));
    if (!out.isZero(0)) REQUIRE((out - before).norm() <= 0.5 * (1 + 1e-9));
    largest = std::max(largest, (out - before).norm());
    before = out;
  }
  CHECK(largest > 0.5);   // zero was reached faster
  CHECK(bench.told(SafetyEvent::tick_gap) > 50);
  CHECK(bench.told(SafetyEvent::model_stale) > 1);
}

TEST_CASE("no step above the slew limit where the thermal limit falls, a late model fades or a clutch opens, however slow slew is", "[haptics][safety]") {
  struct Case {
    double max_force, slew, thermal_time, seconds;
    bool stale;
  };
  for (Case const c : {Case{3.3, 10.0, 10.0, 0.001, false}, {3.3, 500.0, 0.1, 0.001, false}, {20.0, 500.0, 1.0, 0.001, false}, {3.3, 20.0, 0.0, 0.0049, true}, {10.0, 100.0, 0.0, 0.0049, true},
                       {3.3, 5.0, 0.5, 0.001, true}}) {
    CAPTURE(c.max_force, c.slew, c.thermal_time, c.stale);
    Bench bench{.options = {.max_force = c.max_force, .slew = c.slew, .thermal_time = c.thermal_time, .damping = 0.0}, .device = touch_like};
    bench.device.max_force = datasheet(c.max_force);
    bench.begin_armed();
    Vector3<double> before = Vector3<double>::Zero();
    double largest = 0.0;
    for (int k = 0; k < 8000; ++k) {
      bool const late = c.stale && k > 2000 && k % 4000 > 2000;
      bench.reading.seconds = late ? c.seconds : 0.001;
      bench.wanted.age = late && k < 4000 ? 0.2 : 0.0, bench.wanted.quiet = late && k >= 4000;
      Vector3<double> const out = bench.tick({0, 0, c.max_force});
      largest = std::max(largest, (out - before).norm());   // to zero as well
      before = out;
      if (late && (k == 3999 || k == 7999)) REQUIRE(out.isZero(0));
    }
    CHECK(largest <= c.slew * 0.001 * (1 + 1e-9));
    CHECK(largest > 0.99 * c.slew * 0.001);
    if (!c.stale) CHECK(before.norm() == Approx(0.88).epsilon(1e-3));
  }
}

TEST_CASE("the energy of all sessions stays where another mapping begins", "[haptics][safety]") {
  SafetyChain<double> chain;
  Capabilities const device{.max_force = 3.3, .rate = 1000.0, .moves_a_hand = false};
  auto const mapping = [](double scale, double force) { return WorkspaceMapping<double>(Similarity<double>::make(scale, Eigen::Quaterniond::Identity(), Vector3<double>::Zero()), force); };
  chain.begin({}, device, 1000.0, mapping(1.0, 1.0));
  for (int k = 0; k < 100; ++k) {
    chain.read({.position = {0, 0, -1e-5 * k}});
    chain({.force = {0, 0, 1.0}}, mapping(1.0, 1.0));
  }
  double const given = chain.energy();
  CHECK(given > 5e-4);
  chain.begin({}, device, 1000.0, mapping(0.5, 2.0));   // the same stiffness is felt
  CHECK(chain.energy() == Approx(given).epsilon(1e-12));
}

// By hand: 3.3 N until the motors have had four fifths of F_c², then down to the continuous 0.88 N, which passes for ever.
TEST_CASE("C9-X4: motors that warm up bring the force down to what they stand for ever", "[haptics][safety]") {
  Bench bench{.options = {.max_force = 3.3, .damping = 0.0}};
  bench.begin_armed();
  for (int k = 0; k < 100000; ++k) REQUIRE(bench.tick({0.88, 0, 0}).x() >= (k < 2 ? 0.4 : 0.88 * (1 - 1e-12)));
  Bench cold{.options = {.max_force = 3.3, .damping = 0.0}};
  cold.begin_armed();
  double before = 3.3, full = 0.0;
  for (int k = 0; k < 60000; ++k) {
    double const out = cold.tick({3.3, 0, 0}).x();
    if (k > 10) {
      REQUIRE(out <= before * (1 + 1e-12));
      REQUIRE(before - out <= 0.5);
      before = out;
    }
    if (out > 3.299) full += 0.001;
  }
  CHECK(before == Approx(0.88).epsilon(0.01));
  CHECK(full == Approx(-10.0 * std::log1p(-0.8 * 0.88 * 0.88 / (3.3 * 3.3))).epsilon(0.02));   // when the first-order filter reaches 0.8 F_c²
  CHECK(cold.chain.warmth() <= 1.0 + 1e-9);
  CHECK(cold.chain.counts().cooled > 50000);
  cold.begin_armed();   // another session does not cool the motors
  for (int k = 0; k < 50; ++k) CHECK(cold.tick({3.3, 0, 0}).x() < 0.9);
}

TEST_CASE("C9-X5: a tool that begins in the tissue stays disarmed until it leaves", "[haptics][safety]") {
  Bench bench;
  bench.begin();
  for (int k = 0; k < 1000; ++k) REQUIRE(bench.tick({0, 0, 5.0}).isZero(0));   // 10 mm inside 500 N/m
  CHECK(bench.chain.stage() == DeviceStage::open);
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::small_force);
  CHECK(bench.told(SafetyEvent::arming_waits) <= 1);
  CHECK(static_cast<int>(bench.events.size()) == bench.told(SafetyEvent::arming_waits));
  for (int k = 0; k < 3; ++k) bench.tick({0, 0, 0.1});
  CHECK(bench.tick({0, 0, 5.0}).isZero(0));   // only three ticks
  for (int k = 0; k < 4; ++k) bench.tick({0, 0, 0.1});
  CHECK(bench.chain.stage() == DeviceStage::running);
  CHECK(bench.told(SafetyEvent::armed) == 1);
  CHECK(bench.tick({0, 0, 5.0}).z() == Approx(0.6));   // 0.1 and the slew of a tick
}

// What arms is the force that is wanted, whatever damping, a small maximum or a hand-over leave of it.
TEST_CASE("neither damping nor a small maximum arms a tool in the tissue", "[haptics][safety]") {
  Bench retracting;
  retracting.begin();
  for (int k = 0; k < 40; ++k) {   // out of 100 N/m at 60 mm/s, from 5 mm deep
    double const depth = 0.005 - 6e-5 * k;
    retracting.reading.position = {0, 0, -depth};
    REQUIRE(retracting.tick({0, 0, 100 * depth}).isZero(0));
  }
  Bench capped{.options = {.max_force = 0.15}};
  capped.begin();
  for (int k = 0; k < 100; ++k) REQUIRE(capped.tick({0, 0, 5}).isZero(0));
  Bench rising;   // as a model that is handed over
  rising.wanted.inside = true;
  rising.begin();
  for (int k = 0; k < 100; ++k) REQUIRE(rising.tick({0, 0, 0.01 * k}).isZero(0));
  Bench unseen;   // no sample was ever new
  unseen.reading.fresh = false;
  unseen.begin();
  unseen.ticks(100);
  CHECK(unseen.chain.stage() == DeviceStage::open);
}

// Closed form: a scene s times as large feels a damping of the hand's α as α/(κ s).
TEST_CASE("the controller adds no more than the device stands, whatever the scale of the scene", "[haptics][safety]") {
  for (double const scale : {0.3, 1.0, 3.0, 10.0}) {
    CAPTURE(scale);
    Bench bench{.options = unlimited(), .mapping = WorkspaceMapping<double>(Similarity<double>::make(scale, Eigen::Quaterniond::Identity(), {0, 0, 0}))};
    bench.options.damping = 5.0;
    bench.device.max_damping = {};
    bench.chain.begin(bench.options, bench.device, 500.0, bench.mapping);
    bench.ticks(3);
    for (int k = 0; k < 200; ++k) {   // the hand is given energy
      bench.reading.position.x() += 1e-4;
      bench.tick({2.0 / scale, 0, 0});
    }
    CHECK(bench.chain.energy() < -0.01);
    double const speed = 0.1;
    bench.reading.position.x() += speed * 0.001;
    Vector3<double> const felt = bench.tick({0, 0, 0});
    CHECK(-felt.x() == Approx(5.0 * speed).epsilon(1e-9));
  }
}

TEST_CASE("a jump of the position is no work", "[haptics][safety]") {
  Bench bench{.options = {.damping = 0.0}};
  bench.begin_armed();
  bench.tick({0, 0, 0.15});
  bench.reading.position.z() += 0.02;
  bench.tick();
  CHECK(bench.told(SafetyEvent::position_jump) == 1);
  CHECK(bench.chain.energy() == 0.0);
}

TEST_CASE("without a model of the tissue nothing arms", "[haptics][safety]") {
  Bench bench;
  bench.wanted.valid = false;
  bench.begin();
  bench.ticks(100);
  CHECK(bench.chain.stage() == DeviceStage::open);
  bench.wanted.valid = true;
  bench.ticks(4);
  CHECK(bench.chain.stage() == DeviceStage::running);
}

TEST_CASE("C9-X6: a model that is too old is frozen, then fades evenly to zero, and comes back on a ramp", "[haptics][safety]") {
  Bench bench{.options = {.damping = 0.0}};
  bench.begin_armed();
  Vector3<double> const force{0, 0, 0.8};
  bench.tick(force), bench.tick(force);
  double before = 0.8, zero_at = 0.0;
  for (int k = 0; k < 300; ++k) {
    bench.wanted.age += 0.001;
    double const out = bench.tick(force).z();
    if (bench.wanted.age <= 0.1) REQUIRE(out == 0.8);
    REQUIRE(out <= before);
    REQUIRE(before - out <= 0.8 / 100 * (1 + 1e-9));
    if (out == 0.0 && zero_at == 0.0) zero_at = bench.wanted.age;
    before = out;
  }
  CHECK(before == 0.0);
  CHECK(zero_at == Approx(0.2).margin(0.002));
  CHECK(bench.chain.stage() == DeviceStage::stale);
  CHECK(bench.told(SafetyEvent::model_stale) == 1);
  bench.wanted.age = 0.0;
  for (int k = 1; k <= 200; ++k) REQUIRE(bench.tick(force).z() == Approx(0.8 * k / 200).epsilon(1e-9));
  CHECK(bench.tick(force) == force);
  CHECK(bench.told(SafetyEvent::model_fresh) == 1);
  CHECK(bench.events.size() == 2);
}

TEST_CASE("C9-X7: after a gap the force comes back on a ramp, after a long one it has to arm anew", "[haptics][safety]") {
  Bench bench{.options = {.damping = 0.0}};
  Vector3<double> const force{0, 0, 0.8};
  bench.begin_armed();
  bench.tick(force), bench.tick(force);
  bench.reading.seconds = 0.0049;
  CHECK(bench.tick(force) == force);
  CHECK_FALSE(bench.chain.interrupted());
  bench.reading.seconds = 0.02;
  CHECK(bench.tick(force).isZero(0));
  CHECK(bench.chain.interrupted());
  CHECK(bench.chain.stage() == DeviceStage::arming);
  bench.reading.seconds = 0.001;
  for (int k = 1; k <= 100; ++k) REQUIRE(bench.tick(force).z() == Approx(0.008 * k).epsilon(1e-9));
  CHECK(bench.chain.stage() == DeviceStage::running);
  CHECK(bench.events == std::vector<SafetyEvent>{SafetyEvent::tick_gap});
  bench.reading.seconds = 0.06;
  CHECK(bench.tick(force).isZero(0));
  CHECK(bench.chain.stage() == DeviceStage::open);
  CHECK(bench.told(SafetyEvent::long_gap) == 1);
  bench.reading.seconds = 0.001;
  for (int k = 0; k < 100; ++k) REQUIRE(bench.tick(force).isZero(0));   // still inside
}

// The watchdog's times are seconds: 100 ms frozen and 100 ms of fading, whatever ticks are left out on the way.
TEST_CASE("the force is gone as soon, and comes back no sooner, when ticks are skipped", "[haptics][safety]") {
  Random random(Seed{5});
  for (int const each : {1, 2, 4, 0}) {   // periods from tick to tick; 0: one to five
    CAPTURE(each);
    auto const advance = [&](Bench& bench) { return bench.reading.seconds = 0.001 * (each > 0 ? each : 1 + static_cast<int>(5 * random.uniform<double>()) % 5); };
    Bench stale{.options = {.damping = 0.0}};
    stale.begin_armed();
    Vector3<double> const force{0, 0, 0.8};
    stale.tick(force), stale.tick(force);
    double zero_at = 0.0;
    for (double const end = 0.3; stale.wanted.age < end;) {
      stale.wanted.age += advance(stale);
      double const out = stale.tick(force).z(), late = stale.wanted.age - 0.1;
      if (late <= 0.0) REQUIRE(out == 0.8);
      if (late > 0.0) REQUIRE(out <= 0.8 * std::max(0.0, 1 - (late - 0.005) / 0.1) + 1e-9);
      if (out == 0.0 && zero_at == 0.0) zero_at = stale.wanted.age;
    }
    CHECK(zero_at > 0.195);
    CHECK(zero_at <= 0.2051);
    stale.wanted.age = 0.0;
    for (int k = 1; k <= 200; ++k) {   // a tick that was late brings it back by no more than one that was not
      advance(stale);
      REQUIRE(stale.tick(force).z() <= 0.8 * k / 200 * (1 + 1e-9));
    }
    Bench clutch{.options = {.damping = 0.0}};
    clutch.begin_armed();
    clutch.tick(force), clutch.tick(force);
    clutch.wanted.quiet = true;
    double passed = 0.0;
    while (clutch.tick().z() > 0.0) REQUIRE((passed += advance(clutch)) < 0.11);
    CHECK(passed > 0.09);
  }
}

// Closed forms in seconds; a loop at a hundredth of a second sees them in steps of that.
TEST_CASE("limits per second and times are the same for a loop of 100, 1000 and 4000 Hz", "[haptics][safety]") {
  for (double const rate : {100.0, 1000.0, 4000.0}) {
    CAPTURE(rate);
    double const period = 1.0 / rate;
    auto const bench_with = [&](SafetyOptions const& options) {
      Bench bench{.options = options};
      bench.device.rate = rate;
      bench.reading.seconds = period;
      bench.begin_armed();
      return bench;
    };
    auto const ticks_of = [&](double seconds) { return static_cast<int>(std::lround(seconds * rate)); };
    Vector3<double> const force{0, 0, 0.8};

    Bench slew = bench_with({.slew = 10.0, .damping = 0.0});   // 0.8 N in 80 ms
    for (int k = 1; k <= ticks_of(0.2); ++k) REQUIRE(slew.tick(force).z() == Approx(std::min(0.8, 10.0 * k * period)).epsilon(1e-9));

    Bench gap = bench_with({.damping = 0.0});
    for (int k = 0; k < 7; ++k) gap.tick(force);
    double const limit = std::max(0.005, 5 * period), long_limit = std::max(0.05, 50 * period);
    gap.reading.seconds = 0.99 * limit;
    CHECK(gap.tick(force) == force);
    gap.reading.seconds = 1.01 * limit;
    CHECK(gap.tick(force).isZero(0));
    CHECK(gap.chain.stage() == DeviceStage::arming);
    gap.reading.seconds = period;
    for (int k = 1; k <= ticks_of(0.1); ++k) REQUIRE(gap.tick(force).z() == Approx(0.8 * k * period / 0.1).epsilon(1e-9));
    gap.tick(force);
    CHECK(gap.chain.stage() == DeviceStage::running);
    gap.reading.seconds = 0.99 * long_limit;
    gap.tick(force);
    CHECK(gap.chain.stage() == DeviceStage::arming);
    gap.reading.seconds = 1.01 * long_limit;
    gap.tick(force);
    CHECK(gap.chain.stage() == DeviceStage::open);

    Bench stale = bench_with({.damping = 0.0});
    for (int k = 0; k < 7; ++k) stale.tick(force);
    auto const aged = [&](int ticks) {
      double out = 0.0;
      for (int k = 0; k < ticks; ++k) stale.wanted.age += period, out = stale.tick(force).z();
      return out;
    };
    CHECK(aged(ticks_of(0.1) - 1) == 0.8);
    CHECK(aged(ticks_of(0.05) + 1) == Approx(0.4).margin(0.8 * period / 0.1 + 1e-9));
    CHECK(aged(ticks_of(0.05) + 1) == 0.0);

    Bench fast = bench_with({.damping = 0.0});
    for (int k = 0; k < 20; ++k) {
      fast.reading.position.x() += 0.95 * period;   // m/s
      fast.tick({0, 0, 0.1});
    }
    CHECK(fast.chain.stage() == DeviceStage::running);
    fast.reading.position.x() += 1.05 * period;
    fast.tick();
    CHECK(fast.told(SafetyEvent::overspeed) == 1);
    fast.ticks(5);
    fast.reading.position.x() += 1.05 * std::max(0.005, 2 * period);
    fast.tick();
    CHECK(fast.told(SafetyEvent::position_jump) == 1);

    Bench warm = bench_with({.max_force = 3.3, .damping = 0.0});
    int full = 0;
    for (int k = 0; k < ticks_of(3.0); ++k)
      if (warm.tick({3.3, 0, 0}).x() > 3.299) ++full;
    CHECK(full * period == Approx(-10.0 * std::log1p(-0.8 * 0.88 * 0.88 / (3.3 * 3.3))).margin(2.5 * period + 0.012));   // until 0.8 F_c²

    Bench numbers = bench_with({});   // some 15 of them in a second are as many as at another rate
    int every = ticks_of(1.0 / 15), ticks = 0;
    for (; ticks < ticks_of(4.0) && !numbers.chain.faulted(); ++ticks) numbers.tick({0, ticks % every == 0 ? std::nan("") : 0.0, 0});
    CHECK_FALSE(numbers.chain.faulted());
    every = ticks_of(1.0 / 25);
    for (ticks = 0; ticks < ticks_of(4.0) && !numbers.chain.faulted(); ++ticks) numbers.tick({0, ticks % every == 0 ? std::nan("") : 0.0, 0});
    CHECK(numbers.chain.faulted());
    CHECK(ticks * period < 1.0);
  }
}

TEST_CASE("C9-X10 C9-X11: a jump of the position is a gap; overspeed disarms", "[haptics][safety]") {
  Bench bench{.options = {.damping = 0.0}};
  Vector3<double> const force{0, 0, 0.15};
  bench.begin_armed();
  bench.tick(force);
  bench.reading.position.x() += 0.0009;   // 0.9 m/s
  CHECK(bench.tick(force) == force);
  bench.reading.position.x() += 0.006;
  CHECK(bench.tick(force).isZero(0));
  CHECK((bench.chain.interrupted() && bench.chain.stage() == DeviceStage::arming));
  bench.ticks(120);
  CHECK(bench.chain.stage() == DeviceStage::running);
  bench.reading.position.x() += 0.0011;   // 1.1 m/s
  CHECK(bench.tick(force).isZero(0));
  CHECK(bench.chain.stage() == DeviceStage::open);
  bench.ticks(4);
  CHECK(bench.chain.stage() == DeviceStage::running);
  CHECK(bench.events == std::vector<SafetyEvent>{SafetyEvent::position_jump, SafetyEvent::overspeed, SafetyEvent::armed});
}

TEST_CASE("C9-X12: the hand feels only while it holds a button", "[haptics][safety]") {
  Bench bench{.options = {.damping = 0.0}};
  bench.reading.buttons = 0;
  bench.begin();
  bench.ticks(50);
  CHECK(bench.chain.stage() == DeviceStage::open);
  bench.reading.buttons = 2;   // any
  bench.ticks(4);
  CHECK(bench.chain.stage() == DeviceStage::running);
  bench.tick({0, 0, 0.8}), bench.tick({0, 0, 0.8});
  bench.reading.buttons = 0;
  CHECK(bench.tick().isZero(0));
  CHECK(bench.told(SafetyEvent::dead_man_released) == 1);
  bench.reading.buttons = 1;
  for (int k = 0; k < 50; ++k) REQUIRE(bench.tick({0, 0, 0.8}).isZero(0));
}

namespace {

/// What keeps a chain from arming, and how it ends.
struct WaitCase {
  ArmingWaitsFor what;
  void (*make)(Bench&);
  void (*mend)(Bench&);
};

WaitCase const wait_cases[] = {
    {ArmingWaitsFor::sample, [](Bench& b) { b.reading.fresh = false; }, [](Bench& b) { b.reading.fresh = true; }},
    {ArmingWaitsFor::calibration, [](Bench& b) { b.reading.calibration = Calibration::needs_hand; }, [](Bench& b) { b.reading.calibration = Calibration::good; }},
    {ArmingWaitsFor::steady_ticks, [](Bench& b) { b.reading.seconds = 0.0051; }, [](Bench& b) { b.reading.seconds = 0.001; }},
    {ArmingWaitsFor::slower_hand, [](Bench& b) { b.reading.position.x() += 0.002; }, [](Bench&) {}},
    {ArmingWaitsFor::undiverged_body, [](Bench& b) { b.wanted.diverged = true; }, [](Bench& b) { b.wanted.diverged = false; }},
    {ArmingWaitsFor::answer_of_body, [](Bench& b) { b.wanted.valid = false; }, [](Bench& b) { b.wanted.valid = true; }},
    {ArmingWaitsFor::fresh_model, [](Bench& b) { b.wanted.age = 0.2; }, [](Bench& b) { b.wanted.age = 0.0; }},
    {ArmingWaitsFor::tool_outside, [](Bench& b) { b.wanted.inside = true; }, [](Bench& b) { b.wanted.inside = false; }},
    {ArmingWaitsFor::button, [](Bench& b) { b.reading.buttons = 0; }, [](Bench& b) { b.reading.buttons = 1; }},
    {ArmingWaitsFor::small_force, [](Bench& b) { b.wanted.force.z() = 0.21; }, [](Bench& b) { b.wanted.force.z() = 0.1; }},
};

}  // namespace

TEST_CASE("a chain that does not arm says what it waits for, at once, and tells it once after a second", "[haptics][safety]") {
  for (WaitCase const& wait : wait_cases) {
    INFO(to_string(wait.what));
    Bench bench{.options = {.damping = 0.0}};
    bench.begin();
    double waited = 0.0;
    int ticks = 0;
    for (; ticks < 3000 && bench.events.empty(); ++ticks) {
      wait.make(bench);
      bench.tick();
      waited += bench.reading.seconds;
      if (ticks > 0) REQUIRE(bench.chain.waits_for() == wait.what);   // the first has none before it
    }
    CHECK(bench.events == std::vector<SafetyEvent>{SafetyEvent::arming_waits});
    CHECK(waited == Approx(1.0).margin(0.035));
    for (int k = 0; k < 3000; ++k) wait.make(bench), bench.tick();
    CHECK(bench.told(SafetyEvent::arming_waits) == 1);
    wait.mend(bench);
    bench.ticks(3);
    CHECK(bench.chain.waits_for() == wait.what);   // not for long enough yet
    bench.ticks(3);
    CHECK(bench.chain.waits_for() == ArmingWaitsFor::nothing);
    CHECK(bench.events == std::vector<SafetyEvent>{SafetyEvent::arming_waits, SafetyEvent::armed});
  }
}

TEST_CASE("what arming waits for is told again when it has changed, and the foremost is told first", "[haptics][safety]") {
  Bench bench{.options = {.tell_waiting = 0.05}};
  bench.begin();
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::sample);
  bench.wanted.inside = true;
  bench.wanted.force.z() = 1.0;
  bench.reading.buttons = 0;
  bench.ticks(100);
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::tool_outside);
  bench.wanted.inside = false;
  bench.ticks(40);
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::button);
  CHECK(bench.told(SafetyEvent::arming_waits) == 1);   // not for long enough yet
  bench.ticks(60);
  CHECK(bench.told(SafetyEvent::arming_waits) == 2);
  bench.reading.buttons = 1;
  for (int k = 0; k < 100; ++k) bench.tick({0, 0, k % 3 == 0 ? 0.25 : 0.15});   // swings around the limit
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::small_force);
  CHECK(bench.told(SafetyEvent::arming_waits) == 3);
  bench.tick({0, 0, 0.15}), bench.ticks(4);
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::nothing);
  bench.chain.write_failed();
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::new_session);
  bench.ticks(200);
  CHECK(bench.chain.waits_for() == ArmingWaitsFor::new_session);
  CHECK(bench.told(SafetyEvent::arming_waits) == 3);   // the fault was told
  CHECK(bench.told(SafetyEvent::fault) == 1);
  Bench silent{.options = {.tell_waiting = std::numeric_limits<double>::infinity()}};
  silent.reading.buttons = 0;
  silent.begin();
  silent.ticks(5000);
  CHECK(silent.events.empty());
}

namespace {

/// What can go wrong, and what it has to end in.
struct FaultCase {
  std::string name;
  void (*make)(Bench&);
  void (*mend)(Bench&);
  bool faults;      // the chain stays at zero until the next session
  SafetyEvent told;
};

FaultCase const fault_cases[] = {
    {"the device is lost", [](Bench& b) { b.reading.works = false; }, [](Bench& b) { b.reading.works = true; }, true, SafetyEvent::fault},
    {"a write fails", [](Bench& b) { b.chain.write_failed(); }, [](Bench&) {}, true, SafetyEvent::fault},
    {"positions are no numbers", [](Bench& b) { b.reading.usable = false; }, [](Bench& b) { b.reading.usable = true; }, true, SafetyEvent::fault},
    {"forces are no numbers", [](Bench& b) { b.wanted.force.x() = std::nan(""); }, [](Bench& b) { b.wanted.force.x() = 0; }, true, SafetyEvent::fault},
    {"no button is held", [](Bench& b) { b.reading.buttons = 0; }, [](Bench& b) { b.reading.buttons = 1; }, false, SafetyEvent::dead_man_released},
    {"calibration is lost", [](Bench& b) { b.reading.calibration = Calibration::needs_update; }, [](Bench& b) { b.reading.calibration = Calibration::good; }, false, SafetyEvent::not_calibrated},
    {"the body diverges", [](Bench& b) { b.wanted.diverged = true; }, [](Bench& b) { b.wanted.diverged = false; }, false, SafetyEvent::body_diverged},
    {"a debugger stops the program", [](Bench& b) { b.reading.seconds = 3.0; }, [](Bench& b) { b.reading.seconds = 0.001; }, false, SafetyEvent::long_gap},
    {"the hand is too fast", [](Bench& b) { b.reading.position.y() += 0.002; }, [](Bench&) {}, false, SafetyEvent::overspeed},
};

/// The states a session can be in when it goes wrong.
struct StateCase {
  std::string name;
  void (*enter)(Bench&);
  bool renders;
};

Vector3<double> const pressing{0, 0, 0.5};

StateCase const state_cases[] = {
    {"open", [](Bench& b) { b.begin(), b.tick(pressing); }, false},
    {"calibrating", [](Bench& b) { b.begin(), b.reading.calibration = Calibration::needs_update, b.tick(pressing); }, false},
    {"arming", [](Bench& b) { b.begin_armed(), b.tick(pressing), b.reading.seconds = 0.01, b.tick(), b.reading.seconds = 0.001, b.ticks(20); }, true},
    {"running", [](Bench& b) { b.begin_armed(), b.tick(pressing), b.ticks(20); }, true},
    {"stale", [](Bench& b) { b.begin_armed(), b.tick(pressing), b.ticks(20), b.wanted.age = 0.2, b.ticks(20); }, true},
    {"faulted", [](Bench& b) { b.begin_armed(), b.tick(pressing), b.chain.write_failed(), b.tick(); }, false},
};

}  // namespace

TEST_CASE("C9-X8: every fault in every state ends in zero within two ticks, with one event, and can be restarted", "[haptics][safety]") {
  for (FaultCase const& fault : fault_cases) {
    for (StateCase const& state : state_cases) {
      INFO(fault.name << " while " << state.name);
      Bench bench{.options = {.damping = 0.0}};
      state.enter(bench);
      CHECK((bench.chain.stage() == DeviceStage::faulted) == (state.name == "faulted"));
      if (state.renders) CHECK(bench.tick().z() > 0.0);
      bench.events.clear();
      for (int k = 0; k < 30; ++k) {
        fault.make(bench);
        Vector3<double> const out = bench.tick();
        if (k >= 1) REQUIRE(out.isZero(0));
      }
      bool const twice = fault.told == SafetyEvent::fault && state.renders && (fault.name.find("numbers") != std::string::npos);   // not a number, then a fault
      if (state.renders)
        CHECK(bench.events == (twice ? std::vector<SafetyEvent>{SafetyEvent::not_finite, SafetyEvent::fault} : std::vector<SafetyEvent>{fault.told}));
      else
        CHECK(bench.events.size() <= 1);
      fault.mend(bench);
      bench.reading = {.position = bench.reading.position, .buttons = 1};
      bench.wanted = {.force = {0, 0, 0.1}};
      bench.ticks(6);
      if (state.name == "open" && fault.name == "forces are no numbers") continue;   // nobody asked for a force that is no number
      CHECK(bench.chain.faulted() == (fault.faults || state.name == "faulted"));
      CHECK(bench.tick().isZero(0) == (fault.faults || state.name == "faulted"));
      bench.begin_armed();
      CHECK(bench.tick({0, 0, 0.1}) == Vector3<double>(0, 0, 0.1));
    }
  }
}

// Closed form: a wall of K rendered under a hold gives K v T d too much on the way in and out at an even speed.
TEST_CASE("C8-O7: what is sent is what the energy is counted with", "[haptics][safety]") {
  Bench bench{.options = unlimited()};
  bench.options.max_force = 2.0;   // the wall is cut off at 2 mm
  bench.begin_armed();
  double const stiffness = 1000.0, speed = 0.1, period = 0.001;
  auto const at = [&](double z) {
    bench.reading.position = {0, 0, z};
    bench.tick({0, 0, z < 0 ? -stiffness * z : 0.0});
  };
  bench.begin_armed();
  for (int k = 0; k <= 100; ++k) at(-k * speed * period);
  for (int k = 99; k >= -5; --k) at(-k * speed * period);
  CHECK(bench.chain.passivity().energy() == Approx(-stiffness * speed * period * 0.002).epsilon(1e-9));   // beyond 2 mm the force does not change: nothing is gained there
}

TEST_CASE("a device turned and scaled feels the scene's force turned and scaled, and the energy is the scene's", "[haptics][safety]") {
  Bench bench{.options = unlimited(), .mapping = WorkspaceMapping<double>(Similarity<double>::make(0.5, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0, 0, 0}))};
  bench.begin_armed();
  CHECK((bench.tick({1, 0, 0}) - Vector3<double>(0, -0.5, 0)).norm() < 1e-15);   // world x is the device's −y; forces shrink as ways do
  bench.reading.position = {0, -0.02, 0};   // 10 mm along the scene's x
  bench.tick({1, 0, 0});
  CHECK(bench.chain.energy() == Approx(-0.01));
}

TEST_CASE("options that make no sense are refused", "[haptics][safety]") {
  SafetyChain<double> chain;
  CHECK_THROWS_WITH(chain.begin({.max_force = -1.0}, touch_like, 500.0), says(".max_force is -1 N", "zero or more"));
  CHECK_THROWS_WITH(chain.begin({.slew = std::nan("")}, touch_like, 500.0), says(".slew is nan N/s", "above zero"));
  CHECK_THROWS_WITH(chain.begin({.arm_ticks = 0}, touch_like, 500.0), says(".arm_ticks is 0", "one or more"));
  // Where 0 is not "no limit", but no force ever.
  CHECK_THROWS_WITH(chain.begin({.slew = 0.0}, touch_like, 500.0), says(".slew is 0 N/s", "above zero", "infinity for no limit"));
  CHECK_THROWS_WITH(chain.begin({.overspeed = 0.0}, touch_like, 500.0), says(".overspeed is 0 m/s", "infinity for no limit"));
  CHECK_THROWS_WITH(chain.begin({.jump = 0.0}, touch_like, 500.0), says(".jump is 0 m", "infinity for no limit"));
  CHECK_THROWS_WITH(chain.begin({.gap = 0.0}, touch_like, 500.0), says(".gap is 0 s", "infinity for no limit"));
  CHECK_THROWS_WITH(chain.begin({.long_gap = 0.0}, touch_like, 500.0), says(".long_gap is 0 s", "infinity for no limit"));
  CHECK_THROWS_WITH(chain.begin({.stale_after = 0.0}, touch_like, 500.0), says(".stale_after is 0 s", "infinity for no limit"));
  CHECK_THROWS_WITH(chain.begin({.ramp = INFINITY}, touch_like, 500.0), says(".ramp is inf s", "finite"));
  CHECK_THROWS_WITH(chain.begin({.reservoir = 0.0}, touch_like, 500.0), says(".reservoir is 0 J", "above zero"));
  CHECK_THROWS_WITH(chain.begin({.damping = INFINITY}, touch_like, 500.0), says(".damping is inf N·s/m", "finite"));
  CHECK_THROWS_WITH(chain.begin({.max_not_finite_in_window = 65}, touch_like, 500.0), says(".max_not_finite_in_window is 65", "0 to 64"));
  CHECK_THROWS_WITH(chain.begin({.not_finite_window = -1.0}, touch_like, 500.0), says(".not_finite_window is -1 s", "zero or more"));
  CHECK_THROWS_WITH(chain.begin({.tell_waiting = std::nan("")}, touch_like, 500.0), says(".tell_waiting is nan s", "infinity for never"));
}

TEMPLATE_TEST_CASE("a tick through the chain allocates nothing", "[haptics][safety]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(palpate_test::trap_works());
  SafetyChain<S> chain;
  chain.begin({}, touch_like, 500.0);
  WorkspaceMapping<S> const mapping;
  Random random(Seed{8});
  S largest = 0;
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 2000; ++k) {
    Vector3<S> const p{random.normal<S>() * S(1e-4), S(0), S(0)};
    chain.read({.position = p, .seconds = k % 500 == 499 ? 0.01 : 0.001, .buttons = k % 700 < 690 ? 1u : 0u});
    largest = std::max(largest, chain({.force = k < 10 ? Vector3<S>(Vector3<S>::Zero()) : Vector3<S>(-p * S(3000))}, mapping).norm());
    while (chain.pop_event()) {
    }
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(largest > S(0));
}

// Yardstick: the speed of the hand.
TEST_CASE("a hand that is too fast feels nothing, however late its samples are", "[haptics][safety]") {
  for (int const late : {1, 3, 5, 20})
    for (double const speed : {2.0, 0.5}) {
      Bench bench;
      bench.begin_armed();
      int felt = 0, ticks = 0;
      for (int k = 1; k <= 400; ++k) {
        bench.reading.fresh = k % late == 0;
        if (bench.reading.fresh) bench.reading.position.x() += speed * 1e-3 * late;
        bool const feels = !is_zero(bench.tick({0, 0.1, 0}));   // little enough to arm
        if (k > 2 * late) ++ticks, felt += feels;
      }
      CAPTURE(late, speed, ticks);
      CHECK(felt == (speed > 1.0 ? 0 : ticks));
      CHECK(bench.told(SafetyEvent::overspeed) == (speed > 1.0 ? 1 : 0));
    }
}

// Yardstick: the hand moves at 0.2 m/s, whatever the ticks and samples do.
TEST_CASE("a gap without a sample is no speed when the next one comes", "[haptics][safety]") {
  Bench bench;
  bench.begin_armed();
  for (int k = 0; k < 20; ++k) bench.reading.position.x() += 2e-4, bench.tick();
  bench.reading.seconds = 0.010, bench.reading.fresh = false;
  bench.tick();
  bench.reading.seconds = 0.001, bench.reading.fresh = true;
  bench.reading.position.x() += 2.2e-3;
  bench.tick();
  CHECK(bench.told(SafetyEvent::tick_gap) == 1);
  CHECK(bench.told(SafetyEvent::overspeed) + bench.told(SafetyEvent::position_jump) == 0);
}

// Yardstick: the sum of what has passed.
TEST_CASE("a clock that trembles shifts no fade", "[haptics][safety]") {
  Bench bench;
  bench.reading.elapsed = 1e-3;
  bench.begin_armed();
  for (int k = 0; k < 1000; ++k) bench.tick({0, 0, 0.5});
  bench.wanted.age = 1.0;
  double passed = 0.0;
  for (int k = 0; !is_zero(bench.tick()) && k < 100000; ++k) {
    passed += bench.reading.elapsed;
    bench.reading.elapsed = k % 2 == 0 ? 0.6e-3 : 1.4e-3;
  }
  CHECK(passed == Approx(bench.chain.limits().fade).epsilon(0.03));
}

// Yardstick: the clock of the driver, five times as fast as it said.
TEST_CASE("speed, fades and warmth go by the clock where ticks come before their time", "[haptics][safety]") {
  for (double const speed : {4.0, 0.5}) {
    Bench bench;
    bench.reading.elapsed = 2e-4;
    bench.begin_armed();
    bool feels = false;
    for (int k = 0; k < 500; ++k) {
      bench.reading.position.x() += speed * 2e-4;
      feels = !is_zero(bench.tick({0, 0.3, 0}));
    }
    CHECK(feels == (speed < 1.0));
  }
  for (double const elapsed : {2e-4, std::numeric_limits<double>::quiet_NaN(), -1.0}) {
    Bench bench;
    bench.reading.elapsed = 2e-4;
    bench.begin_armed();
    for (int k = 0; k < 1000; ++k) bench.tick({0, 0, 0.5});
    REQUIRE(bench.tick({0, 0, 0.5}).norm() == Approx(0.5));
    bench.wanted.age = 1.0;   // its body is late
    bench.reading.elapsed = elapsed;
    int ticks = 0;
    while (!is_zero(bench.tick()) && ticks < 100000) ++ticks;
    CHECK(ticks * (elapsed > 0 ? elapsed : 1e-3) == Approx(bench.chain.limits().fade).epsilon(0.02));
  }
}

// Yardstick: 11 N·s/m at the speed of the hand, whether its ticks are late or its samples.
TEST_CASE("C8-O4: late ticks and late samples are damped by the speed of the hand", "[haptics][safety]") {
  for (int const late : {1, 4})
    for (bool const sampled_late : {false, true}) {
      Bench bench;
      bench.options = unlimited();
      bench.options.damping = 11.0;
      bench.begin_armed();
      double const speed = 0.2;   // m/s
      for (int round = 0; round < 20; ++round) {
        for (int k = 1; sampled_late && k < late; ++k) bench.reading.fresh = false, bench.tick({3, 0, 0});
        bench.reading.fresh = true, bench.reading.seconds = sampled_late ? 1e-3 : 1e-3 * late;
        bench.reading.position.x() += speed * 1e-3 * late;
        CHECK(bench.tick({3, 0, 0}).x() == Approx(3.0 - 11.0 * speed));
      }
    }
}

// Yardstick: the limits by the second of docs/haptics.md, 500 N/s and a ramp of 100 ms, with ticks five times as often as the device said, and in bursts.
TEST_CASE("ticks before their time bring no more force a second than ticks in time", "[haptics][safety]") {
  for (double const elapsed : {1e-3, 2e-4, 1e-6, 0.0, 5e-3}) {
    Bench bench;
    bench.reading.elapsed = elapsed;
    bench.begin_armed();
    double last = 0;
    for (int k = 0; k < 20; ++k) {
      double const now = bench.tick({0, 0, 0.8}).norm();
      CHECK(now - last <= 500.0 * std::min(elapsed, 1e-3) + 1e-12);
      last = now;
    }
    if (elapsed >= 2e-4) CHECK(last == Approx(0.8));
  }
  Bench bench;   // its body was late for a while: the force comes back by and by
  bench.begin_armed();
  double const recover = bench.chain.limits().recover, elapsed = 2e-4;
  for (int k = 0; k < 20; ++k) bench.tick({0, 0, 0.8});
  bench.wanted.age = 1.0;
  for (int k = 0; k < 400; ++k) bench.tick();
  bench.wanted.age = 0.0, bench.reading.elapsed = elapsed;
  int ticks = 0;
  for (; bench.tick({0, 0, 0.8}).norm() < 0.799 && ticks < 100000; ++ticks) CHECK(bench.chain.gain() <= (ticks + 1) * elapsed / recover + 1e-9);
  CHECK(ticks * elapsed == Approx(recover).epsilon(0.02));
}
