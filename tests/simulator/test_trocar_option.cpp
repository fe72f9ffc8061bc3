// SPDX-License-Identifier: MIT
// A tool that goes through a fixed point, in a whole simulator. Yardsticks: the line from the tip through the point, the commanded tip, the angle between two
// directions, and the recording of the same hand.
#include "catch.hpp"
#include "device/message.hpp"
#include "simulator/puppet.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tool/blunt_tool.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::Puppet;
using palpate_test::Strings;
using palpate_test::unsaid;

namespace {

using V = Vector3<double>;
using Q = Eigen::Quaternion<double>;

/// A sheet of 10 cm × 10 cm, its border nailed.
auto skin() {
  auto const mesh = make_grid<double>(8, 8, 0.0125);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 80, .damping = 0.2}, .home = {.stiffness = 8, .damping = 0.1}});
  tissue.nail(boundary_vertices(mesh));
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}

/// A blunt point that keeps the poses it was given.
struct Watch {
  std::vector<ToolPose<double>>* seen;
  NoCutter<double> point{};

  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    seen->push_back(tool);
    point.advance(body, tool);
  }
  SurfaceContact<double> const& contact() const noexcept { return point.contact(); }
  CuttingPhase state() const noexcept { return point.state(); }
  CutReport const& report() const noexcept { return point.report(); }
  double tip_radius() const noexcept { return 0; }
};

/// m, how far the shaft passes the point; infinite where it points away from it.
double miss(ToolPose<double> const& pose, V const& point, V const& shaft) {
  V const axis = pose.orientation * shaft.normalized(), up = point - pose.position;
  return up.dot(axis) > 0 ? up.cross(axis).norm() : std::numeric_limits<double>::infinity();
}
V any(Random& random, double most) { return {random.uniform(-most, most), random.uniform(-most, most), random.uniform(-most, most)}; }
Q any_turn(Random& random) {
  V const axis = any(random, 1.0);
  return Q(random.uniform(-1.0, 1.0), axis.x(), axis.y(), axis.z()).normalized();
}

}  // namespace

TEST_CASE("of 1,000 commanded poses a simulator's tool goes through its trocar, with the tip where it is commanded", "[simulator][trocar]") {
  Q const R(Eigen::AngleAxis<double>(0.7, V(1, 2, 3).normalized()));
  WorkspaceMapping<double> const mapping(Similarity<double>::make(2.0, R, {0.02, -0.01, 0.03}));
  TrocarOptions<double> const trocar{
      .point = {0.05, 0.04, 0.15}, .shaft = {1, 2, -2}, .length = 10, .orientation = Q::FromTwoVectors(V(1, 2, -2), V(0.2, 0.1, 1))};
  for (bool const reports : {true, false}) {
    Strings<double> strings;
    strings.capabilities.reports_orientation = reports;
    std::vector<ToolPose<double>> seen;
    Simulator simulator(Puppet<double>(strings), skin(), Watch{&seen}, NoForce{}, {.servo = {.mapping = mapping, .trocar = trocar}});
    Random random(Seed{11});
    Q commanded = Q::Identity();
    V tip = V::Zero();
    auto const command = [&] {   // anywhere, the shaft up to 80 degrees off
      for (;;) {
        strings.next.position = any(random, 0.1), strings.next.orientation = any_turn(random);
        commanded = reports ? R * strings.next.orientation : trocar.orientation;
        tip = 2.0 * (R * strings.next.position) + V(0.02, -0.01, 0.03);
        V const up = trocar.point - tip;
        if (up.norm() > 0.005 && (commanded * trocar.shaft.normalized()).dot(up.normalized()) > 0.17) return;
      }
    };
    command();
    double worst = 0, worst_tip = 0, worst_angle = 0, worst_twist = 0;
    simulator.run(1.0, [&](Tick const& tick) {
      ToolPose<double> const& pose = seen.back();
      V const up = trocar.point - pose.position;
      worst = std::max(worst, miss(pose, trocar.point, trocar.shaft) / std::max(tip.norm(), trocar.point.norm()));
      worst_tip = std::max({worst_tip, (pose.position - tip).norm() / 0.1, (tick.tip - pose.position).norm()});
      double const off = std::acos((commanded * trocar.shaft.normalized()).dot(up.normalized()));
      worst_angle = std::max(worst_angle, std::abs(pose.orientation.angularDistance(commanded) - off));   // the smallest turn there is
      worst_twist = std::max(worst_twist, std::abs((pose.orientation * commanded.conjugate()).vec().dot(up.normalized())));
      command();
    });
    CHECK(seen.size() == 1000);
    CHECK(worst < 1e-12);
    CHECK(worst_tip < 1e-14);
    CHECK(worst_angle < 1e-7);
    CHECK(worst_twist < 1e-14);
    CHECK(simulator.statistics().servo_counts.off_trocar == 0);
  }
}

TEST_CASE("where no pose leads through the trocar the tool stays, its force fades, and it is counted", "[simulator][trocar]") {
  Strings<double> strings;
  strings.capabilities.reports_orientation = true;
  V answer(0, 0, 1);
  ToolContact<double> asked;
  int times = 0;
  ServoLoop<Puppet<double>, palpate_test::Answer<double>, double> servo(Puppet<double>(strings), {&answer, &asked, &times},
                                                                        {.trocar = TrocarOptions<double>{.point = {0, 0, 0.1}, .length = 0.2}});
  servo.begin_session();
  LocalModel<double> model;
  model.phase = CuttingPhase::moving;
  double time = 0;
  auto const tick = [&](V const& position) {
    strings.next.position = position;
    servo.read(1e-3);
    return servo.respond(model, time += 1e-3);
  };
  // Above the hole, too far inside, at the hole, turned over: not placed yet, so nothing is felt and nobody is asked.
  Q const over(Eigen::AngleAxis<double>(2.0, V::UnitX()));
  Q const straight = Q::Identity();
  for (auto const& [place, turn] : {std::pair<V, Q>{{0, 0, 0.15}, straight}, {{0, 0, -0.15}, straight}, {{0, 0, 0.0995}, straight}, {{0, 0, 0}, over}}) {
    strings.next.orientation = turn;
    CHECK(tick(place).force.isZero(0));
    CHECK_FALSE(servo.placed());
  }
  CHECK(servo.counts().off_trocar == 4);
  CHECK(times == 0);
  CHECK(servo.chain().waits_for() == ArmingWaitsFor::answer_of_body);
  strings.next.orientation = Q::Identity();
  CHECK(tick({0.03, 0, 0.05}).force == V(0, 0, 1));
  ToolPose<double> const last = servo.tool();
  CHECK(servo.placed());
  for (int k = 1; k <= 110; ++k) {
    Tick const now = tick({0.03, 0, 0.15});   // drawn out
    CHECK(now.force.z() == Approx(std::max(0.0, 1 - 0.01 * k)).margin(1e-12));
    CHECK(now.tip == last.position);
    CHECK((servo.tool().position == last.position && servo.tool().orientation.coeffs() == last.orientation.coeffs() && servo.velocity().isZero(0)));
  }
  CHECK(servo.counts().off_trocar == 114);
  Tick now = tick({0.02, 0, 0.05});   // back: on a ramp, and without a speed
  CHECK(now.tip == V(0.02, 0, 0.05));
  CHECK(now.force.z() == Approx(0.01));
  CHECK(servo.velocity().isZero(0));
  for (int k = 0; k < 100; ++k) now = tick({0.02, 0, 0.05});
  CHECK(now.force.z() == 1);

  // Of a torque the hand feels what turns the tool about its shaft: the tilt is not the hand's. By hand: the shaft is (-0.3, 0, 0.4)/0.5 from (0.03, 0, 0.06), the
  // stylus (0, 0, 1), and the torque lies half way between, so that the hand does the same work as the tool whichever way it turns.
  strings.capabilities.max_torque = 1.0;
  servo.begin_session();
  model.tissue_moment = {0.1, 0.2, 0.3};
  tick({0.03, 0, 0.06});
  V const torque = strings.felt.torque;
  CHECK((torque - (0.3 * 0.8 - 0.1 * 0.6) * V(-0.6, 0, 1.8) / 1.8).norm() < 1e-15);
  for (V const& axis : {V(1, 0, 0), V(0, 1, 0), V(0, 0, 1), V(-0.6, 0.0, 0.8)}) {   // the tool's turn from poses a bit before and after
    double const angle = 1e-4;
    auto const at = [&](double by) {
      strings.next.orientation = Q(Eigen::AngleAxis<double>(by, axis));
      tick({0.03, 0, 0.06});
      return servo.tool().orientation;
    };
    Q const before = at(-angle), after = at(angle);
    Eigen::AngleAxis<double> const turn(after * before.conjugate());
    CHECK(torque.dot(2 * angle * axis) == Approx(turn.angle() * turn.axis().dot(V(0.1, 0.2, 0.3))).margin(1e-10));
  }
}

TEST_CASE("a tool in a trocar that presses and is drawn out is recorded, and replayed to the byte", "[simulator][trocar]") {
  struct Hand {
    long tick = 0;
    Capabilities capabilities() const { return {.max_force = 5.0, .rate = 1000.0, .max_torque = 0.5, .reports_orientation = true, .moves_a_hand = false}; }
    DeviceStatus read(DeviceState<double>& state) noexcept {
      double const t = 1e-3 * static_cast<double>(tick++);
      double const out = t > 0.3005 && t < 0.3495 ? 0.1 : 0.0;
      state.position = V(0.05 + 0.01 * std::sin(9 * t), 0.047 + 0.01 * std::cos(7 * t), 0.004 - 0.007 * std::sin(10 * t) + out);
      state.orientation = Q(Eigen::AngleAxis<double>(3 * t, V::UnitZ())) * Q(Eigen::AngleAxis<double>(0.3 * std::sin(20 * t), V::UnitX()));
      return DeviceStatus::ok;
    }
    DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
  };
  SimulatorOptions const options{.servo = {.trocar = TrocarOptions<double>{.point = {0.03, 0.06, 0.06}}}};
  BluntTool<double> const tool(make_probe_shape<double>({.radius = 0.003}));
  Simulator first(RecordedDevice(Hand{}, 500), skin(), tool, TissueReaction{}, options);
  Recording const recording = first.run(0.5);
  Simulator again(ReplayDevice<double>(first.device().samples(), first.device().capabilities()), skin(), tool, TissueReaction{}, options);
  CHECK(again.run(0.5).to_csv() == recording.to_csv());
  CHECK(first.statistics().servo_counts.off_trocar == again.statistics().servo_counts.off_trocar);
  CHECK(first.statistics().servo_counts.off_trocar == 49);
  CHECK(recording.largest_force() > 0.1);
  CHECK(std::any_of(recording.ticks().begin(), recording.ticks().end(), [](Tick const& tick) { return tick.torque.norm() > 1e-5; }));
  auto const& pose = first.cutter().rods().pose();
  CHECK((pose.orientation.coeffs() == again.cutter().rods().pose().orientation.coeffs() && miss(pose, {0.03, 0.06, 0.06}, V::UnitZ()) < 1e-15));
}

TEST_CASE("each tool goes through its own trocar, else through the simulator's; one that makes no sense is refused", "[simulator][trocar]") {
  Strings<double> strings;
  std::vector<ToolPose<double>> left, right;
  strings.next.position = {0.05, 0.05, 0.02};
  V const all(0, 0, 0.1), own(0.1, 0.1, 0.08);
  Simulator simulator(skin(), {.servo = {.trocar = TrocarOptions<double>{.point = all}}}, Tool(Puppet<double>(strings), Watch{&left}, NoForce{}),
                      Tool(Puppet<double>(strings), Watch{&right}, NoForce{}, {.trocar = TrocarOptions<double>{.point = own}}));
  simulator.run(0.01);
  CHECK(miss(left.back(), all, V::UnitZ()) < 1e-15);
  CHECK(miss(right.back(), own, V::UnitZ()) < 1e-15);
  auto const with = [&](TrocarOptions<double> const& options) {
    return message_of([&] { Simulator refused(Puppet<double>(strings), skin(), Watch{&left}, NoForce{}, {.servo = {.trocar = options}}); });
  };
  CHECK(unsaid(with({.length = -1}), ".length is -1 m") == "");
  CHECK(unsaid(with({.orientation = Q(0, 0, 0, 0)}), ".orientation is no unit quaternion") == "");
}
