// SPDX-License-Identifier: MIT
// The safety chain in a whole simulator: what goes wrong with a device while the tool is in the air, presses, cuts. Yardstick: what a hand has to feel then,
// nothing, and the limits that were asked for.
#include "catch.hpp"

#include "simulator/puppet.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/faulty_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace palpate;

namespace {

/// A force that is there in every phase: 100 N/m of depth.
struct DepthSpring {
  template <RealScalar S>
  Vector3<S> operator()(ToolContact<S> const& contact) const noexcept {
    return contact.phase == CuttingPhase::no_contact ? Vector3<S>(Vector3<S>::Zero()) : Vector3<S>(S(100) * contact.depth * contact.normal);
  }
};

/// A scripted hand with a button that it holds.
class HoldingHand {
 public:
  explicit HoldingHand(Trajectory<double> path) : hand_(std::move(path)) {}
  Capabilities capabilities() const noexcept {
    Capabilities all = hand_.capabilities();
    all.buttons = 1;
    return all;
  }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    state.buttons = 1;
    return hand_.read(state);
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept { return hand_.write(wrench); }

 private:
  ScriptedDevice<double> hand_;
};

auto faulty_session(PlannedFault const& fault) {
  return Simulator(FaultyDevice<HoldingHand>(HoldingHand(palpate_test::stroke<double>()), {fault}), palpate_test::skin<double>(ZoneOfInfluence{.rings = 3}),
                   ProgressiveCutter<double>({.puncture_depth = 0.006, .snap = 5e-4}), DepthSpring{}, {.servo = {.safety = {.protects_a_hand = true, .max_force = 3.3, .damping = 0.0}}});
}

struct InjectedFault {
  std::string name;
  PlannedFault fault;
  bool for_good;   // no force until the next session
  SafetyEvent told;
};

InjectedFault const injected[] = {
    {"disconnected", {.kind = FaultKind::disconnected, .ticks = 0}, true, SafetyEvent::fault},
    {"a fault of its own", {.kind = FaultKind::fault, .ticks = 0}, true, SafetyEvent::fault},
    {"writes fail", {.kind = FaultKind::write_fails, .ticks = 0}, true, SafetyEvent::fault},
    {"positions are no numbers", {.kind = FaultKind::position_not_finite, .ticks = 0}, true, SafetyEvent::not_finite},
    {"the button chatters", {.kind = FaultKind::button_chatter, .ticks = 1}, false, SafetyEvent::dead_man_released},
    {"a jump", {.kind = FaultKind::jump, .ticks = 1, .shift = {0, 0.02, 0}}, false, SafetyEvent::position_jump},
};

struct StageOfStroke {
  std::string name;
  std::uint64_t tick;
  CuttingPhase phase;
};

StageOfStroke const stages_of_stroke[] = {{"in the air", 100, CuttingPhase::no_contact}, {"pressing", 600, CuttingPhase::indenting}, {"cutting", 1500, CuttingPhase::moving}};

}  // namespace

TEST_CASE("C9-X8: whatever goes wrong with a device, in the air, pressing and cutting, ends in zero within two ticks", "[simulator][safety]") {
  for (InjectedFault const& what : injected)
    for (StageOfStroke const& stage : stages_of_stroke) {
      INFO(what.name << " " << stage.name);
      PlannedFault fault = what.fault;
      fault.tick = stage.tick;
      auto simulator = faulty_session(fault);
      Recording const recording = simulator.run(1.9);
      auto const& ticks = recording.ticks();
      CHECK(ticks[stage.tick - 1].phase == stage.phase);
      if (stage.phase != CuttingPhase::no_contact) CHECK(ticks[stage.tick - 1].force.norm() > 0.1);
      CHECK(ticks[stage.tick + 1].force.isZero(0));
      std::vector<SafetyEvent> told;
      while (auto const event = simulator.events().pop()) told.push_back(event->what);
      REQUIRE(told.size() >= 2);
      CHECK(told[0] == SafetyEvent::armed);
      CHECK(told[1] == what.told);
      bool const felt_again = std::any_of(ticks.begin() + static_cast<std::ptrdiff_t>(stage.tick) + 2, ticks.end(), [](Tick const& tick) { return !tick.force.isZero(0); });
      bool const comes_back = !what.for_good && stage.phase == CuttingPhase::no_contact;   // neither arming nor a tool that was placed begins in the tissue
      CHECK(felt_again == comes_back);
      if (what.for_good) CHECK(simulator.safety().faulted());

      simulator.device().heal();   // every state can be restarted
      simulator.run(0.6);
      CHECK_FALSE(simulator.safety().faulted());
    }
}

// Yardstick: the stroke runs along y = 53.3 mm on a grid of 5 mm, so what it cuts lies within a cell of that; the hand is put 20 mm beside it.
TEST_CASE("C9-X11: a jump of the position cuts nothing on the way and ends the stroke where it was", "[simulator][safety]") {
  auto const cut_by = [](PlannedFault const& fault) {
    auto simulator = faulty_session(fault);
    int const whole = simulator.body().size();
    simulator.run(2.9);   // the hand is still inside
    struct Cut {
      CuttingPhase phase;
      int particles = 0, beside = 0;
    } cut{simulator.cutter().state()};
    for (int i = whole; i < simulator.body().size(); ++i) {
      ++cut.particles;
      if (std::abs(simulator.body().reference_position(i).y() - 0.0533) > 0.005) ++cut.beside;
    }
    return cut;
  };
  auto const straight = cut_by({.kind = FaultKind::stale, .tick = 100000}), jumped = cut_by({.kind = FaultKind::jump, .tick = 1500, .ticks = 0, .shift = {0, 0.02, 0}});
  CHECK(straight.beside == 0);
  CHECK(straight.phase == CuttingPhase::moving);
  CHECK(jumped.particles > 5);
  CHECK(jumped.particles < straight.particles);
  CHECK(jumped.beside == 0);
  CHECK(jumped.phase == CuttingPhase::no_contact);   // it was put into the tissue and has not come from outside since
}

TEST_CASE("a hand that is protected feels no more than a newton by default, and what the host raises it to", "[simulator][safety]") {
  auto const largest = [](SafetyOptions const& safety) {
    Simulator simulator(HoldingHand(palpate_test::stroke<double>(0.020)), palpate_test::skin<double>(ZoneOfInfluence{.rings = 3}), ProgressiveCutter<double>({.puncture_depth = 1.0}), DepthSpring{},
                        {.servo = {.safety = safety}});
    return simulator.run(1.5).largest_force();
  };
  CHECK(largest({.protects_a_hand = true, .damping = 0.0}) == Approx(1.0).epsilon(1e-12));
  CHECK(largest({.protects_a_hand = true, .max_force = 1.5, .damping = 0.0}) == Approx(1.5).epsilon(1e-12));
  CHECK(largest({}) == Approx(2.0).epsilon(1e-3));   // 100 N/m at 20 mm: a scripted hand is not protected
}

// By hand: the device is turned by a quarter about z and half as large as the scene.
TEST_CASE("C10-M5: a hand works through its workspace, and a clutch moves neither tip nor tissue", "[simulator][safety]") {
  palpate_test::Strings<double> strings;
  strings.capabilities.buttons = 2;
  Eigen::Quaterniond const turn(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitZ()));
  ServoOptions const options{.mapping = WorkspaceMapping<double>(Similarity<double>::make(2.0, turn, {0.05, 0.05, 0.0})), .clutch = 2u};
  ServoLoop<palpate_test::Puppet<double>, DepthSpring, double> servo(palpate_test::Puppet<double>(strings), DepthSpring{}, options);
  servo.begin_session();
  LocalModel<double> model;
  model.phase = CuttingPhase::indenting;
  model.home_point = {0.05, 0.05, 0.0};
  model.normal = Vector3<double>(1, 0, 1).normalized();
  auto const tick = [&](Vector3<double> const& position, std::uint32_t buttons) {
    strings.next.position = position;
    strings.next.buttons = buttons;
    servo.read(0.001);
    return servo.respond(model, 0.0);
  };
  Tick felt = tick({0.001, 0, -0.005}, 0);
  CHECK((felt.tip - Vector3<double>(0.05, 0.052, -0.010)).norm() < 1e-15);   // x of the device is y of the scene
  CHECK(felt.force.norm() == Approx(100 * 0.010 / std::sqrt(2.0)));
  CHECK((strings.felt.force - 2 * (turn.conjugate() * felt.force)).norm() < 1e-12);
  CHECK(strings.felt.force.y() < 0.0);   // the scene's x is the device's −y
  Vector3<double> const tip = felt.tip;
  Vector3<double> hand{0.001, 0, -0.005};
  tick(hand, 2);
  for (int k = 0; k < 200; ++k) {
    hand += Vector3<double>(1e-5, 2e-5, 5e-5);
    felt = tick(hand, 2);
    REQUIRE(felt.tip == tip);
    REQUIRE(servo.velocity().isZero(0));
  }
  CHECK(felt.force.isZero(0));   // faded while the clutch was open
  felt = tick(hand, 0);
  CHECK((felt.tip - tip).norm() < 1e-15);
  CHECK(felt.force.norm() < 0.02);   // and comes back on a ramp
  for (int k = 0; k < 150; ++k) felt = tick(hand, 0);
  CHECK(felt.force.norm() == Approx(100 * 0.010 / std::sqrt(2.0)));
}

TEST_CASE("a session does not arm while a blade cuts, though its tip is above the skin", "[simulator][safety]") {
  palpate_test::Strings<double> strings;
  ServoLoop<palpate_test::Puppet<double>, DepthSpring, double> servo(palpate_test::Puppet<double>(strings), DepthSpring{}, {.safety = {.protects_a_hand = true}});
  servo.begin_session();
  LocalModel<double> model;   // of a skin at z = 0
  strings.next.position = {0, 0, 0.003};
  auto const ticks = [&](CuttingPhase phase, int count) {
    for (model.phase = phase; count > 0; --count) model.time += 1e-3, servo.read(1e-3), servo.respond(model, model.time);
  };
  ticks(CuttingPhase::moving, 200);
  CHECK(servo.chain().stage() == DeviceStage::open);
  CHECK(servo.chain().waits_for() == ArmingWaitsFor::tool_outside);
  ticks(CuttingPhase::no_contact, 20);
  CHECK(servo.chain().stage() == DeviceStage::running);
}

TEST_CASE("after a jump nothing is felt until the body has answered for the new place, and then on a ramp", "[simulator][safety]") {
  palpate_test::Strings<double> strings;
  ServoLoop<palpate_test::Puppet<double>, DepthSpring, double> servo(palpate_test::Puppet<double>(strings), DepthSpring{}, {.safety = {.protects_a_hand = true, .damping = 0.0}});
  servo.begin_session();
  LocalModel<double> model;
  model.phase = CuttingPhase::indenting;
  int k = 0;
  auto const tick = [&](Vector3<double> const& position, double model_time) {
    strings.next.position = position;
    model.time = model_time;
    servo.read(0.001);
    return servo.respond(model, 0.0, 0.001 * k++).force.norm();
  };
  for (int i = 0; i < 20; ++i) tick({0, 0, 0.001}, 0.001 * k);
  double pressed = 0.0;
  for (int i = 0; i <= 60; ++i) pressed = tick({0, 0, 0.001 - 1e-4 * i}, 0.001 * k);
  CHECK(pressed == Approx(0.5));
  CHECK(servo.pose_discontinuities() == 0);
  Vector3<double> const away{0.02, 0, -0.005};
  double const before = 0.001 * (k - 1);
  for (int i = 0; i < 30; ++i) REQUIRE(tick(away, before) == 0.0);   // the body's thread is slow
  CHECK(servo.pose_discontinuities() == 1);
  for (int i = 1; i <= 100; ++i) REQUIRE(tick(away, 0.001 * k) == Approx(0.5 * i / 100).epsilon(1e-9));
  for (int i = 0; i < 10; ++i) tick({0.02 + 0.0009 * i, 0, -0.005}, 0.001 * k);   // 0.9 m/s is a way that a hand goes
  CHECK(servo.pose_discontinuities() == 1);
}

TEST_CASE("neither a clutch nor a jump while it is open places the tool, a break between two sessions may", "[simulator][safety]") {
  palpate_test::Strings<double> strings;
  strings.capabilities.buttons = 2;
  ServoLoop<palpate_test::Puppet<double>, DepthSpring, double> servo(palpate_test::Puppet<double>(strings), DepthSpring{}, {.safety = {.protects_a_hand = true, .damping = 0.0}, .clutch = 2u});
  LocalModel<double> const model;
  auto const tick = [&](double x, std::uint32_t buttons) {
    strings.next.position.x() = x;
    strings.next.buttons = buttons;
    servo.read(0.001);
    servo.respond(model, 0.0);
  };
  servo.begin_session();
  for (int k = 0; k < 10; ++k) tick(0.0, 1);
  for (int k = 0; k < 100; ++k) tick(5e-4 * k, 3);
  tick(0.2, 3);   // a calibration, too
  tick(0.2, 1);
  CHECK(servo.tip().norm() < 1e-15);
  CHECK(servo.pose_discontinuities() == 0);
  servo.begin_session();
  tick(0.202, 1);
  CHECK(servo.pose_discontinuities() == 0);   // 2 mm between two sessions
  servo.begin_session();
  tick(0.25, 1);
  CHECK(servo.pose_discontinuities() == 1);
  auto const forget = [&](int ticks) {
    strings.reads = DeviceStatus::stale;
    for (int k = 0; k < ticks; ++k) tick(strings.next.position.x(), 1);
    strings.reads = DeviceStatus::ok;
  };
  forget(9);
  tick(0.259, 1);   // 9 mm in 10 ms, for a device with a new sample in every tenth tick
  CHECK(servo.pose_discontinuities() == 1);
  forget(9);
  tick(0.270, 1);   // 11 mm
  CHECK(servo.pose_discontinuities() == 2);
  for (bool const known : {true, false}) {
    forget(60);   // longer than a long gap
    tick(strings.next.position.x() + (known ? 0.004 : 0.006), 1);
    CHECK(servo.pose_discontinuities() == (known ? 2 : 3));
  }
}

TEST_CASE("C9-X6: a device without new samples is heard for a tenth of a second, then fades", "[simulator][safety]") {
  palpate_test::Strings<double> strings;
  ServoLoop<palpate_test::Puppet<double>, DepthSpring, double> servo(palpate_test::Puppet<double>(strings), DepthSpring{}, {.safety = {.protects_a_hand = true, .damping = 0.0}});
  servo.begin_session();
  LocalModel<double> model;
  model.phase = CuttingPhase::indenting;
  auto const tick = [&](double z, DeviceStatus status) {
    strings.next.position.z() = z;
    strings.reads = status;
    servo.read(0.001);
    return servo.respond(model, 0.0).force.norm();
  };
  for (int k = 0; k < 20; ++k) tick(0.001, DeviceStatus::ok);
  double before = 0.0;
  for (int k = 0; k <= 90; ++k) before = tick(0.001 - 1e-4 * k, DeviceStatus::ok);
  CHECK(before == Approx(0.8));
  for (int k = 1; k <= 250; ++k) {
    double const now = tick(-0.008, DeviceStatus::stale);
    REQUIRE(now <= before * (1 + 1e-12));
    if (k < 100) REQUIRE(now == Approx(0.8));
    before = now;
  }
  CHECK(before == 0.0);
}
