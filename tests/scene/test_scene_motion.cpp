// SPDX-License-Identifier: MIT
// What moves the bodies of a scene: obstacles in any place, forces, hands; and what of it is kept. Yardsticks: the scene with its bodies in another order; a rigid
// motion; weights; SoftBody::advance; the force that a slit bears before; the energy at the begin.
#include "catch.hpp"
#include "contact/blocks.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/scene/scene_tool.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tool/blunt_tool.hpp>
#include <palpate/tool/built_in_shapes.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

using Vector = Vector3<double>;
constexpr double g = 9.81;
constexpr BodyContactOptions<double> pressed{.pressure = 5e3, .depth = 5e-3, .friction = 0.4};

auto slab(double low) {
  auto body = solid(block(4, 4, 3, 0.01, {-0.0153, -0.0148, low - 3e-5}), BackwardEuler{}, 1e4, 5.0);
  body.set_gravity({0, 0, -g});
  return body;
}
auto cube(double young) {
  auto body = solid(block(3, 3, 3, 0.01, {0, 0, 0}), LeapfrogVerlet{}, young, 0.0, 0.0);
  body.set_gravity({0, 0, -g});
  return body;
}
template <class Body>
void hold_up(Body& body) {
  for (int i = 0; i < body.size(); ++i) body.apply_force(i, Vector(0, 0, g * body.tissue().mass(i)));
}

}  // namespace

TEST_CASE("an obstacle carries what lies on it in whatever place it is", "[scene]") {
  Scene last(slab(0.02), table(0.02));
  Scene first(table(0.02), slab(0.02));
  last.touch<0, 1>(pressed), first.touch<1, 0>(pressed);
  for (int k = 0; k < 100; ++k) last.advance(1e-3), first.advance(1e-3);
  Vector const from = middle(first.body<1>());
  for (int k = 1; k <= 200; ++k) {
    ToolPose<double> const pose{.position = {2.5e-5 * k, 0, 5e-5 * k}};
    last.body<1>().move_to(pose, 1e-3), first.body<0>().move_to(pose, 1e-3);
    last.advance(1e-3), first.advance(1e-3);
  }
  CHECK(first.body<1>().positions() == last.body<0>().positions());   // the same bodies, the same order of pairs
  CHECK((middle(first.body<1>()) - from)[0] == Approx(0.005).epsilon(0.1));
}

// Yardstick: the weight, in each step. A table that stood still in them would press with none and with three times as much.
TEST_CASE("a table that is lifted evenly bears its load in each of the steps that the load takes", "[scene]") {
  for (double const tick : {1e-3, 5e-3}) {
    CAPTURE(tick);
    auto load = solid(block(4, 4, 3, 0.01, {-0.0153, -0.0148, -3e-5}), LeapfrogVerlet{}, 1e4, 0.0, 2e-3);
    load.set_gravity({0, 0, -g});
    double const weight = g * load.total_mass();
    Scene scene(std::move(load), table(0.0));
    scene.touch<0, 1>();
    double height = 0.0, least = 1e9, most = 0.0;
    int steps = 0;
    for (int k = 0; k * tick < 0.35; ++k) {
      height += tick * 0.2 * std::clamp((k * tick - 0.1) / 0.1, 0.0, 1.0);
      scene.body<1>().move_to({.position = {0, 0, height}}, tick);
      scene.advance(tick, {.most = 1000}, [&](auto const&, int, auto const& equal) {
        steps = std::max(steps, equal.count);
        if (k * tick < 0.3) return;
        double const force = scene.contact<0, 1>().force().z();
        least = std::min(least, force), most = std::max(most, force);
      });
    }
    CHECK(steps > 3);
    CHECK(least > 0.95 * weight);
    CHECK(most < 1.05 * weight);
  }
}

TEST_CASE("a force that was applied before a tick acts through all of its steps", "[scene][simulator]") {
  for (double const young : {1e5, 1e6}) {
    auto alone = cube(young);
    Scene scene(alone, table(-1));
    Simulator simulator(cube(young), Tool(ScriptedDevice<double>(Trajectory<double>::start({1, 0, 0}).line({1, 0, 0.001}, 1.0), {.max_force = 3.3, .rate = 1000.0}),
                                          NoCutter<double>({.tip_radius = 0.004}), TissueReaction{}));
    for (int k = 0; k < 50; ++k) {
      hold_up(scene.body<0>()), hold_up(alone), hold_up(simulator.body());
      scene.advance(1e-3), alone.advance(1e-3), simulator.run(1e-3);
    }
    CHECK(scene.counts<0>().max_steps_a_tick > (young > 2e5 ? 5 : 1));
    CHECK(alone.displacement(0).norm() < 1e-12);
    CHECK(scene.body<0>().displacement(0).norm() < 1e-12);   // with one step's force it falls by g t²/2 of the others, 12 mm
    CHECK(simulator.body().displacement(0).norm() < 1e-12);
  }
}

TEST_CASE("lips that were parted bear what they bore after their body was out, also in a state saved meanwhile", "[scene][cutting]") {
  auto body = solid(block(5, 7, 5, 0.005, {-0.01, -0.015, -0.01}), BackwardEuler{}, 2e4, 5);
  VolumeCutter<double> knife;
  for (int k = 0; k <= 60; ++k) {
    Vector const by(0.104 / 60 * k, 0, 0);
    knife.advance(body, {Vector(-0.1, -0.1, 0.0007) + by, Vector(-0.1, 0.1, 0.0007) + by});
  }
  std::vector<int> top;
  for (int i = 0; i < body.size(); ++i) {
    if (body.positions()(2, i) < -0.0099) body.nail(i);
    if (body.positions()(2, i) > 0.0099) top.push_back(i), body.hold(i);
  }
  Scene scene(std::move(body), table(-1));
  scene.touch<0, 0>({.pressure = 2e4, .depth = 0.6e-3});
  auto const press = [&](double by, int ticks) {
    auto& it = scene.body<0>();
    for (int k = 0; k < ticks; ++k) {
      for (int const i : top) it.drag(i, Vector(Vector(it.positions().col(i)) + Vector(0, 0, by / ticks)));
      scene.advance(1e-3);
    }
  };
  auto const settles = [&] {
    for (int k = 0; k < 150; ++k) scene.advance(1e-3);
    double sum = 0;
    for (int const i : top) sum += scene.body<0>().reaction(i)[2];
    return sum;
  };
  press(0.002, 60), press(-0.004, 120);
  double const bears = settles();
  CHECK(bears < -0.5);
  auto const pressing = scene.save();
  scene.take_out<0>(), scene.advance(1e-3);
  auto const out = scene.save();
  scene.put_back<0>();
  CHECK(settles() == Approx(bears).epsilon(0.01));
  scene.restore(out), scene.put_back<0>();
  CHECK(settles() == Approx(bears).epsilon(0.01));
  scene.restore(pressing);
  CHECK(settles() == Approx(bears).epsilon(0.01));
}

TEST_CASE("what is drawn of a body of other size in a body's place has its triangles", "[scene]") {
  Scene scene(slab(0), table());
  BodySnapshot<double> shown, alone;
  scene.draw(shown), alone.draw(scene.body<0>());
  auto const other = solid(block(3, 3, 3, 0.01, {0, 0, 0}), BackwardEuler{}, 1e4, 5.0);
  scene.body<0>() = other;
  scene.draw(shown), alone.draw(scene.body<0>());
  REQUIRE(alone.triangles.cols() == other.triangles().cols());
  CHECK(alone.triangles == other.triangles());
  REQUIRE(shown.bodies[0].triangles == other.triangles().cols());
  CHECK(shown.triangles.leftCols(other.triangles().cols()) == other.triangles());
  CHECK(shown.triangles.maxCoeff() == shown.points.cols() - 1);
}

TEST_CASE("a tool that presses one body itself may say how it is coupled to the others", "[scene][simulator]") {
  auto const hand = [] {
    return ScriptedDevice<double>(Trajectory<double>::start({0.0007, 0.0003, 0.04}).line({0.0007, 0.0003, 0.02}, 0.1).line({0.0007, 0.0003, 0.02}, 0.2), {.max_force = 3.3, .rate = 1000.0});
  };
  BluntTool<double> const probe(make_probe_shape<double>(), {.friction = 0.2});
  auto const run = [&](double stiffness) {
    Simulator simulator(Scene(slab(-0.03), table(0.025)), Tool(hand(), PerBody(probe, NoCutter<double>({.tip_radius = 0.004})), TissueReaction{}, {.coupling = ContactCoupling{.stiffness = stiffness}}));
    return Vector(simulator.run(0.3).recording(0).ticks().back().force)[2];
  };
  CHECK(run(100) == Approx(100 * 0.009).epsilon(0.01));   // N/m, m
  CHECK(run(200) == Approx(200 * 0.009).epsilon(0.01));
  Simulator on_tissue(Scene(slab(-0.03), slab(0.0)), Tool(hand(), PerBody(probe, probe), TissueReaction{}));
  CHECK_THROWS_AS(Simulator(Scene(slab(-0.03), slab(0.0)), Tool(hand(), PerBody(probe, probe), TissueReaction{}, {.coupling = ContactCoupling{.stiffness = 100.0}})), InvalidArgument);
}

TEST_CASE("a stack of implicit bodies rests where its weights say, at long steps as at short ones, in whatever order its contacts were named", "[scene]") {
  auto const sinks = [](double h, bool from_above) {
    auto const on = [](int across, double x, double low) {
      auto body = solid(block(across, across, 3, 0.01, {x, x, low}), BackwardEuler{}, 1e4, 0.5);
      body.set_gravity({0, 0, -g});
      return body;
    };
    Scene scene(on(5, -0.02, -1e-5), on(4, -0.0197, 0.02 - 3e-5), table());
    constexpr BodyContactOptions<double> rough{.pressure = 5e3, .depth = 5e-3, .friction = 0.3};
    if (from_above) scene.touch<0, 1>(rough);
    scene.touch<0, 2>(rough);
    if (!from_above) scene.touch<0, 1>(rough);
    Vector const from = middle(scene.body<1>());
    for (int k = 0; k < std::lround(1.5 / h); ++k) REQUIRE(scene.advance(h));
    double const above = scene.body<1>().total_mass() * g, all = above + scene.body<0>().total_mass() * g;
    CHECK(scene.contact<0, 2>().force()[2] == Approx(all).epsilon(1e-3));
    CHECK(scene.contact<0, 1>().force()[2] == Approx(-above).epsilon(1e-3));
    CHECK(scene.body<1>().velocities().cwiseAbs().maxCoeff() < 1e-4);
    Vector const way = middle(scene.body<1>()) - from;
    CHECK(way.head<2>().norm() < 1e-3);
    return way[2];
  };
  double const expected = sinks(2.5e-3, true);
  for (double const h : {5e-3, 1e-2})
    for (bool const from_above : {true, false}) CHECK(sinks(h, from_above) == Approx(expected).epsilon(0.02));
}

TEST_CASE("no energy comes of a body that falls on one that lies, whatever the order of the contacts", "[scene]") {
  for (double const h : {1e-3, 5e-3, 1e-2})
    for (bool const from_above : {true, false}) {
      Scene scene(slab(0), slab(0.04), table());
      if (from_above) scene.touch<0, 1>(pressed);
      scene.touch<0, 2>(pressed);
      if (!from_above) scene.touch<0, 1>(pressed);
      auto const energy = [&] {
        auto const of = [](auto const& body) { return body.kinetic_energy() + body.potential_energy() + body.total_mass() * g * middle(body)[2]; };
        return of(scene.body<0>()) + of(scene.body<1>());
      };
      double const begins = energy();
      double most = begins;
      for (int k = 0; k < std::lround(0.4 / h); ++k) scene.advance(h), most = std::max(most, energy());
      CHECK(most < begins + 0.01 * scene.body<1>().total_mass() * g * 0.02);   // of what the fall gives
      CHECK(scene.contact<0, 1>().force().norm() > 0);
    }
}

TEST_CASE("a scene in which contacts count with each other goes on as it did after it is restored, to the byte", "[scene]") {
  Scene scene(slab(0), slab(0.02 - 5e-5), table());
  scene.touch<0, 1>(pressed), scene.touch<0, 2>(pressed), scene.touch<0, 0>({.pressure = 5e3});
  for (int k = 0; k < 10; ++k) scene.advance(1e-2);
  auto const then = scene.save();
  for (int k = 0; k < 5; ++k) scene.advance(1e-2);
  Matrix3X<double> const expected = scene.body<1>().positions();
  scene.restore(then);
  auto const again = scene.save();   // nothing has happened in between
  scene.restore(again);
  for (int k = 0; k < 5; ++k) scene.advance(1e-2);
  CHECK(scene.body<1>().positions() == expected);
}
