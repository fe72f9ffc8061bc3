// SPDX-License-Identifier: MIT
// Bodies of meshes that are numbered without regard to place, as those from files. Yardstick: the same mesh numbered row by row, moved by the same forces; and what
// neighbours are apart in the order, counted here.
#include "catch.hpp"

#include <palpate/body/particle_order.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <random>
#include <vector>

using namespace palpate;

namespace {

template <class S>
using Solid = FiniteElements<S, StableNeoHookean<S>>;

constexpr int side = 11;   // 1,331 particles, 5,000 tetrahedra
constexpr double edge = 0.005;

/// number[i]: what particle i of the mesh becomes.
std::vector<int> at_random(int count) {
  std::vector<int> number(static_cast<std::size_t>(count));
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), std::mt19937(5));
  return number;
}

template <class Mesh>
Mesh renumbered(Mesh const& mesh, std::vector<int> const& number) {
  Mesh made = mesh;
  for (std::size_t i = 0; i < number.size(); ++i) made.points.col(number[i]) = mesh.points.col(static_cast<Eigen::Index>(i));
  for (auto& corner : made.elements().reshaped()) corner = number[static_cast<std::size_t>(corner)];
  return made;
}

template <class S>
TetrahedralMesh<S> block() {
  return make_block<S>(side, side, side, S(edge), BlockPattern::alternating);
}
template <class S>
Solid<S> nailed(TetrahedralMesh<S> const& mesh) {
  Solid<S> tissue(mesh, {.density = S(1000), .material = {.young = S(5000), .poisson = S(0.45)}, .damping = {.alpha = S(1), .beta = S(1e-4)}});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < S(1e-6); }));
  return tissue;
}

/// How far apart neighbours are, in the mean, where particles are taken in this order; in units of n^(2/3).
template <class Tissue>
double apart(Tissue const& tissue, std::vector<int> const& order) {
  std::vector<int> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
  double sum = 0, count = 0;
  for (int i = 0; i < tissue.size(); ++i) tissue.for_each_neighbour(i, [&](int j) { sum += std::abs(place[static_cast<std::size_t>(i)] - place[static_cast<std::size_t>(j)]), ++count; });
  return sum / count / std::pow(tissue.size(), 2.0 / 3);
}

template <class Tissue>
std::vector<int> ordered(Tissue const& tissue) {
  detail::ParticleOrder order;
  order.find(tissue);
  std::vector<int> all(static_cast<std::size_t>(tissue.size()));
  std::iota(all.begin(), all.end(), 0);
  order.sort(all);
  return all;
}

/// Two bodies of the same tissue, otherwise numbered, that are pushed at one place and weighed down: where they differ most, in edges.
template <class Body>
double difference(Body& rows, Body& otherwise, std::vector<int> const& number, int steps, double h) {
  using S = typename Body::Scalar;
  double most = 0;
  for (auto* body : {&rows, &otherwise}) body->set_gravity({0, S(-9.81), 0});
  int const pushed = rows.size() - 40;
  for (int k = 0; k < steps; ++k) {
    rows.apply_force(pushed, {S(0.02), 0, S(-0.05)}), otherwise.apply_force(number[static_cast<std::size_t>(pushed)], {S(0.02), 0, S(-0.05)});
    REQUIRE(rows.step(S(h)));
    REQUIRE(otherwise.step(S(h)));
  }
  for (int i = 0; i < rows.size(); ++i) most = std::max(most, double((rows.positions().col(i) - otherwise.positions().col(number[static_cast<std::size_t>(i)])).norm()) / edge);
  REQUIRE((rows.positions().col(pushed) - rows.tissue().rest_position(pushed)).norm() > S(0.02 * edge));
  return most;
}

}  // namespace

TEST_CASE("particles are computed by number where neighbours have numbers that are close, else row by row", "[body][order]") {
  auto const rows = nailed(block<double>());
  std::vector<int> by_number(static_cast<std::size_t>(rows.size()));
  std::iota(by_number.begin(), by_number.end(), 0);
  CHECK(ordered(rows) == by_number);
  auto const mixed = nailed(renumbered(block<double>(), at_random(rows.size())));
  CHECK(apart(mixed, by_number) > 3);
  CHECK(apart(mixed, ordered(mixed)) < 0.7);
  CHECK(apart(mixed, ordered(mixed)) < 1.2 * apart(rows, by_number));

  auto const grid = make_grid<double>(100, 100, 0.005);
  MassSpring<double> const sheet(grid, {.mass = {.total = 1}, .link = {.stiffness = 100}}), shaken(renumbered(grid, at_random(10000)), {.mass = {.total = 1}, .link = {.stiffness = 100}});
  auto const in_rows = ordered(sheet);
  CHECK(std::is_sorted(in_rows.begin(), in_rows.end()));
  CHECK(apart(shaken, ordered(shaken)) < 0.3);   // 100 is 0.22 n^(2/3)

  auto const one = make_block<double>(2, 2, 2, 0.01);   // too small to matter, and nothing to divide by
  CHECK(ordered(Solid<double>(one, {.density = 1000, .material = {.young = 5000, .poisson = 0.45}})).size() == 8);
}

TEMPLATE_TEST_CASE("a body moves the same however its particles are numbered", "[body][order]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = block<S>();
  auto const number = at_random(side * side * side);
  auto const other = renumbered(mesh, number);
  double const digits = std::is_same_v<S, float> ? 2e-3 : 1e-10;
  {
    INFO("leapfrog");
    SoftBody rows(nailed(mesh), LeapfrogVerlet{}, WholeBody{}), mixed(nailed(other), LeapfrogVerlet{}, WholeBody{});
    CHECK(std::abs(mixed.stable_step() / rows.stable_step() - 1) < S(0.01));   // of a power iteration that begins otherwise
    CHECK(difference(rows, mixed, number, 100, 2e-4) < digits);
  }
  {
    INFO("backward Euler");
    BackwardEuler const integrator{.tolerance = std::is_same_v<S, float> ? 1e-5 : 1e-13, .max_iterations = 2000};
    SoftBody rows(nailed(mesh), integrator, WholeBody{}), mixed(nailed(other), integrator, WholeBody{});
    CHECK(difference(rows, mixed, number, 5, 2e-3) < digits);
  }
  {
    INFO("a zone");
    SoftBody rows(nailed(mesh), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 4}), mixed(nailed(other), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 4});
    CHECK(difference(rows, mixed, number, 50, 2e-4) < digits);
  }
  {
    INFO("at rest");
    SoftBody rows(nailed(mesh), LeapfrogVerlet{}, WholeBody{}), mixed(nailed(other), LeapfrogVerlet{}, WholeBody{});
    for (auto* body : {&rows, &mixed}) body->set_gravity({0, S(-9.81), 0}), body->settle();
    double most = 0;
    for (int i = 0; i < rows.size(); ++i) most = std::max(most, double((rows.positions().col(i) - mixed.positions().col(number[static_cast<std::size_t>(i)])).norm()) / edge);
    CHECK(most < (std::is_same_v<S, float> ? 1e-2 : 1e-4));   // to the tolerance of the search
    CHECK((rows.positions() - mesh.points).colwise().norm().maxCoeff() > S(0.02 * edge));
  }
}

TEST_CASE("a body that is numbered anyhow is cut, saved and restored to the byte", "[body][order][cutting]") {
  auto const mesh = renumbered(block<double>(), at_random(side * side * side));
  auto const make = [&] { return SoftBody(nailed(mesh), LeapfrogVerlet{}, WholeBody{}); };
  auto body = make();
  body.set_gravity({0, 0, -9.81});
  VolumeCutter<double> knife;
  double const wide = edge * (side - 1);
  auto const cut = [&](auto& it, VolumeCutter<double>& blade, int k) {
    double const x = 0.002 + wide * k / 40;
    blade.advance(it, {{x, -0.01, 0.7 * wide}, {x, wide + 0.01, 0.7 * wide}});
    REQUIRE(it.step(1e-4));
  };
  for (int k = 0; k < 10; ++k) cut(body, knife, k);
  REQUIRE(body.size() > side * side * side);
  auto const saved = body.save();
  VolumeCutter<double> const then = knife;
  for (int k = 10; k < 20; ++k) cut(body, knife, k);
  double const stable_step = body.stable_step();   // which begins the next search where it ends
  // In one of a mesh that was in order, and in one of another size: they take the other's order and measures.
  for (auto const& other : {block<double>(), make_block<double>(4, 4, 4, edge / 3, BlockPattern::alternating)}) {
    SoftBody copy(nailed(other), LeapfrogVerlet{}, WholeBody{});
    copy.restore(saved);
    VolumeCutter<double> another = then;
    another.resume(copy);
    for (int k = 10; k < 20; ++k) cut(copy, another, k);
    REQUIRE(copy.size() == body.size());
    CHECK(copy.mean_edge() == body.mean_edge());
    CHECK(copy.positions() == body.positions());
    CHECK(copy.velocities() == body.velocities());
    CHECK(copy.stable_step() == stable_step);
  }
}
