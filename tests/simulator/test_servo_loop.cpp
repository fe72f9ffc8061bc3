// SPDX-License-Identifier: MIT
// Yardstick: what a hand would see from outside. The device is a puppet, the local model is written by hand, so every number that comes
// out follows from the numbers put in.
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "simulator/puppet.hpp"

#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

using namespace palpate;
using palpate_test::Answer;
using palpate_test::message_of;
using palpate_test::Puppet;
using palpate_test::Strings;
using palpate_test::unsaid;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

/// A servo loop on a puppet device of scalar D, for a body of scalar S, and a force model that answers what it is told.
template <class S, class D = S>
struct Stage {
  Strings<D> strings;
  Vector3<S> answer = Vector3<S>::Zero();
  ToolContact<S> asked;
  int times = 0;
  LocalModel<S> model;
  ServoLoop<Puppet<D>, Answer<S>, S> servo{Puppet<D>(strings), Answer<S>{&answer, &asked, &times}};
  double time = 0.0;

  Stage() {
    model.phase = CuttingPhase::indenting;
    servo.begin_session();
  }
  Tick tick(Vector3<D> const& position) {
    strings.next.position = position;
    return tick();
  }
  Tick tick() {
    servo.read(S(1e-3));
    Tick const tick = servo.respond(model, time);
    time += 1e-3;
    return tick;
  }
};

using Servo = ServoLoop<Puppet<double>, NoForce, double>;
static_assert(noexcept(std::declval<Servo&>().read(1e-3)));
static_assert(noexcept(std::declval<Servo&>().respond(std::declval<LocalModel<double> const&>(), 0.0)));
static_assert(std::is_same_v<ServoLoop<Puppet<double>, NoForce, float>::DeviceScalar, double>, "a device of doubles serves a body of floats");
static_assert(std::is_same_v<ServoLoop<Puppet<float>, NoForce, float>::DeviceScalar, float>);
static_assert(std::is_same_v<ServoLoop<Puppet<float>, NoForce, double>::DeviceScalar, float>);

}  // namespace

TEMPLATE_TEST_CASE("a servo tick writes what the force model answers and records it", "[simulator][servo_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Stage<S> stage;
  stage.answer = {S(0.5), S(-0.25), S(1)};
  stage.time = 4.25;
  Tick const tick = stage.tick(Vector3<S>(S(0.125), S(0.25), S(-0.5)));
  CHECK(tick.time == 4.25);
  CHECK(tick.tip == Vector3<double>(0.125, 0.25, -0.5));
  CHECK(tick.force == Vector3<double>(0.5, -0.25, 1));
  CHECK(stage.strings.felt.force == stage.answer);
  CHECK(stage.strings.felt.torque.isZero(0));
  CHECK(tick.phase == CuttingPhase::indenting);
  CHECK(stage.servo.counts().ticks == 1);
  CHECK(stage.servo.counts().safety.limited + stage.servo.counts().safety.not_finite + stage.servo.counts().unread == 0);
}

TEST_CASE("the force model is asked with the local model's plane and the hand's movement", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.model.home_point = {0.1, 0.2, 0.3};
  stage.model.normal = {0, 0.6, 0.8};
  stage.model.tip_radius = 0.002;
  stage.model.tissue_force = {0.1, 0.2, 0.3};
  Vector3<double> const first = stage.model.home_point - 0.005 * stage.model.normal;
  Tick tick = stage.tick(first);
  CHECK(stage.asked.phase == CuttingPhase::indenting);
  CHECK(stage.asked.depth == Approx(0.007));   // 5 mm and the radius
  CHECK(tick.depth == Approx(0.007));
  CHECK(stage.asked.previous_depth == 0.0);
  CHECK(stage.asked.normal == stage.model.normal);
  CHECK(stage.asked.tissue_force == stage.model.tissue_force);
  CHECK(stage.asked.velocity.isZero(0));   // one pose tells no velocity
  tick = stage.tick(first - Vector3<double>(1e-4, 0, 2e-4));
  CHECK(stage.asked.previous_depth == Approx(0.007));
  CHECK(stage.asked.depth == Approx(0.007 + 0.8 * 2e-4));
  CHECK((stage.asked.velocity - Vector3<double>(-0.1, 0, -0.2)).norm() < 1e-9);

  stage.model.phase = CuttingPhase::no_contact;
  tick = stage.tick(first);
  CHECK(tick.depth == 0.0);
  CHECK(tick.phase == CuttingPhase::no_contact);
}

TEST_CASE("a velocity that the device reports is taken as it is, unless it is no number", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.strings.capabilities.reports_velocity = true;
  stage.servo.begin_session();
  stage.strings.next.velocity = {3, 4, 5};
  stage.tick(Vector3<double>::Zero());
  CHECK(stage.asked.velocity == Vector3<double>(3, 4, 5));
  stage.strings.next.velocity = {not_a_number, 0, 0};
  stage.tick({0.001, 0, 0});
  CHECK((stage.asked.velocity - Vector3<double>(1, 0, 0)).norm() < 1e-12);
}

TEMPLATE_TEST_CASE("C9-X2: a force above the device's maximum is shortened and keeps its direction", "[simulator][servo_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Stage<S> stage;
  for (Vector3<S> const& wanted : {Vector3<S>(0, 0, S(3.1)), Vector3<S>(S(10), S(1), 0), Vector3<S>(S(-1e15), S(1e15), S(3e14))}) {
    stage.answer = wanted;
    auto const limited_before = stage.servo.counts().safety.limited;
    Tick const tick = stage.tick();
    double const tolerance = 8 * double(std::numeric_limits<S>::epsilon());
    CHECK(tick.force.norm() == Approx(3.0).epsilon(tolerance));
    CHECK(tick.force.norm() <= 3.0 * (1 + tolerance));
    Vector3<double> const direction = wanted.template cast<double>().stableNormalized();
    CHECK((tick.force.stableNormalized() - direction).norm() < tolerance);
    CHECK(stage.servo.counts().safety.limited == limited_before + 1);
  }
  stage.answer = {0, 0, 3};   // as much as it can
  auto const limited_before = stage.servo.counts().safety.limited;
  CHECK(stage.tick().force.z() == 3.0);
  CHECK(stage.servo.counts().safety.limited == limited_before);

  stage.strings.capabilities.max_force = 0.0;   // a tracker without motors
  stage.servo.begin_session();
  CHECK(stage.tick().force.isZero(0));
  stage.strings.capabilities.max_force = infinite;
  stage.servo.begin_session();
  CHECK(stage.tick().force.z() == 3.0);
}

TEST_CASE("a force that is not finite becomes zero and is counted", "[simulator][servo_loop]") {
  Stage<double> stage;
  std::uint64_t count = 0;
  for (double const bad : {not_a_number, infinite, -infinite})
    for (int axis = 0; axis < 3; ++axis) {
      stage.answer = {1, 1, 1};
      stage.answer[axis] = bad;
      CHECK(stage.tick().force.isZero(0));
      CHECK(stage.strings.felt.force.isZero(0));
      CHECK(stage.servo.counts().safety.not_finite == ++count);
    }
  stage.answer = {1, 1, 1};
  CHECK(stage.tick().force == Vector3<double>(1, 1, 1));   // and nothing of it stays

  Stage<double, float> narrow;   // finite for the body, too large for the device's scalar
  narrow.answer = {0, 0, 1e200};
  CHECK(narrow.tick().force == Vector3<double>(0, 0, 3));
  CHECK(narrow.servo.counts().safety.limited == 1);
}

TEST_CASE("a position that is not finite keeps the last pose and gives no force", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.answer = {0, 0, 1};
  stage.tick({0.01, 0.02, 0.03});
  int const asked = stage.times;
  for (double const bad : {not_a_number, infinite}) {
    Tick const tick = stage.tick({0.01, bad, 0.03});
    CHECK(tick.force.isZero(0));
    CHECK(stage.strings.felt.force.isZero(0));
    CHECK(tick.tip == Vector3<double>(0.01, 0.02, 0.03));
    CHECK(stage.servo.tip() == Vector3<double>(0.01, 0.02, 0.03));
    CHECK(stage.servo.velocity().isZero(0));
  }
  CHECK(stage.servo.counts().unread == 2);
  CHECK(stage.times == asked);
  CHECK(stage.tick({0.02, 0.02, 0.03}).force.z() == 1.0);   // one bad sample is no fault of the device
  CHECK(stage.asked.velocity.isZero(0));                    // and no speed of 10 m/s either
  stage.tick({0.021, 0.02, 0.03});
  CHECK(stage.asked.velocity.x() == Approx(1.0));

  Stage<float, double> narrow;   // finite for the device, infinite for the body
  narrow.answer = {0, 0, 1};
  narrow.tick({0.01, 0.02, 0.03});
  CHECK(narrow.tick({1e300, 0, 0}).force.isZero(0));
  CHECK(narrow.servo.tip().allFinite());
  CHECK(narrow.servo.counts().unread == 1);
}

TEST_CASE("a stale sample is the last one, whether the device fills it in or not", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.answer = {0, 0, 1};
  stage.tick({0.01, 0.02, 0.03});
  stage.strings.reads = DeviceStatus::stale;
  stage.strings.leaves_state = true;
  Tick const tick = stage.tick({9, 9, 9});
  CHECK(tick.tip == Vector3<double>(0.01, 0.02, 0.03));
  CHECK(tick.force.z() == 1.0);
  CHECK(stage.servo.counts().unread == 0);
}

// Yardstick: the speed of the hand, which is 0.1 m/s all the time, then 0.2.
TEST_CASE("a hand has its speed however seldom its device has a new sample", "[simulator][servo_loop]") {
  for (bool const leaves_state : {false, true}) {
    Stage<double> stage;
    stage.strings.leaves_state = leaves_state;
    double z = 0.0, way = -1e-4;
    double slowest = 1.0, fastest = 0.0;
    for (int k = 0; k < 60; ++k) {
      if (k == 30) way = -2e-4;
      z += way;
      bool const fresh = k % 3 == 0;
      stage.strings.reads = fresh ? DeviceStatus::ok : DeviceStatus::stale;
      if (fresh) stage.strings.next.position = {0, 0, z}, stage.strings.leaves_state = false;
      stage.tick();
      stage.strings.leaves_state = leaves_state;
      double const speed = -stage.servo.velocity().z();
      if (k == 0) CHECK(speed == 0.0);
      if (k < 3 || (k >= 30 && k < 33)) continue;   // no way is known yet; it changed on the way
      slowest = std::min(slowest, k < 30 ? speed : speed - 0.1), fastest = std::max(fastest, k < 30 ? speed : speed - 0.1);
    }
    CHECK(slowest == Approx(0.1));
    CHECK(fastest == Approx(0.1));
    // After a read that failed the hand may be anywhere: no speed until there are two new samples.
    stage.strings.leaves_state = false;
    stage.strings.reads = DeviceStatus::ok;
    stage.tick({0, 0, not_a_number});
    stage.strings.reads = DeviceStatus::stale;
    stage.tick({0, 0, z});
    stage.strings.reads = DeviceStatus::ok;
    stage.tick({0, 0, z - 1e-3});
    CHECK(stage.servo.velocity().norm() == 0.0);
    stage.tick({0, 0, z - 2e-3});
    CHECK(stage.servo.velocity().z() == Approx(-1.0));
  }
}

TEST_CASE("after a fault the hand feels nothing until the next session", "[simulator][servo_loop]") {
  for (DeviceStatus const fault : {DeviceStatus::fault, DeviceStatus::disconnected}) {
    Stage<double> stage;
    stage.answer = {0, 0, 1};
    CHECK(stage.tick({0, 0, 0.01}).force.z() == 1.0);
    stage.strings.reads = fault;
    CHECK(stage.tick({0, 0, 0.02}).force.isZero(0));
    stage.strings.reads = DeviceStatus::ok;
    Tick const tick = stage.tick({0, 0, 0.03});
    CHECK(tick.force.isZero(0));
    CHECK(tick.tip.z() == 0.03);   // the pose is followed all the same
    CHECK(stage.strings.writes_done == 3);   // zero is written, every tick
    CHECK(stage.servo.counts().unread == 1);
    CHECK(stage.servo.counts().faulted == 2);
    stage.servo.begin_session();
    CHECK(stage.tick({0, 0, 0.03}).force.z() == 1.0);
  }
  Stage<double> stage;
  stage.answer = {0, 0, 1};
  stage.strings.writes = DeviceStatus::fault;
  stage.tick({0, 0, 0});
  CHECK(stage.servo.counts().unwritten == 1);
  stage.strings.writes = DeviceStatus::ok;
  CHECK(stage.tick({0, 0, 0}).force.isZero(0));
  CHECK(stage.strings.felt.force.isZero(0));
}

TEST_CASE("before the first pose there is no tip and no force", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.answer = {0, 0, 1};
  CHECK_FALSE(stage.servo.placed());
  stage.strings.next.position = {not_a_number, 0, 0};
  CHECK(stage.tick().force.isZero(0));
  CHECK_FALSE(stage.servo.placed());
  CHECK(stage.tick({0, 0, 0}).force.z() == 1.0);
  CHECK(stage.servo.placed());
}

TEST_CASE("a device that has no sample yet has no pose, and its first one is no way from anywhere", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.answer = {0, 0, 1};
  stage.strings.reads = DeviceStatus::stale;
  stage.strings.leaves_state = true;
  for (int k = 0; k < 50; ++k) {
    CHECK(stage.tick({9, 9, 9}).force.isZero(0));
    REQUIRE_FALSE(stage.servo.placed());
  }
  stage.strings.reads = DeviceStatus::ok;
  stage.strings.leaves_state = false;
  Tick const first = stage.tick({0.04, 0, 0});
  CHECK(first.tip == Vector3<double>(0.04, 0, 0));
  CHECK(stage.servo.placed());
  CHECK(stage.servo.velocity().isZero(0));
  CHECK(stage.servo.pose_discontinuities() == 0);

  // In the next session it is the same, wherever the hand has gone meanwhile, and whatever a stale state holds.
  stage.strings.capabilities.moves_a_hand = true;
  stage.servo.begin_session();
  stage.strings.reads = DeviceStatus::stale;
  for (int k = 0; k < 50; ++k) stage.tick({0, 0, 0});
  CHECK(stage.servo.tip() == Vector3<double>(0.04, 0, 0));
  stage.strings.reads = DeviceStatus::ok;
  stage.tick({0, 0.04, 0});
  CHECK(stage.servo.tip() == Vector3<double>(0, 0.04, 0));
  CHECK(stage.servo.velocity().isZero(0));
  CHECK(stage.servo.pose_discontinuities() == 1);   // 57 mm in a tick are no way
}

TEST_CASE("a body that has diverged gives no force", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.answer = {0, 0, 1};
  stage.model.diverged = true;
  CHECK(stage.tick({0, 0, 0}).force.isZero(0));
  CHECK(stage.servo.counts().diverged == 1);
  stage.model.diverged = false;
  CHECK(stage.tick({0, 0, 0}).force.z() == 1.0);
}

TEST_CASE("a device that promises nonsense is refused when the session begins", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.strings.capabilities.rate = 0.0;
  CHECK(unsaid(message_of([&] { stage.servo.begin_session(); }), "rate", "0 Hz") == "");
  stage.strings.capabilities = {.max_force = not_a_number, .rate = 1000.0};
  CHECK(unsaid(message_of([&] { stage.servo.begin_session(); }), "maximum force") == "");
}

TEMPLATE_TEST_CASE("a servo tick allocates nothing", "[simulator][servo_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(palpate_test::trap_works());
  Strings<S> strings;
  CuttingForce force(liver_hysteresis<S>(), OrganForce<S>{.coefficient = S(1)}, TissueReaction{}, WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7}));
  ServoLoop<Puppet<S>, decltype(force), S> servo(Puppet<S>(strings), force);
  servo.begin_session();
  LocalModel<S> model;
  model.tissue_force = {0, 0, 1};
  Recording recording(3000);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 3000; ++k) {
    model.phase = static_cast<CuttingPhase>(k / 1000);
    strings.next.position = Vector3<S>(S(1e-5) * S(k), 0, S(-1e-5) * S(k % 500));
    if (k % 97 == 0) strings.next.position[1] = std::numeric_limits<S>::quiet_NaN();
    servo.read(S(1e-3));
    recording.try_append(servo.respond(model, 1e-3 * k));
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(recording.ticks().size() == 3000);
  CHECK(recording.largest_force() > 0.5);
}

TEST_CASE("a restoration fades what the hand felt, and silences nothing where it felt nothing", "[simulator][servo_loop]") {
  Stage<double> stage;
  stage.answer = {0, 0, 2};
  stage.model.restorations = 3;   // of a body that was restored before the simulator was made
  CHECK(stage.tick({0, 0, 0}).force == Vector3<double>(0, 0, 2));
  stage.model.restorations = 4;
  for (int k = 1; k <= 50; ++k) CHECK((stage.tick().force - Vector3<double>(0, 0, 2 - 0.04 * k)).norm() < 1e-12);
  CHECK(stage.tick().force == Vector3<double>(0, 0, 2));
  CHECK(stage.servo.counts().faded == 50);
  stage.servo.begin_session();
  stage.model.restorations = 0;   // a session in real time begins with a model of no body yet
  CHECK(stage.tick().force == Vector3<double>(0, 0, 2));
}

TEST_CASE("a tick that takes no time, or no number of it, leaves the velocity as it was", "[simulator][servo_loop]") {
  for (double const h : {0.0, -1e-3, not_a_number}) {
    Stage<double> stage;
    stage.model.valid = false;
    double z = 0;
    for (int k = 0; k < 10; ++k) stage.tick({0, 0, z -= 1e-5});
    REQUIRE(stage.servo.velocity().z() == Approx(-0.01));
    stage.strings.next.position = {0, 0, z -= 1e-5};
    stage.servo.read(h);
    CHECK(stage.servo.velocity().z() == Approx(-0.01));
    for (int k = 0; k < 3; ++k) stage.tick({0, 0, z -= 1e-5});
    CHECK(stage.servo.velocity().z() == Approx(-0.01));
  }
}
