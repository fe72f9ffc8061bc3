// SPDX-License-Identifier: MIT
// Several tools at one body. Yardsticks: a simulator of one tool, byte by byte; the same tools in another order; what a hand has to feel when its device fails, and
// the others meanwhile; the sum of what the tools press with against what holds the body.
#include "catch.hpp"

#include "device/message.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/faulty_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <algorithm>
#include <chrono>
#include <limits>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::skin;

namespace {

using Hand = ScriptedDevice<double>;
using Probe = NoCutter<double>;
using Knife = ProgressiveCutter<double>;

/// Down onto the skin at a place, held there, up again after 0.9 s.
Hand press(double x, double y, double depth, double rate = 1000.0) {
  auto path = Trajectory<double>::start({x, y, 0.004});
  path.line({x, y, -depth}, 0.5).line({x, y, -depth}, 0.2).line({x, y, 0.004}, 0.2);
  return Hand(std::move(path), {.max_force = 3.3, .rate = rate});
}
Hand stroke() { return Hand(palpate_test::stroke<double>(0.010, 0.25), {.max_force = 3.3, .rate = 1000.0}); }
Knife knife() { return Knife({.puncture_depth = 0.006, .snap = 5e-4}); }
auto body() { return skin<double>(ZoneOfInfluence{.rings = 4}); }
auto tool(Hand hand, int key) { return Tool(std::move(hand), Probe({.tip_radius = 0.002}), TissueReaction{}, {.key = key}); }

/// Throws after so many ticks.
struct Broken : Probe {
  int left;
  explicit Broken(int ticks) : Probe({.tip_radius = 0.002}), left(ticks) {}
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    if (--left < 0) throw Error("broken");
    Probe::advance(body, tool);
  }
};

/// What a device was told.
struct Told {
  bool is_open = false;
  double force = 0;    // N, written last
  double most = 0;
  int opened = 0;
};
/// A hand that notes it.
class Noting : public Hand {
 public:
  Noting(Hand hand, Told& told) : Hand(std::move(hand)), told_(&told) {}
  void open() noexcept { told_->is_open = true, ++told_->opened; }
  void close() noexcept { told_->is_open = false; }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    told_->force = wrench.force.norm(), told_->most = std::max(told_->most, told_->force);
    return Hand::write(wrench);
  }

 private:
  Told* told_;
};
/// A driver with a clock that does not start.
class Stuck : public Noting {
 public:
  using Noting::Noting;
  void start(void (*)(void*) noexcept, void*) { throw Error("the driver can not start"); }
  void stop() noexcept {}
};

}  // namespace

// Yardstick: a servo and a body's loop, called by hand.
TEST_CASE("one tool among several reads, ticks the body and answers, to the byte", "[simulator][tools]") {
  ServoLoop<Hand, TissueReaction, double> servo(stroke(), TissueReaction{});
  BodyLoop loop(body(), knife(), ContactCoupling{}, 100);
  servo.begin_session();
  Recording expected;
  for (int k = 0; k < 900; ++k) {
    servo.read(1e-3);
    expected.append(servo.respond(loop.tick(servo.tool(), 1e-3, servo.pose_discontinuities()), k / 1000.0));
  }
  CHECK(expected.largest_force() > 0.1);
  Simulator one(body(), Tool(stroke(), knife(), TissueReaction{}));
  ToolRecordings const session = one.run(0.9);
  REQUIRE(session.recordings().size() == 1);
  CHECK(session.recording(0).to_csv() == expected.to_csv());
  CHECK(one.tool<0>().report().particles_added > 0);
  CHECK(one.body().positions() == loop.body().positions());
  CHECK(one.time() == 0.9);
}

TEST_CASE("tools in other places with the same keys give the same bytes", "[simulator][tools]") {
  Simulator first(body(), tool(press(0.030, 0.050, 0.006), 3), Tool(stroke(), knife(), TissueReaction{}, {.key = 1}), tool(press(0.045, 0.060, 0.005), 2));
  Simulator second(body(), tool(press(0.045, 0.060, 0.005), 2), tool(press(0.030, 0.050, 0.006), 3), Tool(stroke(), knife(), TissueReaction{}, {.key = 1}));
  ToolRecordings const a = first.run(0.9), b = second.run(0.9);
  for (auto const& [one, other] : {std::pair(0, 1), std::pair(1, 2), std::pair(2, 0)}) {
    Recording const &here = a.recordings()[static_cast<std::size_t>(one)], &there = b.recordings()[static_cast<std::size_t>(other)];
    CHECK(here.largest_force() > 0.1);
    CHECK(here.to_csv() == there.to_csv());
  }
  CHECK(first.body().size() > body().size());
  CHECK(first.body().positions() == second.body().positions());
}

// In equilibrium the nails hold what the tools press with: each tool's force on the hand is up, and all of them together are the nails' push.
TEST_CASE("what several tools press with adds up", "[simulator][tools]") {
  Simulator simulator(skin<double>(WholeBody{}), tool(press(0.030, 0.050, 0.004), 0), tool(press(0.070, 0.050, 0.004), 1), tool(press(0.050, 0.025, 0.004), 2));
  Vector3<double> felt = Vector3<double>::Zero();
  Simulator alone(skin<double>(WholeBody{}), tool(press(0.030, 0.050, 0.004), 0));
  double const single = alone.run(0.69).recording(0).mean_force(0.68, 0.69).z();
  ToolRecordings const session = simulator.run(0.69);
  for (Recording const& recording : session.recordings()) {
    CHECK(recording.mean_force(0.68, 0.69).z() > 0.5 * single);
    felt += recording.mean_force(0.68, 0.69);
  }
  CHECK(felt.z() > 2 * single);
  // Far from each other they hardly feel one another.
  CHECK(session.recording(0).mean_force(0.68, 0.69).z() == Approx(single).epsilon(0.1));
}

TEST_CASE("a device that fails ends its own tool's force within two ticks, and nobody else's", "[simulator][tools][safety]") {
  auto const all = {FaultKind::disconnected,        FaultKind::fault, FaultKind::stale,          FaultKind::write_fails, FaultKind::position_not_finite,
                    FaultKind::velocity_not_finite, FaultKind::jump,  FaultKind::button_chatter, FaultKind::gap,         FaultKind::stall};
  for (FaultKind const kind : all) {
    INFO(static_cast<int>(kind));
    std::uint64_t const at = 600;
    // A sample that is late, or lost, is no failure: its hand goes on, below the slew limit.
    bool const is_failure = kind != FaultKind::stale && kind != FaultKind::velocity_not_finite && kind != FaultKind::button_chatter && kind != FaultKind::gap && kind != FaultKind::stall;
    bool const is_once = kind == FaultKind::jump || kind == FaultKind::gap || kind == FaultKind::stall;
    ServoOptions const careful{.safety = {.protects_a_hand = true, .max_force = 3.3, .damping = 0.0}};
    auto const whole = [&](Hand hand, int key) { return Tool(std::move(hand), Probe{}, TissueReaction{}, {.key = key, .servo = careful}); };
    Simulator simulator(body(), whole(press(0.020, 0.050, 0.006), 0), whole(press(0.080, 0.050, 0.006), 1),
                        Tool(FaultyDevice<Hand>(press(0.050, 0.020, 0.006), {{.kind = kind, .tick = at, .ticks = is_once ? 1u : kind == FaultKind::stale ? 20u : 0u,
                                                                                .size = kind == FaultKind::gap ? 20.0 : kind == FaultKind::stall ? 0.002 : 0.0,
                                                                                .shift = {0, 0.03, 0}}}),
                             Probe{}, TissueReaction{}, {.servo = careful}),
                        whole(press(0.050, 0.080, 0.006), 3));
    ToolRecordings const session = simulator.run(0.9);
    auto const& failed = session.recording(2).ticks();
    CHECK(failed[at - 1].force.norm() > 0.05);
    if (is_failure) CHECK(failed[at + 1].force.isZero(0));
    for (std::size_t n = at - 1; n + 1 < failed.size(); ++n) {
      double const size = failed[n + 1].force.norm();
      REQUIRE(size <= 3.3);
      if (size > 0) REQUIRE((failed[n + 1].force - failed[n].force).norm() < 0.5);
    }
    for (std::size_t const k : {0u, 1u, 3u}) {
      auto const& ticks = session.recording(k).ticks();
      double largest_step = 0;
      for (std::size_t n = at - 20; n < at + 60; ++n) largest_step = std::max(largest_step, (ticks[n + 1].force - ticks[n].force).norm());
      CHECK(ticks[at + 1].force.norm() > 0.05);
      CHECK(largest_step < 0.5);   // N a tick: 500 N/s, the slew limit
    }
    auto const healthy = [&](auto& events) {
      int count = 0;
      while (auto const event = events.pop()) count += event->what == SafetyEvent::armed ? 1 : 100;
      return count == 1;
    };
    CHECK(healthy(simulator.events<0>()));
    CHECK(healthy(simulator.events<1>()));
    CHECK(healthy(simulator.events<3>()));
    if (is_failure) CHECK_FALSE(healthy(simulator.events<2>()));
  }
}

TEST_CASE("undo takes back what all tools have done", "[simulator][tools]") {
  Simulator simulator(body(), Tool(stroke(), knife(), TissueReaction{}), tool(press(0.045, 0.070, 0.005), 5));
  auto const before = simulator.mark();
  auto const size = simulator.body().size();
  simulator.run(0.7);
  CHECK(simulator.body().size() > size);
  simulator.restore(before);
  CHECK(simulator.body().size() == size);
  CHECK(simulator.body().positions() == body().positions());
}

TEST_CASE("in real time each device has its servo, and the run ends with the last", "[simulator][tools][realtime]") {
  Simulator simulator(body(), SimulatorOptions{.body_rate = 200.0}, tool(press(0.030, 0.050, 0.004), 0), Tool(stroke(), knife(), TissueReaction{}),
                      tool(press(0.080, 0.050, 0.004, 500.0), 2));
  ToolRecordings const session = simulator.run_realtime(0.2);
  CHECK(session.recording(0).ticks().size() == 200);
  CHECK(session.recording(1).ticks().size() == 200);
  CHECK(session.recording(2).ticks().size() == 100);   // 500 Hz
  CHECK(simulator.statistics<2>().servo_counts.ticks == 100);
  CHECK(simulator.statistics<0>().body_counts.ticks > 0);
  CHECK(simulator.snapshots().fetch());
  REQUIRE(simulator.snapshots().latest().tools.size() == 3);
  CHECK(simulator.snapshots().latest().tools[2].pose.position.x() == Approx(0.080));
  CHECK(simulator.run_realtime(0.05).recording(1).ticks().front().time == Approx(0.2));
}

TEST_CASE("options go before any number of tools", "[simulator][tools]") {
  SimulatorOptions const options{.body_rate = 100.0, .snapshot_rate = 10.0};
  Simulator one(body(), options, tool(press(0.030, 0.050, 0.004), 0));
  Simulator two(body(), options, tool(press(0.030, 0.050, 0.004), 0), tool(press(0.070, 0.050, 0.004), 1));
  CHECK(one.run_realtime(0.1).recording(0).ticks().size() == 100);
  CHECK(two.run_realtime(0.1).recording(1).ticks().size() == 100);
  for (auto const& body : {one.statistics<0>().body, two.statistics<1>().body}) CHECK(body.target() == std::chrono::milliseconds(10));
}

TEST_CASE("what the tools tell a renderer and a listener is in their places", "[simulator][tools]") {
  Simulator simulator(body(), tool(press(0.030, 0.050, 0.006), 9), tool(press(0.070, 0.050, 0.0), 2));
  std::size_t told = 0;
  ToolRecordings const session = simulator.run(0.5, [&](std::span<Tick const> ticks) {
    CHECK(ticks.size() == 2);
    told += ticks[0].tip.x() == 0.030 && ticks[1].tip.x() == 0.070 ? 1 : 0;
  });
  CHECK(told == session.recording(1).ticks().size());
  REQUIRE(simulator.snapshots().fetch());
  auto const& tools = simulator.snapshots().latest().tools;
  REQUIRE(tools.size() == 2);
  CHECK(tools[0].phase == CuttingPhase::indenting);
  CHECK(tools[0].pose.position.z() == Approx(-0.006).margin(1e-4));
}

TEST_CASE("tools that do not go together are refused in a sentence", "[simulator][tools]") {
  auto const same_key = [] { Simulator simulator(body(), tool(press(0.03, 0.05, 0.004), 1), tool(press(0.05, 0.05, 0.004), 1)); };
  CHECK(message_of(same_key).find("tools 0 and 1 both have the key 1") != std::string::npos);
  Simulator simulator(body(), tool(press(0.03, 0.05, 0.004), 0), tool(press(0.05, 0.05, 0.004, 500.0), 1));
  CHECK(message_of([&] { simulator.run(0.1); }).find("the device of tool 1 ticks at 500 Hz") != std::string::npos);
  auto const bad_coupling = [] { Simulator one(body(), Tool(press(0.03, 0.05, 0.004), Probe{}, TissueReaction{}, {.coupling = ContactCoupling{.stiffness = -1.0}})); };
  CHECK(message_of(bad_coupling).find("-1 N/m") != std::string::npos);
  CHECK_THROWS_AS(ToolRecordings({}).recording(0), OutOfRange);
}

// Yardstick: run(), which makes the same ticks in one go.
TEST_CASE("a host's own loop makes the ticks that run() makes", "[simulator][tools][host_loop]") {
  Simulator whole(stroke(), body(), knife(), TissueReaction{}), hosted(stroke(), body(), knife(), TissueReaction{});
  Recording const expected = whole.run(0.9);
  Recording ticks;
  int frames = 0;
  for (; frames < 54; ++frames) {   // at 60 Hz: 16 or 17 servo ticks a frame
    auto const made = hosted.tick(1.0 / 60.0, [&](Tick const& tick) { ticks.append(tick); });
    CHECK((made == 16 || made == 17));
  }
  hosted.close();
  CHECK(ticks.to_csv() == expected.to_csv());
  CHECK(hosted.body().positions() == whole.body().positions());
  CHECK_THROWS_AS(hosted.tick_body(0.01), Error);
  CHECK_THROWS_AS(hosted.finish(), Error);
}

TEST_CASE("a host's loop that ends early lets the hand go, and closes the device once", "[simulator][tools][host_loop]") {
  Told told;
  Simulator simulator(Noting(press(0.030, 0.050, 0.006), told), body(), Probe({.tip_radius = 0.002}), TissueReaction{});
  for (double const bad : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) CHECK_THROWS_AS(simulator.tick(bad), InvalidArgument);
  CHECK(told.opened == 0);
  simulator.tick(0.6);
  CHECK(told.is_open);
  CHECK(told.force > 0.05);
  simulator.tick(0.01, [&](Tick const&) { simulator.stop(); });
  CHECK(told.force == 0);
  CHECK(simulator.tick(0.01) == 0);   // until it is closed
  simulator.close();
  CHECK_FALSE(told.is_open);
  CHECK(simulator.tick(0.01) == 10);
  CHECK(told.opened == 2);
  simulator.run(0.01);   // closes before it opens
  CHECK(told.opened == 3);
  CHECK_FALSE(told.is_open);
}

TEST_CASE("a body that throws under a host's tick lets the hand go", "[simulator][tools][host_loop]") {
  Told told;
  Simulator simulator(Noting(press(0.030, 0.050, 0.006), told), body(), Broken(600), TissueReaction{});
  CHECK(message_of([&] { simulator.tick(1.0); }) == "broken");
  CHECK(told.most > 0.05);
  CHECK(told.force == 0);
  CHECK_FALSE(told.is_open);
}

TEST_CASE("a host ticks the body while the servos run on their threads", "[simulator][tools][realtime][host_loop]") {
  Simulator simulator(body(), tool(press(0.030, 0.050, 0.004), 0), tool(press(0.080, 0.050, 0.004, 500.0), 1));
  simulator.start(0.3, 60.0);
  int frames = 0;
  while (simulator.tick_body(1.0 / 60.0)) {
    ++frames;
    if (simulator.snapshots().fetch()) CHECK(simulator.snapshots().latest().points.cols() == simulator.body().size());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ToolRecordings const session = simulator.finish();
  CHECK(frames > 2);
  CHECK(session.recording(0).ticks().size() == 300);
  CHECK(session.recording(1).ticks().size() == 150);
  simulator.start(100.0, 60.0);   // ended before: by finish(), and by nothing but the end of the simulator
  simulator.tick_body(1.0 / 60.0);
  CHECK_THROWS_AS(simulator.tick(0.01), Error);   // the servos run
  CHECK_THROWS_AS(simulator.tick_body(std::numeric_limits<double>::infinity()), InvalidArgument);
  CHECK(simulator.finish().recording(0).ticks().size() < 100000);
  simulator.start(100.0, 60.0);
}

TEST_CASE("a body that throws in a host's frames lets the hand go", "[simulator][tools][realtime][host_loop]") {
  Told told;
  Simulator simulator(Noting(press(0.030, 0.050, 0.006), told), body(), Broken(80), TissueReaction{});
  simulator.start(60.0, 100.0);
  CHECK(message_of([&] {
          while (simulator.tick_body(0.01)) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }) == "broken");
  CHECK(told.opened == 1);
  simulator.close();
  CHECK(told.force == 0);
  CHECK_FALSE(told.is_open);
}

TEST_CASE("a servo that can not be started ends the others, and closes all devices", "[simulator][tools][realtime][host_loop]") {
  Told one, two;
  Simulator simulator(body(), Tool(Noting(press(0.030, 0.050, 0.006), one), Probe{}, TissueReaction{}), Tool(Stuck(press(0.080, 0.050, 0.006), two), Probe{}, TissueReaction{}));
  for (int k = 1; k <= 2; ++k) {
    CHECK(message_of([&] { k == 1 ? static_cast<void>(simulator.run_realtime(0.05)) : simulator.start(0.05, 60.0); }) == "the driver can not start");
    CHECK_FALSE((one.is_open || two.is_open));
    CHECK(one.opened == k);
    CHECK_THROWS_AS(simulator.finish(), Error);
  }
}

// What a tool touched may have another number once another has taken tissue away in the same tick.
TEST_CASE("a tool does not push what has another number meanwhile", "[simulator][tools]") {
  for (bool const is_taken : {false, true}) {
    auto const mesh = make_block<double>(5, 5, 3, 0.005, BlockPattern::alternating);
    SoftBody block(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}}), BackwardEuler{});
    BodyTool<decltype(block), Probe> tool(Probe{}, ContactCoupling{});
    for (double const z : {0.012, 0.0095}) tool.advance(block, {.position = {0.0103, 0.0107, z}}, 0);
    REQUIRE(tool.cutter().contact().touching);
    if (is_taken) block.remove_tetrahedron(0), block.finish_edits();
    tool.push(block, 1, 1, 1e-3);
    CHECK((tool.model(block, false).tissue_force.z() > 0) == !is_taken);
    block.step(1e-3);
    CHECK((block.positions() - block.tissue().rest_positions()).isZero(1e-9) == is_taken);
  }
}
