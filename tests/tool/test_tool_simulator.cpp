// SPDX-License-Identifier: MIT
// Tools as what a simulator holds: the closed loop of hand, contact, tissue and force. Yardsticks: the force that the tissue feels, the battery of cutters.
#include "catch.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/extend/cutter.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tool/hook.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

using namespace palpate;
using namespace palpate_test;

namespace {

using Skin = decltype(skin<double>());
using Block = decltype(block<double>());
static_assert(Cutter<Hook<double>, Skin> && PressesTissue<Hook<double>, Skin> && ResettableCutter<Hook<double>, Skin> && !HoldsTissue<Hook<double>, Skin>);
static_assert(Cutter<BluntTool<double>, Block> && PressesTissue<BluntTool<double>, Block> && Cutter<Hook<float>, decltype(skin<float>())>);

/// Presses 3 mm in within 0.2 s, draws 10 mm along x in 0.5 s, and holds; turned by so many degrees about y.
struct Stroke {
  Vector3<double> start;
  double degrees = 0;
  long tick = 0;

  Capabilities capabilities() const { return {.max_force = 8.0, .rate = 1000.0, .reports_orientation = true, .moves_a_hand = false}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    double const t = static_cast<double>(tick++) * 1e-3, down = std::clamp((t - 0.1) / 0.2, 0.0, 1.0), along = std::clamp((t - 0.3) / 0.5, 0.0, 1.0);
    state.position = start + Vector3<double>(0.01 * along, 0, 0.003 - 0.006 * down);
    state.orientation = Eigen::Quaternion<double>(Eigen::AngleAxis<double>(degrees * std::numbers::pi / 180, Vector3<double>::UnitY()));
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};

template <class Body>
void check_run(Body body, Vector3<double> const& start) {
  auto const run = [&](double degrees, auto look) {
    Simulator simulator(Stroke{start, degrees}, body, Hook<double>({.shape = {.radius = 0.001, .point = 0.01, .shaft = 0.03}}), TissueReaction{});
    Recording const session = simulator.run(1.0);
    look(simulator, session);
    return session;
  };
  auto const down = run(0, [](auto& simulator, Recording const& session) {
    Tick const& last = session.ticks().back();
    CHECK(simulator.cutter().hooked());
    CHECK(last.phase == CuttingPhase::indenting);
    CHECK(last.force.x() < -0.1);
    CHECK((last.force - simulator.cutter().force()).norm() < 0.05 * last.force.norm());   // the hand feels what the tissue does to the tool
    CHECK(last.depth == Approx(0.004).margin(5e-4));                                      // 3 mm and the radius
    auto const& pin = simulator.cutter().held();
    auto const now = RodContact<double>::point_at(simulator.body(), pin.triangle, pin.barycentric);
    auto const& c = simulator.body().tissue().surface().corners(pin.triangle);
    Vector3<double> before = Vector3<double>::Zero();
    for (std::size_t k = 0; k < 3; ++k) before += pin.barycentric[static_cast<int>(k)] * simulator.body().reference_position(c[k]);
    CHECK((now - before).x() > 0.009);   // drawn by 10 mm, less than 1 mm behind
    CHECK(simulator.statistics().body_counts.diverged == 0);
  });
  auto const again = run(0, [](auto&, Recording const&) {});
  REQUIRE(down.ticks().size() == again.ticks().size());
  for (std::size_t k = 0; k < down.ticks().size(); ++k)
    REQUIRE((down.ticks()[k].force == again.ticks()[k].force && down.ticks()[k].depth == again.ticks()[k].depth));
  run(90, [](auto& simulator, Recording const& session) {
    CHECK_FALSE(simulator.cutter().hooked());
    CHECK(session.largest_force() > 0.1);
    double pressed = 0, rubbed = 0;
    for (auto const& touch : simulator.cutter().rods().touches()) pressed += touch.pressed, rubbed += touch.rubbed;
    CHECK(pressed > 0.1);
    CHECK(rubbed <= 0.3 * pressed * (1 + 1e-12));
  });
}

}  // namespace

TEST_CASE("A hook is what a simulator holds: it draws tissue along point down, and slides when it lies", "[tool][tool_simulator]") {
  SECTION("skin of springs, explicit") { check_run(skin<double>(), {0.0263, 0.0341, 0}); }
  SECTION("a block of finite elements, implicit") { check_run(block<double>(), {0.0221, 0.0187, 0.018}); }
}

TEST_CASE("A hook and a blunt tool pass the battery of cutters", "[tool][tool_simulator]") {
  testing::CutterChecks const way{.way = {{0.0313, 0.0287, 0.01}, {0.0313, 0.0287, -0.002}, {0.0413, 0.0287, -0.002}, {0.0413, 0.0287, 0.02}}, .ticks = 10};
  CHECK(testing::to_text(testing::check_cutter(Hook<double>(), skin<double>(), way)) == "");
  CHECK(testing::to_text(testing::check_cutter(BluntTool<double>(), skin<double>(), way)) == "");
}

TEST_CASE("The haptic point is the deepest place, the mean of all, or that of one rod", "[tool][tool_simulator]") {
  ToolShape<double> shape;   // two balls, 20 mm apart, one 1 mm lower
  shape.rods = {{.rod = {.from = {0, 0, 0.001}, .to = {0, 0, 0.001}, .radius = 0.003}}, {.rod = {.from = {0.02, 0, 0}, .to = {0.02, 0, 0}, .radius = 0.003}}};
  auto body = skin<double>();
  auto const point = [&](HapticPoint which, int chosen, double height = 0.001) {
    shape.haptic_point = which, shape.chosen = chosen;
    BluntTool<double> tool(shape);
    for (double const z : {0.01, height}) tool.advance(body, {.position = {0.0213, 0.0323, z}});
    CHECK(tool.contact().touching);
    CHECK(tool.state() == CuttingPhase::indenting);
    return Vector3<double>(tool.haptic_point() - Vector3<double>(0.0213, 0.0323, height));
  };
  // Depths 1 and 2 mm: the deepest is the second ball. The mean lies between, at weights of all triangles within.
  CHECK((point(HapticPoint::deepest, 0) - Vector3<double>(0.02, 0, 0)).norm() < 1e-12);
  CHECK((point(HapticPoint::chosen, 0) - Vector3<double>(0, 0, 0.001)).norm() < 1e-12);
  CHECK((point(HapticPoint::chosen, 0, 0.0025) - Vector3<double>(0.02, 0, 0)).norm() < 1e-12);   // that ball is in the air: what the other touches is felt
  Vector3<double> const mean = point(HapticPoint::averaged, 0);
  CHECK((mean.x() > 0.01 && mean.x() < 0.02 && std::abs(mean.x() + 20 * mean.z() - 0.02) < 1e-12));
}

TEST_CASE("What a tool presses the tissue with is what the hand feels, in every tick in which it is lifted a little, too", "[tool][tool_simulator]") {
  // Yardstick: the force that the tissue gets. A tick before it is lifted the tissue is at rest around it, and follows it up within the step.
  for (double const h : {0.001, 0.002, 0.005, 0.01}) {
    BodyLoop loop(block<double>(), BluntTool<double>(make_probe_shape<double>({.radius = 0.003})), ContactCoupling{}, 100);
    ToolPose<double> tool{.position = {0.0301, 0.0242, 0.03}};
    for (int k = 0; k < 700; ++k) tool.position.z() = 0.018 + std::max(0.001, 0.01 - 4e-5 * k), loop.tick(tool, 0.001);
    for (double const lift : {1e-5, 1e-4, 1e-4}) {
      tool.position.z() += lift, tool.velocity.z() = lift / h;
      for (int k = 0; k < 8; ++k) {
        CAPTURE(h, lift, k);
        auto const model = loop.tick(tool, h);
        CHECK(loop.cutter().force().z() > 0.02);
        CHECK((model.tissue_force - loop.cutter().force()).norm() < 1e-9);
        CHECK(model.phase == CuttingPhase::indenting);
        CHECK(loop.cutter().contact().depth == Approx(0.018 + 0.003 - tool.position.z()).margin(1e-5));   // of the ball's lowest point below the skin at rest
        tool.velocity.setZero();
      }
    }
  }
}

TEST_CASE("a coupling for a tool that presses the tissue itself is refused", "[tool_simulator]") {
  auto const make = [] {
    Simulator simulator(skin<double>(), Tool(Stroke{{0.03, 0.03, 0}}, Hook<double>(), TissueReaction{}, {.coupling = ContactCoupling{.stiffness = 100.0}}));
  };
  CHECK_THROWS_AS(make(), InvalidArgument);
}

TEST_CASE("a tool forgets what it touched where the body is restored, whatever the next pose", "[tool_simulator]") {
  auto body = skin<double>();
  auto const before = body.save();
  BluntTool<double> tool;
  for (double const z : {0.004, 0.001}) tool.advance(body, {.position = {0.03, 0.03, z}});
  REQUIRE(tool.contact().touching);
  body.restore(before);
  tool.advance(body, {.position = {0.03, std::numeric_limits<double>::quiet_NaN(), 0.001}});
  CHECK_FALSE(tool.contact().touching);
  CHECK(tool.rods().touches().empty());
  CHECK(is_zero(tool.press(body, 1.0, 1e-3)));
}
