// SPDX-License-Identifier: MIT
// Pieces that nothing holds have no equilibrium; held where they are they disturb none. Yardstick: the piece that is nailed, alone.
#include "catch.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <cstddef>
#include <utility>

using namespace palpate;

TEST_CASE("free pieces are held, and statics has an equilibrium: what is nailed hangs as it does alone") {
  auto const bar = make_block<double>(6, 3, 3, 0.01, BlockPattern::alternating);
  int const n = static_cast<int>(bar.points.cols());
  auto const make = [&](int bars) {
    TetrahedralMesh<double> mesh{Matrix3X<double>(3, bars * n), Matrix<int, 4, Dynamic>(4, bars * bar.tetrahedra.cols())};
    for (int k = 0; k < bars; ++k) {
      mesh.points.middleCols(k * n, n) = bar.points.colwise() + Vector3<double>(0, 0.1 * k, 0);
      mesh.tetrahedra.middleCols(k * bar.tetrahedra.cols(), bar.tetrahedra.cols()) = bar.tetrahedra.array() + k * n;
    }
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {.young = 5e4, .poisson = 0.4}});
    for (int i = 0; i < n; ++i)
      if (bar.points(0, i) < 1e-9) tissue.nail(i);
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.set_gravity({0, 0, -9.81});
    return body;
  };
  auto body = make(3), alone = make(1);
  alone.settle(NewtonRaphson<>{}, 1e-8);
  body.hold(n + 7);   // the second bar hangs on a hand
  auto const rest = body.positions().eval();
  CHECK_THROWS_AS(body.settle(NewtonRaphson<>{}, 1e-8), Error);
  auto const held = hold_free_pieces(body);
  REQUIRE(held.size() == static_cast<std::size_t>(n));
  CHECK((held.front() == 2 * n && held.back() == 3 * n - 1));
  CHECK(hold_free_pieces(body).empty());
  for (int i = 0; i < 2 * n; ++i) REQUIRE(body.is_held(i) == (i == n + 7));
  body.release(n + 7);
  for (int i = 0; i < n; ++i)
    if (bar.points(0, i) < 1e-9) body.hold(n + i);   // and now like the first, by hands
  body.settle(NewtonRaphson<>{}, 1e-8);
  CHECK((alone.positions() - bar.points).colwise().norm().maxCoeff() > 1e-4);
  CHECK((body.positions().leftCols(n) - alone.positions()).colwise().norm().maxCoeff() < 1e-8);
  CHECK((body.positions().rightCols(n) - rest.rightCols(n)).isZero(0));
  for (int const i : held) body.release(i);
  REQUIRE(body.step(1e-3));
  CHECK(body.velocities().rightCols(n).rowwise().mean().z() == Approx(-9.81e-3).epsilon(1e-3));   // it falls, up to the tolerance of an implicit step
}
