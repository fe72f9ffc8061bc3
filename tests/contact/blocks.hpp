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

#include <cmath>
#include <numbers>

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
/// A bar of square cross-section, `side` wide, bent to a coil: once round it is `rise` higher and `spread` farther out.
inline TetrahedralMesh<double> coil(int across, int segments, double turns, double radius, double side, double rise, double spread) {
  auto bar = make_block<double>(segments + 1, across + 1, across + 1, 1.0, BlockPattern::alternating);
  for (Eigen::Index i = 0; i < bar.points.cols(); ++i) {
    Vector3<double> const p = bar.points.col(i);
    double const round = turns * p[0] / segments, angle = 2 * std::numbers::pi * round;
    double const out = radius + spread * round + side * (0.5 - p[1] / across);
    bar.points.col(i) << out * std::cos(angle), out * std::sin(angle), rise * round + side * (p[2] / across - 0.5);
  }
  return bar;
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

/// From now on a particle has this velocity.
template <class Body>
void throw_particle(Body& body, int i, Vector3<double> const& velocity) {
  body.drag(i, Vector3<double>(body.positions().col(i)), velocity);
  body.release(i);
}
template <class Body>
Vector3<double> momentum(Body const& body) {
  Vector3<double> sum = Vector3<double>::Zero();
  for (int i = 0; i < body.size(); ++i) sum += double(body.tissue().mass(i)) * Vector3<typename Body::Scalar>(body.velocities().col(i)).template cast<double>();
  return sum;
}
template <class Body>
Vector3<double> middle(Body const& body) {
  Vector3<double> sum = Vector3<double>::Zero();
  double mass = 0;
  for (int i = 0; i < body.size(); ++i) {
    double const m = double(body.tissue().mass(i));
    sum += m * Vector3<typename Body::Scalar>(body.positions().col(i)).template cast<double>(), mass += m;
  }
  return sum / mass;
}

}  // namespace palpate_test
