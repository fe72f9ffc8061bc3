// SPDX-License-Identifier: MIT
// OnCores: a body on several cores. Yardstick: the same body on one, byte by byte.
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/parallel/on_cores.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/element_tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include "tissue/user_elements.hpp"

#include <cmath>
#include <utility>

using namespace palpate;

namespace {

template <class Body>
void live(Body& body) {
  for (int step = 0; step < 200; ++step) {
    for (int i = 5; i < body.size(); i += 53) body.apply_force(i, {0.01 * std::sin(0.2 * step + i), 0.0, 0.03});
    REQUIRE(body.step(1e-4));
  }
}

}  // namespace

TEST_CASE("a body on several cores moves as on one, to the bit") {
  auto const tissue = [] {
    return MassSpring<double>(make_grid<double>(100, 100, 0.005), {.mass = {.total = 3.0}, .link = {.stiffness = 100.0, .damping = 0.02}, .home = {.stiffness = 10.0}});
  };
  SoftBody alone(tissue(), LeapfrogVerlet{}, WholeBody{});
  live(alone);
  CHECK(alone.kinetic_energy() > 0);
  for (int const cores : {1, 2, 5}) {
    SoftBody together(tissue(), LeapfrogVerlet{}, WholeBody{}, OnCores(cores));
    live(together);
    CHECK(together.positions() == alone.positions());
    CHECK(together.velocities() == alone.velocities());
    auto copy = together;   // shares the threads
    CHECK(copy.step(1e-4));
  }
}

TEST_CASE("so does tissue with support springs, and tissue of a user's elements") {
  auto const same_on_two = [](auto const& tissue) {
    SoftBody alone(tissue, LeapfrogVerlet{}, WholeBody{});
    SoftBody together(tissue, LeapfrogVerlet{}, WholeBody{}, OnCores(2));
    live(alone), live(together);
    CHECK(alone.kinetic_energy() > 0);
    CHECK(together.positions() == alone.positions());
    CHECK(together.velocities() == alone.velocities());
  };
  MassSpring<double> const sheet(make_grid<double>(80, 80, 0.005), {.mass = {.total = 3.0}, .link = {.stiffness = 100.0, .damping = 0.02}, .home = {.stiffness = 10.0}});
  same_on_two(Supported(sheet, LinearSpring<double>{.stiffness = 20.0}, {0.2, 0.2, -0.2}));
  auto const block = make_block<double>(17, 17, 15, 0.01);
  same_on_two(ElementTissue(block, make_elements(block.points, block.tetrahedra, [](auto const& rest) {
                              return palpate_test::UserTetrahedron<double>(rest, 3000.0, 0.3);
                            })));
  same_on_two(FiniteElements<double, StableNeoHookean<double>>(block, {.density = 1000.0, .material = {.young = 3000.0, .poisson = 0.3}}));
  SoftBody cut(MassSpring<double>(block, {.mass = {.total = 3.0}, .link = {.stiffness = 30.0, .damping = 0.02}}), LeapfrogVerlet{}, WholeBody{});
  VolumeCutter<double> knife;
  for (double const y : {-0.01, 0.04, 0.08}) knife.advance(cut, {{0.0813, y, 0.05}, {0.0813, y, 0.2}});
  REQUIRE(cut.size() > block.points.cols() + 50);
  same_on_two(cut.tissue());
  same_on_two(FiniteElements<double, StableNeoHookean<double>>(
      block, {.density = 1000.0, .material = {.young = 3000.0, .poisson = 0.45}, .damping = {.alpha = 1.0, .beta = 1e-4}, .pressure = Pressure::nodal}));
}

TEST_CASE("implicit steps of solids on several cores are those on one, to the bit") {
  auto const block = make_block<double>(17, 17, 15, 0.01, BlockPattern::alternating);   // 4,335 particles, two blocks
  for (auto const& [pressure, stiffness] : {std::pair{Pressure::element, Stiffness::matrix_free}, {Pressure::nodal, Stiffness::matrix_free}, {Pressure::element, Stiffness::assembled}}) {
    FiniteElements<double, StableNeoHookean<double>> tissue(
        block, {.density = 1000.0, .material = {.young = 3000.0, .poisson = 0.45}, .damping = {.beta = 1e-3}, .pressure = pressure, .stiffness = stiffness});
    tissue.nail(0);
    SoftBody alone(tissue, BackwardEuler{.tolerance = 1e-6, .max_iterations = 60}, WholeBody{});
    SoftBody together(tissue, BackwardEuler{.tolerance = 1e-6, .max_iterations = 60}, WholeBody{}, OnCores(2));
    for (int step = 0; step < 3; ++step) {
      for (int i = 5; i < alone.size(); i += 53) alone.apply_force(i, {0.01, 0.0, 0.03}), together.apply_force(i, {0.01, 0.0, 0.03});
      auto const one = alone.step(5e-3), two = together.step(5e-3);
      REQUIRE(one);
      REQUIRE(two);
      CHECK(one.solve.iterations == two.solve.iterations);
      CHECK(one.solve.iterations > 3);
      CHECK(together.positions() == alone.positions());
      CHECK(together.velocities() == alone.velocities());
    }
  }
}

TEST_CASE("no cores are refused") {
  CHECK_THROWS_WITH(OnCores(0), says("a body on 0 cores", "at least 1"));
  CHECK_THROWS_AS(OnCores(-3), InvalidArgument);
}
