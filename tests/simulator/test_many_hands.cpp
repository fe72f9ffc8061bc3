// SPDX-License-Identifier: MIT
// Four hands at one skin, in the loop: a probe that palpates, a blade, a hook and forceps, each hand a mass, a spring and a damper that yields to what it feels.
// Yardsticks: the limits asked for; the energy that a sampled spring can leak, ½ K |Δx|² a tick; rest is rest; a device that fails has no force two ticks later.
// PALPATE_SOAK_SESSIONS sets how many sessions, a tenth of it (2 if not set), PALPATE_SOAK_TICKS how long one is (3,200).
#include "catch.hpp"

#include "simulator/scene.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/faulty_device.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tool/forceps.hpp>
#include <palpate/tool/hook.hpp>
#include <palpate/training/guidance.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/session.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

long asked_for(char const* name, long otherwise) {
  char const* const asked = std::getenv(name);
  return asked ? std::atol(asked) : otherwise;
}

/// A hand whose fingers close a gripper from 0.5 s to 0.7 s, and open it from 2.3 s to 2.5 s.
class GrippingHand : public SimulatedHand<double> {
 public:
  using SimulatedHand<double>::SimulatedHand;
  Capabilities capabilities() const noexcept {
    Capabilities all = SimulatedHand<double>::capabilities();
    all.reports_gripper = true;
    return all;
  }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    DeviceStatus const status = SimulatedHand<double>::read(state);
    state.gripper = std::clamp(std::max(1 - (time() - 0.5) / 0.2, (time() - 2.3) / 0.2), 0.0, 1.0);
    return status;
  }
};

/// From above to a place, and on to others, in so many seconds each.
template <class Hand>
Hand hand(std::vector<std::pair<Vector3<double>, double>> const& way) {
  auto path = Trajectory<double>::start(way.front().first);
  for (auto const& [to, seconds] : way) path.line(to, seconds, Pace::minimum_jerk);
  Hand made(std::move(path), {.hand = firm_hand(), .quantum = 55e-6, .buttons = 1});
  made.set_buttons(1);
  return made;
}

auto probing() { return hand<SimulatedHand<double>>({{{0.08, 0.03, 0.006}, 0.1}, {{0.08, 0.03, -0.004}, 0.5}, {{0.08, 0.03, 0.006}, 0.5}, {{0.085, 0.03, -0.004}, 0.5}, {{0.085, 0.03, 0.008}, 0.5}}); }
auto cutting() { return hand<SimulatedHand<double>>({{{0.0312, 0.0533, 0.006}, 0.8}, {{0.0312, 0.0533, -0.012}, 0.6}, {{0.0612, 0.0533, -0.012}, 1.0}, {{0.0612, 0.0533, 0.012}, 0.4}}); }
auto drawing() { return hand<SimulatedHand<double>>({{{0.05, 0.075, 0.006}, 0.1}, {{0.05, 0.075, -0.002}, 0.4}, {{0.05, 0.082, -0.002}, 0.8}, {{0.05, 0.082, -0.002}, 0.7}, {{0.05, 0.082, 0.03}, 0.6}}); }
auto holding() { return hand<GrippingHand>({{{0.03, 0.03, 0.006}, 0.1}, {{0.03, 0.03, 0.0}, 0.4}, {{0.03, 0.03, 0.0}, 0.4}, {{0.028, 0.028, 0.006}, 0.5}, {{0.028, 0.028, 0.006}, 0.6}, {{0.028, 0.028, 0.03}, 1.0}}); }

constexpr double cap = 1.5, slew = 0.5;   // N; N a tick
ServoOptions const careful{.safety = {.protects_a_hand = true, .max_force = cap}};

template <class Probing>
auto four(Probing probe) {
  using Knife = ProgressiveCutter<double>;
  return Simulator(palpate_test::skin<double>(WholeBody{}), Tool(std::move(probe), NoCutter<double>({.tip_radius = 0.002}), TissueReaction{}, {.servo = careful}),
                   Tool(cutting(), Knife({.puncture_depth = 0.006, .snap = 5e-4}), CuttingForce(liver_hysteresis<double>()), {.servo = careful}),
                   Tool(drawing(), Hook<double>({.friction = 0.5}), TissueReaction{}, {.servo = careful}), Tool(holding(), Forceps<double>({.grasp = {.clamp_force = 4}}), TissueReaction{}, {.servo = careful}));
}

}  // namespace

TEST_CASE("sessions of four hands in the loop: limits hold, no contact gives energy, and the tissue comes to rest", "[simulator][tools][soak]") {
  long const sessions = std::max(1L, asked_for("PALPATE_SOAK_SESSIONS", 20) / 10);
  double const seconds = static_cast<double>(asked_for("PALPATE_SOAK_TICKS", 3200)) / 1000.0;
  // N/m: of a point's contact; of a rod's, which is rigid to a step, m/h² of a particle is 227, and it lies on some ten beside the grasp's spring.
  constexpr double of_point = 2000.0, of_rod = 2000.0 + 10 * 227.0 + 1000.0;

  auto simulator = four(probing());
  simulator.body().reserve(1000, 2000);
  auto const rest = simulator.mark();
  Matrix3X<double> const home = simulator.body().positions();
  auto const rewind = [](auto&... devices) { (devices.rewind(), ...), (devices.set_buttons(1), ...); };
  for (long session = 0; session < sessions; ++session) {
    CAPTURE(session);
    rewind(simulator.device<0>(), simulator.device<1>(), simulator.device<2>(), simulator.device<3>());
    bool hooked = false, grasped = false;
    ToolRecordings const recordings = simulator.run(seconds, [&](auto const&) {
      hooked = hooked || simulator.tool<2>().hooked();
      grasped = grasped || simulator.tool<3>().grasp().holds_any();
    });
    CHECK((hooked && grasped));
    CHECK((!simulator.tool<2>().hooked() && !simulator.tool<3>().grasp().holds_any()));
    for (std::size_t tool = 0; tool < 4; ++tool) {
      CAPTURE(tool);
      auto const& ticks = recordings.recording(tool).ticks();
      double leak = 0, begin = 0, largest = 0, steepest = 0;
      int contacts = 0;
      for (std::size_t k = 1; k < ticks.size(); ++k) {
        bool const was = ticks[k - 1].phase != CuttingPhase::no_contact, is = ticks[k].phase != CuttingPhase::no_contact;
        if (!was && is) begin = ticks[k - 1].energy, leak = 0, ++contacts;
        leak += (tool < 2 ? of_point : of_rod) * (ticks[k].tip - ticks[k - 1].tip).squaredNorm() / 2;
        if (was && !is) REQUIRE(ticks[k].energy - begin >= -leak);
        largest = std::max(largest, ticks[k].force.norm());
        if (!ticks[k].force.isZero(0)) steepest = std::max(steepest, (ticks[k].force - ticks[k - 1].force).norm());
      }
      CAPTURE(largest, steepest);
      CHECK(contacts >= 1);
      CHECK(largest <= cap * (1 + 1e-12));
      CHECK(largest > 0.1);
      CHECK(steepest <= slew * (1 + 1e-9));
    }
    CHECK(simulator.tool<1>().report().triangles_added > 0);
    double worst = 0;
    for (int i = 0; i < simulator.body().size(); ++i) worst = std::max(worst, simulator.body().displacement(i).norm());
    CHECK(worst <= 1e-8);
    simulator.restore(rest);
    CHECK(simulator.body().positions() == home);
  }
}

TEST_CASE("a device of one of four hands fails in contact, and the other three go on", "[simulator][tools][safety]") {
  for (FaultKind const kind : {FaultKind::disconnected, FaultKind::fault, FaultKind::write_fails, FaultKind::position_not_finite}) {
    INFO(static_cast<int>(kind));
    std::uint64_t const at = 650;
    auto simulator = four(FaultyDevice<SimulatedHand<double>>(probing(), {{.kind = kind, .tick = at, .ticks = 0}}));
    ToolRecordings const recordings = simulator.run(1.3);
    auto const& failed = recordings.recording(0).ticks();
    CHECK(failed[at - 1].force.norm() > 0.05);
    for (std::size_t k = at + 1; k < failed.size(); ++k) REQUIRE(failed[k].force.isZero(0));
    for (std::size_t tool = 1; tool < 4; ++tool) {
      auto const& ticks = recordings.recording(tool).ticks();
      double steepest = 0;
      for (std::size_t k = at - 20; k < ticks.size(); ++k) steepest = std::max(steepest, (ticks[k].force - ticks[k - 1].force).norm());
      CHECK(steepest <= slew * (1 + 1e-9));
      CHECK(ticks.back().force.norm() > 0.02);
    }
    auto const count = [](auto& events) {
      int armed = 0, other = 0;
      while (auto const event = events.pop()) (event->what == SafetyEvent::armed ? armed : other) += 1;
      return std::pair(armed, other);
    };
    CHECK(count(simulator.events<1>()) == std::pair(1, 0));
    CHECK(count(simulator.events<2>()) == std::pair(1, 0));
    CHECK(count(simulator.events<3>()) == std::pair(1, 0));
    CHECK(count(simulator.events<0>()).second > 0);
  }
}

// Guidance holds with k (d − dead band − fade/2) of each tool's own path, closed form.
TEST_CASE("each tool has its own guidance, and its own session to replay", "[simulator][tools][training]") {
  auto const beside = [](double x, double off) {
    auto path = Trajectory<double>::start({x, 0.05 + off, 0.02});
    path.line({x + 0.02, 0.05 + off, 0.02}, 1.0);
    return ScriptedDevice<double>(std::move(path));
  };
  auto const guided = [](double x) {
    Matrix3X<double> points(3, 2);
    points << x - 0.05, x + 0.07, 0.05, 0.05, 0.02, 0.02;
    return Overlaid(TissueReaction{}, PathGuidance<double>(GuidePath<double>(points), {.stiffness = 500.0, .dead_band = 0.001, .fade = 0.001, .arm_time = 0.1}));
  };
  auto const run = [&](auto first, auto second) {
    using Finger = NoCutter<double>;
    Simulator simulator(palpate_test::skin<double>(WholeBody{}), Tool(RecordedDevice(std::move(first), 1000), Finger{}, guided(0.02)), Tool(RecordedDevice(std::move(second), 1000), Finger{}, guided(0.06)));
    ToolRecordings const all = simulator.run(1.0);
    return std::array{make_session(all.recording(0), simulator.template device<0>()), make_session(all.recording(1), simulator.template device<1>())};
  };
  auto const sessions = run(beside(0.02, 0.003), beside(0.06, -0.0025));
  CHECK((sessions[0].recording.ticks().back().force - Vector3<double>(0, -500 * (0.003 - 0.0015), 0)).norm() < 1e-9);
  CHECK((sessions[1].recording.ticks().back().force - Vector3<double>(0, 500 * (0.0025 - 0.0015), 0)).norm() < 1e-9);
  auto const again = run(ReplayDevice<double>(sessions[0].hand, sessions[0].device), ReplayDevice<double>(sessions[1].hand, sessions[1].device));
  for (std::size_t k = 0; k < 2; ++k) CHECK_FALSE(first_difference(again[k].recording, sessions[k].recording));
}
