// SPDX-License-Identifier: MIT
// Yardstick: what a hand would see from outside; the device is a puppet and the forces are what the test says.
#include "catch.hpp"

#include "simulator/puppet.hpp"

#include <palpate/force/cutting_force.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/coupled_force.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::Answer;
using palpate_test::Puppet;
using palpate_test::Strings;

namespace {

/// An overlay that answers what the test says and keeps what it was told.
struct Told {
  Vector3<double>* answer;
  std::vector<ToolMotion<double>>* told;
  Vector3<double> operator()(ToolMotion<double> const& motion) noexcept {
    told->push_back(motion);
    return *answer;
  }
};

struct Stage {
  Strings<double> strings;
  Vector3<double> tissue = Vector3<double>::Zero(), over = Vector3<double>(0.5, 0, 0);
  ToolContact<double> asked;
  int times = 0;
  std::vector<ToolMotion<double>> told;
  LocalModel<double> model;
  int ticks = 0;
  ServoLoop<Puppet<double>, Overlaid<Answer<double>, Told>, double> servo{Puppet<double>(strings),
                                                                          Overlaid(Answer<double>{&tissue, &asked, &times}, Told{&over, &told})};

  explicit Stage(bool moves_a_hand = false) {
    strings.capabilities.moves_a_hand = moves_a_hand;
    servo.begin_session();
  }
  Vector3<double> tick(Vector3<double> const& tip = Vector3<double>::Zero()) {
    strings.next.position = tip;
    servo.read(1e-3);
    return servo.respond(model, 1e-3 * ticks++).force;
  }
};

std::vector<ServoEvent> told_by(ServoEvents& events) {
  std::vector<ServoEvent> all;
  while (auto const event = events.pop()) all.push_back(*event);
  return all;
}

struct Reset {
  int* count;
  Vector3<double> operator()(ToolMotion<double> const&) noexcept { return Vector3<double>::Zero(); }
  void reset() noexcept { ++*count; }
  void validate() const { ++*count; }
};

static_assert(ForceOverlay<Told, double> && !ForceOverlay<NoForce, double>);
static_assert(HasOverlay<Overlaid<NoForce, Told>, double> && !HasOverlay<NoForce, double> && !HasOverlay<CuttingForce<>, double>);
static_assert(ForceModel<Overlaid<NoForce, Told>, double>);
static_assert(HasOverlay<CoupledForce<Overlaid<ProxyForce<double>, Told>>, double> && !HasOverlay<CoupledForce<ProxyForce<double>>, double>);
static_assert(KnowsLoadStiffness<Overlaid<ProxyForce<double>, Told>, double> && !KnowsLoadStiffness<Overlaid<NoForce, Told>, double>);

}  // namespace

TEST_CASE("a coupling passes on the overlay of what it wraps", "[simulator][overlay]") {
  Vector3<double> pull(0.1, 0, 0);
  std::vector<ToolMotion<double>> told;
  CoupledForce force(Overlaid(ProxyForce<double>(), Told{&pull, &told}), {.stiffness = 500});
  ToolMotion<double> const motion{.tip = {0.1, 0.2, 0.3}, .continues = true};
  CHECK(force.overlay(motion) == pull);
  REQUIRE(told.size() == 1);
  CHECK(told[0].tip == motion.tip);
}

TEST_CASE("an overlay is felt in free space and in contact, and is told where the tip is", "[simulator][overlay]") {
  Stage stage;
  CHECK(stage.tick({0.1, 0.2, 0.3}) == Vector3<double>(0.5, 0, 0));
  CHECK(stage.told.back().tip == Vector3<double>(0.1, 0.2, 0.3));
  CHECK(stage.told.back().seconds == 1e-3);
  CHECK_FALSE(stage.told.back().continues);
  stage.model.phase = CuttingPhase::indenting;
  stage.tissue = {0, 0, 1};
  CHECK(stage.tick({0.101, 0.2, 0.3}) == Vector3<double>(0.5, 0, 1));
  CHECK(stage.told.back().continues);
  CHECK((stage.told.back().velocity - Vector3<double>(1, 0, 0)).norm() < 1e-9);
}

TEST_CASE("the sum is limited, and a value that is no number silences both", "[simulator][overlay]") {
  Stage stage;   // 3 N at most
  stage.over = {30, 0, 0};
  stage.tissue = {0, 40, 0};
  CHECK((stage.tick() - Vector3<double>(1.8, 2.4, 0)).norm() < 1e-12);
  CHECK(stage.servo.counts().safety.limited == 1);
  stage.over.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(stage.tick().isZero(0));
  CHECK(stage.servo.counts().safety.not_finite == 1);
  stage.over.x() = 0.5;
  stage.tick();
  CHECK_FALSE(stage.told.back().continues);
  stage.tick();
  CHECK(stage.told.back().continues);
}

TEST_CASE("an overlay is not felt where nothing may be felt, and begins anew after that", "[simulator][overlay]") {
  Stage stage;
  stage.tick();
  stage.tick();
  auto const silent = [&](std::size_t asked) {
    CHECK(stage.tick().isZero(0));
    CHECK(stage.told.size() == asked);
  };
  std::size_t const asked = stage.told.size();
  stage.strings.reads = DeviceStatus::disconnected;   // the hand could not be read
  silent(asked);
  stage.strings.reads = DeviceStatus::ok;   // and is not trusted until the next session
  silent(asked);
  stage.servo.begin_session();
  CHECK(stage.tick() == Vector3<double>(0.5, 0, 0));
  CHECK_FALSE(stage.told.back().continues);
  stage.model.diverged = true;   // the body diverged
  silent(asked + 1);
  stage.model.diverged = false;
  stage.tick();
  CHECK_FALSE(stage.told.back().continues);
  CHECK(stage.tick({std::numeric_limits<double>::infinity(), 0, 0}).isZero(0));
  stage.tick();
  CHECK_FALSE(stage.told.back().continues);
  stage.servo.begin_session();   // the hand was let go in between
  stage.tick();
  CHECK_FALSE(stage.told.back().continues);
}

TEST_CASE("after a restoration the tissue's force fades and the overlay stays as it is", "[simulator][overlay]") {
  Stage stage;
  stage.model.phase = CuttingPhase::indenting;
  stage.tissue = {0, 0, 1};
  stage.tick();
  stage.model.phase = CuttingPhase::no_contact;
  stage.model.restorations = 1;
  stage.tissue.setZero();
  for (int tick = 1; tick <= 60; ++tick) {
    Vector3<double> const felt = stage.tick();
    CHECK(felt.x() == Approx(0.5));
    CHECK(felt.z() == Approx(std::max(0.0, 1.0 - tick / 50.0)).margin(1e-9));
  }
}

TEST_CASE("overlays over overlays add up, and are validated and reset with the force", "[simulator][overlay]") {
  std::vector<ToolMotion<double>> told;
  Vector3<double> one(1, 0, 0), two(0, 2, 0);
  Overlaid both(Overlaid(NoForce{}, Told{&one, &told}), Told{&two, &told});
  CHECK(both.overlay(ToolMotion<double>{}) == Vector3<double>(1, 2, 0));
  CHECK(both(ToolContact<double>{}).isZero(0));
  int count = 0;
  Overlaid counted(CuttingForce<>(), Reset{&count});
  counted.reset();
  counted.validate();
  CHECK(count == 2);
}

TEST_CASE("an overlay above what arms is not felt by a protected hand, and the hand's host is told why", "[simulator][overlay][safety]") {
  Stage stage(true);   // it pulls with 0.5 N where 0.2 N may begin
  for (int k = 0; k < 3000; ++k) REQUIRE(stage.tick().isZero(0));
  CHECK(stage.servo.chain().stage() == DeviceStage::open);
  CHECK(stage.servo.counts().waits_for == ArmingWaitsFor::small_force);
  auto told = told_by(stage.servo.events());
  REQUIRE(told.size() == 1);
  CHECK(told[0].what == SafetyEvent::arming_waits);
  CHECK(told[0].waits_for == ArmingWaitsFor::small_force);
  CHECK(told[0].time == Approx(1.0).margin(0.003));
  CHECK_FALSE(stage.told.back().continues);
  stage.over.x() = 0.15;
  for (int k = 0; k < 4; ++k) stage.tick();
  CHECK(stage.tick() == Vector3<double>(0.15, 0, 0));
  CHECK(stage.servo.counts().waits_for == ArmingWaitsFor::nothing);
  told = told_by(stage.servo.events());
  REQUIRE(told.size() == 1);
  CHECK(told[0].what == SafetyEvent::armed);
}

// By hand: 500 N/s are 0.5 N a tick, 1 N is the most for a hand, and the watchdog lets a force fade between 100 and 200 ms.
TEST_CASE("an overlay on a protected hand passes the same limits as the tissue's force", "[simulator][overlay][safety]") {
  Stage stage(true);
  stage.over.x() = 0.1;
  for (int k = 0; k < 5; ++k) stage.tick();
  REQUIRE(stage.servo.chain().stage() == DeviceStage::running);
  stage.over.x() = 30.0;
  CHECK(stage.tick().x() == Approx(0.6));
  CHECK(stage.tick().x() == Approx(1.0));
  CHECK(stage.tick().x() == Approx(1.0));
  stage.over.x() = 0.8;
  stage.model.time = 1e-3 * stage.ticks;   // the last one from the body
  int const last = stage.ticks;
  while (stage.ticks < last + 300) {
    int const late = stage.ticks - last;
    double const felt = stage.tick().x();
    if (late <= 100) REQUIRE(felt == Approx(0.8));
    if (late > 201) REQUIRE(felt == 0.0);
  }
  stage.model.time = std::numeric_limits<double>::quiet_NaN();   // of now, again
  for (int k = 0; k < 210; ++k) stage.tick();
  CHECK(stage.tick().x() == Approx(0.8));
  CHECK(stage.told.back().continues);
  stage.tick({0.02, 0, 0});   // a jump
  CHECK(stage.strings.felt.force.isZero(0));
  CHECK(stage.tick({0.02, 0, 0}).x() == Approx(0.008));
}

// Closed form: a pull of 0.8 N along 100 mm gives the hand 80 mJ. A controller gives no more than it took, but for the force held through the first tick.
TEST_CASE("an overlay that pulls a protected hand along gives it no energy, and holds it back in full", "[simulator][overlay][safety]") {
  auto const given = [](bool protect, double speed) {
    Stage stage(protect);
    stage.over.x() = 0.1;
    for (int k = 0; k < 5; ++k) stage.tick();
    stage.over.x() = 0.8;
    for (int k = 0; k < 5; ++k) stage.tick();
    for (int k = 1; k <= static_cast<int>(0.1 / (std::abs(speed) * 1e-3) + 0.5); ++k) stage.tick({k * speed * 1e-3, 0, 0});
    return -stage.servo.chain().energy();
  };
  CHECK(given(false, 0.1) == Approx(0.08));
  CHECK(std::abs(given(true, 0.1)) < 2 * 0.8 * 1e-4);
  CHECK(given(true, -0.1) == Approx(-0.08));
}
