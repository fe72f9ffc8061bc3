// SPDX-License-Identifier: MIT
// A blade as a tool of a body of cubes. Yardsticks: faces counted by hand, and the same stroke by Cubes::cut in one.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/body_loop.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <vector>

using namespace palpate;
using namespace palpate_test;

static_assert(Cutter<CubeCutter<double>, Cubes<double>> && ResettableCutter<CubeCutter<float>, Cubes<float>> && CountsArea<CubeCutter<double>>);

namespace {

constexpr double edge = 0.01;   // m

/// 6 × 4 × 3 cubes, nailed below.
template <class S>
Cubes<S> block(int levels = 0) {
  TriangleMesh<S> skin = surface(make_block<S>(7, 5, 4, S(edge), BlockPattern::alternating));
  repair(skin);   // without the points inside
  Cubes<S> body(skin, {.edge = S(edge), .young = 5000, .levels = levels});
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
  return body;
}
template <class S>
CubeCutter<S> knife(S puncture_depth = 0) {
  return CubeCutter<S>({.edge = {Vector3<S>::Zero(), Vector3<S>(0, 0, S(0.05))}, .puncture_depth = puncture_depth});
}
/// Steps until nothing moves.
template <class S>
void settle(Cubes<S>& body) {
  for (int k = 0; k < 400 && !body.step(S(1e-3)).at_rest; ++k) {
  }
}

}  // namespace

TEMPLATE_TEST_CASE("a blade that comes down on cubes and goes through them opens the faces that it passes", "[cutting][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (int const levels : {0, 1}) {
    BodyLoop loop(block<S>(levels), knife<S>(), ContactCoupling{}, 100);
    auto const tick = [&](double x, double y, double z) { return loop.tick({Vector3<S>(S(x), S(y), S(z))}, S(1e-3)); };
    for (int k = 0; k <= 20; ++k) tick(0.0202, 0.0003, 0.04 - 0.001 * k);   // 10 mm deep at the rim of the top
    CHECK(loop.cutter().state() == CuttingPhase::moving);
    for (int k = 0; k <= 60; ++k) tick(0.0202, 0.0003 + 0.0005 * k, 0.0201);
    // Across y = 0.3 … 30.3 mm, z > 20.1 mm: one layer of faces, three of them.
    CHECK(loop.body().opened_faces() == 3);
    CHECK(loop.cutter().report().faces_opened == 3);
    CHECK(loop.cutter().area() == Approx(3 * edge * edge));
    CHECK(loop.cutter().report().triangles_added >= 3 * 2 * 2);
    for (int k = 0; k <= 40; ++k) {   // down to the middle of the block, and back
      tick(0.0202, 0.0303, 0.0201 - 0.00025 * k);
    }
    for (int k = 0; k <= 60; ++k) tick(0.0202, 0.0303 - 0.0005 * k, 0.0101);
    CHECK(loop.body().opened_faces() == 6);
    for (int k = 0; k <= 100; ++k) tick(0.0202, 0.0003 - 0.0005 * k, 0.0101 + 0.001 * k);
    CHECK(loop.cutter().state() == CuttingPhase::no_contact);
    CHECK(loop.body().opened_faces() == 6);
    CHECK(loop.counts().diverged == 0);
  }
}

TEMPLATE_TEST_CASE("tissue that moves over a blade at rest is cut by it, and tissue that moves with it is not", "[cutting][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = block<S>();
  auto cutter = knife<S>();
  auto const advance = [&](Vector3<S> const& tip) { cutter.advance(body, tip); };
  for (int k = 0; k <= 20; ++k) advance(Vector3<S>(S(0.0101), S(0.0202), S(0.04) - S(0.001) * S(k)));   // between the first cubes, 10 mm deep
  REQUIRE(cutter.state() == CuttingPhase::moving);
  int const opened = body.opened_faces();
  // Gravity along y moves the top by more than a cube to each side.
  Vector3<S> const place = body.middle(70);
  std::vector<S> way;
  for (double const g : {-60.0, 60.0}) {
    body.set_gravity({0, S(g), 0});
    for (int k = 0; k < 300; ++k) body.step(S(1e-3)), advance(Vector3<S>(S(0.0101), S(0.0202), S(0.0201)));
    way.push_back(body.middle(70)[1] - place[1]);
  }
  CAPTURE(way[0], way[1]);
  REQUIRE(way[1] - way[0] > S(2 * edge));
  CHECK(body.opened_faces() > opened);
  // With the tissue: a blade that is where the same place of it is.
  auto with = block<S>();
  auto carried = knife<S>();
  auto const place_of = [&] {   // in the middle of the face between two cubes of the top layer
    return Vector3<S>((with.middle(48 + 7) + with.middle(48 + 8)) / 2);
  };
  for (int k = 0; k <= 20; ++k) carried.advance(with, Vector3<S>(place_of() + Vector3<S>(S(1e-4), S(2e-4), S(0.02) - S(0.001) * S(k))));
  int const had = with.opened_faces();
  with.set_gravity({0, S(60), 0});
  for (int k = 0; k < 300; ++k) with.step(S(1e-3)), carried.advance(with, Vector3<S>(place_of() + Vector3<S>(S(1e-4), S(2e-4), 0)));
  CHECK(with.opened_faces() == had);
}

TEMPLATE_TEST_CASE("a blade presses cubes until it punctures, and one that is taken away or restored has to come from outside", "[cutting][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = block<S>();
  auto cutter = knife<S>(S(0.004));
  auto const at = [](double y, double depth) { return Vector3<S>(S(0.0202), S(y), S(0.03 - depth)); };
  cutter.advance(body, at(0.0151, -0.01));
  auto const before = body.save();
  for (int k = 0; k <= 20; ++k) cutter.advance(body, at(0.0051 + 0.001 * k, 0.003));   // 3 mm deep, 20 mm along
  CHECK(cutter.state() == CuttingPhase::indenting);
  CHECK(cutter.contact().depth == Approx(S(0.003)).epsilon(0.01));
  CHECK(body.opened_faces() == 0);
  for (int k = 0; k <= 20; ++k) cutter.advance(body, at(0.0251 - 0.001 * k, 0.0055));
  CHECK(cutter.state() == CuttingPhase::moving);
  CHECK(body.opened_faces() == 2);   // at y = 5 and 15 mm, from 25.1: z of the middles is 25 mm, 0.5 mm above the tip
  body.restore(before);
  CHECK(body.opened_faces() == 0);
  cutter.advance(body, at(0.0251, 0.0055));
  CHECK(cutter.state() == CuttingPhase::no_contact);
  cutter.advance(body, at(0.0051, 0.0055));   // behind the skin since it was restored
  CHECK(body.opened_faces() == 0);
  CutReport const report = cutter.report();
  CHECK(report.triangles_added > 0);
}

TEMPLATE_TEST_CASE("a turned blade of two pieces cuts cubes where both go", "[cutting][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = block<S>();
  // Up in the tool's frame; turned by a right angle about x, along y at the height of the tip.
  CubeCutter<S> cutter({.edge = {Vector3<S>::Zero(), Vector3<S>(0, 0, S(0.02)), Vector3<S>(0, 0, S(0.05))}});
  Eigen::Quaternion<S> const turned(Eigen::AngleAxis<S>(-std::numbers::pi_v<S> / 2, Vector3<S>::UnitX()));
  // From the side x = 60 mm, at z = 20.1 mm, towards x = 0: under the top layer.
  for (int k = 0; k <= 45; ++k) cutter.advance(body, {.position = {S(0.065 - 0.001 * k), S(0.0003), S(0.0201)}, .orientation = turned});
  CHECK(body.opened_faces() == 4 * 4);   // middles at x = 55, 45, 35 and 25 mm, of four rows
  CHECK(cutter.report().faces_opened == 16);
  int walls = 0;
  for (int t = 0; t < body.triangles().cols(); ++t) walls += body.tissue().is_wound(t);
  CHECK(walls == 16 * 2 * 2);
}

TEMPLATE_TEST_CASE("a blade in cubes refuses what is not finite, and allocates nothing where it opens nothing", "[cutting][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(trap_works());
  S const nan = std::numeric_limits<S>::quiet_NaN();
  CHECK_THROWS_AS(CubeCutter<S>({.edge = {Vector3<S>::Zero()}}), InvalidArgument);
  CHECK_THROWS_AS(CubeCutter<S>({.edge = {Vector3<S>::Zero(), Vector3<S>(0, nan, 0)}}), InvalidArgument);
  CHECK_THROWS_AS(CubeCutter<S>({.edge = {Vector3<S>::Zero(), Vector3<S>::Zero()}}), InvalidArgument);
  CHECK_THROWS_AS(CubeCutter<S>({.puncture_depth = -1}), InvalidArgument);
  CHECK_THROWS_WITH(CubeCutter<S>({.puncture_depth = 2}), Catch::Contains("the puncture depth is 2 m") && Catch::Contains("in mm it would be 0.002 m"));
  CHECK_THROWS_AS(CubeCutter<S>({.tip_radius = -1}), InvalidArgument);
  auto body = block<S>();
  auto cutter = knife<S>();
  cutter.advance(body, Vector3<S>(S(0.0202), S(0.0151), S(0.05)));
  cutter.advance(body, Vector3<S>(S(0.0202), S(0.0151), S(0.025)));
  REQUIRE(cutter.state() == CuttingPhase::moving);
  auto const positions = Matrix3X<S>(body.positions());
  CHECK_THROWS_AS(cutter.advance(body, Vector3<S>(nan, 0, 0)), InvalidArgument);
  CHECK_THROWS_AS(cutter.advance(body, {.position = Vector3<S>(0, 0, 0), .orientation = {0, 0, 0, 0}}), InvalidArgument);
  CHECK(cutter.state() == CuttingPhase::moving);
  CHECK(body.positions() == positions);
  settle(body);
  cutter.advance(body, Vector3<S>(S(0.0202), S(0.0152), S(0.025)));
  AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) cutter.advance(body, Vector3<S>(S(0.0202), S(0.0152) + S(1e-5) * S(k % 10), S(0.025)));
  long const count = allocations.count();
  CHECK(count == 0);
}

TEMPLATE_TEST_CASE("another tool at cubes that are cut feels nothing of it", "[cutting][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  // A ball presses 1.5 mm deep, 30 mm away from a blade that opens face after face; both in one loop.
  using Finger = BodyTool<Cubes<S>, NoCutter<S>>;
  using Knife = BodyTool<Cubes<S>, CubeCutter<S>>;
  BodyLoop<Cubes<S>, NoCutter<S>, CubeCutter<S>> loop(block<S>(), std::tuple(Finger(NoCutter<S>({.tip_radius = S(0.005)}), {}), Knife(knife<S>(), {})), {0, 1}, 100);
  S before = 0, least = 1e9, most = 0;
  for (int k = 0; k < 900; ++k) {
    S const down = std::min(S(1), S(k) / 100), along = std::clamp(S(k - 400) / 400, S(0), S(1));
    ToolPose<S> const ball{.position = {S(0.012), S(0.018), S(0.037) - S(0.0035) * down}};
    ToolPose<S> const blade{.position = {S(0.0502), S(0.0003) + S(0.045) * along, S(0.05) - S(0.0299) * std::clamp(S(k - 200) / 100, S(0), S(1))}};
    S const force = loop.tick(std::array{PlacedTool<S>{true, ball}, PlacedTool<S>{true, blade}}, S(1e-3))[0].tissue_force.norm();
    if (k == 390) before = force;
    if (k > 390) least = std::min(least, force), most = std::max(most, force);
  }
  CHECK(loop.body().opened_faces() > 2);
  CAPTURE(before, least, most);
  CHECK(before > S(0.02));
  CHECK(most - least < S(0.1) * before);
}
