// SPDX-License-Identifier: MIT
// Yardsticks: a body's loop with the cutter alone, in whose place the scalpel cuts and presses; what a blunt rod does for the handle.
#include "catch.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/extend/tool.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/tool/scalpel.hpp>

#include <cmath>
#include <numbers>
#include <utility>

using namespace palpate;
using namespace palpate_test;

namespace {

using Skin = decltype(skin<double>());
using Block = decltype(block<double>());
using Knife = Scalpel<double, ProgressiveCutter<double>>;
static_assert(Cutter<Scalpel<double>, Block> && PressesTissue<Scalpel<double>, Block> && ResettableCutter<Scalpel<double>, Block> && TellsMoment<Scalpel<double>, Block>);
static_assert(FeelsReaction<Scalpel<double>, Block> && ResistsBlade<Scalpel<double>, Block> && CountsArea<Scalpel<double>> && !HoldsTissue<Scalpel<double>, Block>);
static_assert(PressesTissue<Knife, Skin> && HoldsTissue<Knife, Skin> && !ResistsBlade<Knife, Skin> && !CountsArea<Knife>);

/// Down in 0.2 s, along y in 0.4 s, and out.
template <class C, class Body>
auto stroke(C const& cutter, Body body, Vector3<double> const& start, double down, double along) {
  BodyLoop loop(std::move(body), cutter, ContactCoupling{}, 16);
  Vector3<double> sum = Vector3<double>::Zero();
  for (int k = 0; k < 800; ++k) {
    double const t = k * 1e-3, out = std::max(0.0, t - 0.6) / 0.2, in = std::min(1.0, t / 0.2), way = std::clamp((t - 0.2) / 0.4, 0.0, 1.0);
    Vector3<double> const at = start + Vector3<double>(0, along * way, 0.004 - (down + 0.004) * in + 0.04 * out);
    sum += loop.tick({.position = at}, 1e-3).tissue_force;
  }
  return std::pair(std::move(loop), sum);
}

}  // namespace

TEST_CASE("A scalpel cuts and presses as its edge does", "[tool][scalpel]") {
  SECTION("solids, with the shape's edge") {
    ScalpelShape const shape{.edge = 0.03, .angle = std::numbers::pi / 2};
    Vector3<double> const start(0.0301, 0.01, 0.018);
    VolumeCutOptions<double> cut{.puncture_depth = 0.002, .toughness = 30};
    auto const [scalpel, felt] = stroke(Scalpel<double>(cut, {.shape = shape}), block<double>(), start, 0.008, 0.03);
    cut.edge = {Vector3<double>::Zero(), make_scalpel_shape<double>(shape).rods[0].rod.to};
    auto const [alone, expected] = stroke(VolumeCutter<double>(cut), block<double>(), start, 0.008, 0.03);
    CHECK(scalpel.body().size() > block<double>().size());
    REQUIRE(scalpel.body().size() == alone.body().size());
    CHECK(scalpel.body().triangles() == alone.body().triangles());
    CHECK((scalpel.body().positions() - alone.body().positions()).norm() < 1e-12);
    CHECK((felt - expected).norm() < 1e-9 * expected.norm());
    CHECK(expected.norm() > 1);
    CHECK(scalpel.cutter().area() == alone.cutter().area());
    CHECK(scalpel.cutter().state() == CuttingPhase::no_contact);
  }
  SECTION("surfaces") {
    ProgressiveCutter<double> const cutter({.puncture_depth = 0.002});
    Vector3<double> const start(0.0351, 0.02, 0);
    auto const [scalpel, felt] = stroke(Knife(cutter, {.shape = {.angle = std::numbers::pi / 2}}), skin<double>(), start, 0.005, 0.03);
    auto const [alone, expected] = stroke(cutter, skin<double>(), start, 0.005, 0.03);
    CHECK(scalpel.body().size() > skin<double>().size());
    REQUIRE(scalpel.body().size() == alone.body().size());
    CHECK(scalpel.body().triangles() == alone.body().triangles());
    CHECK((scalpel.body().positions() - alone.body().positions()).norm() < 1e-12);
    CHECK((felt - expected).norm() < 1e-9 * expected.norm());
  }
}

TEST_CASE("A scalpel that lies down presses with its handle", "[tool][scalpel]") {
  // Turned over by a right angle about x: the edge and the handle lie along y, the handle from the heel on.
  auto const lying = [](double z) {
    return ToolPose<double>{.position = {0.03, 0.04, z}, .orientation = Eigen::Quaternion<double>(Eigen::AngleAxis<double>(std::numbers::pi / 2, Vector3<double>::UnitX()))};
  };
  ScalpelShape const shape{.edge = 0.01, .angle = std::numbers::pi / 2, .radius = 0.003, .length = 0.08};
  Scalpel<double> scalpel({.puncture_depth = 0.05}, {.shape = shape});
  BluntTool<double> rod(ToolShape<double>{.rods = {{.rod = make_scalpel_shape<double>(shape).rods[1].rod}}});
  auto body = block<double>(), other = block<double>();
  for (int k = 0; k <= 100; ++k) {
    auto const pose = lying(0.022 - 0.003 * k / 100);   // the edge stays above
    scalpel.advance(body, pose), rod.advance(other, pose);
    Vector3<double> const force = scalpel.press(body, 1.0, 1e-3), expected = rod.press(other, 1.0, 1e-3);
    REQUIRE(force == expected);
    REQUIRE(body.step(1e-3));
    REQUIRE(other.step(1e-3));
  }
  CHECK(scalpel.force().z() > 0.1);
  CHECK(scalpel.state() == CuttingPhase::indenting);
  CHECK(scalpel.contact().touching);
  CHECK(scalpel.tip_radius() == 0.003);
  CHECK((scalpel.haptic_point() - rod.haptic_point()).norm() == 0);
}

TEST_CASE("A scalpel keeps the laws of tools, and refuses a second edge", "[tool][scalpel]") {
  CHECK(testing::to_text(testing::check_tool(Knife(ProgressiveCutter<double>({.puncture_depth = 1.0})), SoftBody(MassSpring<double>(make_grid<double>(9, 9, 0.005), {}), LeapfrogVerlet{}))) == "");
  CHECK_THROWS_WITH(Scalpel<double>({.edge = {{0, 0, 0}, {0, 0, 1}}}), says("Scalpel: .edge is the shape's"));
  CHECK_THROWS_WITH(Scalpel<double>({}, {.tip = {.stiffness = 0}}), says("the contact stiffness is 0"));
  CHECK_THROWS_WITH(Scalpel<double>({}, {.shape = {.angle = 0}}), says(".angle is 0"));
}
