// SPDX-License-Identifier: MIT
// Yardsticks: the edges of a grid that a straight line crosses, counted by hand, and the cut that is made in one tick: however few edges a tick may
// cross, the same mesh comes out in the end.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/components.hpp>

#include <array>
#include <string>

using namespace palpate;

namespace {

using Sheet = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
using Scalpel = ProgressiveCutter<double>;

constexpr int all = 1000000;

/// 40 × 6 squares of 1 cm, each with one diagonal from lower left to upper right.
Sheet sheet() { return Sheet(make_tissue(make_grid<double>(41, 7, 0.01))); }

Scalpel scalpel(int crossings) { return Scalpel({.puncture_depth = 0.002, .snap = 0.0, .crossings_per_tick = crossings}); }

int crossed(Scalpel const& cutter) {
  auto const& report = cutter.report();
  return report.vertex_vertex + report.vertex_edge + report.edge_vertex + report.edge_edge;
}

/// Millimetres on the sheet.
Vector3<double> in(double x, double y) { return {x * 1e-3, y * 1e-3, -0.003}; }
Vector3<double> above(double x, double y) { return {x * 1e-3, y * 1e-3, 0.004}; }

void puncture(Scalpel& cutter, Sheet& body, double x, double y) {
  cutter.advance(body, above(x, y));
  cutter.advance(body, in(x, y));
  REQUIRE(cutter.state() == CuttingPhase::moving);
}

std::string difference(Sheet const& a, Sheet const& b) {
  auto const one = a.rest_mesh(), other = b.rest_mesh();
  if (one.points.cols() != other.points.cols()) return "another number of particles";
  if (one.triangles.cols() != other.triangles.cols() || one.triangles != other.triangles) return "other triangles";
  if (!((one.points - other.points).cwiseAbs().maxCoeff() <= 1e-15)) return "other rest positions";   // m, rounding of where a wound was left
  auto const here = a.drawn_mesh(), there = b.drawn_mesh();
  if (here.triangles.cols() != there.triangles.cols() || here.triangles != there.triangles) return "other triangles are drawn";
  if (!((here.points - there.points).cwiseAbs().maxCoeff() <= 1e-15)) return "the blade is elsewhere";   // the tip was found in another triangle on its way
  return {};
}

}  // namespace

TEST_CASE("a tick crosses no more edges than it may, and the ticks that follow the rest", "[cutting]") {
  // From 13 to 396 mm at y = 34.7 mm: 38 upright edges, at 20, 30 … 390 mm, and the diagonals at 14.7, 24.7 … 394.7 mm, 39. The first
  // way through a triangle begins inside and does not count.
  auto body = sheet(), at_once = sheet();
  auto cutter = scalpel(8), quick = scalpel(all);
  testing::CutInvariants const before(body);
  puncture(cutter, body, 13, 34.7), puncture(quick, at_once, 13, 34.7);
  quick.advance(at_once, in(396, 34.7));
  CHECK_FALSE(quick.is_behind());
  CHECK(crossed(quick) == 38 + 39 - 1);

  int ticks = 0, last = 0;
  do {
    cutter.advance(body, in(396, 34.7));
    REQUIRE(testing::to_text(before.check(body)) == "");
    int const now = crossed(cutter) + 1;   // with the first
    CHECK(now - last == std::min(8, 77 - last));
    CHECK(cutter.is_behind() == (now < 77));
    last = now;
  } while (++ticks < 20 && cutter.is_behind());
  CHECK(ticks == 10);
  CHECK(crossed(cutter) == crossed(quick));
  CHECK(cutter.contact().home_point.x() == Approx(0.396));
  cutter.advance(body, in(397, 34.7)), quick.advance(at_once, in(397, 34.7));   // within its triangle
  CHECK(body.temporary_subdivisions().size() == 1);
  cutter.advance(body, above(397, 34.7)), quick.advance(at_once, above(397, 34.7));
  CHECK(difference(body, at_once) == "");
}

TEST_CASE("however few edges a tick may cross, strokes across each other go the same way where that depends on masses", "[cutting]") {
  // Thin pieces lie where strokes cross, and where masses are too small for more of them the path goes to a vertex instead.
  auto mesh = make_grid<double>(13, 13, 0.01);
  Random random(Seed{31});
  for (int i = 0; i < 169; ++i)
    if (int const x = i % 13, y = i / 13; x > 0 && x < 12 && y > 0 && y < 12) mesh.points(0, i) += random.uniform(-0.0035, 0.0035), mesh.points(1, i) += random.uniform(-0.0035, 0.0035);
  Sheet body(make_tissue(mesh)), at_once(make_tissue(mesh));
  for (int stroke = 0; stroke < 40; ++stroke) {
    auto cutter = scalpel(1), quick = scalpel(all);
    std::array<std::array<double, 2>, 2> ends{};
    for (auto& end : ends) end = {random.uniform(12.0, 108.0), random.uniform(12.0, 108.0)};
    auto const [from, to] = ends;
    for (auto const& tip : {above(from[0], from[1]), in(from[0], from[1]), in(to[0], to[1]), above(to[0], to[1])}) {
      quick.advance(at_once, tip);
      do cutter.advance(body, tip);
      while (cutter.is_behind());
    }
    CAPTURE(stroke);
    REQUIRE(difference(body, at_once) == "");
  }
}

TEST_CASE("a cut that is behind goes where the tip was first, and then to where it is", "[cutting]") {
  // Ahead, back and ahead again, faster than the cut: it makes the first way whole, then follows the tip straight from there.
  auto body = sheet(), slowly = sheet();
  auto cutter = scalpel(5), quick = scalpel(all);
  puncture(cutter, body, 13, 34.7), puncture(quick, slowly, 13, 34.7);
  cutter.advance(body, in(113, 24.2));   // 21 or more edges
  REQUIRE(cutter.is_behind());
  for (double const x : {150.0, 200.0, 250.0}) cutter.advance(body, in(x, 44.3));
  for (int k = 0; k < 20 && cutter.is_behind(); ++k) cutter.advance(body, in(203, 13.6));
  CHECK_FALSE(cutter.is_behind());
  quick.advance(slowly, in(113, 24.2));
  CHECK(difference(body, slowly) == "");
  for (int k = 0; k < 20; ++k) cutter.advance(body, in(203, 13.6));
  quick.advance(slowly, in(203, 13.6));
  CHECK(difference(body, slowly) == "");
}

TEST_CASE("a tip that is lifted leaves no cut half made", "[cutting]") {
  auto body = sheet(), at_once = sheet();
  auto cutter = scalpel(5), quick = scalpel(all);
  testing::CutInvariants const before(body);
  puncture(cutter, body, 13, 34.7), puncture(quick, at_once, 13, 34.7);
  cutter.advance(body, in(396, 34.7)), quick.advance(at_once, in(396, 34.7));
  int ticks = 0;
  do {
    cutter.advance(body, above(390, 34.7));
    CHECK(cutter.state() == CuttingPhase::no_contact);
    REQUIRE(testing::to_text(before.check(body)) == "");
  } while (++ticks < 30 && cutter.is_behind());
  CHECK(ticks == 15);   // 77 edges, 5 of them before
  quick.advance(at_once, above(390, 34.7));
  CHECK(difference(body, at_once) == "");
  CHECK(body.temporary_subdivisions().empty());

  SECTION("nothing follows") {
    int const particles = body.size();
    for (int k = 0; k < 5; ++k) cutter.advance(body, above(200, 34.7));
    CHECK(body.size() == particles);
  }
}

TEST_CASE("a puncture waits until the last cut is whole", "[cutting]") {
  auto body = sheet();
  auto cutter = scalpel(10);
  testing::CutInvariants const before(body);
  puncture(cutter, body, 13, 34.7);
  cutter.advance(body, in(396, 34.7));
  cutter.advance(body, above(396, 34.7));
  int waited = 0;
  while (waited < 20 && cutter.state() != CuttingPhase::moving) {
    cutter.advance(body, in(203, 12.8)), ++waited;
    REQUIRE(testing::to_text(before.check(body)) == "");
    if (cutter.is_behind()) CHECK(cutter.state() == CuttingPhase::indenting);
  }
  CHECK(waited == 7);   // 77 edges: 10 while it moved, 10 as it rose, 57 in six ticks, and the seventh punctures
  CHECK(crossed(cutter) == 0);
  cutter.advance(body, in(208, 12.8));
  cutter.advance(body, above(208, 12.8));
  CHECK(testing::to_text(before.check(body)) == "");
}

TEST_CASE("a cut that is behind ends where it is when the tool is taken away, and is gone with the state it was in", "[cutting]") {
  auto body = sheet();
  auto cutter = scalpel(10);
  testing::CutInvariants const before(body);
  auto const whole = body.save();
  puncture(cutter, body, 13, 34.7);
  cutter.advance(body, in(396, 34.7));
  REQUIRE(cutter.is_behind());

  SECTION("taken away") {
    cutter.reset(body);
    CHECK(crossed(cutter) == 9);
  }
  SECTION("taken away after the tip was lifted") {
    cutter.advance(body, above(396, 34.7));
    cutter.reset(body);
    CHECK(crossed(cutter) == 19);
  }
  SECTION("restored") {
    body.restore(whole);
    cutter.advance(body, in(396, 34.7));
    CHECK(body.size() == 41 * 7);
  }
  SECTION("restored after the tip was lifted") {
    cutter.advance(body, above(396, 34.7));
    body.restore(whole);
    cutter.advance(body, above(396, 34.7));
    CHECK(body.size() == 41 * 7);
  }
  CHECK_FALSE(cutter.is_behind());
  CHECK(cutter.state() == CuttingPhase::no_contact);
  int const particles = body.size();
  for (int k = 0; k < 5; ++k) cutter.advance(body, above(396, 34.7));
  CHECK(body.size() == particles);
  CHECK(testing::to_text(before.check(body)) == "");
}

TEST_CASE("a cutter says how many edges a tick has to cross at least", "[cutting]") {
  CHECK_THROWS_WITH(scalpel(0), says("crossings_per_tick is 0", "at least 1"));
  CHECK_THROWS_WITH(scalpel(-3), says("crossings_per_tick is -3", "at least 1"));
  auto body = sheet();
  auto cutter = scalpel(1);
  puncture(cutter, body, 13, 34.7);
  for (int k = 0; k < 80; ++k) cutter.advance(body, in(396, 34.7));
  CHECK(crossed(cutter) == 76);
}
