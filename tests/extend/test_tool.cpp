// SPDX-License-Identifier: MIT
// A tool of one's own needs palpate/extend/tool.hpp and nothing else. Yardsticks: Newton's third law, lever arms; the force that a vacuum bears is in the example.
#include "../../examples/own_tool/suction_tip.hpp"

#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tool/forceps.hpp>
#include <palpate/tool/hook.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

using namespace palpate;

namespace {

template <class S>
auto sheet() {
  return SoftBody(MassSpring<S>(make_grid<S>(9, 9, S(0.005)), {.mass = {.total = S(0.1)}, .link = {.stiffness = S(60), .damping = S(0.02)}, .home = {.stiffness = S(6)}}),
                  LeapfrogVerlet{});
}
template <class S>
auto block() {
  auto const mesh = make_block<S>(5, 4, 3, S(0.01), BlockPattern::alternating);
  return SoftBody(FiniteElements<S, StableNeoHookean<S>>(mesh, {.density = S(1060), .material = {.young = S(5e3), .poisson = S(0.4)}}), BackwardEuler{});
}

/// Mistakes in a tool, one each.
enum class Mistake { none, keeps, lever, random, nan, reset, restored };
template <Mistake mistake>
struct Wrong : BluntTool<double> {
  Wrong() : BluntTool<double>(make_probe_shape<double>({.radius = 0.004})) {}
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    BluntTool<double>::advance(body, tool);
    if (mistake == Mistake::restored && body.restorations() > 0) stuck = true;
  }
  template <class Body>
  Vector press(Body& body, double share, double h) {
    Vector force = BluntTool<double>::press(body, share, h);
    if (mistake == Mistake::restored && stuck) body.apply_force(0, {0, 0, 1}), force.z() -= 1;
    if (mistake == Mistake::keeps) force *= 0.9;
    if (mistake == Mistake::random && ++shared() % 2 == 0) force = -force;
    if (mistake == Mistake::nan && !is_zero(force)) force.x() = std::numeric_limits<double>::quiet_NaN();
    wrong_moment = mistake == Mistake::lever ? Vector(2 * BluntTool<double>::moment()) : BluntTool<double>::moment();
    return force;
  }
  template <class Body>
  void reset(Body& body) noexcept {
    if (mistake != Mistake::reset) BluntTool<double>::reset(body);
    wrong_moment.setZero();
  }
  Vector const& moment() const noexcept { return wrong_moment; }
  static int& shared() {
    static int count = 0;
    return count;
  }
  Vector wrong_moment = Vector::Zero();
  bool stuck = false;
};

template <Mistake mistake>
std::string said() {
  return testing::to_text(testing::check_tool(Wrong<mistake>(), sheet<double>()));
}

template <class S>
using Sheet = decltype(sheet<S>());

}  // namespace

static_assert(PressesTissue<SuctionTip<double>, Sheet<double>> && ResettableCutter<SuctionTip<float>, Sheet<float>> && !PressesTissue<SuctionTip<float>, Sheet<double>>);
static_assert(PressesTissue<testing::ToolArchetype<double>, Sheet<double>> && !ResettableCutter<testing::ToolArchetype<double>, Sheet<double>>);

TEMPLATE_TEST_CASE("a tool of one's own, and those of the library, keep the laws of tools", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const check = [](auto const& body, testing::ToolChecks const& checks) {
    CHECK(testing::to_text(testing::check_tool(SuctionTip<S>(), body, checks)) == "");
    CHECK(testing::to_text(testing::check_tool(testing::ToolArchetype<S>{}, body, {.motions = 1})) == "");
    CHECK(testing::to_text(testing::check_tool(BluntTool<S>(make_probe_shape<S>({.radius = 0.004})), body, checks)) == "");
    CHECK(testing::to_text(testing::check_tool(Hook<S>(), body, checks)) == "");
    CHECK(testing::to_text(testing::check_tool(Forceps<S>({.grasp = {.clamp_force = S(20)}}), body, checks)) == "");
  };
  check(sheet<S>(), {.motions = 20});
  check(block<S>(), {.motions = 10, .ticks = 10});
}

TEST_CASE("a tool that breaks a law is told which") {
  CHECK(said<Mistake::none>() == "");
  CHECK_THAT(said<Mistake::keeps>(), says("not opposite to what it has applied"));
  CHECK_THAT(said<Mistake::lever>(), says("moment() is not that of what was applied"));
  CHECK_THAT(said<Mistake::random>(), says("a copy of the tool does something else"));
  CHECK_THAT(said<Mistake::nan>(), says("it must be finite"));
  CHECK_THAT(said<Mistake::reset>(), says("after reset() the tool still touches"));
  CHECK_THAT(said<Mistake::restored>(), says("the tool presses, and there is no contact"));
  auto nailed = sheet<double>();
  nailed.nail(7);
  CHECK_THROWS_WITH(testing::check_tool(SuctionTip<double>(), nailed), says("particle 7 is nailed", "nothing holds"));
  CHECK_THROWS_WITH(testing::check_tool(SuctionTip<double>(), sheet<double>(), {.motions = 0}), says(".motions is 0"));
}

// A spatula of 20 mm pressed flat on a sheet that is held at its border: pushed up where it lies, and nothing to the sides.
TEST_CASE("a tool that is a shape alone touches along all of its rods") {
  ScriptedDevice<double> const device({{0.0, {0.02, 0.0211, 0.005}}, {0.2, {0.02, 0.0211, 0.0}}, {0.6, {0.02, 0.0211, 0.0}}});
  auto body = sheet<double>();
  body.nail(0), body.nail(8), body.nail(72), body.nail(80);
  ToolShape<double> spatula{.rods = {{.rod = {.from = {-0.01, 0, 0}, .to = {0.01, 0, 0}, .radius = 0.001}},   // m
                                     {.rod = {.to = {0, 0, 0.1}, .radius = 0.002}}}};
  spatula.picture = rods_picture(spatula.rods);
  Simulator simulator(device, std::move(body), BluntTool<double>(spatula, {.friction = 0.2}), TissueReaction{});
  Recording const session = simulator.run(0.6);
  Vector3<double> const force = session.mean_force(0.55, 0.6);
  CHECK(force.z() > 0.01);
  CHECK(std::abs(force.x()) < 0.05 * force.z());
  int touched = 0;
  for (auto const& touch : simulator.cutter().rods().touches()) touched += touch.acts && touch.rod == 0 ? 1 : 0;
  CHECK(touched > 2);   // from end to end
}
