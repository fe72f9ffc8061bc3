// SPDX-License-Identifier: MIT
// A tool of one's own in a simulator: a suction tip is pressed on skin and drawn off, beside the force that its vacuum bears.
#include "suction_tip.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace {

using namespace palpate;

/// Skin of 60 × 60 mm, held at its border where that is wanted.
auto skin(bool nailed) {
  auto const mesh = make_grid<double>(13, 13, 0.005);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 60.0, .damping = 0.05}});
  if (nailed) tissue.nail(boundary_vertices(mesh));
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}

/// The largest force that draws the hand down while the tip is drawn off [N].
double drawn_off(double radius, double vacuum) {
  Vector3<double> const above(0.031, 0.0293, 0.01), in(0.031, 0.0293, 0.002), high(0.031, 0.0293, 0.05);
  Simulator simulator(ScriptedDevice<double>({{0.0, above}, {0.2, in}, {0.4, in}, {4.4, high}}), skin(true), SuctionTip<double>({.radius = radius, .vacuum = vacuum}), TissueReaction{});
  double largest = 0;
  Recording const session = simulator.run(4.4);   // s, in lock-step
  for (Tick const& tick : session.ticks()) largest = std::max(largest, -tick.force.z());
  return largest;
}

}  // namespace

int main() try {
  auto const broken = testing::check_tool(SuctionTip<double>(), skin(false), {.motions = 10});
  bool all_as_expected = broken.empty();
  std::printf("laws of tools: %s\n", broken.empty() ? "kept" : testing::to_text(broken).c_str());
  for (double const vacuum : {5e3, 1e4})
    for (double const radius : {0.003, 0.004}) {
      double const found = drawn_off(radius, vacuum), closed_form = vacuum * std::numbers::pi * radius * radius;
      bool const good = std::abs(found - closed_form) < 0.01 * closed_form;
      all_as_expected = all_as_expected && good;
      std::printf("%.0f kPa in %.0f mm: drawn off with %.4f N, closed form %.4f N%s\n", vacuum / 1e3, radius * 1e3, found, closed_form, good ? "" : "   <- wrong");
    }
  std::printf(all_as_expected ? "all as expected\n" : "not as expected\n");
  return all_as_expected ? EXIT_SUCCESS : EXIT_FAILURE;
} catch (palpate::Error const& error) {
  std::printf("own_tool: %s\n", error.what());
  return EXIT_FAILURE;
}
