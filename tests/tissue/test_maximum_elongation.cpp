// SPDX-License-Identifier: MIT
// Provot's limit. Yardsticks: one link by hand, every link's length after a pass, and momentum and centre of mass before it.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/maximum_elongation.hpp>
#include <palpate/tissue/supported.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

using namespace palpate;

namespace {

template <class S, class Tissue>
ElongationReport<S> pass(MaximumElongation const& limit, Tissue const& tissue, Matrix3X<S>& x) {
  std::vector<int> all(static_cast<std::size_t>(tissue.size()));
  std::iota(all.begin(), all.end(), 0);
  return limit.correct(tissue, all, [&](int i) { return tissue.nailed(i) ? S(0) : 1 / tissue.mass(i); }, x,
                       [&](int i, Vector3<S> const& shift) { x.col(i) += shift; });
}

/// The largest |d|/L − 1 of all links with a free end.
template <class Tissue, class X>
double largest_strain(Tissue const& tissue, X const& x) {
  double most = -1;
  for (int l = 0; l < tissue.links().size(); ++l) {
    auto const& link = tissue.links()[l];
    if (tissue.nailed(link.a) && tissue.nailed(link.b)) continue;
    most = std::max(most, double((x.col(link.a) - x.col(link.b)).norm()) / double(link.rest_length) - 1);
  }
  return most;
}

TriangleMesh<double> one_triangle() {
  TriangleMesh<double> mesh{Matrix3X<double>(3, 3), Matrix<int, 3, Dynamic>(3, 1)};
  mesh.points << 0, 1, 0, 0, 0, 1, 0, 0, 0;
  mesh.triangles << 0, 1, 2;
  return mesh;
}

}  // namespace

TEST_CASE("a link that is too long is shortened by inverse mass, or from its free end alone") {
  MassSpring<double> tissue(one_triangle(), {});
  tissue.set_mass(0, 1.0);
  tissue.set_mass(1, 3.0);
  Matrix3X<double> x = one_triangle().points;
  x(0, 1) = 1.5;              // the link 0–1 is 1.5 m long, 1.1 m are allowed
  x.col(2) << 0.5, 0.9, 0.0;   // near enough to both
  Matrix3X<double> const before = x;
  SECTION("both ends free: three quarters by the end of a third of the mass") {
    auto const report = pass<double>({.limit = 0.1, .sweeps = 2}, tissue, x);
    CHECK(report.satisfied);
    CHECK(report.sweeps == 2);
    CHECK(x(0, 0) == Approx(0.3));
    CHECK(x(0, 1) == Approx(1.4));
  }
  SECTION("one end nailed") {
    tissue.nail(0);
    CHECK_FALSE(pass<double>({.limit = 0.1, .sweeps = 1}, tissue, x).satisfied);
    CHECK(x.col(0) == before.col(0));
    CHECK(x(0, 1) == Approx(1.1));
  }
  SECTION("both ends nailed") {
    tissue.nail({0, 1});
    CHECK(pass<double>({.limit = 0.1}, tissue, x).satisfied);   // nothing that can move is too long
    CHECK(x.leftCols(2) == before.leftCols(2));
  }
  CHECK(x.col(2) == before.col(2));
  CHECK(x.bottomRows(2) == before.bottomRows(2));
}

TEMPLATE_TEST_CASE("a pass leaves no link longer than the limit, and the centre of mass where it was", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  MassSpring<S> tissue(make_grid<S>(9, 8, S(0.01)), {});
  Random random(Seed{5});
  for (int i = 0; i < tissue.size(); ++i) tissue.set_mass(i, S(random.uniform(0.5, 2.0)));
  Matrix3X<S> x = tissue.rest_positions();
  for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] += S(random.uniform(-0.003, 0.003));
  auto const centre = [&] {
    Vector3<double> sum = Vector3<double>::Zero();
    for (int i = 0; i < tissue.size(); ++i) sum += double(tissue.mass(i)) * x.col(i).template cast<double>();
    return sum;
  };
  Vector3<double> const before = centre();
  REQUIRE(largest_strain(tissue, x) > 0.3);
  auto const report = pass<S>({.limit = 0.1, .sweeps = 200, .tolerance = 1e-3}, tissue, x);
  CAPTURE(report.sweeps);
  CHECK(report.satisfied);
  CHECK(report.sweeps < 30);
  CHECK(largest_strain(tissue, x) <= 0.101 + 1e-5);
  CHECK((centre() - before).norm() < (std::same_as<S, float> ? 1e-5 : 1e-13));
}

TEST_CASE("a strip pulled out between its nails obeys where it can and is reported where it can not") {
  MassSpring<double> tissue(make_grid<double>(12, 2, 0.01), {});
  tissue.nail({0, 12, 11, 23});
  Matrix3X<double> x = tissue.rest_positions();
  for (int const i : {11, 23}) x(0, i) += 0.005;   // 4.5 % of the length, all of it in the last links
  auto const slow = pass<double>({.limit = 0.1, .sweeps = 2}, tissue, x);
  CHECK_FALSE(slow.satisfied);
  auto const done = pass<double>({.limit = 0.1, .sweeps = 1000}, tissue, x);
  CHECK(done.satisfied);
  CHECK(done.sweeps < 100);
  CHECK(largest_strain(tissue, x) <= 0.101 + 1e-9);
  for (int const i : {11, 23}) x(0, i) += 0.02;   // 22 %: more than 10 % each can give
  auto const impossible = pass<double>({.limit = 0.1, .sweeps = 2000}, tissue, x);
  CHECK_FALSE(impossible.satisfied);
  CHECK(impossible.largest > 0.2);
  CHECK(x.allFinite());
}

TEST_CASE("a body corrected after each step keeps its limit, and momentum when it is free") {
  auto const hang = [](bool limited) {
    MassSpring<double> tissue(make_grid<double>(6, 6, 0.01), {.mass = {.total = 0.05}, .link = {.stiffness = 5.0, .damping = 0.02}, .home = {.damping = 0.01}});
    tissue.nail({30, 31, 32, 33, 34, 35});
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
    body.set_gravity({0.0, -9.81, 0.0});
    double most = 0;
    for (int k = 0; k < 4000; ++k) {
      REQUIRE(body.step(5e-4));
      if (limited) body.correct(MaximumElongation{.limit = 0.1});
      most = std::max(most, largest_strain(body.tissue(), body.positions()));
    }
    CAPTURE(limited);
    CHECK(body.kinetic_energy() < 1e-6);   // it hangs still: the corrections do not make it tremble
    return most;
  };
  CHECK(hang(false) > 1.0);    // super-elastic: the top row carries all
  CHECK(hang(true) < 0.103);

  SoftBody flying(MassSpring<double>(make_grid<double>(6, 5, 0.01), {.mass = {.total = 0.05}, .link = {.stiffness = 5.0}}), LeapfrogVerlet{}, WholeBody{});
  flying.apply_force(7, {3.0, 1.0, 5.0});
  flying.apply_force(20, {-1.0, 1.0, 2.0});
  flying.step(2e-3);
  Vector3<double> const momentum = flying.momentum();
  double const energy = flying.kinetic_energy();
  bool corrected = false;
  for (int k = 0; k < 200; ++k) {
    corrected = corrected || largest_strain(flying.tissue(), flying.positions()) > 0.1;
    flying.correct(MaximumElongation{.limit = 0.1});
    flying.step(2e-3);
  }
  CHECK(corrected);
  CHECK((flying.momentum() - momentum).norm() < 1e-12 * momentum.norm());
  CHECK(flying.kinetic_energy() < energy);
}

TEST_CASE("in a zone only what moves is corrected, and a body that never stepped stays at rest") {
  SoftBody body(MassSpring<double>(make_grid<double>(15, 15, 0.01), {.link = {.stiffness = 5.0, .damping = 0.01}, .home = {.stiffness = 0.1}}),
                LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  auto const untouched = body.correct(MaximumElongation{});
  CHECK(untouched.satisfied);
  CHECK(body.velocities().isZero(0));
  auto const rest = body.positions().eval();
  for (int k = 0; k < 50; ++k) {
    body.apply_force(112, {0.0, 0.0, -1.0});
    REQUIRE(body.step(1e-3).moving >= 7);
    body.correct(MaximumElongation{.limit = 0.05, .sweeps = 100});
  }
  CHECK(body.displacement(112).z() < -1e-3);
  CHECK((body.positions().col(0) - rest.col(0)).norm() == 0);
  CHECK(largest_strain(body.tissue(), body.positions()) < 0.052);
}

TEST_CASE("a correction does not allocate, and supported tissue does not after its first step") {
  REQUIRE(palpate_test::trap_works());
  SoftBody body(Supported(MassSpring<double>(make_grid<double>(15, 15, 0.01), {.link = {.stiffness = 5.0, .damping = 0.01}, .home = {.stiffness = 0.1}}),
                          LinearSpring<double>{.stiffness = 0.1}, {0.07, 0.07, -0.1}),
                LeapfrogVerlet{}, WholeBody{});
  auto const tick = [&] {
    body.apply_force(112, {0.0, 0.0, -1.0});
    body.step(1e-3);
    return body.correct(MaximumElongation{.limit = 0.02});
  };
  tick();
  palpate_test::AllocationCount const allocations;
  int sweeps = 0;
  for (int k = 0; k < 20; ++k) sweeps += tick().sweeps;
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(sweeps > 20);
}
