// SPDX-License-Identifier: MIT
// Where a body comes to rest. Yardsticks: closed forms of home springs and of a chain, Eigen's LDLᵀ for small loads, and the energy itself,
// whose gradient and minimum are found by differences and by trying.
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include <Eigen/Cholesky>

#include "catch.hpp"
#include "statics/solvers.hpp"

#include <cmath>
#include <concepts>
#include <string>
#include <vector>

using namespace palpate;
using palpate_test::Chain;
using palpate_test::for_each_solver;
using palpate_test::free_particles;
using palpate_test::rest_of;

static_assert(EquilibriumSolver<DynamicRelaxation, MassSpring<float>> && EquilibriumSolver<LocalRelaxation, MassSpring<double>> &&
              EquilibriumSolver<NewtonRaphson<>, MassSpring<double>> &&
              EquilibriumSolver<NewtonRaphson<TangentOverRelaxation>, Supported<MassSpring<float>>>);

TEMPLATE_TEST_CASE("a body on home springs sags by g m/k", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  MassSpring<S> const tissue(make_grid<S>(6, 5, S(0.01)), {.mass = {.total = S(0.03), .lumping = Lumping::equal},
                                                           .link = {.stiffness = S(20)}, .home = {.stiffness = S(5)}});
  auto const free = free_particles(tissue);
  S const tolerance = std::same_as<S, float> ? S(1e-8) : S(1e-10);   // float: two digits of the coordinates
  for_each_solver([&](char const* name, auto const& solver) {
    CAPTURE(name);
    Matrix3X<S> x = rest_of(tissue);
    auto const found = solver.solve(StaticProblem<MassSpring<S>>{.tissue = tissue, .free = free, .gravity = {S(0), S(1), S(-9.81)}, .tolerance = tolerance}, x);
    CHECK(found.converged);
    CHECK(found.imbalance <= tolerance);
    for (int i = 0; i < tissue.size(); ++i)
      CHECK((x.col(i) - tissue.rest_position(i) - Vector3<S>(S(0), S(1), S(-9.81)) * S(0.001 / 5)).norm() < (std::same_as<S, float> ? 2e-6 : 1e-7));
  });
}

TEMPLATE_TEST_CASE("a chain of springs hangs as its closed form says", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::vector<S> const stiffness{S(3), S(8), S(2), S(20), S(5), S(1), S(4)};
  Chain<S> const chain(stiffness);
  auto const free = free_particles(chain);
  Matrix3X<S> applied = Matrix3X<S>::Zero(3, 8);
  applied.col(7) << S(0.5), S(0.1), S(0);
  applied.col(3) << S(-0.2), S(0), S(0.4);
  Vector3<S> const gravity(S(1), S(0), S(-2));
  for_each_solver([&](char const* name, auto const& solver) {
    CAPTURE(name);
    Matrix3X<S> x = rest_of(chain);
    auto const found = solver.solve(StaticProblem<Chain<S>>{.tissue = chain, .free = free, .gravity = gravity, .applied = applied,
                                                            .tolerance = std::same_as<S, float> ? S(2e-6) : S(1e-11)}, x);
    CHECK(found.converged);
    Vector3<double> u = Vector3<double>::Zero();
    for (int i = 0; i < 7; ++i) {
      Vector3<double> carried = Vector3<double>::Zero();
      for (int j = i + 1; j < 8; ++j) carried += (applied.col(j) + S(0.1) * gravity).template cast<double>();
      u += carried / double(stiffness[static_cast<std::size_t>(i)]);
      CHECK(((x.col(i + 1) - chain.rest_position(i + 1)).template cast<double>() - u).norm() < (std::same_as<S, float> ? 2e-3 : 1e-8));
    }
    CHECK(x.col(0) == chain.rest_position(0));
  });
}

TEST_CASE("under small loads it is K u = f") {
  MassSpring<double> tissue(make_sphere<double>(0.05, 4), {.link = {.stiffness = 80.0}, .home = {.stiffness = 2.0}});
  tissue.nail({0, 5, 9});
  auto const free = free_particles(tissue);
  int const n = tissue.size();
  Matrix3X<double> const rest = rest_of(tissue);
  Random random(Seed{4});
  Matrix3X<double> applied(3, n);
  for (int k = 0; k < 3 * n; ++k) applied.data()[k] = random.uniform(-1e-6, 1e-6);
  // Every column of K by itself, the nailed ones struck out.
  Eigen::MatrixXd matrix(3 * free.size(), 3 * free.size());
  Eigen::VectorXd load(3 * free.size());
  for (std::size_t c = 0; c < free.size(); ++c)
    for (int axis = 0; axis < 3; ++axis) {
      Matrix3X<double> unit = Matrix3X<double>::Zero(3, n), y = unit;
      unit(axis, free[c]) = 1;
      tissue.add_stiffness_product(rest, unit, y);
      auto const column = static_cast<Eigen::Index>(3 * c) + axis;
      for (std::size_t r = 0; r < free.size(); ++r) matrix.col(column).segment<3>(static_cast<Eigen::Index>(3 * r)) = y.col(free[r]);
      load[column] = applied(axis, free[c]);
    }
  Eigen::VectorXd const u = matrix.ldlt().solve(load);
  for_each_solver([&](char const* name, auto const& solver) {
    CAPTURE(name);
    Matrix3X<double> x = rest;
    auto const found = solver.solve(StaticProblem<MassSpring<double>>{.tissue = tissue, .free = free, .applied = applied, .tolerance = 1e-14}, x);
    CHECK(found.converged);
    double error = 0;
    for (std::size_t k = 0; k < free.size(); ++k)
      error = std::max(error, (x.col(free[k]) - rest.col(free[k]) - u.segment<3>(static_cast<Eigen::Index>(3 * k))).norm());
    CHECK(error < 1e-3 * u.cwiseAbs().maxCoeff());   // u/L = 1e-5 of an edge is left to second order
    CHECK(x.col(5) == rest.col(5));
  });
}

namespace {

/// The positions that each solver finds have no gradient, agree, and no small displacement lowers their energy.
template <class Tissue>
void check_minimum(Tissue const& tissue, Matrix3X<double> const& applied, double size) {
  auto const free = free_particles(tissue);
  Matrix3X<double> const start = rest_of(tissue);
  Matrix3X<double> first;
  for_each_solver([&](char const* name, auto const& solver) {
    CAPTURE(name);
    Matrix3X<double> x = start;
    auto const found = solver.solve(StaticProblem<Tissue>{.tissue = tissue, .free = free, .applied = applied, .tolerance = 1e-10 * size}, x);
    REQUIRE(found.converged);
    auto const energy = [&](Matrix3X<double> const& at) { return tissue.potential_energy(at) - applied.cwiseProduct(at).sum(); };
    if (first.cols() == 0) {
      first = x;
      CHECK((x - start).cwiseAbs().maxCoeff() > 0.2 * size);   // far from linear
    }
    CHECK((x - first).cwiseAbs().maxCoeff() < 1e-5 * size);
    Random random(Seed{9});
    double const lowest = energy(x);
    for (int trial = 0; trial < 300; ++trial) {
      Matrix3X<double> other = x;
      double const width = size * std::pow(10.0, random.uniform(-4.0, -1.0));
      bool const one = trial % 2 == 0;   // one particle, or all
      int const chosen = free[static_cast<std::size_t>(random.below(free.size()))];
      for (int const i : free)
        if (!one || i == chosen)
          for (int a = 0; a < 3; ++a) other(a, i) += random.uniform(-width, width);
      if (energy(other) < lowest) FAIL("a displacement of " << width << " lowers the energy by " << lowest - energy(other));
    }
    double steepest = 0;
    for (int const i : {free.front(), free[free.size() / 2], free.back()})
      for (int a = 0; a < 3; ++a) {
        Matrix3X<double> ahead = x, behind = x;
        double const step = 1e-5 * size;
        ahead(a, i) += step, behind(a, i) -= step;
        steepest = std::max(steepest, std::abs(energy(ahead) - energy(behind)) / (2 * step));
      }
    CHECK(steepest < 1e-5 * applied.cwiseAbs().maxCoeff());
  });
}

}  // namespace

TEST_CASE("all solvers find the same minimum of energy far from rest") {
  SECTION("a skin on home springs, pulled and pushed") {
    MassSpring<double> const skin(make_grid<double>(7, 6, 0.01), {.link = {.stiffness = 50.0}, .home = {.stiffness = 5.0}});
    Matrix3X<double> applied = Matrix3X<double>::Zero(3, 42);
    applied.col(17) << 0.05, 0.0, -0.4;
    applied.col(24) << 0.0, 0.3, 0.1;
    check_minimum(skin, applied, 0.01);
  }
  SECTION("a flat sheet on its border alone: its tangent is singular at the start") {
    auto const mesh = make_grid<double>(7, 7, 0.01);
    MassSpring<double> sheet(mesh, {.link = {.stiffness = 50.0}});
    sheet.nail(boundary_vertices(mesh));
    Matrix3X<double> applied = Matrix3X<double>::Zero(3, 49);
    for (int i = 0; i < 49; ++i)
      if (!sheet.nailed(i)) applied.col(i) << 0.0, 0.001 * i, -0.1;
    check_minimum(sheet, applied, 0.01);
  }
  SECTION("locking springs in a block, squeezed") {
    MassSpring<double, LockingSpring<double>> block(make_block<double>(3, 3, 4, 0.01), {.link = {.stiffness = 50.0, .largest_tension = 0.4}});
    for (int i = 0; i < 9; ++i) block.nail(i);
    Matrix3X<double> applied = Matrix3X<double>::Zero(3, 36);
    for (int i = 27; i < 36; ++i) applied.col(i) << 0.05, 0.02, 0.15;
    check_minimum(block, applied, 0.01);
  }
  SECTION("cubic springs in a block that is drawn out by a corner") {   // there they are a hundred times as stiff as at rest
    MassSpring<double, CubicSpring<double>> block(make_block<double>(6, 4, 4, 0.01, BlockPattern::alternating), {.link = {.stiffness = 50.0, .cubic = 2e6}});
    for (int i = 0; i < 24; ++i) block.nail(i);
    Matrix3X<double> applied = Matrix3X<double>::Zero(3, 96);
    applied.col(95) << 6.3, 4.4, 6.3;
    check_minimum(block, applied, 0.01);
  }
  SECTION("cubic springs in a supported ball") {
    using Tissue = Supported<MassSpring<double, CubicSpring<double>>>;
    Tissue const ball(MassSpring<double, CubicSpring<double>>(make_sphere<double>(0.05, 4), {.link = {.stiffness = 20.0, .cubic = 3e5}, .home = {.stiffness = 5.0}}),
                      {.stiffness = 10.0});
    Matrix3X<double> applied = Matrix3X<double>::Zero(3, ball.size());
    applied.col(0) << 0.0, 0.2, 1.0;
    applied.col(20) << -0.5, 0.2, 0.0;
    check_minimum(ball, applied, 0.01);
  }
}
