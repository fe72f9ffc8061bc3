// SPDX-License-Identifier: MIT
// Hands that palpate a soft skin in a simulator.
#include "pictures.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <utility>

namespace haptics {

using namespace palpate;

namespace {

/// Three presses that are meant to reach 15 mm below the skin.
Trajectory<double> presses() { return Trajectory<double>::start({0.0512, 0.0533, 0.005}).hold(0.1).tap({0.0, 0.0, -0.020}, 2.4, 3).hold(0.2); }
constexpr double presses_take = 2.7;   // s

Recording palpate_with(HandOptions const& hand) {
  auto const mesh = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(mesh));
  Simulator simulator(SimulatedHand<double>(presses(), {.hand = hand}), SoftBody(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 4}),
                      NoCutter<double>(), TissueReaction{});
  return simulator.run(presses_take);
}

struct Hand {
  Colour colour;
  char const* label;
  HandOptions options;
};
Hand const hands[] = {{blue, "light hand", light_hand()}, {green, "normal hand", normal_hand()}, {orange, "firm hand", firm_hand()}};

}  // namespace

Picture palpating() {
  Picture picture("haptics_palpating", "Hands that mean to press 15 mm into a soft skin", "time [s]", "height of the tip [mm]");
  picture.y().from = -16.0, picture.y().to = 8.0;
  Trajectory<double> const path = presses();
  sample(picture.dashes(black, "meant"), 0.0, presses_take, 1.0, [&](double t) { return 1000 * path.at(t).position.z(); }, 600);
  for (Hand const& hand : hands) {
    PlotSeries& series = picture.line(hand.colour, hand.label);
    double deepest = 0.0, most = 0.0;
    Recording const recording = palpate_with(hand.options);
    for (Tick const& tick : recording.ticks()) {
      add(series, tick.time, 1000 * tick.tip.z());
      deepest = std::min(deepest, tick.tip.z()), most = std::max(most, tick.force.norm());
    }
    picture.quote("%-11s %.2f mm deep, at most %.3f N", hand.label, -1000 * deepest, most);
  }
  return picture;
}

Picture palpating_energy() {
  Picture picture("haptics_palpating_energy", "What the skin has taken from the hands", "time [s]", "energy [mJ]");
  for (Hand const& hand : hands) {
    PlotSeries& series = picture.line(hand.colour, hand.label);
    double most = 0.0, least = 0.0, end = 0.0;
    Recording const recording = palpate_with(hand.options);
    for (Tick const& tick : recording.ticks()) {
      end = 1000 * tick.energy;
      add(series, tick.time, end);
      most = std::max(most, end), least = std::min(least, end);
    }
    picture.quote("%-11s at most %.3f mJ, at least %.4f mJ, at the end %.3f mJ", hand.label, most, least, end);
  }
  return picture;
}

}  // namespace haptics
