// SPDX-License-Identifier: MIT
// What is felt over a network of every kind of body and tool, at every rate of a servo, beside what a Simulator feels of the same in one program.
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/network/network_simulation.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tool/blunt_tool.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

using namespace palpate;

namespace {

template <RealScalar S, class Region = WholeBody>
auto sheet(Region region = {}) {
  auto const skin = make_grid<S>(21, 21, S(0.005));
  MassSpring<S> tissue(skin, {.mass = {.total = S(0.1)}, .link = {.stiffness = S(80), .damping = S(0.2)}, .home = {.stiffness = S(8), .damping = S(0.1)}});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, std::move(region));
}
auto block() {
  auto const mesh = make_block<double>(9, 9, 5, 0.005, BlockPattern::alternating);
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}, .damping = {.beta = 0.01}});
  tissue.nail(vertices_where(mesh, [](Vector3<double> const& p) { return p.z() < 1e-9; }));
  return SoftBody(std::move(tissue), BackwardEuler{});
}
/// Down to a depth below a surface at `height` in 0.3 s, and then there.
ScriptedDevice<double> pressing(double x, double y, double height, double depth, double rate = 1000.0) {
  return ScriptedDevice<double>({{0.0, {x, y, height + 0.003}}, {0.3, {x, y, height - depth}}, {9.0, {x, y, height - depth}}}, {.rate = rate});
}

/// N, along z at the end: over a network with 5 ms each way, and by a simulator with the tissue's reaction alone.
template <class MakeBody, class MakeCutter>
std::pair<double, double> felt(MakeBody const& body, MakeCutter const& cutter, ScriptedDevice<double> const& device, double seconds, double max_step = 0.002) {
  NetworkSimulationOptions options;
  options.server.max_step = max_step;
  options.up.delay = options.down.delay = 0.005;
  NetworkSimulation remote(device, body(), cutter(), SurfaceThenTissue<double>{}, options);
  Simulator local(device, body(), cutter(), TissueReaction{});
  Recording const far = remote.run(seconds), near = local.run(seconds);
  CHECK(far.ticks().size() == near.ticks().size());
  for (Tick const& tick : far.ticks()) REQUIRE(is_finite(tick.force));
  return {far.ticks().back().force.z(), near.ticks().back().force.z()};
}

}  // namespace

// Yardstick: at rest the tissue's reaction is the same whoever asks for it, at any rate; a Simulator in one program.
TEST_CASE("a hand that rests feels over a network what it feels here", "[network]") {
  SECTION("springs in double, at 1, 2 and 4 kHz") {
    for (double const rate : {1000.0, 2000.0, 4000.0}) {
      INFO(rate << " Hz");
      auto const [far, near] = felt([] { return sheet<double>(); }, [] { return NoCutter<double>{}; }, pressing(0.052, 0.051, 0.0, 0.004, rate), 1.2);
      CHECK(near > 0.05);
      CHECK(far == Approx(near).epsilon(0.01));
    }
  }
  SECTION("springs in float") {
    NetworkSimulation remote(pressing(0.052, 0.051, 0.0, 0.004), sheet<float>(), NoCutter<float>{}, SurfaceThenTissue<double>{});
    auto const [far, near] = felt([] { return sheet<double>(); }, [] { return NoCutter<double>{}; }, pressing(0.052, 0.051, 0.0, 0.004), 1.2);
    CHECK(remote.run(1.2).ticks().back().force.z() == Approx(near).epsilon(0.01));
    CHECK(far == Approx(near).epsilon(0.01));
  }
  SECTION("a zone of influence") {
    auto const zone = [] { return sheet<double>(ZoneOfInfluence{.rings = 4}); };
    auto const [far, near] = felt(zone, [] { return NoCutter<double>{}; }, pressing(0.052, 0.051, 0.0, 0.004), 1.2);
    CHECK(near > 0.05);
    CHECK(far == Approx(near).epsilon(0.02));
  }
  SECTION("an elastic solid, by implicit steps") {
    auto const [far, near] = felt(block, [] { return NoCutter<double>{}; }, pressing(0.0213, 0.0207, 0.02, 0.002), 1.5);
    CHECK(near > 0.1);
    CHECK(far == Approx(near).epsilon(0.02));
    CHECK(felt(block, [] { return NoCutter<double>{}; }, pressing(0.0213, 0.0207, 0.02, 0.002), 1.5, 0.01).first == Approx(near).epsilon(0.02));   // a tick in one step
  }
  SECTION("a probe that presses the solid itself") {
    auto const probe = [] { return BluntTool<double>{}; };
    auto const [far, near] = felt(block, probe, pressing(0.0213, 0.0207, 0.02, 0.002), 1.5, 0.001);   // as the simulator's
    CHECK(near > 0.1);
    CHECK(far == Approx(near).epsilon(0.02));
  }
}

// Yardstick: golden 03's cut, 23 edges crossed by hand count; the force of a step of the servo is bounded by what one answer changes.
TEST_CASE("a hand cuts over a network, and no surface of the body before the cut is used after it", "[network]") {
  NetworkSimulationOptions options;
  options.up.delay = options.down.delay = 0.01;
  ScriptedDevice<double> const stroke({{0.0, {0.0212, 0.0533, 0.01}}, {0.5, {0.0212, 0.0533, -0.006}}, {2.5, {0.0788, 0.0517, -0.006}}, {3.0, {0.0788, 0.0517, 0.02}}, {3.3, {0.0788, 0.0517, 0.02}}});
  NetworkSimulation cutting(stroke, sheet<double>(), ProgressiveCutter<double>({.puncture_depth = 0.002, .snap = 2e-4}), SurfaceThenTissue<double>{}, options);
  std::size_t const before = cutting.body().topology_revision();
  double most = 0.0, fastest = 0.0;
  Vector3<double> last = Vector3<double>::Zero();
  bool moved = false;
  Recording const session = cutting.run(3.3, [&](Tick const& tick) {
    most = std::max(most, tick.force.norm());
    fastest = std::max(fastest, (tick.force - last).norm());
    last = tick.force;
    moved = moved || tick.phase == CuttingPhase::moving;
  });
  CHECK(moved);
  CHECK(cutting.body().topology_revision() > before);
  CHECK(cutting.tissue().loop().cutter().report().particles_added > 20);
  CHECK(most > 0.02);
  CHECK(fastest < 0.1);
  CHECK(session.ticks().back().force.norm() == 0.0);
  CHECK(session.ticks().back().phase == CuttingPhase::no_contact);
}

TEST_CASE("a solid is cut over a network", "[network]") {
  ScriptedDevice<double> const stroke({{0.0, {0.0213, -0.01, 0.015}}, {1.0, {0.0213, 0.05, 0.015}}, {1.2, {0.0213, 0.05, 0.04}}});
  NetworkSimulation cutting(stroke, block(), VolumeCutter<double>(), SurfaceThenTissue<double>{});
  Recording const session = cutting.run(1.2);
  CHECK(cutting.tissue().loop().cutter().report().area > 1e-4);
  CHECK(session.ticks().back().cut_area > 1e-4);
  for (Tick const& tick : session.ticks()) REQUIRE(is_finite(tick.force));
  CHECK(session.ticks().back().force.norm() == 0.0);
}
