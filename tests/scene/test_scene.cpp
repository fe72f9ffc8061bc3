// SPDX-License-Identifier: MIT
// Several bodies, what touches them and what holds them. Yardsticks: the same bodies stepped by hand; a simulator of one body; weights; what the nails hold.
// PALPATE_SCENE_TICKS sets for how many ticks a stack has to stay where it is (200 if not set; 60,000 is a minute), and with more
// than 1,000 the four tools press two solids of 3,840 tetrahedra for 1,000 ticks.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "contact/blocks.hpp"
#include "device/message.hpp"
#include "simulator/scene.hpp"

#include <palpate/body/substeps.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/scene/scene_tool.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

using Vector = Vector3<double>;
using Hand = ScriptedDevice<double>;
using Probe = NoCutter<double>;

constexpr double g = 9.81;

int long_run(char const* name, int otherwise) {
  char const* const given = std::getenv(name);
  return given != nullptr ? std::atoi(given) : otherwise;
}

/// Two slabs of 5 × 5 × 2 cm and 4 × 4 × 2 cm: the upper begins a little in the lower, that in the table.
auto lower() {
  auto body = solid(block(6, 6, 3, 0.01, {-0.025, -0.025, -1e-5}), LeapfrogVerlet{}, 5e3, 40.0);
  body.set_gravity({0, 0, -g});
  return body;
}
auto upper() {
  auto body = solid(block(5, 5, 3, 0.01, {-0.0203, -0.0198, 0.02 - 3e-5}), BackwardEuler{}, 1e4, 40.0);
  body.set_gravity({0, 0, -g});
  return body;
}
constexpr BodyContactOptions<double> pressed{.pressure = 5e3, .depth = 5e-3, .friction = 0.4};   // k/δ twice E over an edge of the lower: they come to rest
auto stack() {
  Scene scene(lower(), upper(), table());
  scene.touch<0, 2>(pressed), scene.touch<1, 0>(pressed);
  return scene;
}
/// Down to a place, held there, and up again.
Hand press(double x, double y, double from, double to) {
  auto path = Trajectory<double>::start({x, y, from});
  path.line({x, y, to}, 0.3).line({x, y, to}, 0.3).line({x, y, from}, 0.2);
  return Hand(std::move(path), {.max_force = 3.3, .rate = 1000.0});
}
auto tool(Hand hand, int key = 0) { return Tool(std::move(hand), Probe({.tip_radius = 0.004}), TissueReaction{}, {.key = key}); }

}  // namespace

TEST_CASE("bodies on one another bear what lies on them, explicit and implicit ones, each with its own steps", "[scene]") {
  auto scene = stack();
  for (int k = 0; k < 600; ++k) REQUIRE(scene.advance(1e-3));
  double const both = (scene.body<0>().total_mass() + scene.body<1>().total_mass()) * g, above = scene.body<1>().total_mass() * g;
  CHECK(scene.contact<0, 2>().force()[2] == Approx(both).epsilon(1e-3));
  CHECK(scene.contact<1, 0>().force()[2] == Approx(above).epsilon(1e-3));
  CHECK(scene.contact<1, 0>().force().head<2>().norm() < 0.01 * above);
  CHECK(scene.counts<0>().max_steps_a_tick > 1);
  CHECK(scene.counts<1>().max_steps_a_tick == scene.counts<0>().max_steps_a_tick);   // they touch each other
  CHECK(scene.counts<1>().lag == 0);
  Matrix3X<double> const rests = scene.body<1>().positions();
  for (int k = 0; k < long_run("PALPATE_SCENE_TICKS", 200); ++k) scene.advance(1e-3);
  CHECK((scene.body<1>().positions() - rests).cwiseAbs().maxCoeff() < 1e-6);   // a hundredth of an edge is 1e-4
}

TEST_CASE("a scene steps and presses its bodies as a loop by hand does, to the byte", "[scene]") {
  auto scene = stack();
  auto low = lower();
  auto high = upper();
  auto ground = table();
  BodyContact on_table(low, ground, pressed);
  BodyContact on_low(high, low, pressed);
  for (int k = 0; k < 100; ++k) {
    scene.step(2e-4);
    on_low.expect(high, low);
    on_table.apply(low, ground, 2e-4), on_low.apply(high, low, 2e-4);
    low.step(2e-4), high.step(2e-4);
  }
  CHECK(scene.body<0>().positions() == low.positions());
  CHECK(scene.body<1>().velocities() == high.velocities());
  CHECK(on_low.force().norm() > 0.01);
  CHECK(scene.contact<1, 0>().force() == on_low.force());
}

TEST_CASE("bodies that are far from each other take their own steps, also where both lie on one obstacle", "[scene]") {
  auto far = solid(block(3, 3, 3, 0.01, {0.06, -0.01, -1e-5}), BackwardEuler{}, 1e4, 5.0);
  far.set_gravity({0, 0, -g});
  Scene scene(lower(), std::move(far), table());
  scene.touch<0, 2>(pressed), scene.touch<1, 2>(pressed), scene.touch<0, 1>(pressed);
  for (int k = 0; k < 50; ++k) REQUIRE(scene.advance(1e-3));
  CHECK(scene.counts<0>().max_steps_a_tick > 1);
  CHECK(scene.counts<1>().max_steps_a_tick == 1);
  CHECK(scene.counts<1>().steps == 50);
  CHECK(scene.counts().steps == scene.counts<0>().steps + 50 + scene.counts<2>().steps);
  CHECK(scene.contact<1, 2>().force()[2] > 0);
  CHECK(scene.contact<0, 1>().regions().empty());
}

TEST_CASE("a simulator of a scene of one body is one of the body, to the byte", "[scene][simulator]") {
  auto const body = [] { return skin<double>(ZoneOfInfluence{.rings = 4}); };
  auto const knife = [] { return Tool(Hand(stroke<double>(0.010, 0.25), {.max_force = 3.3, .rate = 1000.0}), ProgressiveCutter<double>({.puncture_depth = 0.006, .snap = 5e-4}), TissueReaction{}); };
  Simulator alone(body(), knife());
  Simulator scene(Scene{body()}, knife());
  ToolRecordings const expected = alone.run(0.9), found = scene.run(0.9);
  CHECK(expected.recording(0).largest_force() > 0.1);
  CHECK(found.recording(0).to_csv() == expected.recording(0).to_csv());
  CHECK(scene.body().body<0>().positions() == alone.body().positions());
  CHECK(scene.tool<0>().on<0>().report().particles_added == alone.tool<0>().report().particles_added);
  CHECK(scene.statistics<0>().body_counts.steps == alone.statistics<0>().body_counts.steps);
  CHECK(scene.forecast().stable_step == Approx(alone.forecast().stable_step));
}

TEST_CASE("a tool that presses the upper body presses what lies below it", "[scene][simulator]") {
  Simulator simulator(stack(), SimulatorOptions{.coupling = {.stiffness = 300.0}}, tool(press(0.0007, 0.0003, 0.05, 0.040)));
  double const weight = (simulator.body().body<0>().total_mass() + simulator.body().body<1>().total_mass()) * g;
  double felt = 0, borne = 0;
  simulator.run(0.85, [&](std::span<Tick const> ticks) {
    if (ticks[0].time < 0.5 || ticks[0].time >= 0.6) return;
    felt += ticks[0].force[2] / 100, borne += simulator.body().contact<0, 2>().force()[2] / 100;
  });
  CHECK(felt > 0.1);
  CHECK(borne - weight == Approx(felt).epsilon(0.05));
  CHECK(simulator.tool<0>().state() == CuttingPhase::no_contact);
}

TEST_CASE("one tool on two bodies feels both, and obstacles", "[scene][simulator]") {
  // Two blocks beside each other, nailed below; the ball goes down between them, and touches both tops.
  auto const beside = [](double x) {
    auto const mesh = block(4, 4, 3, 0.01, {x, -0.015, -0.02});
    auto body = solid(mesh, BackwardEuler{}, 1e4, 5.0);
    for (int const i : vertices_where(mesh, [](Vector const& p) { return p[2] < -0.019; })) body.nail(i);
    return body;
  };
  auto const hand = [] { return Tool(press(0.0, 0.0003, 0.02, 0.004), Probe({.tip_radius = 0.008}), TissueReaction{}); };
  Simulator both(Scene(beside(-0.0305), beside(0.0005), table(-0.02)), hand());
  Simulator left(beside(-0.0305), hand()), right(beside(0.0005), hand());
  Simulator none(Scene(beside(-0.0305), table(0.0)), Tool(press(0.05, 0.05, 0.02, 0.004), Probe({.tip_radius = 0.008}), TissueReaction{}));
  auto const a = both.run(0.6), b = left.run(0.6), c = right.run(0.6), d = none.run(0.6);
  auto const last = [](ToolRecordings const& session) { return Vector(session.recording(0).ticks().back().force); };
  CHECK(last(b)[2] > 0.05);
  CHECK(last(c)[2] > 0.05);
  CHECK((last(a) - last(b) - last(c)).norm() < 1e-9);
  CHECK(last(d)[2] > 1.0);   // 4 mm in a wall of 2,000 N/m: as much as the device gives
}

TEST_CASE("the same tools in other places with the same keys give the same bytes in a scene", "[scene][simulator]") {
  auto const one = [] { return tool(press(0.0007, 0.0003, 0.05, 0.0405), 2); };
  auto const other = [] { return tool(press(-0.0232, -0.0227, 0.05, 0.0215), 1); };
  Simulator first(stack(), one(), other()), second(stack(), other(), one());
  ToolRecordings const a = first.run(0.4), b = second.run(0.4);
  CHECK(a.recording(0).largest_force() > 0.1);
  CHECK(a.recording(1).largest_force() > 0.1);
  CHECK(a.recording(0).to_csv() == b.recording(1).to_csv());
  CHECK(a.recording(1).to_csv() == b.recording(0).to_csv());
  CHECK(first.body().body<1>().positions() == second.body().body<1>().positions());
}

TEST_CASE("a scene goes on as it did after it is restored, and so does a copy", "[scene]") {
  auto scene = stack();
  scene.body<1>().set_gravity({0.3 * g, 0, -g});   // friction holds it
  for (int k = 0; k < 200; ++k) scene.advance(1e-3);
  auto const then = scene.save();
  auto copy = scene;
  for (int k = 0; k < 50; ++k) scene.advance(1e-3);
  Matrix3X<double> const expected = scene.body<1>().positions();
  Vector const force = scene.contact<1, 0>().force();
  CHECK(std::abs(force[0]) > 0.01);
  scene.restore(then);
  for (int k = 0; k < 50; ++k) scene.advance(1e-3), copy.advance(1e-3);
  CHECK(scene.body<1>().positions() == expected);
  CHECK(copy.body<1>().positions() == expected);
  CHECK(scene.contact<1, 0>().force() == force);
  scene.restore(then);
  auto const again = scene.save();   // nothing has happened in between
  scene.restore(again);
  for (int k = 0; k < 50; ++k) scene.advance(1e-3);
  CHECK(scene.body<1>().positions() == expected);
}

TEST_CASE("a hand that feels a surface feels nothing of a body that was taken out", "[scene][simulator]") {
  auto const mesh = block(4, 4, 3, 0.01, {-0.015, -0.015, -0.02});
  auto body = solid(mesh, BackwardEuler{}, 1e4, 5.0);
  for (int const i : vertices_where(mesh, [](Vector const& p) { return p[2] < -0.019; })) body.nail(i);
  Simulator simulator(Scene(std::move(body), table(-0.02)), Tool(press(0.0007, 0.0003, 0.02, 0.002), Probe({.tip_radius = 0.004}), ProxyForce<double>()));
  double before = 0, after = 0;
  simulator.run(0.55, [&](std::span<Tick const> ticks) {
    if (ticks[0].time == 0.4) before = ticks[0].force.norm(), simulator.body().take_out<0>();
    if (ticks[0].time > 0.5) after = std::max(after, ticks[0].force.norm());
  });
  CHECK(before > 0.05);
  CHECK(after < 1e-9);
  CHECK(simulator.tool<0>().state() == CuttingPhase::no_contact);   // the tip is where the body was
  BodyCounts const counts = simulator.statistics<0>().body_counts;
  CHECK(counts.ticks == 550);
  CHECK(counts.seconds == Approx(0.55));
  CHECK(std::isinf(counts.stable_step));
}

TEST_CASE("what lies on an obstacle goes along with it, and stays with it where it stops", "[scene]") {
  Scene scene(upper(), table(0.02));
  scene.touch<0, 1>(pressed);
  for (int k = 0; k < 300; ++k) scene.advance(1e-3);
  Vector const before = scene.body<0>().positions().rowwise().mean();
  double const rests = scene.contact<0, 1>().regions()[0].volume / scene.contact<0, 1>().regions()[0].area;
  double deepest = 0, least = 1;
  for (int k = 1; k <= 400; ++k) {
    scene.body<1>().move_to({.position = {2.5e-5 * k, 0, 5e-5 * k}}, 1e-3);   // 10 and 20 mm
    scene.advance(1e-3);
    if (k < 200) continue;   // evenly by now
    auto const& region = scene.contact<0, 1>().regions()[0];
    deepest = std::max(deepest, region.volume / region.area), least = std::min(least, region.volume / region.area);
  }
  double const borne = 1 + 40.0 * 0.05 / g;   // weight and drag, at 50 mm/s
  CHECK(deepest == Approx(rests * borne).epsilon(0.02));
  CHECK(least == Approx(rests * borne).epsilon(0.02));
  for (int k = 0; k < 400; ++k) scene.advance(1e-3);
  Vector const way = scene.body<0>().positions().rowwise().mean() - before;
  CHECK(way[0] == Approx(0.010).epsilon(0.01));
  CHECK(std::abs(way[1]) < 1e-5);
  CHECK(way[2] == Approx(0.020).epsilon(1e-3));
  CHECK(scene.body<0>().velocities().cwiseAbs().maxCoeff() < 1e-5);
  CHECK(scene.body<1>().velocities().cwiseAbs().maxCoeff() == 0);
}

TEST_CASE("a body that was all held when its stable step was found keeps to it when it is let go", "[scene]") {
  auto held = lower();
  for (int i = 0; i < held.size(); ++i) held.hold(i);
  Scene scene(std::move(held), table());
  scene.touch<0, 1>(pressed);
  for (int k = 0; k < 20; ++k) scene.advance(1e-2);
  for (int i = 0; i < scene.body<0>().size(); ++i) scene.body<0>().release(i);
  for (int k = 0; k < 50; ++k) scene.advance(1e-2);
  CHECK(scene.counts<0>().diverged <= 1);   // the step in which it is let go
  CHECK(scene.counts<0>().steps > 300);
  CHECK(scene.body<0>().velocities().cwiseAbs().maxCoeff() < 0.01);
}

TEST_CASE("a scene whose explicit bodies hit each other fast goes on as it did, step by step, after it is restored", "[scene]") {
  auto const cube = [](double low) {
    auto mesh = make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating);
    mesh.points.row(2).array() += low;
    return SoftBody(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000.0, .material = {.young = 2e4, .poisson = 0.3}}), LeapfrogVerlet{});
  };
  Scene scene(cube(0), cube(0.032));
  scene.touch<1, 0>({.pressure = 2e4});
  for (int i = 0; i < scene.body<1>().size(); ++i) scene.body<1>().drag(i, Vector(scene.body<1>().positions().col(i)), Vector(0.1, 0, -3)), scene.body<1>().release(i);
  for (int from = 0; from < 12; ++from) {
    auto const then = scene.save();
    auto const run = [&] {
      std::vector<std::uint64_t> steps{scene.counts<0>().steps, scene.counts<1>().steps};
      for (int k = 0; k < 40; ++k) scene.advance(1e-3);
      return std::vector{scene.counts<0>().steps - steps[0], scene.counts<1>().steps - steps[1]};
    };
    auto const steps = run();
    Matrix3X<double> const expected = scene.body<1>().positions();
    scene.restore(then);
    CHECK(run() == steps);
    CHECK(scene.body<1>().positions() == expected);
    scene.restore(then);
    scene.advance(1e-3);
  }
  CHECK(scene.counts<0>().guarded > 20);
}

TEST_CASE("a body that lies on itself does so in a scene as in a loop by hand, to the byte, and after it is restored", "[scene]") {
  auto made = [] {
    auto body = solid<double>(coil(2, 32, 1.4, 0.02, 0.01, 0.0101, 0.0007), BackwardEuler{}, 5e3);
    body.set_gravity({0, 0, -9.81});
    return body;
  };
  auto by_hand = made();
  auto ground = table<double>(-0.0055, 0.2);
  Scene scene(by_hand, ground);
  auto& on_ground = scene.touch<0, 1>(pressed);
  auto& own = scene.touch<0, 0>({.pressure = 3e3, .friction = 0.2});
  BodyContact below(by_hand, ground, pressed);
  SelfContact folded(by_hand, {.pressure = 3e3, .friction = 0.2});
  for (int k = 0; k < 40; ++k) {
    scene.advance(2e-3);
    folded.expect(by_hand);
    below.apply(by_hand, ground, 2e-3), folded.apply(by_hand, 2e-3), by_hand.step(2e-3);
  }
  REQUIRE(!own.regions().empty());
  CHECK(&own == &scene.contact<0, 0>());
  CHECK(scene.body<0>().positions() == by_hand.positions());
  auto const state = scene.save();
  for (int k = 0; k < 20; ++k) scene.advance(2e-3);
  Matrix3X<double> const once = scene.body<0>().positions();
  scene.restore(state);
  for (int k = 0; k < 20; ++k) scene.advance(2e-3);
  CHECK(scene.body<0>().positions() == once);
  CHECK(on_ground.force()[2] > 0.1);
}

TEST_CASE("a body that is taken out leaves no force behind, and comes back where it was", "[scene][simulator]") {
  Simulator simulator(stack(), SimulatorOptions{.coupling = {.stiffness = 300.0}}, tool(press(0.0007, 0.0003, 0.05, 0.040)));
  auto& scene = simulator.body();
  double const weight = scene.body<0>().total_mass() * g;
  Matrix3X<double> left;
  double on_table = 0, felt = 0;
  std::size_t revision = 0;
  simulator.run(1.0, [&](std::span<Tick const> ticks) {
    double const t = ticks[0].time;
    if (t == 0.4) left = scene.body<1>().positions(), revision = scene.topology_revision(), scene.take_out<1>();
    if (t > 0.5 && t < 0.6) felt = std::max(felt, ticks[0].force.norm());
    if (t >= 0.95) on_table += scene.contact<0, 2>().force()[2] / 50;
  });
  CHECK(scene.contact<1, 0>().regions().empty());
  CHECK(scene.contact<1, 0>().force() == Vector::Zero());
  CHECK(scene.body<1>().positions() == left);
  CHECK(felt < 1e-9);   // the tip is above the lower body
  CHECK(on_table == Approx(weight).epsilon(0.02));
  CHECK(scene.topology_revision() != revision);
  scene.put_back<1>();
  CHECK(scene.is_here(1));
  simulator.run(0.5);
  CHECK(scene.contact<1, 0>().force()[2] > 0);
}

TEST_CASE("a body is cut while another lies on it, and the cut is undone", "[scene][cutting]") {
  auto scene = stack();
  for (int k = 0; k < 300; ++k) scene.advance(1e-3);
  auto const before = scene.save();
  int const vertices = scene.body<0>().size();
  VolumeCutter<double> blade;
  double const stored = scene.body<0>().potential_energy() + scene.body<1>().potential_energy();
  double fastest = 0;
  auto const cut = [&] {
    for (int k = 0; k < 60; ++k) {
      Vector const low(-0.0302 + 0.0011 * k, 0.0013, -0.005);
      blade.advance(scene.body<0>(), {low, low + Vector(0, 0, 0.035)});
      REQUIRE(scene.advance(1e-3));
      fastest = std::max(fastest, scene.body<0>().kinetic_energy() + scene.body<1>().kinetic_energy());
    }
  };
  cut();
  CHECK(scene.body<0>().size() > vertices);
  CHECK(scene.body<0>().positions().allFinite());
  for (int k = 0; k < 200; ++k) REQUIRE(scene.advance(1e-3));
  double const both = (scene.body<0>().total_mass() + scene.body<1>().total_mass()) * g;
  CHECK(scene.contact<0, 2>().force()[2] == Approx(both).epsilon(0.01));
  CHECK(fastest < stored);
  scene.restore(before);
  CHECK(scene.body<0>().size() == vertices);
  for (int k = 0; k < 200; ++k) REQUIRE(scene.advance(1e-3));
  CHECK(scene.contact<0, 2>().force()[2] == Approx(both).epsilon(0.01));
}

TEST_CASE("what is drawn of a scene is all its bodies, one behind the other", "[scene][simulator]") {
  Simulator simulator(stack(), tool(press(0.0007, 0.0003, 0.05, 0.045)));
  simulator.run(0.05);
  REQUIRE(simulator.snapshots().fetch());
  auto const& shown = simulator.snapshots().latest();
  REQUIRE(shown.bodies.size() == 3);
  auto const& high = simulator.body().body<1>();
  BodyRange const one = shown.bodies[1];
  CHECK(one.first_point == simulator.body().body<0>().size());
  CHECK(shown.points.middleCols(one.first_point, one.points) == high.positions());
  CHECK((shown.triangles.middleCols(one.first_triangle, one.triangles).array() - static_cast<int>(one.first_point)).matrix() == high.triangles());
  CHECK(shown.points.cols() == shown.bodies[2].first_point + shown.bodies[2].points);
}

TEST_CASE("a scene in motion with a tool in it allocates nothing", "[scene]") {
  REQUIRE(trap_works());
  BodyLoop loop(stack(), Probe({.tip_radius = 0.004}), ContactCoupling{.stiffness = 300.0}, 100);
  auto const at = [](int k) { return ToolPose<double>{.position = Vector(0.0007, 0.0003, 0.048 - 4e-5 * std::min(k, 200))}; };
  for (int k = 0; k < 200; ++k) loop.tick(at(k), 1e-3);
  AllocationCount const allocations;
  LocalModel<double> last;
  for (int k = 200; k < 300; ++k) last = loop.tick(at(k), 1e-3);
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(last.tissue_force[2] > 0.05);
}

TEST_CASE("two solids on one another, each watched for contact with itself, and four tools allocate nothing", "[scene]") {
  REQUIRE(trap_works());
  int const cells = long_run("PALPATE_SCENE_TICKS", 0) > 1000 ? 12 : 6, counted = cells == 12 ? 1000 : 100;   // 12: 3,840 tetrahedra each
  double const edge = 0.06 / cells;
  auto const organ = [&](double low) {
    auto mesh = make_block<double>(cells + 1, cells * 2 / 3 + 1, cells * 2 / 3 + 1, edge, BlockPattern::alternating);
    mesh.points.colwise() += Vector(-0.03, -0.02, low);
    auto body = solid(mesh, LeapfrogVerlet{}, 5e3, 40.0, 2e-4);
    body.set_gravity({0, 0, -g});
    return body;
  };
  double const high = edge * (cells * 2 / 3);
  Scene scene(organ(-1e-5), organ(high - 2e-5), table());
  scene.touch<0, 2>(pressed), scene.touch<1, 0>(pressed), scene.touch<0, 0>({.pressure = 5e3}), scene.touch<1, 1>({.pressure = 5e3});
  using Loop = BodyLoop<decltype(scene), Probe, Probe, Probe, Probe>;
  using At = BodyTool<decltype(scene), Probe>;
  auto const at = [] { return At(Probe({.tip_radius = 0.004}), ContactCoupling{.stiffness = 300.0}); };
  Loop loop(std::move(scene), std::tuple(at(), at(), at(), at()), {0, 1, 2, 3}, 100);
  auto const placed = [&](int k) {
    std::array<PlacedTool<double>, 4> all;
    double const depth = 1e-4 * std::min(k, 110) - 0.004;
    for (std::size_t n = 0; n < 4; ++n) all[n] = {.is_placed = true, .pose = {.position = Vector(n % 2 == 0 ? -0.02 : 0.015, n < 2 ? -0.011 : 0.01, 2 * high - depth)}};
    return all;
  };
  constexpr int settles = 300;
  for (int k = 0; k < settles; ++k) loop.tick(placed(k), 1e-3);
  AllocationCount const allocations;
  Loop::Models last;
  for (int k = settles; k < settles + counted; ++k) last = loop.tick(placed(k), 1e-3);
  long const count = allocations.count();
  CHECK(count == 0);
  for (auto const& one : last) CHECK(one.tissue_force[2] > 0.02);
}

TEST_CASE("what a scene refuses", "[scene][errors]") {
  auto scene = stack();
  CHECK(message_of([&] { scene.touch<0, 1>(); }) == "Scene: bodies 0 and 1 touch each other already; contact<1, 0>() is theirs");
  CHECK(message_of([&] { scene.contact<1, 2>(); }) == "Scene: nobody said that bodies 1 and 2 touch each other; touch<1, 2>() does");
  CHECK(message_of([&] { scene.contact<0, 1>(); }) == "Scene: the contact of bodies 0 and 1 is contact<1, 0>()");
  Scene other(lower(), upper(), table());
  other.touch<1, 0>(pressed), other.touch<0, 2>(pressed);
  Matrix3X<double> const there = other.body<0>().positions();
  for (int k = 0; k < 5; ++k) scene.advance(1e-3);
  CHECK(message_of([&] { other.restore(scene.save()); }) ==
        "Scene: the state is of a scene whose contact 0 is of bodies 0 and 2; name the same contacts in the same order here");
  CHECK(other.body<0>().positions() == there);
  CHECK(message_of([&] { scene.advance(0); }).find("0 s") != std::string::npos);
  CHECK(message_of([&] { scene.advance(1e-3, {.most = 0}); }).find("at most 0 steps") != std::string::npos);
  CHECK_THROWS_AS((scene.touch<1, 2>({.pressure = -1.0})), InvalidArgument);
}
