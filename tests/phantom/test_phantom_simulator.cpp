// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "phantom/fake.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/phantom.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tool/blunt_tool.hpp>
#include <palpate/tool/tool_shape.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

using namespace palpate;
using palpate_test::fresh_fake;

namespace {

/// A spring of 100 N/m along the normal, while the tool presses.
struct PhantomSpring {
  Vector3<double> operator()(ToolContact<double> const& contact) const noexcept {
    return contact.phase == CuttingPhase::indenting ? Vector3<double>(100.0 * contact.depth * contact.normal)
                                                    : Vector3<double>(Vector3<double>::Zero());
  }
};

/// A patch of skin whose z axis is the device's y, under the middle of the workspace.
auto phantom_on_skin() {
  Matrix<double, 3, 3> turn;
  turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  auto const placed = Similarity<double>::make(1.0, Eigen::Quaternion<double>(turn), Vector3<double>(0.05, 0.0533, 0.0));
  return Simulator(PhantomDevice(), palpate_test::skin<double>(WholeBody{}), ProgressiveCutter<double>({.puncture_depth = 0.012}), PhantomSpring{},
                   {.servo = {.mapping = WorkspaceMapping<double>(placed)}});
}

}  // namespace

TEST_CASE("a PHANToM palpates and cuts in a simulator, and its hand gives way to the force", "[phantom]") {
  // Yardstick: the hand behind the stand-in is a spring of 1500 N/m; at rest it is pushed back by F/1500.
  auto& fake = fresh_fake();
  auto simulator = phantom_on_skin();
  Vector3<double> on_motors = Vector3<double>::Zero();
  Tick pressed;
  int tick_number = 0;
  Recording const recording = simulator.run(7.3, [&](Tick const& tick) {
    if (++tick_number == 1690) {   // the hand holds still at y = −9 mm
      pressed = tick;
      on_motors = palpate_test::force_on(fake);
    }
  });
  CHECK(pressed.phase == CuttingPhase::indenting);
  CHECK(on_motors.y() > 0.3);
  CHECK((pressed.force - Vector3<double>(on_motors.x(), -on_motors.z(), on_motors.y())).norm() <= 0.02);   // of the tick before
  CHECK(pressed.tip.z() == Approx(-0.009 + on_motors.y() / 1500.0).margin(1e-4));
  bool cut = false;
  for (Tick const& tick : recording.ticks()) cut = cut || tick.phase == CuttingPhase::moving;
  CHECK(cut);
  CHECK(simulator.cutter().report().particles_added > 0);
  CHECK(fake.violations == 0);
  CHECK(simulator.device().counts().misuses == 0);
}

TEST_CASE("a device of three degrees gets no torque from a tool that has a moment, one of six does", "[phantom]") {
  for (int const degrees : {3, 6}) {
    CAPTURE(degrees);
    auto& fake = fresh_fake();
    fake.plan.output_degrees = degrees;
    Matrix<double, 3, 3> turn;
    turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    auto const placed = Similarity<double>::make(1.0, Eigen::Quaternion<double>(turn), Vector3<double>(0.05, 0.0533, 0.0));
    // Its rod leans to the side: where it presses is beside the tip.
    ToolShape<double> shape{.rods = {{.rod = {.from = {0.004, 0, 0}, .to = {0.03, 0, 0.01}, .radius = 0.003}}}};
    Simulator simulator(PhantomDevice(), palpate_test::skin<double>(WholeBody{}), BluntTool<double>(shape), TissueReaction{},
                        {.servo = {.safety = {.damping = 0.0}, .mapping = WorkspaceMapping<double>(placed)}});
    double moment = 0, on_motors = 0, force = 0;
    simulator.run(1.8, [&](Tick const&) {
      moment = std::max(moment, simulator.cutter().moment().norm());
      force = std::max(force, palpate_test::force_on(fake).norm());
      for (double const each : fake.seen[0].torque) on_motors = std::max(on_motors, std::abs(each));
    });
    CHECK(moment > 1e-4);
    CHECK(force > 0.05);
    if (degrees == 3) CHECK(on_motors == 0);
    if (degrees == 6) CHECK(on_motors > 1e-4);
    CHECK(fake.violations == 0);
  }
}

TEST_CASE("in real time the PHANToM's driver has the clock of the simulator", "[phantom][threads]") {
  auto& fake = fresh_fake();
  auto simulator = phantom_on_skin();
  Recording const recording = simulator.run_realtime(0.2);   // run_realtime: a thread of the driver's calls the servo
  CHECK(recording.ticks().size() == 200);
  CHECK(fake.violations == 0);
  CHECK(fake.starts == fake.stops);
}
