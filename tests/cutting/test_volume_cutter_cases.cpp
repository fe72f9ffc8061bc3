// SPDX-License-Identifier: MIT
// Cuts that end inside. Yardsticks: parts of a tetrahedron after each edge that a blade has come to, counted by hand; faces at the end of a stroke, found by
// hand in a block; the volumes of what a blade parts; tetrahedra that finer ticks make.
#include "catch.hpp"
#include "solid_strokes.hpp"
#include "solid_tissues.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

auto body_of(TetrahedralMesh<double> const& mesh) { return SoftBody(Elements::tissue(mesh, 0.0), BackwardEuler{}); }
auto block_of(int nx, int ny, int nz, BlockPattern pattern = BlockPattern::alternating) { return body_of(make_block<double>(nx, ny, nz, 0.005, pattern)); }
auto invariants_of(auto& body) { return testing::SolidCutInvariants(body, {.min_height = 0.0199 * body.mean_edge()}); }

/// A long straight blade that goes through one_tetrahedron() in the plane through `at`, and stops where toward · x = stop.
struct PartialCase {
  char const* name;
  Place at, normal, toward;
  double stop;
  int tetrahedra, particles, triangles, divided, open;   // `open`: faces

  template <class Body>
  void cut(VolumeCutter<double>& knife, Body& body) const {
    Place const way = toward - toward.dot(normal) / normal.squaredNorm() * normal, blade = 0.03 * normal.cross(way).normalized();
    for (int tick = 0; tick <= 20; ++tick) {
      Place const on = at + (stop - 0.03 * (1 - tick / 20.0) - toward.dot(at)) / toward.dot(way) * way;
      knife.advance(body, {on - blade, on + blade});
    }
  }
};

}  // namespace

TEST_CASE("a blade that stops after some of a tetrahedron's edges leaves the parts that are counted by hand", "[volume_cutter]") {
  // A new vertex on an edge of the border, while nothing is open: V − E + F = 2 with 3 F = 2 E, so F = 2 V − 4. A face that opens with one of its vertices adds
  // a particle and two triangles. Edges are named by their vertices.
  // Along A, x = 4 mm, 2 y + z is 0 on 01, 6 mm on 13, 12 mm on 12. All parts after 01 have its vertex; 13 and 12 are in one of the two parts.
  Place const a(0.004, 0, 0), of_a(1, 0, 0), along_a(0, 2, 1);
  // B goes through 02 at 2 mm, 03 and 12 in their middle, 13 at 8 mm from 1. The four are a ring: 02, 03, 13, 12; those across from one another have no common
  // corner. The second of two such is in both halves that the first has left. So it is one part more, and what lies between them and the third is a face
  // between parts: cut, and open at the vertex in the middle of the three, since it has the border all round.
  Place const b(0, 0.002, 0), of_b(-3, 5, 2), across(1, 0, 0.1), beside(0, 1, 0.1);
  // X goes through vertex 3, and 01 and 02 at 4 mm. Y goes through vertices 0 and 3, and 12 at x = 4 mm.
  Place const x(0, 0, 0.01), of_x(1, 1, 0.4), y(0, 0, 0), of_y(0.6, -0.4, 0);
  for (PartialCase const& c :
       {PartialCase{"A: 01", a, of_a, along_a, 0.003, 2, 5, 6, 1, 0}, PartialCase{"A: 01, 13", a, of_a, along_a, 0.009, 3, 6, 8, 2, 0},
        PartialCase{"A: 01, 13, 12", a, of_a, along_a, 0.015, 4, 10, 12, 3, 1}, PartialCase{"B: 02", b, of_b, across, 0.00025, 2, 5, 6, 1, 0},
        PartialCase{"B: 02, 03", b, of_b, across, 0.0015, 3, 6, 8, 2, 0}, PartialCase{"B: 02, 03, 13", b, of_b, across, 0.004, 5, 8, 12, 3, 1},
        PartialCase{"B: 02, 03, 13, 12", b, of_b, across, 0.008, 6, 12, 16, 4, 2}, PartialCase{"B: 03, 13", b, of_b, beside, 0.0013, 3, 6, 8, 2, 0},
        PartialCase{"B: 03, 13, 02", b, of_b, beside, 0.0035, 4, 7, 10, 3, 0}, PartialCase{"B: 03, 13, 02, 12", b, of_b, beside, 0.008, 6, 12, 16, 4, 2},
        PartialCase{"X: 01", x, of_x, Place(-1, 0, 1), -0.002, 2, 5, 6, 1, 0}, PartialCase{"X: 01, 02", x, of_x, Place(-1, 0, 1), 0.005, 3, 6, 8, 2, 0},
        PartialCase{"X: 01, 02, vertex 3", x, of_x, Place(-1, 0, 1), 0.015, 3, 9, 10, 2, 1},
        PartialCase{"X: vertex 3", x, of_x, Place(1, 0, -1), -0.005, 1, 4, 4, 0, 0},
        PartialCase{"X: vertex 3, 02", x, of_x, Place(1, 0, -1), 0.002, 2, 5, 6, 1, 0}, PartialCase{"Y: 12", y, of_y, Place(-1, 0, 0.2), -0.002, 2, 5, 6, 1, 0},
        PartialCase{"Y: 12, vertex 0", y, of_y, Place(-1, 0, 0.2), 0.001, 2, 5, 6, 1, 0},
        PartialCase{"Y: 12, vertices 0 and 3", y, of_y, Place(-1, 0, 0.2), 0.006, 2, 8, 8, 1, 1},
        PartialCase{"Y: vertices 0 and 3", y, of_y, Place(1, 0, 0), 0.002, 1, 4, 4, 0, 0}}) {
    INFO(c.name);
    auto body = body_of(one_tetrahedron());
    auto const before = invariants_of(body);
    VolumeCutter<double> knife;
    c.cut(knife, body);
    for (bool const lifts : {false, true}) {   // there is no edge between two closed faces to divide
      if (lifts) knife.lift(body);
      CHECK(body.tissue().tetrahedra() == c.tetrahedra);
      CHECK(body.size() == c.particles);
      CHECK(body.triangles().cols() == c.triangles);
      CHECK(knife.report().edges_divided == c.divided);
      CHECK(testing::to_text(before.check(body)) == "");
    }
    int wounds = 0;
    for (int t = 0; t < c.triangles; ++t) wounds += body.tissue().is_wound(t) ? 1 : 0;
    CHECK(wounds == 2 * c.open);
    CHECK(pieces(body) == (c.particles - c.divided - 4 > 1 ? 2 : 1));   // three vertices or four have split, or one, or none
    CHECK(knife.report().closed_faces == 0);
  }
}

TEST_CASE("a tip that has come through a face and no edge waits for the first edge, and cuts that", "[volume_cutter]") {
  auto body = body_of(one_tetrahedron());
  VolumeCutter<double> knife;
  auto const go = [&](double x, double tip) { knife.advance(body, {Place(x, 0.003, -0.02), Place(x, 0.003, tip)}); };
  for (int tick = 0; tick <= 20; ++tick) go(0.002, -0.002 + 0.004 * tick / 20);   // up through the face at z = 0; the tetrahedron is 5 mm high there
  for (int tick = 0; tick <= 10; ++tick) go(0.002 - 0.001 * tick / 10, 0.002);    // and aside in it
  CHECK_FALSE(knife.is_cutting());
  CHECK(body.tissue().tetrahedra() == 1);
  CHECK(body.size() == 4);
  CHECK(body.triangles().cols() == 4);
  CHECK(knife.report().area == 0);
  for (int tick = 0; tick <= 10; ++tick) go(0.001 - 0.004 * tick / 10, 0.002);   // out over the edge from (0, 0, 0) to (0, 10, 0) mm
  CHECK(knife.report().edges_divided == 1);
  CHECK(body.tissue().tetrahedra() == 2);
  REQUIRE(body.size() == 5);
  CHECK((body.tissue().rest_position(4) - Place(0, 0.003, 0)).norm() < 1e-15);
}

namespace {

/// In a block of the alternating pattern, at a vertex c that has the six edges along the axes alone: eight tetrahedra, each with a right corner at c. The plane
/// 2 mm along all three axes from c goes through the edges ahead, and through edges from the ends of those to the ends of the ones behind.
struct Corner {
  decltype(block_of(2, 2, 2)) body = block_of(5, 5, 5);
  testing::SolidCutInvariants<decltype(body)> before = invariants_of(body);
  Place c;
  VolumeCutter<double> knife;
  int const tetrahedra = body.tissue().tetrahedra(), particles = body.size(), triangles = static_cast<int>(body.triangles().cols());

  Corner() {
    bool is_found = false;
    for (int i = 0; i < body.size(); ++i) {
      int joined = 0;
      body.tissue().for_each_joined(i, [&](int) { ++joined; });
      Place const at = body.tissue().rest_position(i);
      if (joined == 6 && body.tissue().topology().tetrahedra_at(i).size() == 8 && at.maxCoeff() < 0.006) c = at, is_found = true;
    }
    REQUIRE(is_found);
  }
  /// From the middle of one place of the blade to that of another, with half of its length at each [mm from c].
  void cut(Place const& from, double half_from, Place const& to, double half_to, Place const& along) {
    for (int tick = 0; tick <= 20; ++tick) {
      double const u = tick / 20.0;
      Place const at = c + 0.001 * ((1 - u) * from + u * to), half = 0.001 * ((1 - u) * half_from + u * half_to) * along.normalized();
      knife.advance(body, {at - half, at + half});
    }
  }
  void check(int more_tetrahedra, int more_particles, int open_faces, double area, double open_area, int closed_faces) {
    CHECK(body.tissue().tetrahedra() - tetrahedra == more_tetrahedra);
    CHECK(body.size() - particles == more_particles);
    CHECK(body.triangles().cols() - triangles == 2 * open_faces);
    CHECK(knife.report().area == Approx(area).epsilon(1e-9));
    CHECK(knife.report().lip_area == Approx(2 * open_area).epsilon(1e-9));
    CHECK(knife.report().closed_faces == closed_faces);
    CHECK(pieces(body) == 1);
    CHECK(testing::to_text(before.check(body)) == "");
  }
};

}  // namespace

TEST_CASE("where a stroke ends inside, one face stays closed, two open with the edge between them, and a ring opens at its vertex", "[volume_cutter]") {
  double const triangle = 2 * std::sqrt(3.0) * 1e-6, step = std::sqrt(6.0);   // m², of three points 2 mm along the axes; mm
  SECTION("one face: its three edges have four tetrahedra each, and no two edges are across from one another in one") {
    Corner corner;
    Place const up = Place(-1, -1, 2) / step, middle(1, 1, 0);
    corner.cut(middle - 0.2 * up, 1.6, middle + 2.6 * up, 1.6, Place(-1, 1, 0));
    corner.check(12, 3, 0, triangle, 0, 0);
    CHECK(corner.knife.is_cutting());
    corner.knife.lift(corner.body);
    corner.check(12, 3, 0, triangle, 0, 1);
  }
  SECTION("two faces in one tetrahedron: it is cut in six, and others at the four edges in two or three; the edge between the faces has four tetrahedra") {
    // Edges c-x and c-y with four tetrahedra each, x-z′ and y-z′ with six; the tetrahedron c x y z′ is at all of them, in six parts: 4 + 4 + 6 + 6 + 1.
    Corner corner;
    Place const down = Place(1, 1, -2) / step, middle(1, 1, 0);
    double const height = 4.5 / step, area = (std::sqrt(2.0) + 3.5 / std::sqrt(2.0)) * height * 1e-6;
    corner.cut(middle - 0.2 * down, 2.7, middle + (height + 0.2) * down, 2.7, Place(-1, 1, 0));
    corner.check(21, 4, 0, area, 0, 0);
    corner.knife.lift(corner.body);
    corner.check(25, 6, 4, area, area, 0);   // the vertex in the middle of that edge, and its copy; two faces have become four
  }
  SECTION("a ring of faces: those at its vertex open in the tick that closes it, two beyond the edges of the ring stay closed") {
    // Two triangles and two quadrilaterals round the vertex on c-x. The blade comes from the edges beyond x: diagonals go to those and not to the vertex.
    Corner corner;
    Place const out = Place(2, -1, -1) / step, vertex(2, 0, 0);
    double const high = 4.5 / step, low = 6 / step;
    corner.cut(vertex + (high + 0.16) * out, 1.15, vertex - (low + 0.15) * out, 3.75, Place(0, 1, -1));
    double const outer = 1.5 * std::sqrt(2.0) / 2 * high * 1e-6;   // m², the triangle on the side of x
    double const trapezium = (std::sqrt(2.0) + 3.5 / std::sqrt(2.0)) * high * 1e-6;
    // The quadrilateral has parallel sides of 2 √2 and 3.5 √2 mm; its diagonal parts it as those.
    double const all = triangle + outer + 2 * trapezium, beyond = 2 * trapezium * 3.5 / 5.5;
    int const made = corner.body.tissue().tetrahedra() - corner.tetrahedra;
    corner.check(made, 8, 4, all, all - beyond, 0);
    corner.knife.lift(corner.body);
    corner.check(made, 8, 4, all, all - beyond, 2);
  }
}

TEST_CASE("two cutting edges that are offset and two elements apart cut between them, too, as one blade of three pieces", "[volume_cutter]") {
  // Yardstick: the volume on one side of the three planes that they sweep.
  for (BlockPattern const pattern : {BlockPattern::alternating, BlockPattern::kuhn})
    for (double const offset : {0.0025, 0.005, 0.0075}) {
      INFO("offset by " << offset << " m");
      auto body = block_of(7, 7, 7, pattern);
      auto const before = invariants_of(body);
      double const side = 0.03, x = 0.0128;
      VolumeCutter<double> knife;
      for (int tick = 0; tick <= 60; ++tick) {
        double const y = -0.005131 + 0.0412377 * tick / 60;
        std::array<Place, 4> const blade{Place(x, y, -0.005), Place(x, y, 0.0102), Place(x + offset, y, 0.0202), Place(x + offset, y, 0.035)};
        knife.advance(body, std::span<Place const>(blade));
      }
      knife.lift(body);
      CHECK(testing::to_text(before.check(body)) == "");
      REQUIRE(pieces(body) == 2);
      auto const mesh = body.rest_solid();
      auto const parts = connected_components(mesh);
      double near = 0;   // m³, of the piece with the vertex at 0
      for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
        auto const at = [&](int k) { return Place(mesh.points.col(mesh.tetrahedra(k, t))); };
        auto const& part = parts[std::binary_search(parts[0].begin(), parts[0].end(), 0) ? 0 : 1];
        if (std::binary_search(part.begin(), part.end(), mesh.tetrahedra(0, t))) near += (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6;
      }
      CHECK(near == Approx(side * (x * side + offset * (0.005 + side - 0.0202))).epsilon(0.03));   // it bends to vertices
      CHECK(knife.report().area == Approx(side * (0.02 + std::hypot(0.01, offset))).epsilon(0.01));
    }
}

TEST_CASE("a stroke that ends or begins at an old wound parts the piece; one that goes on where another ended begins an edge before", "[volume_cutter]") {
  // Yardsticks: pieces; the area of a plane through the block.
  double const height = 0.025, wall = 0.0113;   // the wound is at x = wall, from y = 0 to 15 mm
  auto const sweep = [](auto& body, Place const& from, Place const& way) {
    VolumeCutter<double> knife;
    stroke(knife, body, from - Place(0, 0, 0.01), from + Place(0, 0, 0.04), way, 50);
    knife.lift(body);
    return knife.area();
  };
  for (BlockPattern const pattern : {BlockPattern::alternating, BlockPattern::kuhn}) {
    for (double const beyond : {0.0005, 0.0021, 0.0043})   // less than an edge: what stays uncut is in the tissue beyond
      for (bool const begins : {false, true}) {
        INFO((begins ? "begins " : "ends ") << beyond << " m beyond the wound");
        auto body = block_of(6, 6, 6, pattern);
        auto const before = invariants_of(body);
        sweep(body, Place(wall, -0.01, 0), Place(0, 0.025, 0));
        REQUIRE(pieces(body) == 1);
        Place const at(wall + beyond, 0.0078, 0), outside(-0.01, 0.0078, 0);
        double const area = begins ? sweep(body, at, outside - at) : sweep(body, outside, at - outside);
        CHECK(pieces(body) == 2);
        CHECK(area > wall * height * (1 - 1e-9));
        CHECK(testing::to_text(before.check(body)) == "");
      }
    for (double const short_of : {0.0012, 0.0061}) {   // it joins the piece, with what is uncut before the blade's end
      auto body = block_of(6, 6, 6, pattern);
      sweep(body, Place(wall, -0.01, 0), Place(0, 0.025, 0));
      double const area = sweep(body, Place(-0.01, 0.0078, 0), Place(0.01 + wall - short_of, 0, 0));
      CHECK(pieces(body) == 1);
      CHECK(area < (wall - short_of) * height);
      CHECK(area > (wall - short_of - 0.0071) * height);   // m, the longest edge
    }
    for (double const end : {0.0123, 0.0137, 0.0151})
      for (double const back : {0.0, 0.005, 0.0075}) {
        INFO("another blade goes on from " << back << " m before the end at " << end);
        auto body = block_of(6, 6, 6, pattern);
        double area = sweep(body, Place(wall, -0.01, 0), Place(0, end + 0.01, 0));
        area += sweep(body, Place(wall, end - back, 0), Place(0, 0.035 - end + back, 0));
        double const left = height - area / height;   // m, of the way, in the mean
        CHECK(pieces(body) == (back > 0 ? 2 : 1));
        if (back > 0)
          CHECK(std::abs(left) < 1e-9);
        else
          CHECK((left > 0.001 && left < 0.005));   // a strip with no more than an edge between the last edges of the one and the first ones of the other
      }
  }
}

TEST_CASE("a tick exceeds max_tetrahedra by what the blade makes on half a mean edge at most, and the rest comes in the next ones", "[volume_cutter]") {
  // Yardstick: the most that ticks of a twentieth of an edge make on such a way.
  for (BlockPattern const pattern : {BlockPattern::alternating, BlockPattern::kuhn}) {
    auto const to = [](double y) { return BladeSegment<double>{{0.0137, y, -0.005}, {0.0153, y, 0.035}}; };
    double const from = -0.005131, way = 0.0412377;
    auto whole = block_of(7, 7, 7, pattern);
    VolumeCutter<double> fast;
    int const ticks = static_cast<int>(20 * way / whole.mean_edge()) + 1, span = 11;
    std::vector<int> made{0};
    for (int tick = 0; tick <= ticks; ++tick) {
      fast.advance(whole, to(from + way * tick / ticks));
      made.push_back(whole.tissue().tetrahedra());
    }
    int largest = 0;
    for (std::size_t k = 1 + span; k < made.size(); ++k) largest = std::max(largest, made[k] - made[k - span]);
    REQUIRE(largest > 20);
    for (int const most : {1, 20, 60, 150}) {
      INFO("at most " << most << ", and up to " << largest << " on half an edge");
      auto body = block_of(7, 7, 7, pattern);
      VolumeCutter<double> slow({.max_tetrahedra = most});
      slow.advance(body, to(from));
      int count = 0;
      do {
        int const before = body.tissue().tetrahedra();
        slow.advance(body, to(from + way));
        CHECK(body.tissue().tetrahedra() - before <= most - 1 + largest);
        if (slow.is_behind()) CHECK(body.tissue().tetrahedra() - before >= most);
        ++count;
      } while (slow.is_behind() && count < 100);
      CHECK(count > 1);
      CHECK(shape(body) == shape(whole));
    }
  }
}

TEST_CASE("what an earlier stroke, or another blade, has left closed opens with what opens beside it, and a blade that begins deep inside cuts", "[volume_cutter]") {
  // Yardsticks: the checker, after every tick; the area of the way.
  SECTION("four strokes of a blade, two ticks each: one vertex was left between two parts of the tissue") {
    std::array<BladeSegment<double>, 8> const ticks{{{{0.0071911876, 0.0071812523, 0.0149970606}, {-0.0027075993, -0.0043678613, 0.0064699101}},
                                                     {{0.0107804434, 0.0124313357, 0.0137799086}, {0.0006862923, 0.0001964336, 0.0038998570}},
                                                     {{0.0086345904, 0.0209825418, 0.0009568626}, {0.0041444999, 0.0177765174, -0.0024829208}},
                                                     {{0.0063273437, 0.0105559675, 0.0115100324}, {0.0005223089, 0.0055426184, 0.0066610349}},
                                                     {{0.0099218955, -0.0129069547, -0.0008598828}, {0.0176868409, -0.0037891138, 0.0015165188}},
                                                     {{0.0079374771, -0.0068681194, 0.0024655831}, {0.0140930449, 0.0040510588, 0.0041750955}},
                                                     {{0.0039686402, 0.0052095513, 0.0091165148}, {0.0069054530, 0.0197314038, 0.0094922488}},
                                                     {{-0.0030684842, 0.0111603432, 0.0256068773}, {0.0141777881, 0.0026179102, 0.0188412709}}}};
    auto body = body_of(solid_of(32));
    auto const before = invariants_of(body);
    VolumeCutter<double> knife;
    for (auto const& blade : ticks) {
      knife.advance(body, blade);
      CHECK(testing::to_text(before.check(body)) == "");
    }
  }
  SECTION("three blades by turns, and again") {
    for (unsigned const seed : {4u, 12u, 32u, 45u, 54u}) {
      INFO("seed " << seed);
      auto const mesh = solid_of(seed);
      if (!validate(mesh).empty()) continue;
      auto body = body_of(mesh);
      auto const before = invariants_of(body);
      auto const strokes = strokes_of(seed).strokes;
      std::array<VolumeCutter<double>, 3> knives;
      for (int round = 0; round < 2; ++round) {
        for (std::size_t tick = 0; tick < 22; ++tick) {
          for (std::size_t n = 0; n < 3; ++n) {
            if (tick >= strokes[n].size()) continue;
            auto const& [from, to, steps] = strokes[n][tick];
            Place const aside = round * Place(0.0004, -0.0003, 0.0002);
            knives[n].advance(body, {from + aside, to + aside});
          }
          REQUIRE(testing::to_text(before.check(body)) == "");
        }
        for (auto& knife : knives) {
          knife.lift(body);
          REQUIRE(testing::to_text(before.check(body)) == "");
        }
      }
    }
  }
  SECTION("12 mm long, 12 mm deep in 40") {
    auto body = block_of(9, 9, 9);
    VolumeCutter<double> knife;
    for (int tick = 0; tick <= 60; ++tick) {
      double const x = 0.012 + 0.016 * tick / 60;
      knife.advance(body, {Place(x, 0.0213, 0.0147), Place(x, 0.0213, 0.0267)});
    }
    knife.lift(body);
    CHECK(knife.area() > 0.4 * 0.012 * 0.016);   // up to an edge short of each side
    CHECK(knife.area() < 0.012 * 0.016);
  }
}
