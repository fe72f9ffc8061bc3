// SPDX-License-Identifier: MIT
// A cutter of one's own needs palpate/extend/cutter.hpp and nothing else. Yardstick: the invariants of every cut, the area of a circle.
#include "../../examples/own_cutter/biopsy_punch.hpp"

#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <numbers>
#include <string>
#include <utility>

using namespace palpate;

namespace {

template <class S>
using Body = SoftBody<MassSpring<S>, LeapfrogVerlet, WholeBody>;

template <class S>
Body<S> sheet(int n = 13) {
  auto mesh = make_grid<S>(n, n, S(0.12) / S(n - 1));
  MassSpring<S> tissue(mesh, {.mass = {.total = S(0.1)}, .link = {.stiffness = S(50), .damping = S(0.01)}, .home = {.stiffness = S(2)}});
  tissue.nail({0, n - 1, n * (n - 1), n * n - 1});
  return Body<S>(std::move(tissue));
}

testing::CutterChecks const pressed{.way = {{0.0613, 0.0587, 0.01}, {0.0613, 0.0587, -0.006}, {0.0613, 0.0587, 0.02}}, .ticks = 20};
testing::CutterChecks const drawn{.way = {{0.0213, 0.0237, 0.01}, {0.0213, 0.0237, -0.006}, {0.0913, 0.0871, -0.006}, {0.0913, 0.0871, 0.02}}, .ticks = 20};

/// Mistakes in a cutter, one each.
enum class Mistake { none, counts, still, nan, stays, random, radius, outside, reset };
template <class S, Mistake mistake>
struct Wrong : BiopsyPunch<S> {
  using Punch = BiopsyPunch<S>;
  using Punch::Punch;

  template <class B>
  void advance(B& body, ToolPose<S> const& tool) {
    if (mistake == Mistake::nan && !tool.position.allFinite()) return void(body.insert_in_triangle(0, {S(0.3), S(0.3), S(0.4)}));
    Punch::advance(body, tool);
    counted = Punch::report();
    has_cut = has_cut || Punch::state() == CuttingPhase::moving;
    if (mistake == Mistake::counts) ++counted.particles_added;
    if (mistake == Mistake::outside || (mistake == Mistake::still && Punch::contact().touching)) body.insert_in_triangle(0, {S(0.3), S(0.3), S(0.4)});
    if (mistake == Mistake::random && Punch::contact().touching && ++shared() % 2 == 0) body.insert_in_triangle(0, {S(0.3), S(0.3), S(0.4)});
  }
  template <class B>
  void reset(B& body) {
    if (mistake != Mistake::reset) Punch::reset(body);
    has_cut = false;
  }
  static int& shared() {
    static int count = 0;
    return count;
  }
  CutReport const& report() const { return counted; }
  CuttingPhase state() const { return mistake == Mistake::stays && has_cut ? CuttingPhase::moving : Punch::state(); }
  S tip_radius() const { return mistake == Mistake::radius ? S(-1) : S(0); }

  CutReport counted;
  bool has_cut = false;
};

template <Mistake mistake>
std::string said() {
  return testing::to_text(testing::check_cutter(Wrong<double, mistake>({.radius = 0.025}), sheet<double>(), pressed));
}

}  // namespace

static_assert(Cutter<BiopsyPunch<double>, Body<double>> && Cutter<BiopsyPunch<float>, Body<float>> && ResettableCutter<BiopsyPunch<double>, Body<double>>);
static_assert(!Cutter<BiopsyPunch<float>, Body<double>> && !FeelsReaction<BiopsyPunch<double>, Body<double>> && !HoldsTissue<BiopsyPunch<double>, Body<double>>);
static_assert(Cutter<testing::CutterArchetype<double>, Body<double>> && !ResettableCutter<testing::CutterArchetype<double>, Body<double>>);

TEMPLATE_TEST_CASE("a cutter of one's own keeps the laws of cutters", "", PALPATE_TEST_SCALARS) {
  auto const body = sheet<TestType>();
  CHECK(testing::to_text(testing::check_cutter(BiopsyPunch<TestType>({.radius = TestType(0.025)}), body, pressed)) == "");
  CHECK(testing::to_text(testing::check_cutter(testing::CutterArchetype<TestType>{}, body, pressed)) == "");
}

TEMPLATE_TEST_CASE("the cutters of the library keep the laws of cutters", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const body = sheet<S>();
  CHECK(testing::to_text(testing::check_cutter(NoCutter<S>({.tip_radius = S(0.004)}), body, drawn)) == "");
  CHECK(testing::to_text(testing::check_cutter(ProgressiveCutter<S>({.puncture_depth = S(0.003)}), body, drawn)) == "");
  auto moving = drawn;
  moving.moves_vertices = true;
  CHECK(testing::to_text(testing::check_cutter(SeparatingCutter<S>({.puncture_depth = S(0.003)}), body, moving)) == "");
}

TEST_CASE("a cutter that breaks a law is told which") {
  CHECK(said<Mistake::none>() == "");
  CHECK_THAT(said<Mistake::counts>(), says("report() counts"));
  CHECK_THAT(said<Mistake::still>(), says("a tool that stands still goes on changing the body"));
  CHECK_THAT(said<Mistake::nan>(), says("a pose that is not finite changes body or state"));
  CHECK_THAT(said<Mistake::stays>(), says("the way ends outside the tissue, but the state is \"moving\""));
  CHECK_THAT(said<Mistake::random>(), says("a copy of the cutter does something else"));
  CHECK_THAT(said<Mistake::radius>(), says("tip_radius() is -1 m"));
  CHECK_THAT(said<Mistake::outside>(), says("outside the tissue the tool touches or changes it"));
  CHECK_THAT(said<Mistake::reset>(), says("after reset() the tool still touches"));
  CHECK_THROWS_AS(testing::check_cutter(BiopsyPunch<double>({.radius = 0.025}), sheet<double>(), {.way = {{0, 0, 0}}}), InvalidArgument);
}

TEST_CASE("a punch takes out a circle, over the border too") {
  for (double const x : {0.06, 0.0613, 0.0, 0.007}) {
    auto body = sheet<double>(41);
    testing::CutInvariants const before(body);
    BiopsyPunch<double> punch({.radius = 0.02});
    for (double const z : {0.01, -0.001, -0.003}) punch.advance(body, {.position = {x + 1e-4, 0.06, z}});
    CHECK(punch.state() == CuttingPhase::moving);
    CHECK(testing::to_text(before.check(body)) == "");
    auto const pieces = connected_components(body.mesh());
    REQUIRE(pieces.size() == 2);
    double const r = 0.02, d = x + 1e-4;   // of the circle, and of its middle from the border
    double const cap = d < r ? r * r * std::acos(d / r) - d * std::sqrt(r * r - d * d) : 0.0;
    std::vector<bool> in_plug(static_cast<std::size_t>(body.size()), false);
    for (int const p : pieces[1]) in_plug[static_cast<std::size_t>(p)] = true;
    auto plug = body.rest_mesh();
    std::vector<int> kept;
    for (int t = 0; t < plug.triangles.cols(); ++t)
      if (in_plug[static_cast<std::size_t>(plug.triangles(0, t))]) kept.push_back(t);
    plug.triangles = Matrix<int, 3, Dynamic>(plug.triangles(Eigen::all, kept));
    double const area = surface_area(plug), other = surface_area(body.rest_mesh()) - area;
    CHECK(std::min(area, other) == Approx(std::numbers::pi * r * r - cap).epsilon(0.02));
  }
}

TEST_CASE("a punch says what it can not do") {
  CHECK_THROWS_AS(BiopsyPunch<double>({.radius = -1.0}), InvalidArgument);
  auto body = sheet<double>();
  BiopsyPunch<double> small({.radius = 0.015});
  CHECK_THROWS_WITH(small.advance(body, {.position = {0.06, 0.06, 0.01}}), says(".radius is 0.015 m"));
}
