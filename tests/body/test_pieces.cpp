// SPDX-License-Identifier: MIT
// A piece taken out goes on as it would have in the whole. Yardstick: the whole body, of which the piece is a part that nothing holds: the two
// compute the same sums in another order of particles.
#include <palpate/body/pieces.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/cut_invariants.hpp>
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
