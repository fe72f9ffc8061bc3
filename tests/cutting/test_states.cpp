// SPDX-License-Identifier: MIT
// Yardsticks: the thresholds and states that the thesis names, and the sheet's topology counted by hand.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>

#include <cmath>
#include <limits>

using namespace palpate;

namespace {

using Grid = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;

/// A grid of 1 cm squares, each with one diagonal from lower left to upper right.
Grid grid(int n) { return Grid(make_tissue(make_grid<double>(n, n, 0.01))); }

/// Presses straight down at the first point, draws through the others in small ticks, lifts. Millimetres on the grid.
void stroke(Grid& body, ProgressiveCutter<double>& cutter, std::vector<std::array<double, 2>> const& points) {
  auto const tip = [](std::array<double, 2> const& p, double z) { return Vector3<double>(p[0] * 1e-3, p[1] * 1e-3, z); };
  Points<double> tips{tip(points.front(), 0.004), tip(points.front(), -0.003)};
  Points<double> path;
  for (auto const& p : points) path.push_back(tip(p, -0.003));
  for (auto const& t : sampled(path, 3e-4)) tips.push_back(t);
  tips.push_back(tip(points.back(), 0.004));
  testing::CutInvariants const before(body);
  CHECK(violations_along(body, cutter, tips, before, [](Grid&) {}) == "");
  CHECK(cutter.state() == CuttingPhase::no_contact);
}

ProgressiveCutter<double> scalpel() { return ProgressiveCutter<double>({.puncture_depth = 0.002, .snap = 5e-4}); }

}  // namespace

TEST_CASE("below the threshold nothing is created") {
  auto body = grid(4);
  auto cutter = scalpel();
  for (double z : {0.004, 0.0, -0.001, -0.0019, -0.001, 0.001}) cutter.advance(body, {0.0133, 0.0117, z});
  CHECK(body.size() == 16);
  CHECK(body.triangles().cols() == 18);
  CHECK(cutter.state() == CuttingPhase::no_contact);
}

TEST_CASE("from border to border the sheet falls in two") {
  auto body = grid(5);
  auto cutter = scalpel();
  stroke(body, cutter, {{13, 16}, {-3, 16.5}});   // from inside over the left border
  CHECK(connected_components(body.mesh()).size() == 1);
  auto second = scalpel();
  stroke(body, second, {{13, 16}, {43, 15.5}});   // from the same place over the right one
  CHECK(connected_components(body.mesh()).size() == 2);
}

TEST_CASE("a report is of the current or last cut") {
  auto body = grid(6);
  auto cutter = scalpel();
  stroke(body, cutter, {{16, 12}, {36, 12.5}});
  CHECK(cutter.report().edge_edge > 0);
  cutter.advance(body, {0.0162, 0.0331, 0.004});
  cutter.advance(body, {0.0162, 0.0331, -0.001});
  CHECK(cutter.report().edge_edge > 0);   // still the last one: not punctured yet
  cutter.advance(body, {0.0162, 0.0331, -0.0025});
  CHECK(cutter.report().edge_edge == 0);
  CHECK(cutter.report().particles_added == 1);
}

TEST_CASE("puncture by force, and no threshold afterwards") {
  auto body = grid(4);
  ProgressiveCutter<double> cutter({.puncture_depth = 0.5, .puncture_force = 1.0, .snap = 5e-4});
  cutter.advance(body, {0.016, 0.012, 0.004});
  cutter.advance(body, {0.016, 0.012, -0.001}, 0.99);
  CHECK(cutter.state() == CuttingPhase::indenting);
  cutter.advance(body, {0.016, 0.012, -0.001}, 1.0);
  CHECK(cutter.state() == CuttingPhase::moving);
  cutter.advance(body, {0.017, 0.013, -1e-4});
  CHECK(cutter.state() == CuttingPhase::moving);
}

TEST_CASE("a tip that is not finite, and options without meaning, are refused in words") {
  auto body = grid(4);
  auto cutter = scalpel();
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(cutter.advance(body, {nan, 0.0, 0.0}), InvalidArgument);
  CHECK_THROWS_AS(ProgressiveCutter<double>({.puncture_depth = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(ProgressiveCutter<double>({.snap = nan}), InvalidArgument);
  CHECK_THROWS_WITH(ProgressiveCutter<double>({.puncture_depth = 2}), Catch::Contains("puncture_depth is 2 m") && Catch::Contains("in mm it would be 0.002 m"));
  CHECK(body.size() == 16);
}

TEST_CASE("the pre-tensioned wound is open behind the blade while it moves") {
  auto const skin = make_grid<double>(11, 11, 0.01);
  auto tissue = make_tissue(skin, 0.1);
  tissue.nail(boundary_vertices(skin));
  Grid body(std::move(tissue));
  auto cutter = scalpel();
  Points<double> tips{Vector3<double>(0.023, 0.052, 0.004), Vector3<double>(0.023, 0.052, -0.003)};
  for (auto const& t : sampled<double>({Vector3<double>(0.023, 0.052, -0.003), Vector3<double>(0.075, 0.053, -0.003)}, 5e-5)) tips.push_back(t);
  for (auto const& tip : tips) {
    cutter.advance(body, tip);
    double const h = body.stable_step();
    for (double t = 0; t < 1e-3; t += h) body.step(std::min(h, 1e-3));
  }
  CHECK(cutter.state() == CuttingPhase::moving);
  REQUIRE(cutter.lips().size() > 4);
  double gap = 0;
  for (auto const& [left, right] : cutter.lips()) gap = std::max(gap, (body.positions().col(left) - body.positions().col(right)).norm());
  CHECK(gap > 1e-3);
}

// A body that was never cut is the yardstick: restored to its state, the next stroke has to do to both the same.
TEST_CASE("a body restored under a tool: the tool has to come from outside again") {
  auto body = grid(9);
  auto const whole = body.save();
  auto const draw = [&](auto& tool, Grid& on, double from, double to) {
    for (double const z : {0.004, 0.001, -0.003}) tool.advance(on, {from, 0.0333, z});
    for (int k = 1; k <= 60; ++k) tool.advance(on, {from + (to - from) * k / 60, 0.0333, -0.003});
  };
  SECTION("a cut in progress is gone with the state it was in") {
    auto cutter = scalpel();
    draw(cutter, body, 0.0123, 0.0677);
    REQUIRE(cutter.state() == CuttingPhase::moving);
    body.restore(whole);
    for (double const x : {0.0677, 0.05}) cutter.advance(body, {x, 0.0333, -0.003});
    CHECK(cutter.state() == CuttingPhase::no_contact);
    CHECK(cutter.lips().empty());
    CHECK(cutter.report().particles_added == 0);
    CHECK(body.size() == 81);
    cutter.advance(body, {0.05, 0.0333, 0.004});
    draw(cutter, body, 0.0123, 0.0677);
    cutter.advance(body, {0.0677, 0.0333, 0.004});
    auto fresh = grid(9);
    auto other = scalpel();
    draw(other, fresh, 0.0123, 0.0677);
    other.advance(fresh, {0.0677, 0.0333, 0.004});
    CHECK(body.triangles() == fresh.triangles());
    CHECK(body.rest_mesh().points == fresh.rest_mesh().points);
  }
  SECTION("a blunt tool on a triangle that the cut had made") {
    auto cutter = scalpel();
    draw(cutter, body, 0.0123, 0.0677);
    cutter.advance(body, {0.0677, 0.0333, 0.004});
    NoCutter<double> tool;
    int const there = body.nearest_point({0.06, 0.0332, 0}).triangle;
    REQUIRE(there >= 0);
    for (double const z : {0.004, -0.001}) tool.advance(body, {0.06, 0.0332, z});
    REQUIRE(tool.contact().touching);
    body.restore(whole);
    tool.advance(body, {0.061, 0.0332, -0.001});
    CHECK_FALSE(tool.contact().touching);
    tool.advance(body, {0.061, 0.0332, 0.001});
    tool.advance(body, {0.061, 0.0332, -0.001});
    CHECK(tool.contact().touching);
    CHECK(tool.contact().triangle < body.tissue().surface().triangle_count());
  }
  SECTION("reset ends a cut where the blade is") {
    auto cutter = scalpel();
    draw(cutter, body, 0.0123, 0.0677);
    cutter.reset(body);
    CHECK(cutter.state() == CuttingPhase::no_contact);
    CHECK(body.temporary_subdivisions().empty());
    CHECK_NOTHROW(body.save());
    CHECK_FALSE(cutter.lips().empty());
    cutter.advance(body, {0.05, 0.0123, -0.003});
    CHECK(cutter.state() == CuttingPhase::no_contact);   // from inside
    NoCutter<double> tool;
    for (double const z : {0.004, -0.001}) tool.advance(body, {0.02, 0.0123, z});
    CHECK(tool.contact().touching);
    tool.reset(body);
    CHECK_FALSE(tool.contact().touching);
  }
}

// The yardstick is the plate itself: its underside is known, and what is below it is outside.
TEST_CASE("a blade that passes through a closed plate leaves it on the other side") {
  auto mesh = surface(make_block<double>(11, 11, 2, 0.01));   // 10 cm × 10 cm × 1 cm, z from 0 to 1 cm
  Grid body(make_tissue(mesh));
  auto cutter = scalpel();
  auto const tip = [](double x, double z) { return Vector3<double>(x, 0.0533, z); };
  for (double const z : {0.012, 0.0099, 0.007}) cutter.advance(body, tip(0.0312, z));
  for (int k = 0; k <= 100; ++k) cutter.advance(body, tip(0.0312 + 2e-4 * k, 0.005));
  REQUIRE(cutter.state() == CuttingPhase::moving);
  double z = 0.005;
  while (cutter.state() == CuttingPhase::moving && z > -0.05) cutter.advance(body, tip(0.0512, z -= 2e-4));
  CHECK(cutter.state() == CuttingPhase::no_contact);
  CHECK(z < 0);
  CHECK(z > -0.0015);
  CHECK(body.temporary_subdivisions().empty());
  cutter.advance(body, tip(0.0512, -0.01));
  CHECK(cutter.state() == CuttingPhase::no_contact);
  cutter.advance(body, tip(0.0812, -0.001));
  cutter.advance(body, tip(0.0812, 0.001));
  CHECK(cutter.state() == CuttingPhase::indenting);   // from below
  CHECK(cutter.contact().normal.z() < -0.9);
}

TEST_CASE("no contact is deeper than the body is long") {
  auto body = grid(5);   // 4 cm × 4 cm
  auto cutter = scalpel();
  NoCutter<double> finger;
  double const diagonal = 0.04 * std::sqrt(2.0);
  for (double const z : {0.004, -0.001, -0.01, -0.99 * diagonal}) {
    cutter.advance(body, {0.0133, 0.0117, z});
    finger.advance(body, {0.0233, 0.0217, z});
  }
  CHECK(cutter.state() == CuttingPhase::moving);
  CHECK(finger.contact().touching);
  cutter.advance(body, {0.0133, 0.0117, -1.01 * diagonal});
  finger.advance(body, {0.0233, 0.0217, -1.01 * diagonal});
  CHECK(cutter.state() == CuttingPhase::no_contact);
  CHECK_FALSE(finger.contact().touching);
}

// Yardstick: a cutter that has cut nothing before.
TEST_CASE("a cutter that is taken to another body in mid-cut begins anew there", "[cutting]") {
  auto first = grid(10), other = grid(10), third = grid(10);
  auto cutter = scalpel(), fresh = scalpel();
  for (int k = 0; k < 30; ++k) cutter.advance(first, {0.0212 + 0.001 * k, 0.0533, k < 3 ? 0.01 : -0.004});
  REQUIRE(cutter.state() == CuttingPhase::moving);
  REQUIRE(first.size() > 100);
  cutter.advance(other, {0.0512, 0.0533, -0.004}), fresh.advance(third, {0.0512, 0.0533, -0.004});   // behind the surface
  for (int k = 0; k < 30; ++k) {
    Vector3<double> const tip(0.0212 + 0.001 * k, 0.0333, k < 3 ? 0.01 : -0.004);
    cutter.advance(other, tip), fresh.advance(third, tip);
    REQUIRE(cutter.state() == fresh.state());
  }
  CHECK(other.size() > 100);
  CHECK(other.positions() == third.positions());
  CHECK(other.triangles() == third.triangles());
}
