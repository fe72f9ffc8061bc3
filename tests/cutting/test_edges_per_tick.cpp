// SPDX-License-Identifier: MIT
// Yardsticks: edges and vertices of a grid, counted by hand, and the same way in ticks far shorter than an edge: however few edges a tick may go
// over, a leap cuts as a slower tip does. Points in mm.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace palpate;

namespace {

using Sheet = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
using Scalpel = SeparatingCutter<double>;

constexpr int all = std::numeric_limits<int>::max();

/// 40 × 6 squares of 1 cm, each with one diagonal from lower left to upper right.
TriangleMesh<double> grid() { return make_grid<double>(41, 7, 0.01); }

Scalpel scalpel(int edges) { return Scalpel({.puncture_depth = 0.002, .edges_per_tick = edges}); }

Vector3<double> in(double x, double y) { return {x * 1e-3, y * 1e-3, -0.003}; }
Vector3<double> above(double x, double y) { return {x * 1e-3, y * 1e-3, 0.004}; }

/// A sheet and what no cut may change, checked after every tick.
struct Bench {
  explicit Bench(TriangleMesh<double> const& mesh = grid()) : body(make_tissue(mesh)), before(body, {.moves_vertices = true}) {}

  void tick(Scalpel& cutter, Vector3<double> const& tip) {
    cutter.advance(body, tip);
    if (only_separates)
      REQUIRE(testing::to_text(before.check(body)) == "");
    else
      require_valid();
  }
  void tick(ProgressiveCutter<double>& cutter, Vector3<double> const& tip) {
    cutter.advance(body, tip);
    only_separates = false;
    require_valid();
  }
  void require_valid() {
    for (MeshDefect const& defect : validate(body.rest_mesh()))
      REQUIRE((defect.kind == MeshDefectKind::duplicate_vertex || defect.kind == MeshDefectKind::open_border));   // lips, the sheet's border
  }
  template <class Tool>
  void puncture(Tool& cutter, double x, double y) {
    tick(cutter, above(x, y)), tick(cutter, in(x, y));
    REQUIRE(cutter.state() == CuttingPhase::moving);
  }
  /// Ticks at one place until the cut is there; how many.
  template <class Tool>
  int leap(Tool& cutter, Vector3<double> const& tip) {
    int ticks = 0;
    do tick(cutter, tip), ++ticks;
    while (cutter.is_behind() && ticks < 1000);
    REQUIRE_FALSE(cutter.is_behind());
    return ticks;
  }
  /// Down, along and up again in ticks of 0.3 mm.
  void slowly(Scalpel& cutter, std::vector<std::array<double, 2>> const& points) {
    Points<double> path;
    for (auto const& p : points) path.push_back(in(p[0], p[1]));
    puncture(cutter, points.front()[0], points.front()[1]);
    for (auto const& tip : sampled(path, 3e-4)) tick(cutter, tip);
    tick(cutter, above(points.back()[0], points.back()[1]));
  }

  Sheet body;
  testing::CutInvariants<Sheet> before;
  bool only_separates = true;
};

/// An edge between two inner vertices opens with the second.
int opened_of(int edges) { return edges < 2 ? 0 : edges; }

/// The grid without the squares from x to x_end that a way at y = 30 mm meets, and without the particles inside.
TriangleMesh<double> with_hole(int column, int column_end) {
  auto const whole = grid();
  TriangleMesh<double> mesh;
  std::vector<int> now(static_cast<std::size_t>(whole.points.cols()), -1);
  for (Eigen::Index t = 0; t < whole.triangles.cols(); ++t) {
    Vector3<double> middle = Vector3<double>::Zero();
    for (int k = 0; k < 3; ++k) middle += whole.points.col(whole.triangles(k, t)) / 3;
    if (middle.x() > 0.01 * column && middle.x() < 0.01 * column_end && std::abs(middle.y() - 0.03) < 0.02) continue;
    mesh.triangles.conservativeResize(3, mesh.triangles.cols() + 1);
    for (int k = 0; k < 3; ++k) {
      int const p = whole.triangles(k, t);
      int& name = now[static_cast<std::size_t>(p)];
      if (name < 0) {
        name = static_cast<int>(mesh.points.cols());
        mesh.points.conservativeResize(3, name + 1);
        mesh.points.col(name) = whole.points.col(p);
      }
      mesh.triangles(k, mesh.triangles.cols() - 1) = name;
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE("a tick goes over no more edges than it may, and the ticks that follow over the rest", "[cutting]") {
  // From (20, 30) to (380, 30): 36 edges. While the blade is in the tissue the wound ends one before.
  int const most = GENERATE(1, 2, 5, 6, 8, 35, 36, 37, 100);
  CAPTURE(most);
  Bench sheet, at_once, slow;
  auto cutter = scalpel(most), quick = scalpel(all), hand = scalpel(most);
  sheet.puncture(cutter, 20, 31), at_once.puncture(quick, 20, 31);
  CHECK(at_once.leap(quick, in(380, 31)) == 1);
  CHECK(quick.report().vertex_vertex == 35);

  int ticks = 0;
  do {
    sheet.tick(cutter, in(380, 31));
    ++ticks;
    CHECK(cutter.report().vertex_vertex == opened_of(std::min(most * ticks, 36) - 1));
    CHECK(cutter.is_behind() == (most * ticks <= 36));
  } while (cutter.is_behind());
  CHECK(ticks == 36 / most + 1);
  CHECK(cutter.contact().home_point.x() == Approx(0.38));
  sheet.tick(cutter, above(380, 31)), at_once.tick(quick, above(380, 31));
  slow.slowly(hand, {{20, 31}, {380, 31}});
  for (Bench const* other : {&at_once, &slow}) {
    REQUIRE(sheet.body.triangles() == other->body.triangles());
    CHECK((sheet.body.rest_mesh().points - other->body.rest_mesh().points).cwiseAbs().maxCoeff() < 1e-12);
  }
  CHECK(cutter.report().vertex_vertex == 36);
  CHECK(cutter.report().particles_added == 35);
}

TEST_CASE("a tick goes over no more edges than it may where they are far shorter than the mean", "[cutting]") {
  int const most = GENERATE(1, 2, 5);
  double const tip = GENERATE(0.3935, 0.399);   // m
  CAPTURE(most, tip);
  TriangleMesh<double> mesh = grid();
  double const all_columns = 1 - std::pow(1.1, -40);   // each a tenth narrower than the one before
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points(0, i) = 0.4 * (1 - std::pow(1.1, -100 * mesh.points(0, i))) / all_columns;
  Bench sheet(mesh);
  auto cutter = scalpel(most);
  sheet.puncture(cutter, 40, 31);
  int opened = 0, ticks = 0;
  do {
    sheet.tick(cutter, in(1e3 * tip, 31));
    CHECK(cutter.report().vertex_vertex - opened <= most + (opened == 0 ? 1 : 0));   // the first opens with the second
    opened = cutter.report().vertex_vertex;
  } while (cutter.is_behind() && ++ticks < 1000);
  CHECK_FALSE(cutter.is_behind());
  sheet.tick(cutter, above(1e3 * tip, 31));
  CHECK(cutter.report().vertex_vertex >= 30);
}

TEST_CASE("a leap askew opens along the blade's line", "[cutting]") {
  int const most = GENERATE(1, 3, 10, 100);
  double const end = GENERATE(25.0, 38.0, 52.0);   // mm
  CAPTURE(most, end);
  Bench sheet;
  auto cutter = scalpel(most);
  sheet.puncture(cutter, 22, 32);
  sheet.leap(cutter, in(378, end));
  sheet.tick(cutter, above(378, end));
  CHECK(cutter.report().vertex_vertex >= 36);   // of columns
  CHECK(cutter.report().vertex_vertex <= 36 + std::abs(end - 32) / 10 + 2);
  for (auto const& [a, b] : cutter.lips()) {
    Vector3<double> const p = 1e3 * sheet.body.tissue().rest_position(a);
    CHECK(std::abs(p.y() - 32 - (p.x() - 22) * (end - 32) / 356) < 1e-6);
  }
}

TEST_CASE("a leap over wounds cuts what lies between them", "[cutting]") {
  int const most = GENERATE(1, 2, 5, 9);
  CAPTURE(most);
  Bench sheet;
  for (double const x : {100.0, 150.0, 160.0, 300.0}) {
    auto first = scalpel(all);
    sheet.slowly(first, {{x, 10}, {x, 50}});
    REQUIRE(first.report().vertex_vertex == 4);
  }
  auto cutter = scalpel(most);
  sheet.puncture(cutter, 20, 31);
  CHECK(sheet.leap(cutter, in(380, 31)) <= 36 / most + 1 + 4);   // a tick more for each
  sheet.tick(cutter, above(380, 31));
  CHECK(cutter.report().vertex_vertex == 36);
  CHECK(cutter.report().particles_added == 35 + 4);   // where it crosses a wound, one of each lip
}

TEST_CASE("a leap over a hole ends on this side and goes on from the other", "[cutting]") {
  int const most = GENERATE(1, 3, 8, 15, all);
  CAPTURE(most);
  Bench sheet(with_hole(15, 25));
  auto cutter = scalpel(most);
  sheet.puncture(cutter, 20, 31);
  sheet.leap(cutter, in(380, 31));
  sheet.tick(cutter, above(380, 31));
  CHECK(cutter.report().vertex_vertex == 13 + 13);
  CHECK(cutter.report().particles_added == 13 + 13);   // the border's too
}

TEST_CASE("a leap over the border opens it", "[cutting]") {
  int const most = GENERATE(1, 7, 19, 38, all);
  CAPTURE(most);
  Bench sheet;
  auto cutter = scalpel(most);
  sheet.puncture(cutter, 20, 31);
  sheet.leap(cutter, in(405, 31));
  CHECK(cutter.contact().off_surface);
  CHECK(cutter.report().vertex_vertex == 38);
  CHECK(cutter.report().particles_added == 38);

  SECTION("and back where it left: the cut goes on from there") {
    sheet.leap(cutter, in(380, 44));
    sheet.tick(cutter, above(380, 44));
    CHECK(cutter.report().vertex_vertex > 38);
  }
  SECTION("and far away: it starts anew, here at the lip beside") {
    for (double const x : {420.0, 420.0}) sheet.tick(cutter, in(x, 31));
    sheet.tick(cutter, in(200, 41));
    sheet.tick(cutter, above(200, 41));
    CHECK(cutter.report().vertex_vertex == 38 + 1);
  }
}

TEST_CASE("a cut that is behind a blade that leaves the surface and comes back elsewhere ends where the blade was", "[cutting]") {
  Bench sheet;
  auto cutter = scalpel(3);
  sheet.puncture(cutter, 20, 31);
  sheet.tick(cutter, in(200, 31));
  REQUIRE(cutter.is_behind());
  sheet.tick(cutter, in(200, 120));
  CHECK(cutter.contact().off_surface);
  sheet.leap(cutter, in(300, 31));
  CHECK(cutter.state() == CuttingPhase::moving);
  sheet.tick(cutter, in(300, 31));
  CHECK(cutter.report().vertex_vertex == 18);
  sheet.leap(cutter, in(330, 31));
  sheet.tick(cutter, above(330, 31));
  CHECK(cutter.report().vertex_vertex == 18 + 3);
  CHECK(connected_components(sheet.body.rest_mesh()).size() == 1);
}

TEST_CASE("a tip that is lifted leaves no separating cut half made, and the next puncture waits", "[cutting]") {
  Bench sheet;
  auto cutter = scalpel(5);
  sheet.puncture(cutter, 20, 31);
  sheet.tick(cutter, in(380, 31));
  int ticks = 1;
  SECTION("lifted") {
    do {
      sheet.tick(cutter, above(380, 31)), ++ticks;
      CHECK(cutter.state() == CuttingPhase::no_contact);
    } while (cutter.is_behind());
    CHECK(ticks == 36 / 5 + 1);
    sheet.tick(cutter, above(200, 31));
    CHECK(cutter.report().vertex_vertex == 36);
  }
  SECTION("down again") {
    sheet.tick(cutter, above(380, 31)), ++ticks;
    while (cutter.state() != CuttingPhase::moving && ticks < 20) {
      if (cutter.is_behind()) CHECK(cutter.report().vertex_vertex == 5 * ticks - 1);
      sheet.tick(cutter, in(200, 11)), ++ticks;
    }
    CHECK(ticks == 36 / 5 + 2);   // one more punctures
    CHECK(cutter.report().vertex_vertex == 0);
    CHECK(sheet.body.size() == 41 * 7 + 35);
    sheet.leap(cutter, in(250, 11));
    sheet.tick(cutter, above(250, 11));
    CHECK(cutter.report().vertex_vertex == 5);
  }
}

TEST_CASE("a tip that goes on while the cut is behind, and is lifted then, loses nothing of its way", "[cutting]") {
  int const most = GENERATE(3, 5, 8);
  CAPTURE(most);
  Bench sheet;
  auto const draw = [&](auto cutter) {
    sheet.puncture(cutter, 20, 31);
    for (double const x : {110.0, 200.0, 290.0, 380.0}) sheet.tick(cutter, in(x, 31));
    REQUIRE(cutter.is_behind());
    sheet.leap(cutter, above(380, 31));
    CHECK(cutter.state() == CuttingPhase::no_contact);
    return cutter;
  };
  SECTION("along edges") { CHECK(draw(scalpel(most)).report().vertex_vertex == 36); }
  SECTION("anywhere") {
    auto const cutter = draw(ProgressiveCutter<double>({.puncture_depth = 0.002, .crossings_per_tick = most}));
    double farthest = 0;
    for (auto const& [a, b] : cutter.lips()) farthest = std::max(farthest, sheet.body.tissue().rest_position(a).x());
    CHECK(farthest >= 0.37);   // the last column; the end itself is one particle
  }
}

TEST_CASE("a separating cut that is behind ends where it is when the tool is taken away, and is gone with the state it was in", "[cutting]") {
  Bench sheet;
  auto cutter = scalpel(5);
  auto const whole = sheet.body.save();
  sheet.puncture(cutter, 20, 31);
  sheet.tick(cutter, in(380, 31));
  REQUIRE(cutter.is_behind());
  SECTION("taken away") {
    cutter.reset(sheet.body);
    CHECK(cutter.report().vertex_vertex == 5);
  }
  SECTION("taken away after the tip was lifted") {
    sheet.tick(cutter, above(380, 31));
    cutter.reset(sheet.body);
    CHECK(cutter.report().vertex_vertex == 10);
  }
  SECTION("restored") {
    sheet.body.restore(whole);
    sheet.tick(cutter, in(380, 31));
    CHECK(sheet.body.size() == 41 * 7);
  }
  SECTION("restored after the tip was lifted") {
    sheet.tick(cutter, above(380, 31));
    sheet.body.restore(whole);
    sheet.tick(cutter, above(380, 31));
    CHECK(sheet.body.size() == 41 * 7);
  }
  CHECK_FALSE(cutter.is_behind());
  CHECK(cutter.state() == CuttingPhase::no_contact);
  int const particles = sheet.body.size();
  for (int k = 0; k < 5; ++k) sheet.tick(cutter, above(380, 31));
  CHECK(sheet.body.size() == particles);
}

TEST_CASE("separating cuts that are behind in one body", "[cutting]") {
  Bench sheet;
  auto cutter = scalpel(3);
  sheet.puncture(cutter, 20, 31);
  SECTION("two beside each other: each as if alone") {
    auto other = scalpel(4);
    sheet.puncture(other, 380, 11);
    for (int k = 0; k < 20; ++k) sheet.tick(cutter, in(380, 31)), sheet.tick(other, in(20, 11));
    sheet.tick(cutter, above(380, 31)), sheet.tick(other, above(20, 11));
    CHECK(cutter.report().vertex_vertex == 36);
    CHECK(other.report().vertex_vertex == 36);
    CHECK(sheet.body.size() == 41 * 7 + 35 + 35);
  }
  SECTION("two across each other") {
    auto other = scalpel(1);
    sheet.puncture(other, 200, 10);
    for (int k = 0; k < 20; ++k) sheet.tick(cutter, in(380, 31)), sheet.tick(other, in(200, 50));
    sheet.tick(cutter, above(380, 31)), sheet.tick(other, above(200, 50));
    CHECK(cutter.report().vertex_vertex == 36);
    CHECK(other.report().vertex_vertex == 4);
    CHECK(sheet.body.size() == 41 * 7 + 35 + 4);   // one each, and one more where they cross
  }
  SECTION("a progressive one divides the triangle that the blade was in") {
    ProgressiveCutter<double> other({.puncture_depth = 0.002, .crossings_per_tick = 2});
    sheet.puncture(other, 372, 12);
    sheet.tick(cutter, in(377, 32));
    for (int k = 0; k < 40; ++k) sheet.tick(cutter, in(377, 32)), sheet.tick(other, in(378, 48));
    CHECK_FALSE(cutter.is_behind());
    sheet.tick(cutter, above(377, 32)), sheet.tick(other, above(378, 48));
    CHECK(cutter.report().vertex_vertex >= 35);
  }
  SECTION("the triangle that the blade was in is gone when another's blade has left it") {
    ProgressiveCutter<double> other({.puncture_depth = 0.002});
    sheet.puncture(other, 368, 24);
    sheet.tick(other, in(376, 32));
    REQUIRE(sheet.body.temporary_subdivisions().size() == 1);
    sheet.tick(cutter, in(377, 32));
    sheet.tick(other, in(395, 32));
    other.reset(sheet.body);
    sheet.leap(cutter, in(377, 32));
    sheet.tick(cutter, above(377, 32));
    CHECK(cutter.report().vertex_vertex >= 33);
  }
}

TEST_CASE("a separating cutter says how many edges a tick has to go over at least", "[cutting]") {
  CHECK_THROWS_WITH(scalpel(0), says("edges_per_tick is 0", "at least 1"));
  CHECK_THROWS_WITH(scalpel(-3), says("edges_per_tick is -3", "at least 1"));
}
