// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/contact/obstacle.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/tissue/finite_elements.hpp>

namespace palpate_test {

using namespace palpate;

template <class S>
TriangleMesh<S> skin_of(TetrahedralMesh<S> const& solid) {
  auto skin = surface(solid);
  repair(skin);
  return skin;
}
/// A block whose lower corner is at `low`.
template <class S = double>
auto block(int nx, int ny, int nz, double edge, Vector3<double> const& low) {
  auto mesh = make_block<S>(nx, ny, nz, S(edge), BlockPattern::alternating);
  mesh.points.colwise() += low.cast<S>();
  return mesh;
}
template <class S = double>
Obstacle<S> table(double top = 0, double side = 0.3) {
  return Obstacle<S>(skin_of(block<S>(2, 2, 2, side, {-side / 2, -side / 2, top - side})));
}
template <class S, class Integrator>
auto solid(TetrahedralMesh<S> const& mesh, Integrator integrator, double young = 1e4, double drag = 0.5, double damping = 1e-3) {
  return SoftBody(FiniteElements<S, StableNeoHookean<S>>(mesh, {.density = S(1000), .material = {.young = S(young), .poisson = S(0.3)}, .damping = {.alpha = S(drag), .beta = S(damping)}}),
                  integrator);
}

}  // namespace palpate_test
