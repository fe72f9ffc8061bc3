// SPDX-License-Identifier: MIT
// What a hand feels of a contact's moment. Yardsticks: lever arms and power worked out in the device's frame, the limits that are printed, the force beside it,
// and r × F of a tool that lies on a plate.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "simulator/puppet.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/device/simulated_touch.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tool/blunt_tool.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::Answer;
using palpate_test::Puppet;
using palpate_test::Strings;

namespace {

using V = Vector3<double>;
using Q = Eigen::Quaternion<double>;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN(), degree = std::numbers::pi / 180;

Capabilities const simulated_wrist{.max_force = 3.0, .rate = 1000.0, .max_torque = 0.2, .reports_orientation = true, .moves_a_hand = false};

Q turned(V const& rotation) {
  double const angle = rotation.norm();
  return angle > 0 ? Q(Eigen::AngleAxis<double>(angle, rotation / angle)) : Q::Identity();
}

/// A servo on a puppet whose force model says what the test says, as the local model says the moment.
struct Stage {
  Strings<double> strings;
  V answer = V::Zero();
  ToolContact<double> asked;
  int times = 0;
  LocalModel<double> model;
  ServoLoop<Puppet<double>, Answer<double>, double> servo;
  double time = 0;

  explicit Stage(Capabilities const& device, ServoOptions const& options = {})
      : servo(Puppet<double>(strings), Answer<double>{&answer, &asked, &times}, options) {
    strings.capabilities = device;
    servo.begin_session();
  }
  Tick tick(double h = 1e-3) {
    servo.read(h);
    time += 1e-3;
    return servo.respond(model, time);
  }
  void ticks(int count) {
    for (int k = 0; k < count; ++k) tick();
  }
  V const& force() const { return strings.felt.force; }
  V const& torque() const { return strings.felt.torque; }
};

/// In somebody's hand, that holds a button.
Capabilities const wrist{.max_force = 3.0, .rate = 1000.0, .max_torque = 0.2, .reports_orientation = true, .buttons = 1};

/// It has armed and feels 0.8 N and 0.04 N m.
std::unique_ptr<Stage> holding(Capabilities const& device = wrist, ServoOptions const& options = {}) {
  auto stage = std::make_unique<Stage>(device, options);
  stage->strings.next.buttons = 1;
  stage->ticks(10);
  stage->model.phase = CuttingPhase::moving;
  stage->answer = {0, 0, 0.8}, stage->model.tissue_moment = {0.04, 0, 0};
  stage->ticks(10);
  REQUIRE(stage->force() == V(0, 0, 0.8));
  REQUIRE(stage->torque() == V(0.04, 0, 0));
  return stage;
}

}  // namespace

TEST_CASE("C10-M7: enlarged tenfold, the hand feels the felt force's torque on its own lever, at a tenth of the scene's power", "[simulator][torque]") {
  Q const R = turned({0.3, -1.1, 0.7});
  Stage stage(simulated_wrist, {.mapping = WorkspaceMapping<double>(Similarity<double>::make(10.0, R, {0.1, 0.2, 0.3}), 1.0)});
  V const arm(0.01, -0.02, 0.005), force(0.5, -0.25, 1.0), v(0.02, 0.01, -0.03), omega(1.5, -0.5, 2.0);   // of the device, N in the scene, m/s, rad/s
  stage.answer = force;
  stage.model.tissue_moment = (10.0 * (R * arm)).cross(force);
  double of_scene = 0;
  for (int k = 0; k <= 200; ++k) {
    stage.strings.next.position = 1e-3 * k * v;
    stage.strings.next.orientation = turned(1e-3 * k * omega);
    Tick const tick = stage.tick();
    REQUIRE((stage.torque() - arm.cross(stage.force())).norm() < 1e-15);
    REQUIRE((stage.force() - R.conjugate() * force).norm() < 1e-15);
    REQUIRE((tick.torque - stage.model.tissue_moment).norm() < 1e-14);
    double const by_hand = -1e-3 * k * (stage.force().dot(v) + stage.torque().dot(omega));
    REQUIRE(std::abs(tick.energy - by_hand) < 1e-12);
    of_scene = -1e-3 * k * (force.dot(10.0 * (R * v)) + stage.model.tissue_moment.dot(R * omega));
    REQUIRE(std::abs(tick.energy - of_scene / 10) < 1e-12);
  }
  CHECK(std::abs(of_scene) > 0.01);
}

TEST_CASE("a torque is shortened to its maximum, keeps its direction and changes no faster than a force at 50 mm", "[simulator][torque]") {
  std::pair<SafetyOptions, double> const cases[] = {{{}, 0.05}, {{.max_torque = 0.15}, 0.15}, {{.max_torque = 5.0}, 0.2}, {{.max_torque = 0.0}, 0.0}};
  for (auto const& [options, most] : cases) {
    Stage stage(wrist, {.safety = options});
    stage.strings.next.buttons = 1;
    stage.ticks(10);
    V const wanted(0.3, 0.1, -0.2);
    V before = V::Zero();
    for (double const sign : {1.0, -1.0}) {
      stage.model.tissue_moment = sign * wanted;
      for (int k = 0; k < 20; ++k) {
        stage.tick();
        REQUIRE((stage.torque() - before).norm() <= 0.05 * 0.5 * (1 + 1e-12));   // 500 N/s
        REQUIRE(stage.torque().norm() <= most * (1 + 1e-12));
        before = stage.torque();
      }
      CHECK((before - sign * most * wanted.normalized()).norm() < 1e-15);
    }
    CHECK(stage.servo.counts().safety.torques_limited == (most > 0 ? 40 : 0));
    CHECK(stage.servo.counts().safety.limited == 0);
    CHECK((stage.servo.counts().safety.slewed > 0) == (most > 0.025));
    CHECK(stage.force().isZero(0));
  }
}

TEST_CASE("a torque that is large at rest does not arm, and says that it is too large", "[simulator][torque]") {
  Stage stage(wrist);
  stage.strings.next.buttons = 1;
  stage.model.tissue_moment = {0, 0.0101, 0};   // 0.2 N at 50 mm is what arms
  stage.ticks(50);
  CHECK(stage.torque().isZero(0));
  CHECK(stage.servo.chain().waits_for() == ArmingWaitsFor::small_force);
  stage.model.tissue_moment = {0, 0.0099, 0};
  stage.ticks(5);
  CHECK(stage.torque() == V(0, 0.0099, 0));
}

TEST_CASE("C9-X8: whatever ends a force ends the torque with it, within two ticks", "[simulator][torque]") {
  struct Trouble {
    std::string name;
    std::function<void(Stage&)> begin;
    double gap = 1e-3;
  };
  Trouble const troubles[] = {
      {"a fault", [](Stage& s) { s.strings.reads = DeviceStatus::fault; }},
      {"disconnected", [](Stage& s) { s.strings.reads = DeviceStatus::disconnected; }},
      {"writes fail", [](Stage& s) { s.strings.writes = DeviceStatus::fault; }},
      {"no position", [](Stage& s) { s.strings.next.position.x() = not_a_number; }},
      {"no button", [](Stage& s) { s.strings.next.buttons = 0; }},
      {"overspeed", [](Stage& s) { s.strings.next.position.x() = 0.004; }},
      {"a jump", [](Stage& s) { s.strings.next.position.x() = 0.02; }},
      {"a gap", [](Stage&) {}, 0.02},
      {"a long gap", [](Stage&) {}, 0.2},
      {"a diverged body", [](Stage& s) { s.model.diverged = true; }},
      {"no answer yet", [](Stage& s) { s.model.valid = false; }},
      {"a force that is no number", [](Stage& s) { s.answer.y() = not_a_number; }},
      {"a moment that is no number", [](Stage& s) { s.model.tissue_moment.z() = not_a_number; }},
      {"an infinite moment", [](Stage& s) { s.model.tissue_moment.z() = std::numeric_limits<double>::infinity(); }},
  };
  for (Trouble const& trouble : troubles) {
    INFO(trouble.name);
    auto const stage = holding();
    trouble.begin(*stage);
    bool is_zero = false;   // after a jump both come back on a ramp, from the second tick on
    for (int k = 0; k < 2 && !is_zero; ++k) {
      Tick const tick = stage->tick(trouble.gap);
      is_zero = stage->force().isZero(0) && stage->torque().isZero(0) && tick.torque.isZero(0);
    }
    CHECK(is_zero);
  }
}

TEST_CASE("C9-X6: a torque fades and comes back as the force does, with an old model and with a clutch", "[simulator][torque]") {
  auto const look = [](Stage& stage, int ticks, bool down) {
    double last = down ? 0.8 : 0;
    for (int k = 0; k < ticks; ++k) {
      stage.tick();
      REQUIRE((stage.torque() - 0.05 * V(stage.force().z(), 0, 0)).norm() < 1e-15);   // 0.04 N m to 0.8 N
      REQUIRE((down ? stage.force().z() <= last : stage.force().z() >= last));
      last = stage.force().z();
    }
    return last;
  };
  auto const stale = holding();
  stale->model.time = stale->time;
  CHECK(look(*stale, 98, true) == 0.8);   // frozen
  CHECK(look(*stale, 120, true) == 0);
  stale->model.time = not_a_number;
  CHECK(look(*stale, 220, false) == 0.8);
  Capabilities two = wrist;
  two.buttons = 2;
  auto const clutched = holding(two, {.clutch = 2});
  clutched->strings.next.buttons = 3;
  CHECK(look(*clutched, 120, true) == 0);
  clutched->strings.next.buttons = 1;
  CHECK(look(*clutched, 220, false) == 0.8);
}

TEST_CASE("a restoration fades the torque that was felt, evenly within 50 ms", "[simulator][torque]") {
  auto const stage = holding(simulated_wrist);
  stage->model.restorations = 1, stage->model.phase = CuttingPhase::no_contact;
  stage->answer.setZero(), stage->model.tissue_moment.setZero();
  for (int k = 1; k <= 60; ++k) {
    stage->tick();
    CHECK(stage->torque().x() == Approx(std::max(0.0, 0.04 * (1 - k / 50.0))).margin(1e-15));
  }
  CHECK(stage->torque().isZero(0));
}

TEST_CASE("a torque that would do work on a turning hand is held back, one that takes work is not", "[simulator][torque]") {
  // The hand turns at 2 rad/s about z. Damping of 3 N s/m at 50 mm is 7.5 mN m s: 15 mN m at that speed.
  auto const run = [](double moment, double damping) {
    Stage stage(simulated_wrist, {.safety = {.damping = damping}});
    stage.model.tissue_moment = {0, 0, moment};
    Tick tick;
    for (int k = 0; k <= 500; ++k) {
      stage.strings.next.orientation = turned({0, 0, 2e-3 * k});
      tick = stage.tick();
      REQUIRE((damping == 0 || moment < 0 || k < 4 || std::abs(stage.torque().z() - std::max(0.0, moment - 0.015)) < 1e-12));
      REQUIRE((moment > 0 || stage.torque().z() == moment));
      REQUIRE((stage.torque().x() == 0 && stage.torque().y() == 0 && stage.force().isZero(0)));
    }
    CHECK((stage.servo.counts().safety.damped > 0) == (damping > 0 && moment > 0));
    return tick.energy;
  };
  CHECK(run(0.01, 0.0) == Approx(-0.01 * 2 * 0.5));            // observed alone
  CHECK(std::abs(run(0.01, 3.0)) < 1e-15);                     // what the first tick gave, before anybody knew of a motion, is taken back
  CHECK(run(0.05, 3.0) == Approx(-0.035 * 2 * 0.5).epsilon(2e-3));
  CHECK(run(-0.01, 3.0) == Approx(0.01 * 2 * 0.5));
}

TEST_CASE("a device without torque, or one that does not say how it is turned, gets none, and the same bytes as without a moment", "[simulator][torque]") {
  auto const run = [](Capabilities const& device, double moment) {
    Stage stage(device, {.safety = {.protects_a_hand = true, .dead_man = 0u}});
    Recording recording;
    for (int k = 0; k < 400; ++k) {
      stage.model.phase = k > 50 ? CuttingPhase::moving : CuttingPhase::no_contact;
      stage.model.restorations = k > 300 ? 1 : 0;
      stage.model.tissue_moment = k > 50 && moment != 0 ? V(moment, -moment, 2 * moment) : V(V::Zero());
      stage.answer = k > 50 ? V(0.3 * std::sin(0.1 * k), 0.4, 0.5) : V(V::Zero());
      stage.strings.next.position = {5e-5 * k, 1e-3 * std::sin(0.05 * k), 0};
      stage.strings.next.orientation = turned({0, 0.001 * k, 0});
      recording.append(stage.tick());
      REQUIRE((stage.strings.capabilities.reports_orientation || stage.torque().isZero(0)));
      REQUIRE((stage.strings.capabilities.max_torque.value > 0 || stage.torque().isZero(0)));
    }
    return recording.to_csv();
  };
  Capabilities without = wrist, blind = wrist;
  without.max_torque = {}, blind.reports_orientation = false;
  std::string const none = run(without, 0);
  CHECK(run(without, 0.03) == none);
  CHECK(run(without, not_a_number) == none);
  CHECK(run(blind, 0.03) == none);
  CHECK(none.find("torque") == std::string::npos);
  std::string const felt = run(wrist, 0.03);
  CHECK(felt.find(",torque_x_Nm,torque_y_Nm,torque_z_Nm\n") != std::string::npos);
}

TEST_CASE("an orientation that is no unit quaternion gives no torque in that tick, and no work", "[simulator][torque]") {
  auto const stage = holding();
  Q const good = stage->strings.next.orientation;
  double const energy = stage->tick().energy;
  for (Q const& bad : {Q(0, 0, 0, 0), Q(not_a_number, 0, 0, 0), Q(3, 0, 0, 0)}) {
    stage->strings.next.orientation = bad;
    stage->ticks(3);   // slewed
    CHECK(stage->torque().isZero(0));
    CHECK(stage->force() == V(0, 0, 0.8));
    stage->strings.next.orientation = good;
    stage->ticks(3);
    CHECK(stage->torque() == V(0.04, 0, 0));
  }
  CHECK(stage->tick().energy == energy);
}

TEST_CASE("a servo tick with torque and trocar allocates nothing", "[simulator][torque]") {
  REQUIRE(palpate_test::trap_works());
  Stage stage(simulated_wrist, {.safety = {.damping = 3.0}, .trocar = TrocarOptions<double>{.point = {0, 0, 0.1}}});
  palpate_test::AllocationCount const allocations;
  double largest = 0;
  for (int k = 0; k < 3000; ++k) {
    stage.model.phase = static_cast<CuttingPhase>(k / 1000);
    stage.model.restorations = static_cast<std::size_t>(k / 700);
    stage.model.tissue_moment = {0.01, 0, k % 97 == 0 ? not_a_number : 0.02};
    stage.strings.next.position = {1e-5 * k, 0, -1e-5 * (k % 500)};
    stage.strings.next.orientation = turned({0, 0, 1e-3 * k});
    stage.tick();
    largest = std::max(largest, stage.torque().norm());
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(largest > 0.015);
}

// A ball 40 mm beside the tool's origin presses a plate that can not give way by 0.4 mm: a spring of 2000 N/m, so F = 0.8 N upwards.
// The hand's frame is half as large.
TEST_CASE("a tool that lies on a plate is felt with the moment r × F, and by a device without torque with the same force", "[simulator][torque]") {
  auto const plate = [] {
    auto const mesh = make_grid<double>(3, 3, 0.05);
    MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}});
    for (int i = 0; i < tissue.size(); ++i) tissue.nail(i);
    return SoftBody(std::move(tissue), LeapfrogVerlet{});
  };
  ToolShape<double> shape;
  shape.rods = {{.rod = {.from = {0.04, 0, 0}, .to = {0.04, 0, 0}, .radius = 0.003}}};
  BluntTool<double> const tool(shape, {.friction = 0.3, .stiffness = 2000});
  V const lever = turned({0, 0, 30 * degree}) * V(0.04, 0, 0), ball(0.025, 0.008, 0);   // 8 mm and more from every edge
  Q const R = turned({1, 0.5, -0.2});
  V const torque = lever.cross(V(0, 0, 0.8));
  std::string csv[2];
  for (bool const has_torque : {true, false}) {
    Strings<double> strings;
    strings.capabilities = simulated_wrist;
    if (!has_torque) strings.capabilities.max_torque = {};
    Simulator simulator(Puppet<double>(strings), plate(), tool, TissueReaction{},
                        {.servo = {.mapping = WorkspaceMapping<double>(Similarity<double>::make(2.0, R, V::Zero()), 1.0)}});
    strings.next.orientation = R.conjugate() * turned({0, 0, 30 * degree});
    auto const put = [&](double z) { strings.next.position = R.conjugate() * (ball - lever + V(0, 0, z)) / 2; };
    put(0.004);
    simulator.run(0.02);
    put(0.0026);
    Recording recording = simulator.run(0.3, [&](Tick const& tick) {
      if (tick.time < 0.3) return;
      REQUIRE((tick.force - V(0, 0, 0.8)).norm() < 1e-9);
      REQUIRE((tick.torque - (has_torque ? torque : V(V::Zero()))).norm() < 1e-10);
      REQUIRE((strings.felt.torque - (has_torque ? V(R.conjugate() * torque / 2) : V(V::Zero()))).norm() < 1e-10);
    });
    CHECK(strings.felt.torque.isZero(0));   // the end of the session
    if (has_torque) {
      Recording const live = simulator.run_realtime(0.2);
      CHECK(std::any_of(live.ticks().begin(), live.ticks().end(), [&](Tick const& tick) { return (tick.torque - torque).norm() < 1e-9; }));
    }
    Recording forces;
    for (Tick tick : recording.ticks()) tick.torque.setZero(), forces.append(tick);
    csv[has_torque ? 0 : 1] = forces.to_csv();
  }
  CHECK(csv[0] == csv[1]);

  SimulatedTouch<double> const touch(Trajectory<double>::start(ball - lever + V(0, 0, 0.006)).line(ball - lever + V(0, 0, -0.004), 0.2).hold(0.2));
  Simulator simulator(touch, plate(), BluntTool<double>([&] {
                        ToolShape<double> along;   // a Touch's tool is not turned
                        along.rods = {{.rod = {.from = lever, .to = lever, .radius = 0.003}}};
                        return along;
                      }()),
                      TissueReaction{});
  double largest_moment = 0;
  simulator.run(0.4, [&](Tick const& tick) {
    largest_moment = std::max(largest_moment, simulator.cutter().moment().norm());
    REQUIRE(tick.torque.isZero(0));
    REQUIRE(simulator.device().hand().last_wrench().torque.isZero(0));
  });
  CHECK(largest_moment > 0.01);
}
