// SPDX-License-Identifier: MIT
// Yardstick: the bytes of the session that is repeated.
#include "catch.hpp"

#include "device/message.hpp"
#include "device/temporary_folder.hpp"
#include "simulator/puppet.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/session_io.hpp>

#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::skin;
using palpate_test::stroke;
using palpate_test::TemporaryFolder;
using palpate_test::unsaid;

namespace {

constexpr Seed seed{7};

Configuration configuration(double puncture_depth = 0.006) {
  return Configuration{}.set("scene", "golden 05").set("cutter.puncture_depth_m", puncture_depth);
}

/// Golden program 05 with noise, on this device.
template <class S, class Device>
auto scene(Device device) {
  return Simulator(
      std::move(device), skin<S>(ZoneOfInfluence{.rings = 4}), ProgressiveCutter<S>({.puncture_depth = S(0.006), .snap = S(5e-4)}),
      CuttingForce(liver_hysteresis<S>(), OrganForce<S>{.coefficient = S(1)}, WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = seed.value})));
}

/// What is rough in real devices: failed and stale reads, positions that are no numbers, failed writes; velocities of its own.
template <class S>
class Rough {
 public:
  explicit Rough(Trajectory<S> path) : path_(std::move(path)) {}
  Capabilities capabilities() const { return {.max_force = 0.8, .rate = 1000.0, .reports_velocity = true}; }
  DeviceStatus read(DeviceState<S>& state) noexcept {
    int const tick = tick_++;
    if (tick % 97 == 5) return DeviceStatus::stale;
    auto const now = path_.at(tick / 1000.0);
    state.position = now.position;
    state.velocity = S(0.9) * now.velocity;   // a filter that lags
    if (tick % 101 == 7) state.position.x() = std::numeric_limits<S>::quiet_NaN();
    return tick == 700 ? DeviceStatus::fault : DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<S> const&) noexcept { return DeviceStatus::ok; }

 private:
  Trajectory<S> path_;
  int tick_ = 0;
};

/// As in golden program 05: positions alone.
template <class S>
class Tips {
 public:
  explicit Tips(Trajectory<S> path) : path_(std::move(path)) {}
  Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  DeviceStatus read(DeviceState<S>& state) noexcept {
    state.position = path_.at(tick_++ / 1000.0).position;
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<S> const&) noexcept { return DeviceStatus::ok; }

 private:
  Trajectory<S> path_;
  int tick_ = 0;
};

template <class S, class Device>
Session recorded(Device device) {
  auto simulator = scene<S>(RecordedDevice<Device, S>(std::move(device), 900));
  Recording recording = simulator.run(0.9);
  CHECK(simulator.cutter().report().particles_added > 0);
  return make_session(std::move(recording), simulator.device(), configuration(), seed);
}

}  // namespace

TEMPLATE_TEST_CASE("a session is repeated to the byte, with a cut and noise, from a file of either kind", "[training][replay]",
                   PALPATE_TEST_SCALARS) {
  using S = TestType;
  Session const session = recorded<S>(ScriptedDevice<S>(stroke<S>(0.010, 0.25)));
  TemporaryFolder const folder;
  write_session_csv(folder / "session.csv", session);
  write_session(folder / "session.bin", session);
  for (Session const& read : {read_session_csv(folder / "session.csv"), read_session(folder / "session.bin")}) {
    auto simulator = scene<S>(RecordedDevice<ReplayDevice<S>, S>(replay<S>(read, configuration(), seed), 900));
    Recording const again = simulator.run(simulator.device().device().duration());
    CHECK_FALSE(first_difference(again, session.recording));
    Session const once_more = make_session(again, simulator.device(), configuration(), seed);
    CHECK((to_csv(once_more) == to_csv(session)));
    CHECK((to_bytes(once_more) == to_bytes(session)));
  }
}

TEMPLATE_TEST_CASE("failed reads, positions that are no numbers and a fault are repeated too", "[training][replay]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Session const session = recorded<S>(Rough<S>(stroke<S>(0.010, 0.25)));
  auto simulator = scene<S>(RecordedDevice<ReplayDevice<S>, S>(replay<S>(session_from_bytes(to_bytes(session)), configuration(), seed), 900));
  Recording const again = simulator.run(0.9);
  CHECK((to_bytes(make_session(again, simulator.device(), configuration(), seed)) == to_bytes(session)));
  CHECK(simulator.statistics().servo_counts.unread > 5);
  CHECK(simulator.statistics().servo_counts.faulted == 200);
  CHECK(simulator.statistics().servo_counts.safety.limited > 10);
}

TEST_CASE("the tips alone repeat a session whose device reported no velocity", "[training][replay]") {
  auto simulator = scene<double>(Tips<double>(stroke<double>(0.010, 0.25)));
  Session const session = make_session(simulator.run(0.9), simulator.device(), configuration(), seed);
  CHECK(session.hand.empty());
  CHECK(session.events.size() == 3);
  CHECK(replay_obstacles(session, configuration(), seed).size() == 1);   // whether a read failed, nobody knows
  auto again = scene<double>(replay_whatever(session));
  CHECK_FALSE(first_difference(again.run(0.9), session.recording));
}

TEST_CASE("a trajectory through the recorded tips does not repeat a session, which is why there is a ReplayDevice", "[training][replay]") {
  TemporaryFolder const folder;
  auto simulator = scene<double>(ScriptedDevice<double>(stroke<double>(0.010, 0.25)));
  Recording const recording = simulator.run(0.9);
  recording.write_csv(folder / "session.csv");
  auto again = scene<double>(ScriptedDevice<double>(Trajectory<double>::from_csv(folder / "session.csv")));
  CHECK(first_difference(again.run(0.9), recording));
}

TEST_CASE("a replay that would be another session is refused with all reasons", "[training][replay]") {
  Session session{.seed = seed, .configuration = configuration(), .device = {.max_force = 1.0, .rate = 1000.0}};
  session.recording.append({});
  session.hand.push_back({});
  CHECK(replay_obstacles(session, configuration(), seed).empty());
  CHECK(replay(session, configuration(), seed).duration() == 0.001);

  Session gap = session;   // a tick is missing after the first
  gap.recording.append({.time = 0.002});
  gap.hand.push_back({});
  CHECK(unsaid(message_of([&] { replay(gap, configuration(), seed); }), "tick 1 is at 0.002 s after the first, a run in lock-step has it at 0.001 s") == "");
  session.hand.clear();

  session.version = "0.0.9";
  session.device.reports_velocity = true;
  session.configuration.set("old", "yes");
  Configuration const now = configuration(0.005).set("new", 3);
  std::string const said = message_of([&] { replay(session, now, Seed{8}); });
  CHECK(unsaid(said, "can not be repeated", "recorded by version 0.0.9, this is " PALPATE_VERSION_STRING, "its seed was 7, now it is 8",
               "cutter.puncture_depth_m was 0.006, now it is 0.005", "old was yes, now it is not set", "new was not set, now it is 3",
               "RecordedDevice", "replay_whatever(session)") == "");
  CHECK(replay_obstacles(session, now, Seed{8}).size() == 6);
  CHECK_THROWS_AS(replay(session, now, Seed{8}), InvalidArgument);
  CHECK(replay_whatever(session).duration() == 0.001);
  CHECK(unsaid(message_of([] { replay_whatever(Session{}); }), "there are 0 samples") == "");
}

TEST_CASE("the first tick that differs is found", "[training][replay]") {
  Recording a;
  for (int i = 0; i < 5; ++i) a.append({.time = i / 1000.0});
  Recording b = a;
  CHECK_FALSE(first_difference(a, b));
  b.append({});
  CHECK(first_difference(a, b) == 5u);
  Recording c;
  for (int i = 0; i < 5; ++i) c.append({.time = i / 1000.0, .force = {0, i == 3 ? -0.0 : 0.0, 0}});
  CHECK(first_difference(a, c) == 3u);
}

TEST_CASE("a session of a run in real time is not taken for one that lock-step repeats", "[training][replay][realtime]") {
  auto simulator = scene<double>(RecordedDevice(ScriptedDevice<double>(stroke<double>(0.010, 0.25)), 900));
  Session const session = make_session(simulator.run_realtime(0.05), simulator.device(), configuration(), seed);
  REQUIRE(session.recording.ticks().size() == session.hand.size());
  Session const read = session_from_bytes(to_bytes(session));
  CHECK(read.events == session.events);
  for (Session const& one : {session, read}) {
    CHECK(unsaid(message_of([&] { replay(one, configuration(), seed); }), "it ran in real time", "replay_whatever(session)") == "");
    CHECK(replay_whatever(one).duration() > 0.0);
  }
  Session made = session;   // by a host, without make_session
  made.events.clear();
  CHECK_FALSE(replay_obstacles(made, configuration(), seed).empty());
}
