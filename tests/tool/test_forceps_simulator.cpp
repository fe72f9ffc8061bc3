// SPDX-License-Identifier: MIT
// Two forceps stretch a sheet and a blade cuts it between them: the closed loop of three hands. Yardsticks: Newton's third law between the two hands that stretch, the mass.
#include "catch.hpp"
#include "device/temporary_folder.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tool/forceps.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/session_io.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// Closes at 0.3 s on the skin at x, lifts it by 2 mm, and draws it by 4 mm to its side.
ScriptedDevice<double> hand(double x, double side) {
  Vector3<double> const tip(x, 0.035, 0.0005), drawn(x + 0.004 * side, 0.035, 0.0025);
  return ScriptedDevice<double>({{0.0, tip + Vector3<double>(0, 0, 0.005)}, {0.1, tip}, {0.5, tip}, {0.9, drawn}}, {.gripper = {{0.3, 1.0}, {0.4, 0.2}}});
}

}  // namespace

TEST_CASE("Two forceps stretch a fold, and a blade cuts it between them", "[tool][forceps][simulator]") {
  ScriptedDevice<double> const blade({{0.0, {0.035, 0.022, 0.02}}, {1.1, {0.035, 0.022, 0.02}}, {1.3, {0.035, 0.022, -0.004}}, {1.9, {0.035, 0.05, -0.004}}, {2.0, {0.035, 0.05, 0.02}}});
  Simulator simulator(skin<double>(), Tool(hand(0.025, -1), Forceps<double>({.grasp = {.clamp_force = 10}}), TissueReaction{}),
                      Tool(hand(0.045, 1), Forceps<double>({.grasp = {.clamp_force = 10}}), TissueReaction{}),
                      Tool(blade, ProgressiveCutter<double>({.puncture_depth = 0.002}), TissueReaction{}));
  double const mass = simulator.body().total_mass();
  auto const recordings = simulator.run(2.4);
  auto const mean = [&](std::size_t tool, double from, double to) { return recordings.recording(tool).mean_force(from, to); };
  Vector3<double> const l = mean(0, 1.0, 1.1), r = mean(1, 1.0, 1.1), l_after = mean(0, 2.3, 2.4), r_after = mean(1, 2.3, 2.4);
  CAPTURE(l.transpose(), r.transpose(), l_after.transpose(), r_after.transpose());
  CHECK(l.x() > 0.05);                                  // each is drawn inwards, and both, alike, down
  CHECK(std::abs(l.x() + r.x()) < 0.02 * l.x());
  CHECK((l.z() < -0.02 && std::abs(l.z() - r.z()) < 0.02 * std::abs(l.z())));
  CHECK(simulator.tool<2>().report().triangles_added > 0);
  CHECK((simulator.tool<0>().grasp().holds_any() && simulator.tool<1>().grasp().holds_any()));
  CHECK(l_after.x() < 0.8 * l.x());                     // what was between them draws no more
  CHECK(-r_after.x() < 0.8 * -r.x());
  CHECK(std::abs(simulator.body().total_mass() - mass) < 1e-12);
}

TEST_CASE("A gripper is recorded and replayed to the byte, through files too", "[tool][forceps][simulator]") {
  using namespace palpate;
  auto const run = [](auto device) {
    Simulator simulator(std::move(device), skin<double>(), Forceps<double>({.grasp = {.clamp_force = 10}}), TissueReaction{});
    Recording recording = simulator.run(1.2);
    CHECK(simulator.cutter().grasp().holds_any());
    return make_session(std::move(recording), simulator.device());
  };
  Session const session = run(RecordedDevice(hand(0.025, -1), 1200));
  CHECK(session.device.reports_gripper);
  CHECK(session.hand.back().gripper == 0.2);
  TemporaryFolder const folder;
  write_session(folder / "a.session", session);
  write_session_csv(folder / "a.csv", session);
  for (auto const& path : {folder / "a.session", folder / "a.csv"}) {
    Session const read = read_session(path);
    REQUIRE(read.device.reports_gripper);
    Session const again = run(RecordedDevice(ReplayDevice<double>(read.hand, read.device), 1200));
    CHECK((to_bytes(again) == to_bytes(session)));
  }
}

TEST_CASE("A button closes the jaws where a device has no gripper", "[tool][forceps][simulator]") {
  struct Pressed {
    long ticks = 0;
    Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .buttons = 2, .moves_a_hand = false}; }
    DeviceStatus read(DeviceState<double>& state) noexcept {
      state.position = {0.035, 0.035, 0.0005};
      state.buttons = ticks >= 300 && ticks < 700 ? 2u : 0u;
      ++ticks;
      return DeviceStatus::ok;
    }
    DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
  };
  Simulator simulator(Pressed{}, skin<double>(), Forceps<double>{}, TissueReaction{}, {.servo = {.grip = 2, .grip_time = 0.2}});
  int begin = 0, end = 0;
  simulator.run(1.0, [&](Tick const& tick) {
    bool const holds = simulator.cutter().grasp().holds_any();
    int const now = static_cast<int>(std::lround(tick.time * 1000));
    if (holds && begin == 0) begin = now;
    if (!holds && begin > 0 && end == 0) end = now;
  });
  CHECK(std::abs(begin - 380) <= 2);   // below 0.6 of the opening, after 0.4 of 0.2 s
  CHECK(std::abs(end - 840) <= 2);     // above 0.7 of it
  auto const refused = [&](ServoOptions const& servo) {
    Simulator other(Pressed{}, skin<double>(), Forceps<double>{}, TissueReaction{}, {.servo = servo});
    other.run(0.01);
  };
  CHECK_THROWS_WITH(refused({.clutch = 3, .grip = 2}), says(".clutch, 3, and .grip, 2, are the same button"));
  CHECK_THROWS_WITH(refused({.grip = 4}), says(".grip is 4", "has 2 buttons"));
  // A button that closes jaws is no dead man: the hand feels with open jaws too.
  Simulator careful(Pressed{}, skin<double>(), Forceps<double>{}, TissueReaction{}, {.servo = {.safety = {.protects_a_hand = true}, .grip = 3}});
  careful.run(0.1);
  CHECK(careful.statistics().servo_counts.waits_for != ArmingWaitsFor::button);
  CHECK_THROWS_WITH((Simulator(Pressed{}, skin<double>(), Forceps<double>{}, TissueReaction{}, {.servo = {.grip_time = 0}})), says("ServoOptions: .grip_time is 0"));
}
