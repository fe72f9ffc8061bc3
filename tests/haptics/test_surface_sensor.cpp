// SPDX-License-Identifier: MIT
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/surface_sensor.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace {

using namespace palpate;
constexpr double edge = 0.005, middle = 5 * edge + 0.0011;   // m; beside a vertex

/// A soft sheet that is pressed `depth` deep by a ball of this radius, from 3 mm above, in so many seconds.
template <class Force>
Recording pressed(Force const& force, double radius, double depth, double seconds, double rest) {
  auto const skin = make_grid<double>(11, 11, edge);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.1}, .link = {.stiffness = 20.0, .damping = 0.1}, .home = {.stiffness = 15.0, .damping = 0.2}});
  tissue.nail(boundary_vertices(skin));
  auto const path = Trajectory<double>::start({middle, middle, radius + 0.003}).line({middle, middle, radius - depth}, seconds).hold(rest);
  Simulator simulator(ScriptedDevice<double>(path, {.max_force = 100.0}), SoftBody(std::move(tissue)), NoCutter<double>({.tip_radius = radius}), force);
  return simulator.run(seconds + rest);
}

}  // namespace

TEST_CASE("a tool of any radius feels at rest what the tissue feels, on planes, balls and facets", "[haptics][surface_sensor]") {
  double const tissue = pressed(TissueReaction{}, 0.0, 0.010, 0.2, 0.3).ticks().back().force.norm();
  CHECK(tissue > 0.6);
  for (double const radius : {0.0, 0.005}) {
    CAPTURE(radius);
    CHECK(pressed(TissueReaction{}, radius, 0.010, 0.2, 0.3).ticks().back().force.norm() == Approx(tissue).epsilon(1e-9));   // so does the tissue itself
    // What a fit levels out of a dent of 10 mm in a mesh of 5 mm is what these are off.
    for (auto const& [kind, close] : {std::pair(SurfaceKind::ball, 0.02), {SurfaceKind::plane, 0.15}, {SurfaceKind::facets, 0.16}}) {
      CAPTURE(static_cast<int>(kind));
      double const felt = pressed(ProxyForce<double>({.surface = kind, .max_stiffness = 2000}), radius, 0.010, 0.2, 0.3).ticks().back().force.norm();
      CHECK(felt == Approx(tissue).epsilon(close));
    }
  }
}

TEST_CASE("what is sent of a surface before contact holds no tool, whatever its folds", "[haptics][surface_sensor]") {
  Random random(Seed{5});
  int sent = 0;
  for (int k = 0; k < 60; ++k) {
    auto mesh = make_grid<double>(9, 9, edge);
    for (Eigen::Index v = 0; v < mesh.points.cols(); ++v) mesh.points.col(v).z() += random.uniform(-0.004, 0.004);
    MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 20.0}, .home = {.stiffness = 15.0}});
    SoftBody body(std::move(tissue));
    SurfaceSensor<double> sensor(SurfaceKind::facets);
    for (int tick = 0; tick < 8; ++tick) {
      Vector3<double> const tip(random.uniform(0.01, 0.03), random.uniform(0.01, 0.03), random.uniform(0.0, 0.012));
      auto const& model = sensor.look(body, SurfaceContact<double>{}, CuttingPhase::no_contact, tip, 0.003, 500.0);
      if (model.planes.count() > 0) ++sent;
      REQUIRE(model.planes.project(tip).count == 0);
    }
  }
  CHECK(sent > 30);
}

TEST_CASE("a tool larger than its dent is pushed out of it without steps", "[haptics][surface_sensor]") {
  auto const recording = pressed(ProxyForce<double>({.surface = SurfaceKind::ball}), 0.010, 0.012, 0.5, 0.1);
  double step = 0.0, aside = 0.0;
  for (std::size_t i = 1; i < recording.ticks().size(); ++i) {
    auto const& tick = recording.ticks()[i];
    step = std::max(step, (tick.force - recording.ticks()[i - 1].force).norm());
    aside = std::max(aside, tick.force.head<2>().norm() - 0.25 * tick.force.norm());
  }
  CHECK(step < 0.02);    // N: 500 N/m times 0.03 mm that the tip moves in a tick is 0.015 N
  CHECK(aside < 0.01);   // it goes straight down
  CHECK(recording.ticks().back().force.z() > 0.15);   // a quarter of what the tissue feels, whose contact is four times as stiff
}
