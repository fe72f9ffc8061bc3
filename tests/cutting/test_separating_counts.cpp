// SPDX-License-Identifier: MIT
// Yardstick: counts by hand on a grid of 1 cm squares, each cut by the diagonal from its lower left to its upper right corner, and the rule
// χ_after = χ_before − χ(G) + χ(G ∩ ∂), G the graph of cut edges: inner vertices of a cut are doubled, free ends are not, ends on a border
// or an earlier cut are. Points in mm.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/quality.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace {

using namespace palpate;

template <class S>
using Sheet = SoftBody<MassSpring<S>, LeapfrogVerlet, WholeBody>;

struct Expected {
  int particles, edges, pieces, chi;
};

template <class S>
class Bench {
 public:
  explicit Bench(int n, S tick = S(0.3)) : grid_(make_grid<S>(n, n, S(0.01))), body(make_tissue(grid_)), tick_(tick) {}

  /// Draws through points [mm], in ticks of so many mm, with all checks after each.
  SeparatingReport<S> draw(std::vector<std::array<double, 2>> const& points) {
    Points<S> corners;
    for (auto const& p : points) corners.push_back({static_cast<S>(p[0] * 1e-3), static_cast<S>(p[1] * 1e-3), S(0)});
    Points<S> tips{corners.front() + Vector3<S>(0, 0, S(0.004))};
    for (Vector3<S> const& p : sampled<S>(corners, tick_ * S(1e-3))) tips.push_back(p - Vector3<S>(0, 0, S(0.003)));
    tips.push_back(corners.back() + Vector3<S>(0, 0, S(0.004)));
    testing::CutInvariants const before(body, {.moves_vertices = true});
    std::size_t const border = boundary_edges(body.rest_mesh()).size();
    SeparatingCutter<S> cutter({.puncture_depth = S(0.002)});
    CHECK(violations_along(body, cutter, tips, before, [](auto&) {}) == "");
    CHECK(cutter.state() == CuttingPhase::no_contact);
    // The wound opens along its edges alone: each has two sides now, and no other edge has.
    CHECK(boundary_edges(body.rest_mesh()).size() == border + 2 * static_cast<std::size_t>(cutter.report().vertex_vertex));
    lips = cutter.lips();
    return cutter.report();
  }

  void draw(std::vector<std::array<double, 2>> const& points, Expected const& expected) {
    int const size = body.size();
    auto const report = draw(points);
    CHECK(report.particles_added == expected.particles);
    CHECK(report.triangles_added == 0);
    CHECK(report.vertex_vertex == expected.edges);
    CHECK(body.size() == size + expected.particles);
    CHECK(static_cast<int>(connected_components(body.mesh()).size()) == expected.pieces);
    CHECK(euler_characteristic(body.rest_mesh()) == expected.chi);
    CHECK(static_cast<int>(lips.size()) == expected.particles);
    for (auto const& [a, b] : lips) CHECK(body.tissue().rest_position(a) == body.tissue().rest_position(b));
  }

  Vector3<double> at(int i) const { return 1e3 * body.tissue().rest_position(i).template cast<double>(); }   // mm

 private:
  TriangleMesh<S> grid_;

 public:
  Sheet<S> body;
  std::vector<std::array<int, 2>> lips;

 private:
  S tick_;
};

}  // namespace

TEMPLATE_TEST_CASE("a cut along edges doubles what lies between its ends", "[cutting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const tick = GENERATE(S(0.3), S(3), S(100));
  CAPTURE(tick);
  Bench<S> sheet(5, tick);
  SECTION("two edges: one vertex doubled") { sheet.draw({{10, 20}, {30, 20}}, {1, 2, 1, 0}); }
  SECTION("two diagonals") { sheet.draw({{10, 10}, {30, 30}}, {1, 2, 1, 0}); }
  SECTION("one edge between inner vertices can not open") {
    auto const before = sheet.body.rest_mesh();
    sheet.draw({{11, 21}, {21, 22}}, {0, 0, 1, 1});
    CHECK(sheet.body.rest_mesh().points == before.points);
  }
  SECTION("a stab") {
    auto const before = sheet.body.rest_mesh();
    sheet.draw({{13, 22}, {13, 22}}, {0, 0, 1, 1});
    CHECK(sheet.body.rest_mesh().points == before.points);
  }
  SECTION("one edge from the border in") { sheet.draw({{0.5, 20}, {11, 20}}, {1, 1, 1, 1}); }
  SECTION("one edge to the border, and over it") { sheet.draw({{11, 20}, {-3, 20}}, {1, 1, 1, 1}); }
  SECTION("from border to border") { sheet.draw({{0.5, 20}, {43, 20}}, {5, 4, 2, 2}); }
  SECTION("a corner: from border to border over one edge") { sheet.draw({{0.5, 10}, {10, 10}, {10, -2}}, {3, 2, 2, 2}); }
}

TEMPLATE_TEST_CASE("vertices are moved onto the blade's line", "[cutting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  // One vertex after the other; a blade whose tick is far longer than an edge takes the shortest path, which is the same here.
  Bench<S> sheet(7, GENERATE(S(0.3), S(3), S(100)));
  double const tolerance = sizeof(S) == 4 ? 1e-4 : 1e-10;   // mm
  SECTION("beside a row of vertices: each moves by 2.5 mm to the side, and inside a flat sheet no area changes") {
    auto const report = sheet.draw({{10, 32.5}, {50, 32.5}});
    CHECK(report.particles_added == 3);
    CHECK(report.particles_moved == 5);
    CHECK(static_cast<double>(report.largest_move) == Approx(0.0025));
    CHECK(std::abs(static_cast<double>(report.area_change)) < 1e-9);
    for (int i = 1; i <= 5; ++i) CHECK((sheet.at(3 * 7 + i) - Vector3<double>(10 * i, 32.5, 0)).norm() < tolerance);
  }
  SECTION("the first vertex goes to the puncture") {
    sheet.draw({{12, 31}, {50, 31}});
    CHECK((sheet.at(3 * 7 + 1) - Vector3<double>(12, 31, 0)).norm() < tolerance);
  }
  SECTION("an inclined line: all on it, however many rows it passes") {
    auto const report = sheet.draw({{10, 11}, {52, 38}});
    REQUIRE(sheet.lips.size() >= 2);
    for (auto const& [a, b] : sheet.lips) {
      Vector3<double> const p = sheet.at(a);
      double const off = ((p.x() - 10) * 27 - (p.y() - 11) * 42) / std::hypot(27, 42);
      CHECK(std::abs(off) < 1e-3);
    }
    CHECK(report.largest_move < S(0.0075));
  }
  SECTION("the border stays: only what is inside moves") {
    auto const report = sheet.draw({{1, 32}, {63, 32}});
    CHECK(report.particles_moved <= 5);
    CHECK((sheet.at(3 * 7 + 6) - Vector3<double>(60, 30, 0)).norm() < tolerance);
    CHECK((sheet.at(3 * 7 + 5) - Vector3<double>(50, 32, 0)).norm() < tolerance);
  }
}

TEMPLATE_TEST_CASE("cuts along edges that cross, meet and close", "[cutting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Bench<S> sheet(7, GENERATE(S(0.3), S(3)));
  SECTION("a cross: the vertex between has four copies") {
    sheet.draw({{10, 30}, {50, 30}}, {3, 4, 1, 0});
    sheet.draw({{30, 10}, {30, 50}}, {4, 4, 1, 0});
  }
  SECTION("a T: the second cut ends on the first") {
    sheet.draw({{10, 30}, {50, 30}}, {3, 4, 1, 0});
    sheet.draw({{30, 50}, {30, 30.5}}, {2, 2, 1, 0});   // (30, 40), and one lip of (30, 30)
  }
  SECTION("a T the other way: the second cut starts on the first") {
    sheet.draw({{10, 30}, {50, 30}}, {3, 4, 1, 0});
    sheet.draw({{30, 30.5}, {30, 50}}, {2, 2, 1, 0});
  }
  SECTION("a closed loop frees its piece") {
    // Eight edges, eight vertices, all doubled: χ(G) = 0.
    sheet.draw({{20, 20}, {40, 20}, {40, 40}, {20, 40}, {20, 20}}, {8, 8, 2, 1});
  }
  SECTION("a loop from the border to the border") { sheet.draw({{0.4, 20}, {20, 20}, {20, 40}, {-3, 40}}, {7, 6, 2, 2}); }
  SECTION("a path that crosses itself") {
    // Right, up, left, and down through (20, 30): eleven edges between eleven vertices, so χ(G) = 0. The two ends stay single, the crossing
    // gets three copies, the other eight vertices one each.
    sheet.draw({{10, 30}, {40, 30}, {40, 50}, {20, 50}, {20, 10}}, {11, 11, 2, 1});
  }
  SECTION("back and forth over the same line cuts once") {
    sheet.draw({{10, 30}, {50, 30}, {10, 30}, {50, 30}}, {3, 4, 1, 0});
    sheet.draw({{50, 30}, {10, 30}}, {0, 0, 1, 0});
  }
  SECTION("across an earlier cut: it ends on one lip and goes on from the other") {
    sheet.draw({{10, 30}, {50, 30}}, {3, 4, 1, 0});
    sheet.draw({{24, 10}, {24, 50}}, {4, 4, 1, 0});   // (20, 20), (20, 40) and both lips of (20, 30)
  }
  SECTION("across two cuts an edge apart: what lies between is cut too") {
    sheet.draw({{20, 10}, {20, 50}}, {3, 4, 1, 0});
    sheet.draw({{30, 10}, {30, 50}}, {3, 4, 1, -1});
    sheet.draw({{10, 31}, {50, 31}}, {5, 4, 1, 0});   // both lips of (20, 30) and (30, 30), and (40, 30)
  }
  SECTION("lifted and entered again: the second stroke goes on where the first ended") {
    sheet.draw({{10, 30}, {30, 30}}, {1, 2, 1, 0});
    sheet.draw({{30, 30}, {50, 30}}, {2, 2, 1, 0});   // the old end (30, 30) and (40, 30)
  }
}
