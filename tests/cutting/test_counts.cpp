// SPDX-License-Identifier: MIT
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

// Yardstick: counts by hand on a grid of 1 cm squares, each cut by the diagonal from its lower left to its upper right corner, and the rule
// χ_after = χ_before − χ(G) + χ(G ∩ ∂), G the graph of cut edges. Strokes are placed so that no point is nearer to a vertex or
// edge than the 0.5 mm it would snap at, unless it is meant to.
//
//   points  an interior cut point is doubled, a free end is not; a point on a border is doubled
//   triangles  a new point on an inner edge divides two triangles, on a border one, inside a triangle it makes three of one

namespace {

using namespace palpate;

struct Expected {
  int particles, triangles, vertex_edge, vertex_vertex, edge_vertex, edge_edge, pieces, chi;
};

/// Draws a stroke over a grid of 5 × 5 vertices and compares all counts.
template <class S>
void draw(Points<S> const& corners, S step, Expected const& expected) {
  auto const grid = make_grid<S>(5, 5, S(0.01));
  auto body = SoftBody(make_tissue(grid), LeapfrogVerlet{}, WholeBody{});
  testing::CutInvariants const before(body);
  ProgressiveCutter<S> cutter({.puncture_depth = S(0.002), .snap = S(5e-4)});
  CHECK(violations_along(body, cutter, stroke_over(grid, sampled(corners, step), S(0.003), S(0.003)), before, [](auto&) {}) == "");
  CutReport const& report = cutter.report();
  CHECK(cutter.state() == CuttingPhase::no_contact);
  CHECK(report.particles_added == expected.particles);
  CHECK(report.triangles_added == expected.triangles);
  CHECK(report.vertex_edge == expected.vertex_edge);
  CHECK(report.vertex_vertex == expected.vertex_vertex);
  CHECK(report.edge_vertex == expected.edge_vertex);
  CHECK(report.edge_edge == expected.edge_edge);
  CHECK(body.size() == 25 + expected.particles);
  CHECK(body.triangles().cols() == 32 + expected.triangles);
  CHECK(static_cast<int>(connected_components(body.mesh()).size()) == expected.pieces);
  CHECK(euler_characteristic(body.rest_mesh()) == expected.chi);
}

}  // namespace

TEMPLATE_TEST_CASE("the four ways through a triangle add what the table says", "[cutting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const step = GENERATE(S(0.0003), S(0.003), S(0.05));
  CAPTURE(step);
  SECTION("V-P and P-V: vertex (1,1) to vertex (3,2), over the edge between") {
    // One new point, doubled; two triangles divided. Path of two edges inside: χ 1 − 1.
    draw<S>({{S(0.01), S(0.01), 0}, {S(0.03), S(0.02), 0}}, step, {2, 2, 1, 0, 1, 0, 1, 0});
  }
  SECTION("V-V: along two edges, from vertex (1,1) over (2,1) to (3,1)") {
    draw<S>({{S(0.01), S(0.01), 0}, {S(0.03), S(0.01), 0}}, step, {1, 0, 0, 2, 0, 0, 1, 0});
  }
  SECTION("V-V: along two diagonals, from vertex (1,1) over (2,2) to (3,3)") {
    draw<S>({{S(0.01), S(0.01), 0}, {S(0.03), S(0.03), 0}}, step, {1, 0, 0, 2, 0, 0, 1, 0});
  }
  SECTION("P-P: from the edge at x = 1 cm to the edge at x = 3 cm, over three between") {
    // Five points on edges, three of them doubled: 8 particles; 5 · 2 triangles.
    draw<S>({{S(0.01), S(0.015), 0}, {S(0.03), S(0.016), 0}}, step, {8, 10, 0, 0, 0, 4, 1, 0});
  }
  SECTION("V-P, P-P, P-V: vertex (1,1) to vertex (3,2) by way of the triangle above") {
    // From (1,1) with slope 3/4 to x = 2 cm at 1.75 cm, from there down to (3,2)? No: straight to the vertex (2,3) over two edges:
    // (1,1) → (2,3): the line x = 1 + t, y = 1 + 2t meets y = 2 at x = 1.5.
    draw<S>({{S(0.01), S(0.01), 0}, {S(0.02), S(0.03), 0}}, step, {2, 2, 1, 0, 1, 0, 1, 0});
  }
  SECTION("V-P, P-P, P-P, P-V: vertex (1,1) to vertex (4,2) at the border, over two verticals and one diagonal") {
    // y − 1 = (x − 1)/3: x = 2 at y 1.333; in square (2,1) the diagonal at x 2.5, y 1.5; x = 3 at y 1.667; then vertex (4,2).
    // Three points doubled, the end at the border doubled: 7; G a path, one point on the border: χ = 1 − 1 + 1.
    draw<S>({{S(0.01), S(0.01), 0}, {S(0.04), S(0.02), 0}}, step, {7, 6, 1, 0, 1, 2, 1, 1});
  }
  SECTION("from border to border: two pieces") {
    // Nine points on edges, all doubled; the two at the border divide one triangle each. χ = 1 − 1 + 2.
    draw<S>({{0, S(0.0153), 0}, {S(0.04), S(0.0157), 0}}, step, {18, 16, 0, 0, 0, 8, 2, 2});
  }
}

TEMPLATE_TEST_CASE("free ends of a cut: in a triangle, at an edge, at a vertex", "[cutting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const step = GENERATE(S(0.0003), S(0.003), S(0.05));
  CAPTURE(step);
  SECTION("inside one triangle: start and end, net +4 triangles, and nothing opens") {
    // One edge between two inner points has no doubled point: the rule for χ needs at least two.
    draw<S>({{S(0.013), S(0.012), 0}, {S(0.017), S(0.012), 0}}, step, {2, 4, 0, 0, 0, 0, 1, 1});
  }
  SECTION("from inside a triangle to its edge: the point on the edge divides the triangle beyond as well") {
    draw<S>({{S(0.015), S(0.012), 0}, {S(0.02), S(0.015), 0}}, step, {2, 4, 0, 0, 0, 0, 1, 1});
  }
  SECTION("from inside a triangle to a vertex: +2") {
    draw<S>({{S(0.016), S(0.012), 0}, {S(0.02), S(0.02), 0}}, step, {1, 2, 0, 0, 0, 0, 1, 1});
  }
  SECTION("ending 0.4 mm before a vertex it ends at the vertex") {
    draw<S>({{S(0.016), S(0.012), 0}, {S(0.0198), S(0.01965), 0}}, step, {1, 2, 0, 0, 0, 0, 1, 1});
  }
  SECTION("ending 0.4 mm before an edge it ends at the edge") {
    draw<S>({{S(0.015), S(0.012), 0}, {S(0.0196), S(0.0148), 0}}, step, {2, 4, 0, 0, 0, 0, 1, 1});
  }
  SECTION("ending beside the edge along which the last point lies") {
    // From the middle of one diagonal almost along it: the path lies on the diagonal, no triangle is passed.
    draw<S>({{S(0.014), S(0.014), 0}, {S(0.0172), S(0.0168), 0}}, step, {2, 4, 0, 0, 0, 0, 1, 1});
  }
  SECTION("a stroke of no length adds its point alone") {
    draw<S>({{S(0.016), S(0.012), 0}, {S(0.016), S(0.012), 0}}, step, {1, 2, 0, 0, 0, 0, 1, 1});
  }
  SECTION("two triangles with inner ends: both ends free, one point doubled") {
    // Start +2, edge point +2, end +2 triangles; particles 1 + 2 + 1; start and end triangle are no crossings.
    draw<S>({{S(0.016), S(0.012), 0}, {S(0.024), S(0.017), 0}}, step, {4, 6, 0, 0, 0, 0, 1, 0});
  }
}

TEST_CASE("a tick that crosses twenty triangles does what four hundred small ones do", "[cutting]") {
  // Yardstick: 23 edges between the ends, so 22 triangles are crossed, and the counts by hand: 4 · 2 − 2 + 22 · 2 = 50 triangles,
  // 2 + 23 · 2 = 48 particles.
  auto const grid = make_grid<double>(21, 21, 0.005);
  Points<double> const ends{{0.0212, 0.0533, 0}, {0.0788, 0.0517, 0}};
  auto const cut = [&](double step) {
    auto body = SoftBody(make_tissue(grid), LeapfrogVerlet{}, WholeBody{});
    ProgressiveCutter<double> cutter({.puncture_depth = 0.002, .snap = 2e-4});
    for (auto const& tip : stroke_over(grid, sampled(ends, step), 0.003, 0.01)) cutter.advance(body, tip);
    CHECK(cutter.report().particles_added == 48);
    CHECK(cutter.report().triangles_added == 50);
    CHECK(cutter.report().edge_edge == 22);
    return body.rest_mesh();
  };
  auto const slow = cut(1.44e-4), fast = cut(1);
  // The order of new particles may differ; where they are and what they join may not.
  auto const centres = [](TriangleMesh<double> const& mesh) {
    std::vector<std::array<double, 2>> all;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      Vector3<double> const sum = mesh.points.col(mesh.triangles(0, t)) + mesh.points.col(mesh.triangles(1, t)) + mesh.points.col(mesh.triangles(2, t));
      all.push_back({std::round(sum[0] * 1e10), std::round(sum[1] * 1e10)});
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  CHECK((centres(slow) == centres(fast)));
}

TEST_CASE("cuts that meet, cross and close: pieces and Euler characteristic by the rule", "[cutting]") {
  // χ of the sheet is 1. A wound is a tree inside: 1 − 1 = 0, a closed loop has χ(G) = 0 and frees a disc: 1, in two pieces 1 = χ of
  // the annulus (0) and the disc (1).
  auto const grid = make_grid<double>(9, 9, 0.01);
  auto body = SoftBody(make_tissue(grid), LeapfrogVerlet{}, WholeBody{});
  testing::CutInvariants const before(body);
  ProgressiveCutter<double> cutter({.puncture_depth = 0.002, .snap = 5e-4});
  double const step = GENERATE(0.0004, 0.003);
  auto const draw_on = [&](Points<double> const& corners) {
    REQUIRE(violations_along(body, cutter, stroke_over(grid, sampled(corners, step), 0.003, 0.003), before, [](auto&) {}) == "");
    CHECK(cutter.state() == CuttingPhase::no_contact);
  };
  auto const pieces = [&] { return connected_components(body.rest_mesh()).size(); };
  SECTION("a T: the second cut meets the first from the side and stops there") {
    draw_on({{0.0113, 0.0353, 0}, {0.0687, 0.0357, 0}});
    CHECK(euler_characteristic(body.rest_mesh()) == 0);
    draw_on({{0.0413, 0.0653, 0}, {0.0423, 0.0352, 0}});
    CHECK(euler_characteristic(body.rest_mesh()) == 0);   // a tree with one point on the wound: 0 − 1 + 1
    CHECK(pieces() == 1);
  }
  SECTION("an X: the second cut goes on beyond the first") {
    draw_on({{0.0113, 0.0353, 0}, {0.0687, 0.0357, 0}});
    draw_on({{0.0413, 0.0653, 0}, {0.0423, 0.0117, 0}});
    CHECK(euler_characteristic(body.rest_mesh()) == 0);   // one tree inside: 1 − 1
    CHECK(pieces() == 1);
    // A T has the same characteristic: the lips tell how far the second cut goes.
    double lowest = 1, highest = 0;
    for (auto const& pair : cutter.lips()) {
      CHECK(body.tissue().rest_position(pair[0]) == body.tissue().rest_position(pair[1]));
      lowest = std::min(lowest, body.tissue().rest_position(pair[0])[1]);
      highest = std::max(highest, body.tissue().rest_position(pair[0])[1]);
    }
    CHECK(lowest < 0.02);
    CHECK(highest > 0.055);
  }
  SECTION("two cuts from border to border that cross leave four pieces") {
    draw_on({{-0.005, 0.0353, 0}, {0.085, 0.0357, 0}});
    CHECK(pieces() == 2);
    draw_on({{0.0413, 0.085, 0}, {0.0423, -0.005, 0}});
    CHECK(pieces() == 4);
    CHECK(euler_characteristic(body.rest_mesh()) == 4);   // four discs
  }
  SECTION("three wounds in one tick: what lies between them is cut too") {
    for (double const y : {0.0253, 0.0353, 0.0437}) draw_on({{-0.005, y, 0}, {0.085, y + 4e-4, 0}});
    CHECK(pieces() == 4);
    double const tick = GENERATE(0.1, 0.025, 0.008);
    REQUIRE(violations_along(body, cutter, stroke_over(grid, sampled(Points<double>{{0.0413, 0.085, 0}, {0.0423, -0.005, 0}}, tick), 0.003, 0.003), before, [](auto&) {}) == "");
    CHECK(pieces() == 8);
  }
  SECTION("several blades at once: the pieces are those of the lines, and each blade has its temporary subdivision") {
    std::vector<Points<double>> const lines = GENERATE(std::vector<Points<double>>{{{-0.005, 0.0253, 0}, {0.085, 0.0257, 0}}, {{-0.005, 0.0553, 0}, {0.085, 0.0557, 0}}},
                                                       std::vector<Points<double>>{{{-0.005, 0.0353, 0}, {0.085, 0.0357, 0}}, {{0.0413, 0.085, 0}, {0.0423, -0.005, 0}}},
                                                       std::vector<Points<double>>{{{-0.005, 0.0253, 0}, {0.085, 0.0257, 0}}, {{0.085, 0.0553, 0}, {-0.005, 0.0557, 0}}, {{0.0413, 0.085, 0}, {0.0423, -0.005, 0}}});
    std::vector<Points<double>> tips;
    for (auto const& line : lines) tips.push_back(stroke_over(grid, sampled(line, step), 0.003, 0.003));
    std::vector<ProgressiveCutter<double>> blades(lines.size(), cutter);
    std::size_t most = 0, longest = 0;
    for (auto const& along : tips) longest = std::max(longest, along.size() + 1);
    for (std::size_t i = 0; i < longest; ++i)
      for (std::size_t k = 0; k < blades.size(); ++k) {
        if (i < tips[k].size()) blades[k].advance(body, tips[k][i]);
        if (i == tips[k].size()) blades[k].reset(body);
        most = std::max(most, body.temporary_subdivisions().size());
        REQUIRE(testing::to_text(before.check(body)) == "");
      }
    CHECK(most == blades.size());
    CHECK(body.temporary_subdivisions().empty());
    CHECK(pieces() == (lines.size() == 3 ? 6u : lines[1][0][0] < 0 ? 3u : 4u));
  }
  SECTION("a stroke that crosses itself frees the loop it closes") {
    draw_on({{0.0113, 0.0353, 0}, {0.0587, 0.0357, 0}, {0.0593, 0.0593, 0}, {0.0357, 0.0587, 0}, {0.0353, 0.0117, 0}});
    CHECK(pieces() == 2);
    CHECK(euler_characteristic(body.rest_mesh()) == 1);   // a disc and an annulus
  }
  SECTION("a path that closes on its own first point") {
    draw_on({{0.0213, 0.0217, 0}, {0.0587, 0.0223, 0}, {0.0573, 0.0583, 0}, {0.0223, 0.0567, 0}, {0.0213, 0.0217, 0}});
    CHECK(pieces() == 2);
    CHECK(euler_characteristic(body.rest_mesh()) == 1);
  }
}
