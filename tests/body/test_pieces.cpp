// SPDX-License-Identifier: MIT
// A piece taken out goes on as it would have in the whole. Yardstick: the whole body, of which the piece is a part that nothing holds: the two
// compute the same sums in another order of particles.
#include <palpate/body/pieces.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace palpate;

namespace {

template <class Region>
auto cut_in_two(Region region) {
  MassSpring<double> tissue(make_grid<double>(9, 9, 0.01),
                            {.mass = {.total = 0.1}, .link = {.stiffness = 60, .damping = 0.02}, .home = {.stiffness = 4, .damping = 0.02}});
  tissue.nail({0, 8, 72, 80});
  SoftBody body(tissue, LeapfrogVerlet{}, region);
  ProgressiveCutter<double> scalpel({.puncture_depth = 0.002});
  auto const advance = [&](double x, double z) { scalpel.advance(body, {x, 0.0413 + 0.1 * x, z}); };
  for (double const z : {0.01, 0.002, -0.004}) advance(0.0005, z);   // snaps to the border
  for (double x = 0.002; x < 0.09; x += 0.002) advance(x, -0.004);
  advance(0.09, 0.01);
  return body;
}

}  // namespace

TEMPLATE_TEST_CASE("a piece taken out moves as it does in the whole", "", WholeBody, ZoneOfInfluence) {
  auto whole = cut_in_two(TestType{});
  auto const pieces = connected_components(whole.mesh());
  REQUIRE(pieces.size() == 2);
  double const h = whole.stable_step() / 2;
  for (int const i : {20, 60}) whole.apply_force(i, {0.02, 0.01, -0.05});
  for (int k = 0; k < 20; ++k) REQUIRE(whole.step(h));
  whole.hold(pieces[1][5]);
  whole.apply_force(pieces[1][9], {0, 0, 0.03});
  whole.apply_force(pieces[0][9], {0, 0.01, 0.03});
  double mass = 0;
  for (auto const& piece : pieces) {
    SoftBody before = whole;
    auto part = part_of(whole, piece);
    REQUIRE(part.size() == static_cast<int>(piece.size()));
    CHECK(part.time() == whole.time());
    mass += part.total_mass();
    for (int k = 0; k < 50; ++k) {
      REQUIRE(part.step(h));
      REQUIRE(before.step(h));
    }
    double farthest = 0, moved = 0;
    for (int i = 0; i < part.size(); ++i) {
      int const there = piece[static_cast<std::size_t>(i)];
      farthest = std::max(farthest, (part.positions().col(i) - before.positions().col(there)).norm());
      moved = std::max(moved, (before.positions().col(there) - whole.positions().col(there)).norm());
      CHECK(part.tissue().nailed(i) == before.tissue().nailed(there));
      CHECK(part.is_held(i) == before.is_held(there));
    }
    CHECK(moved > 1e-5);
    CHECK(farthest <= 1e-9 * moved);
    CHECK(before.size() == whole.size());
  }
  CHECK(std::abs(mass - whole.total_mass()) <= 1e-15);
}

TEST_CASE("a piece taken out can be cut on") {
  auto const whole = cut_in_two(WholeBody{});
  auto part = part_of(whole, connected_components(whole.mesh()).at(0));
  testing::CutInvariants const before(part);
  REQUIRE(testing::to_text(before.check(part)) == "");
  ProgressiveCutter<double> scalpel({.puncture_depth = 0.002});
  for (double const z : {0.02, 0.01, 0.002, -0.004}) scalpel.advance(part, {0.0413, 0.0113, z});
  for (double y = 0.0113; y < 0.06; y += 0.003) {   // and out of it where it was cut off
    scalpel.advance(part, {0.0413, y, -0.004});
    REQUIRE(testing::to_text(before.check(part)) == "");
  }
  scalpel.advance(part, {0.0413, 0.06, 0.02});
  CHECK(scalpel.report().particles_added > 3);
  CHECK(testing::to_text(before.check(part)) == "");
}

TEST_CASE("what is no whole piece can not be taken out, and the error says why") {
  auto const whole = cut_in_two(WholeBody{});
  auto piece = connected_components(whole.mesh()).at(1);
  int const missing = piece.back();
  piece.pop_back();
  CHECK_THROWS_WITH(part_of(whole, piece), says("hang together", std::to_string(missing)));
  CHECK_THROWS_AS(part_of(whole, std::vector<int>{}), InvalidArgument);
  CHECK_THROWS_AS(part_of(whole, std::vector<int>{0, whole.size()}), OutOfRange);
  piece.push_back(missing), piece.push_back(missing);
  CHECK_THROWS_WITH(part_of(whole, piece), says("twice"));
  auto cutting = whole;
  ProgressiveCutter<double> scalpel({.puncture_depth = 0.002});
  for (double const z : {0.02, 0.002, -0.004}) scalpel.advance(cutting, {0.0413, 0.0113, z});
  scalpel.advance(cutting, {0.0423, 0.0173, -0.004});
  REQUIRE(cutting.temporary_subdivisions().size() == 1);
  CHECK_THROWS_WITH(part_of(cutting, connected_components(cutting.mesh())[0]), says("in progress", "lift the tool"));
}

TEST_CASE("a piece can be taken out right after an edit that took a particle away") {
  SoftBody body(MassSpring<double>(make_grid<double>(4, 4, 0.01), {.mass = {.total = 0.1}, .link = {.stiffness = 60.0}}), LeapfrogVerlet{}, WholeBody{});
  std::vector<int> all;
  for (int i = 0; i < body.size(); ++i) all.push_back(i);
  int const copy = body.split_particle(5, {});
  REQUIRE(copy == 16);
  body.step(1e-5);   // it is computed as well
  body.merge_last_particle(5);
  auto part = part_of(body, all);
  CHECK(part.size() == 16);
  CHECK(part.positions() == body.positions());
  CHECK(part.step(1e-5));
}

TEST_CASE("pieces are the same by neighbours and by triangles") {
  auto const body = cut_in_two(WholeBody{});
  CHECK(pieces_of(body) == connected_components(body.mesh()));
}

// Two bars side by side in one mesh, nailed, of two materials that fade: the second is taken out of the swing.
TEMPLATE_TEST_CASE("a piece of a solid moves as it does in the whole", "", BackwardEuler, LeapfrogVerlet) {
  auto const pressure = GENERATE(Pressure::element, Pressure::nodal);
  auto const bar = make_block<double>(6, 3, 3, 0.01, BlockPattern::alternating);
  int const n = static_cast<int>(bar.points.cols());
  auto const tetrahedra = bar.tetrahedra.cols();
  TetrahedralMesh<double> two{Matrix3X<double>(3, 2 * n), Matrix<int, 4, Dynamic>(4, 2 * tetrahedra)};
  two.points << bar.points, bar.points.colwise() + Vector3<double>(0, 0.1, 0);
  two.tetrahedra << bar.tetrahedra, (bar.tetrahedra.array() + n).matrix();
  Viscoelastic soft{StableNeoHookean<double>{.young = 5e3, .poisson = 0.45}, {{0.4, 0.05}}};
  Viscoelastic hard{StableNeoHookean<double>{.young = 2e4, .poisson = 0.45}, {{0.2, 0.02}}};
  FiniteElements tissue(two, SolidOptions<double, decltype(soft)>{.density = 1000, .material = soft, .damping = {.beta = 1e-3}, .prestrain = 0.02, .pressure = pressure});
  std::vector<int> some;
  for (int t = 0; t < 2 * static_cast<int>(tetrahedra); ++t)
    if (t % 7 < 3) some.push_back(t);
  tissue.set_material(some, hard, 1200);
  for (int i = 0; i < 2 * n; ++i)
    if (two.points(0, i) < 1e-9) tissue.nail(i);
  tissue.set_mass(n + 20, 0.002);
  SoftBody whole(std::move(tissue), TestType{}, WholeBody{});
  whole.set_gravity({0, 0, -9.81});
  double const h = std::isfinite(whole.stable_step()) ? whole.stable_step() / 2 : 2e-3;
  for (int k = 0; k < 40; ++k) REQUIRE(whole.step(h));
  auto const pieces = pieces_of(whole);
  REQUIRE(pieces.size() == 2);
  whole.hold(pieces[1][30]);
  whole.apply_force(pieces[1][50], {0.01, 0.02, 0});
  auto mixed = pieces[1];
  std::reverse(mixed.begin(), mixed.end());   // whatever order is asked for
  auto part = part_of(whole, mixed);
  REQUIRE(part.size() == n);
  auto const before = whole.positions().eval();
  for (int k = 0; k < 40; ++k) REQUIRE((part.step(h) && whole.step(h)));
  double farthest = 0, moved = 0;
  for (int i = 0; i < n; ++i) {
    int const there = mixed[static_cast<std::size_t>(i)];
    farthest = std::max(farthest, (part.positions().col(i) - whole.positions().col(there)).norm());
    moved = std::max(moved, (before.col(there) - whole.positions().col(there)).norm());
    CHECK(part.tissue().mass(i) == whole.tissue().mass(there));
    CHECK(part.tissue().nailed(i) == whole.tissue().nailed(there));
    CHECK(part.tissue().stiffness_bound(i) == Approx(whole.tissue().stiffness_bound(there)));
  }
  CHECK(moved > 1e-5);
  CHECK(farthest <= (std::is_same_v<TestType, BackwardEuler> ? 1e-3 : 1e-8) * moved);
  auto torn = pieces[1];
  torn.pop_back();
  CHECK_THROWS_WITH(part_of(whole, torn), says("hang together"));
  CHECK(part.triangles().cols() == whole.triangles().cols() / 2);
}
