// SPDX-License-Identifier: MIT
// Yardstick: the C library's functions that may wait, which end the program while the servo's part of a tick runs; see test_servo_guard.cpp.
#include "catch.hpp"

#include "servo_guard.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/device/any_device.hpp>
#include <palpate/device/faulty_device.hpp>
#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/mouse_device.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/simulated_touch.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::guard_violations;
using palpate_test::ServoGuard;
using palpate_test::skin;
using palpate_test::stroke;

namespace {

struct GuardedStroke {
  int ticks = 0, indenting = 0, moving = 0, felt = 0;
  long violations = 0;
};

/// Ticks as `Simulator::run` does them, with the servo's two calls under the guard and the body's outside.
template <class Device, class CutterType, class Force>
GuardedStroke guarded_stroke(Device device, CutterType cutter, Force force, int ticks = 380) {
  ServoLoop<Device, Force, double> servo(std::move(device), std::move(force));
  BodyLoop loop(skin<double>(ZoneOfInfluence{.rings = 3}), std::move(cutter), ContactCoupling{}, 100);
  servo.begin_session();
  GuardedStroke run;
  long const before = guard_violations();
  for (; run.ticks < ticks; ++run.ticks) {
    {
      ServoGuard const guard;
      servo.read(1e-3);
    }
    LocalModel<double> const model = loop.tick(servo.tool(), 1e-3);
    ServoGuard const guard;
    Tick const tick = servo.respond(model, 1e-3 * run.ticks);
    if (tick.phase == CuttingPhase::indenting) ++run.indenting;
    if (tick.phase == CuttingPhase::moving) ++run.moving;
    if (!tick.force.isZero(0)) ++run.felt;
  }
  run.violations = guard_violations() - before;
  return run;
}

}  // namespace

TEST_CASE("in lock-step with a body that is touched and cut, the servo waits for nothing", "[simulator][servo_guard][realtime]") {
  auto const force = [] { return CuttingForce(liver_hysteresis<double>(), WhiteGaussianNoise<double>({.seed = 7})); };
  auto const hand = [] { return ScriptedDevice<double>(stroke<double>(0.010, 0.1)); };
  auto const progressive = guarded_stroke(hand(), ProgressiveCutter<double>({.puncture_depth = 0.006}), force());
  auto const separating = guarded_stroke(hand(), SeparatingCutter<double>({.puncture_depth = 0.006}), force());
  for (auto const& run : {progressive, separating}) {
    CHECK(run.violations == 0);
    CHECK(run.indenting > 20);
    CHECK(run.moving > 100);
    CHECK(run.felt > 100);
  }
  auto const blunt = guarded_stroke(hand(), NoCutter<double>{}, TissueReaction{});
  CHECK(blunt.violations == 0);
  CHECK(blunt.moving == 0);
  CHECK(blunt.felt > 100);
}

TEST_CASE("no device of the library waits in a tick", "[simulator][servo_guard][realtime]") {
  auto const run = [](AnyDevice<double> device) {
    device.open();
    device.arm();
    return guarded_stroke(std::move(device), NoCutter<double>{}, TissueReaction{}, 60).violations;
  };
  ScriptedDevice<double> const hand(stroke<double>(0.004, 0.02));
  CHECK(run(NullDevice<double>{}) == 0);
  CHECK(run(hand) == 0);
  CHECK(run(TremblingDevice(hand, HandTremor<double>({.amplitude = 1e-4, .seed = 3}))) == 0);
  CHECK(run(RecordedDevice(hand, 40)) == 0);   // with room for fewer ticks than there are
  CHECK(run(SimulatedHand<double>(stroke<double>(0.004, 0.02))) == 0);
  CHECK(run(SimulatedTouch<double>(stroke<double>(0.004, 0.02))) == 0);
  CHECK(run(FaultyDevice<ScriptedDevice<double>>(hand, {{.kind = FaultKind::fault, .tick = 40, .ticks = 0}})) == 0);
  Mouse mouse;
  CHECK(run(MouseDevice<double>(mouse)) == 0);
  std::vector<HandSample> samples(40);
  samples[20].read = DeviceStatus::disconnected;
  CHECK(run(ReplayDevice<double>(samples, hand.capabilities())) == 0);
}
