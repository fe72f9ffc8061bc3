// SPDX-License-Identifier: MIT
// Why the springs of a split particle keep the rest lengths of the undeformed shape. The source sets them to the actual lengths: what that does, by a plain
// loop over the springs, beside what the library does.
#include "body/naive_body.hpp"
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/cutting/separating_cutter.hpp>

#include <algorithm>
#include <cmath>
#include <set>

using namespace palpate;

TEST_CASE("a sheet that is cut while it is stretched keeps its energy and goes back to its shape; with actual lengths it would do neither") {
  constexpr double stretch = 1.2;
  SoftBody body(make_tissue(make_grid<double>(11, 11, 0.01)), LeapfrogVerlet{}, WholeBody{});
  auto const at_rest = body.rest_mesh().points;
  for (int i = 0; i < body.size(); ++i) body.drag(i, {stretch * at_rest(0, i), at_rest(1, i), 0.0});
  for (int i = 0; i < body.size(); ++i) body.release(i);
  double const before = body.potential_energy();

  SeparatingCutter<double> scalpel({.puncture_depth = 0.002});   // along a row of vertices: none has to be moved
  scalpel.advance(body, {stretch * 0.02, 0.05, 0.004});
  for (int k = 0; k <= 240; ++k) scalpel.advance(body, {stretch * (0.02 + 2.5e-4 * k), 0.05, -0.003});
  scalpel.advance(body, {stretch * 0.08, 0.05, 0.004});
  REQUIRE(scalpel.lips().size() == 5);   // of seven vertices the two at the ends stay single
  REQUIRE(std::abs(scalpel.report().area_change) < 1e-15);
  CHECK(body.potential_energy() == Approx(before).epsilon(1e-12));

  std::set<int> split;
  for (auto const& lip : scalpel.lips()) split.insert({lip[0], lip[1]});
  auto const& links = body.tissue().links();
  palpate_test::NaiveBody ours(body.rest_mesh().points);
  ours.x = body.positions();
  for (int i = 0; i < body.size(); ++i) ours.home_stiffness[static_cast<std::size_t>(i)] = body.tissue().home(i).stiffness;
  for (int l = 0; l < links.size(); ++l) {
    ours.join(links[l].a, links[l].b, links[l].weight * links[l].law.stiffness, 0.0);
    CHECK(links[l].rest_length == Approx(ours.edges.back().rest_length).epsilon(1e-14));
  }
  auto sources = ours;
  double lost = 0;
  for (auto& edge : sources.edges)
    if (split.count(edge.a) + split.count(edge.b) > 0) {
      double const actual = (ours.x.col(edge.a) - ours.x.col(edge.b)).norm();
      lost += edge.stiffness / 2 * std::pow(actual - edge.rest_length, 2);
      edge.rest_length = actual;
    }
  CHECK(ours.energy(ours.x) == Approx(before).epsilon(1e-12));
  CHECK(before - sources.energy(ours.x) == Approx(lost).epsilon(1e-9));
  CHECK(lost > 0.025 * before);

  // Let go: down the energy until nothing moves.
  auto const drift = [](palpate_test::NaiveBody sheet) {
    palpate_test::Points const still = palpate_test::Points::Zero(3, sheet.size());
    for (int k = 0; k < 20000; ++k) sheet.x += 2e-3 * sheet.forces(sheet.x, still);
    return (sheet.x - sheet.home).colwise().norm().maxCoeff();
  };
  CHECK(drift(ours) < 1e-6);
  CHECK(drift(sources) > 1e-3);   // of an edge of 10 mm
}
