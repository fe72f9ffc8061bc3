// SPDX-License-Identifier: MIT
// A cutter of one's own in a simulator: a hand presses a biopsy punch into skin, and the plug is taken out, beside the closed forms of what that should give.
#include "biopsy_punch.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/force/indentation_spring.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace {

using namespace palpate;

bool all_as_expected = true;

void compare(char const* what, double found, double expected, double tolerance, char const* unit) {
  bool const good = std::abs(found - expected) <= tolerance * std::abs(expected);
  all_as_expected = all_as_expected && good;
  std::printf("%-46s %12.6g %s, closed form %12.6g%s\n", what, found, unit, expected, good ? "" : "   <- wrong");
}

/// Skin of 30 × 30 mm, in so many edges along a side, held at its border; nothing is below it.
auto skin(int edges) {
  auto const mesh = make_grid<double>(edges + 1, edges + 1, 0.03 / edges);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.001}, .link = {.stiffness = 5.0, .damping = 0.0005}});
  tissue.nail(boundary_vertices(mesh));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
}

template <class Body>
Vector3<double> middle(Body const& body) {
  Vector3<double> sum = Vector3<double>::Zero();
  for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * body.positions().col(i);
  return sum / body.total_mass();
}

}  // namespace

int main() try {
  double const radius = 0.004, pi = std::numbers::pi;
  Vector3<double> const above(0.0151, 0.0148, 0.002), in(0.0151, 0.0148, -0.0025);   // m
  BiopsyPunch<double> const punch({.radius = radius, .puncture_depth = 0.002});

  auto const broken = testing::check_cutter(punch, skin(20), {.way = {above, in, above}, .ticks = 10});
  all_as_expected = all_as_expected && broken.empty();
  std::printf("%-46s %s\n", "laws of cutters", broken.empty() ? "kept" : testing::to_text(broken).c_str());

  auto hand = Trajectory<double>::start(above);
  hand.line(in, 0.2).hold(0.05).line(above, 0.1);
  Simulator simulator(ScriptedDevice<double>(hand), skin(40), punch, IndentationSpring<double>{.stiffness = 300.0});
  Recording const session = simulator.run(0.4);   // s, in lock-step
  auto const& body = simulator.body();
  auto const pieces = connected_components(body.mesh());
  std::printf("%d particles and %d triangles more, largest force %.2f N\n", simulator.cutter().report().particles_added,
              simulator.cutter().report().triangles_added, session.largest_force());
  compare("pieces", static_cast<double>(pieces.size()), 2, 0, "  ");
  compare("rest area of all", surface_area(body.rest_mesh()), 0.03 * 0.03, 1e-12, "m²");
  compare("mass of all", body.total_mass(), 0.001, 1e-12, "kg");

  auto plug = part_of(body, pieces.back());
  auto const shape = plug.rest_mesh();
  double round = 0;
  for (auto const& [from, to] : boundary_edges(shape)) round += (shape.points.col(from) - shape.points.col(to)).norm();
  compare("rest area of the plug, a circle of 4 mm", surface_area(shape), pi * radius * radius, 0.02, "m²");
  compare("length of the cut, its circumference", round, 2 * pi * radius, 0.02, "m ");
  compare("mass of the plug, as its share of the area", plug.total_mass(), 0.001 * surface_area(shape) / (0.03 * 0.03), 0.02, "kg");

  // Nothing holds the plug: its middle falls freely.
  double const h = plug.stable_step() / 2, z = middle(plug).z();
  double momentum = 0;   // over its mass, m/s
  for (int i = 0; i < plug.size(); ++i) momentum += plug.tissue().mass(i) * plug.velocities()(2, i) / plug.total_mass();
  plug.set_gravity({0.0, 0.0, -9.81});
  int steps = 0;
  while (steps * h < 0.1) plug.step(h), ++steps;
  double const t = steps * h;
  compare("the plug falls for 0.1 s", middle(plug).z() - z, momentum * t - 9.81 / 2 * t * t, 1e-6, "m ");

  std::printf(all_as_expected ? "all as expected\n" : "not as expected\n");
  return all_as_expected ? EXIT_SUCCESS : EXIT_FAILURE;
} catch (palpate::Error const& error) {
  std::printf("own_cutter: %s\n", error.what());
  return EXIT_FAILURE;
}
