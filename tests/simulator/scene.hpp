// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <utility>

namespace palpate_test {

/// The patch of skin of golden program 05, 10 cm × 10 cm, its border nailed.
template <class S, class Region>
auto skin(Region region) {
  auto const mesh = palpate::make_grid<S>(21, 21, S(0.005));
  palpate::MassSpring<S> tissue(mesh, {.mass = {.total = S(0.1)},
                                       .link = {.stiffness = S(80), .damping = S(0.2)},
                                       .home = {.stiffness = S(8), .damping = S(0.1)}});
  tissue.nail(palpate::boundary_vertices(mesh));
  return palpate::SoftBody(std::move(tissue), palpate::LeapfrogVerlet{}, region);
}

/// Down onto the skin and into it, along, and out again; `share` of the durations of golden program 05.
template <class S>
palpate::Trajectory<S> stroke(double depth = 0.010, double share = 1.0) {
  auto const at = [](double x, double z) { return palpate::Vector3<S>(S(x), S(0.0533), S(z)); };
  auto path = palpate::Trajectory<S>::start(at(0.0312, 0.002));
  path.line(at(0.0312, -depth), 1.0 * share).line(at(0.0712, -depth), 2.0 * share).line(at(0.0712, 0.010), 0.6 * share);
  return path;
}

}  // namespace palpate_test
