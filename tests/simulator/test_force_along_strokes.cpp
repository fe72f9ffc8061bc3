// SPDX-License-Identifier: MIT
// What the hand feels along strokes that cross each other on an organ that gapes, noise off. Yardstick: the just noticeable difference of a force, and
// what the steepest curve gives for the way of the tip.
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>

using namespace palpate;

namespace {

auto gaping_sheet() {
  auto const skin = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.1},
                                   .link = {.stiffness = 80.0, .damping = 0.2},
                                   .home = {.stiffness = 8.0, .damping = 0.1},
                                   .link_prestrain = 0.15});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
}

/// Down, along, up; then the same across.
Trajectory<double> two_strokes() {
  auto path = Trajectory<double>::start({0.0212, 0.0533, 0.004});
  path.line({0.0212, 0.0533, -0.010}, 0.7).line({0.0788, 0.0517, -0.010}, 1.5).line({0.0788, 0.0517, 0.006}, 0.6);
  path.line({0.0513, 0.0212, 0.004}, 0.5).line({0.0513, 0.0212, -0.010}, 0.7).line({0.0488, 0.0788, -0.010}, 1.5).line({0.0488, 0.0788, 0.006}, 0.6);
  return path;
}

/// `stiffness`: of the steepest part of the force [N/m].
template <class Force>
void check_strokes(Force const& force, double stiffness) {
  Simulator simulator(ScriptedDevice<double>(two_strokes(), {.max_force = 10.0}), gaping_sheet(), ProgressiveCutter<double>({.puncture_depth = 0.006}), force);
  Recording const session = simulator.run(6.2);
  auto const& ticks = session.ticks();
  int punctures = 0;
  double since = 1;
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    bool const punctured = ticks[k].phase == CuttingPhase::moving && ticks[k - 1].phase == CuttingPhase::indenting;
    punctures += punctured;
    since = punctured ? 0 : since + ticks[k].time - ticks[k - 1].time;
    double const change = (ticks[k].force - ticks[k - 1].force).norm();
    double const allowed = std::max(force_just_noticeable_difference * ticks[k].force.norm(), 0.02) + stiffness * (ticks[k].tip - ticks[k - 1].tip).norm();
    if (since <= 0.006) continue;   // the drop at the puncture, which test_cutting_force looks at
    CAPTURE(ticks[k].time, ticks[k].depth, ticks[k - 1].depth, to_string(ticks[k].phase), to_string(ticks[k - 1].phase));
    REQUIRE(change <= allowed);
  }
  CHECK(punctures == 2);
}

}  // namespace

TEST_CASE("the force along strokes that cross has no step, loosely coupled") {
  check_strokes(CuttingForce(liver_hysteresis<double>(), OrganForce<double>{.coefficient = 1.0, .wall_normal = {1, 0, 0}},
                             CurveJoin<double>{.reversal_depth = 1e-3}),
                520.0);
}

TEST_CASE("the force along strokes that cross has no step, tightly coupled") {
  check_strokes(CuttingForce(TissueReaction{}, IndentationSpring<double>{.stiffness = 0.0}), 200.0);
}
