// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <utility>

/// What the tools of this folder are tested on: springs in explicit steps, finite elements in implicit ones.
namespace palpate_test {

/// A sheet of 70 mm at z = 0, nailed at its rim.
template <class S>
auto skin() {
  auto const mesh = palpate::make_grid<S>(15, 15, S(0.005));
  palpate::MassSpring<S> tissue(
      mesh, {.mass = {.total = S(0.1)}, .link = {.stiffness = S(60), .damping = S(0.02)}, .home = {.stiffness = S(6), .damping = S(0.05)}});
  tissue.nail(palpate::boundary_vertices(mesh));
  return palpate::SoftBody(std::move(tissue), palpate::LeapfrogVerlet{});
}

/// A block of 60 × 48 × 18 mm, nailed at the bottom.
template <class S, class Integrator = palpate::BackwardEuler>
auto block(bool nailed = true) {
  using namespace palpate;
  auto const mesh = make_block<S>(11, 9, 4, S(0.006), BlockPattern::alternating);
  FiniteElements<S, StableNeoHookean<S>> tissue(mesh, {.density = S(1060), .material = {.young = S(5e3), .poisson = S(0.4)}});
  if (nailed) tissue.nail(vertices_where(mesh, [](Vector3<S> const& p) { return p.z() < S(1e-6); }));
  return SoftBody(std::move(tissue), Integrator{});
}

}  // namespace palpate_test
