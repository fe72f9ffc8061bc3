// SPDX-License-Identifier: MIT
// Cuts as a hand makes them: that cross, undermine, take out a wedge, a core or a slice. Yardsticks: pieces, areas and volumes of planes, a prism and a cylinder;
// tetrahedra that a parallelogram meets, counted here. PALPATE_CROSSINGS sets how many pairs of planes (60 if not set, 24 in tissue that gapes).
#include "catch.hpp"
#include "solid_strokes.hpp"
#include "solid_tissues.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/detail/traced_blade.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

constexpr double edge = 0.005;   // m, of the blocks

template <class Solid = Elements>
auto make_body(int nx, int ny, int nz, BlockPattern pattern, double prestrain = 0.0, double tolerance = 1e-3) {
  auto tissue = Solid::tissue(make_block<double>(nx, ny, nz, edge, pattern), prestrain, 30.0);
  for (int i = 0; i < tissue.size(); ++i)
    if (prestrain > 0 && tissue.rest_position(i)[2] < 1e-6) tissue.nail(i);
  return SoftBody(std::move(tissue), BackwardEuler{.tolerance = tolerance});
}

auto invariants_of(auto& body) { return testing::SolidCutInvariants(body, {.min_height = 0.0199 * body.mean_edge()}); }

/// m³ at rest of each piece, the largest first.
std::vector<double> volumes(auto const& body) {
  auto const mesh = body.rest_solid();
  auto const parts = connected_components(mesh);
  std::vector<std::size_t> of(static_cast<std::size_t>(mesh.points.cols()));
  for (std::size_t k = 0; k < parts.size(); ++k)
    for (int const i : parts[k]) of[static_cast<std::size_t>(i)] = k;
  std::vector<double> all(parts.size());
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto const corner = [&](int k) -> Place { return mesh.points.col(mesh.tetrahedra(k, t)); };
    all[of[static_cast<std::size_t>(mesh.tetrahedra(0, t))]] += (corner(1) - corner(0)).cross(corner(2) - corner(0)).dot(corner(3) - corner(0)) / 6;
  }
  std::sort(all.rbegin(), all.rend());
  return all;
}

}  // namespace

TEMPLATE_LIST_TEST_CASE("two planes that cross leave four pieces, whatever their directions", "[volume_cutter][scenes]", Solids) {
  std::uint64_t const pairs = from_environment("PALPATE_CROSSINGS", 60);
  int wrong = 0;
  for (std::uint64_t seed = 0; seed < pairs && wrong < 3; ++seed) {
    Random random(Seed{seed});
    auto body = make_body<TestType>(4, 4, 4, seed % 2 == 0 ? BlockPattern::kuhn : BlockPattern::alternating);
    auto const before = invariants_of(body);
    AnyPlane const first(random, 3 * edge);
    AnyPlane second(random, 3 * edge);
    while (std::abs(first.normal.dot(second.normal)) > 0.8) second = AnyPlane(random, 3 * edge);
    first.cut(body, 3 * edge, false), second.cut(body, 3 * edge, false);
    INFO("seed " << seed);
    CHECK(pieces(body) == 4);
    CHECK(testing::to_text(before.check(body)) == "");
    wrong += pieces(body) == 4 ? 0 : 1;
  }
}

TEMPLATE_LIST_TEST_CASE("cuts that cross in tissue that gapes and moves leave no more than a crumb in a few dozen", "[volume_cutter][scenes]", Solids) {
  std::uint64_t const pairs = from_environment("PALPATE_CROSSINGS", 24);
  int others = 0;
  for (std::uint64_t seed = 100; seed < 100 + pairs; ++seed) {
    Random random(Seed{seed});
    auto body = make_body<TestType>(5, 5, 4, BlockPattern::alternating, 0.08);
    auto const before = invariants_of(body);
    auto const upright = [&](double turn) {
      AnyPlane plane(random, 4 * edge);
      plane.normal = Place(std::cos(turn), std::sin(turn), 0.2 * random.uniform(-1.0, 1.0)).normalized();
      plane.at[2] = 1.5 * edge;
      return plane;
    };
    double const turn = random.uniform(0.0, 3.0);
    upright(turn).cut(body, 4 * edge, true), upright(turn + random.uniform(0.9, 2.2)).cut(body, 4 * edge, true);
    INFO("seed " << seed);
    CHECK(testing::to_text(before.check(body)) == "");
    others += pieces(body) == 4 ? 0 : 1;
  }
  CHECK(others <= 1 + static_cast<int>(pairs / 100));
}

TEMPLATE_LIST_TEST_CASE("a blade under the skin undermines it, and a cut down to it peels a layer off", "[volume_cutter][scenes]", Solids) {
  // Yardstick: the area that was swept, and the volume of the layer.
  auto body = make_body<TestType>(9, 7, 4, BlockPattern::alternating);
  auto const before = invariants_of(body);
  double const top = 3 * edge, under = top - 0.0031, width = 6 * edge;
  VolumeCutter<double> knife;
  stroke(knife, body, Place(-0.01, -0.01, under), Place(-0.01, width + 0.01, under), Place(0.0335, 0, 0), 60);   // in from one end, 23.5 mm
  knife.lift(body);
  CHECK(pieces(body) == 1);
  CHECK(knife.report().area == Approx(0.0235 * width).epsilon(0.25));
  stroke(knife, body, Place(0.0157, -0.01, under - 0.0004), Place(0.0157, -0.01, top + 0.01), Place(0, width + 0.02, 0), 60);   // down to it
  knife.lift(body);
  CHECK(testing::to_text(before.check(body)) == "");
  auto const parts = volumes(body);
  REQUIRE(parts.size() == 2);
  CHECK(parts[1] == Approx(0.0157 * width * 0.0031).epsilon(0.2));
}

TEMPLATE_LIST_TEST_CASE("two cuts that meet in the depth take out a wedge, and a closed one takes out a core", "[volume_cutter][scenes]", Solids) {
  SECTION("wedge: a prism with a triangle of 17 mm by 13 mm") {
    auto body = make_body<TestType>(9, 7, 5, BlockPattern::alternating);
    auto const before = invariants_of(body);
    double const top = 4 * edge, length = 6 * edge, low = top - 0.013;
    for (double const side : {-1.0, 1.0}) {
      VolumeCutter<double> knife;
      Place const bottom(0.0203 - 0.001 * side, -0.01, low - 0.0015), above(0.0203 + side * 0.0085 * 1.5, -0.01, top + 0.0065);
      stroke(knife, body, bottom, above, Place(0, length + 0.02, 0), 60);
      knife.lift(body);
    }
    CHECK(testing::to_text(before.check(body)) == "");
    auto const parts = volumes(body);
    REQUIRE(parts.size() == 2);
    CHECK(parts[1] == Approx(0.017 * 0.013 / 2 * length).epsilon(0.15));
  }
  SECTION("core: a cylinder of 10 mm radius") {
    auto body = make_body<TestType>(9, 9, 4, BlockPattern::alternating);
    auto const before = invariants_of(body);
    VolumeCutter<double> knife;
    double const radius = 0.0101;
    for (int tick = 0; tick <= 200; ++tick) {
      double const angle = 2.05 * std::numbers::pi * tick / 200;   // a little on, over where it began
      Place const at(4 * edge + radius * std::cos(angle), 4 * edge + radius * std::sin(angle), 0);
      knife.advance(body, {at - Place(0, 0, 0.01), at + Place(0, 0, 0.03)});
    }
    knife.lift(body);
    CHECK(testing::to_text(before.check(body)) == "");
    auto const parts = volumes(body);
    REQUIRE(parts.size() == 2);
    CHECK(parts[1] == Approx(std::numbers::pi * radius * radius * 3 * edge).epsilon(0.12));
  }
}

TEMPLATE_LIST_TEST_CASE("a slice comes off as thick as it is cut, down to a fifth of an edge; one about as thin as the snap stays, and the report says so", "[volume_cutter][scenes]", Solids) {
  for (double const thickness : {0.0042, 0.0012, 0.0010, 0.0008}) {
    auto body = make_body<TestType>(6, 5, 5, BlockPattern::alternating);
    auto const before = invariants_of(body);
    double const side = 4 * edge;
    VolumeCutReport report;
    for (double const x : {0.0112, 0.0112 + thickness}) {
      VolumeCutter<double> knife;
      stroke(knife, body, Place(x, -0.01, -0.01), Place(x, -0.01, side + 0.01), Place(0, side + 0.02, 0), 60);
      knife.lift(body);
      report = knife.report();
    }
    INFO("a slice of " << thickness);
    CHECK(testing::to_text(before.check(body)) == "");
    auto const parts = volumes(body);
    if (thickness > 0.0009) {
      REQUIRE(parts.size() == 3);
      CHECK(parts[2] == Approx(thickness * side * side).epsilon(thickness > 0.002 ? 0.25 : 1e-9));   // of the thick one a side has snapped
    } else {
      CHECK(parts.size() == 2);
      CHECK(report.joined + report.snapped > 0);
    }
  }
}

TEMPLATE_LIST_TEST_CASE("a stroke makes at most six tetrahedra of each that it goes through, and steps stay as easy to solve", "[volume_cutter][scenes]", Solids) {
  // Yardsticks: tetrahedra with an edge through the parallelogram that the blade sweeps, counted one by one; iterations of a block of as many tetrahedra.
  // PALPATE_ORGANS sets how many strokes, for all of which then both steps are solved.
  std::uint64_t const asked = from_environment("PALPATE_ORGANS", 0), strokes = asked > 0 ? asked : 12, solved = asked > 0 ? asked : 8;
  struct Solved {
    double step, most, cut = 0, whole = 0, worst = 0;   // s; iterations, of a cut body and of a block, and their ratio
  };
  std::vector<Solved> all{{2e-3, 1.7}};
  if (asked > 0) all.push_back({1e-2, 1.4});
  std::int64_t made = 0, crossed = 0;
  for (std::uint64_t seed = 1; seed <= strokes; ++seed) {
    Random random(Seed{seed});
    auto body = make_body<TestType>(9, 9, 7, BlockPattern::alternating, 0.0, 1e-8);
    double const top = 6 * edge, length = edge * random.uniform(3.0, 8.0), depth = edge * random.uniform(1.0, 3.0), turn = random.uniform(0.0, 6.28);
    Place const way(std::cos(turn), std::sin(turn), 0), tilt = 0.3 * Place(-way[1], way[0], 0) * random.uniform(-1.0, 1.0);
    Place const low = Place(4 * edge, 4 * edge, top - depth) - length / 2 * way, high = low + (depth + 0.01) * (Place::UnitZ() + tilt);
    auto const mesh = body.rest_solid();
    int through = 0;
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      bool meets = false;
      for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j) {
          Place const a = mesh.points.col(mesh.tetrahedra(i, t)), b = mesh.points.col(mesh.tetrahedra(j, t));
          Eigen::Matrix3d system;
          system << high - low, length * way, a - b;
          Place const at = system.fullPivLu().solve(a - low);
          meets = meets || (at.minCoeff() >= 0 && at.maxCoeff() <= 1);
        }
      through += meets ? 1 : 0;
    }
    VolumeCutter<double> knife;
    stroke(knife, body, low, high, length * way, 60);
    knife.lift(body);
    made += knife.report().tetrahedra_added, crossed += through;
    CHECK(knife.report().tetrahedra_added <= 6 * through);

    // Nailed, hanging from there, and pulled aside at a corner.
    auto const iterations = [](auto const& of, double step) {
      auto tissue = of.tissue();
      for (int i = 0; i < tissue.size(); ++i)
        if (tissue.rest_position(i)[2] < 1e-6) tissue.nail(i);
      SoftBody loaded(std::move(tissue), BackwardEuler{.tolerance = 1e-8, .max_iterations = 2000});
      loaded.set_gravity({0, 0, 9.81});
      for (int k = 0; k < 10; ++k) {
        loaded.apply_force(loaded.nearest_vertex({0.04, 0.04, 0.03}), {0.02, 0.01, 0});
        REQUIRE(loaded.step(step));
      }
      return static_cast<double>(loaded.solve_statistics().iterations) / 10;
    };
    if (seed > solved) continue;
    auto const whole = make_body<TestType>(10, 9, 7, BlockPattern::alternating);
    CHECK(std::abs(whole.tissue().tetrahedra() - body.tissue().tetrahedra()) < 0.2 * body.tissue().tetrahedra());
    for (Solved& at : all) {
      double const after = iterations(body, at.step), otherwise = iterations(whole, at.step);
      CHECK(after <= at.most * otherwise);
      at.cut += after, at.whole += otherwise, at.worst = std::max(at.worst, after / otherwise);
    }
  }
  INFO(made << " tetrahedra made of " << crossed << ", " << double(made) / double(crossed) << " of each");
  CHECK(made <= 6 * crossed);
  for (Solved const& at : all) {
    INFO("a step of " << at.step << " s: " << at.cut / double(solved) << " iterations after a cut, " << at.whole / double(solved) << " of a block, " << at.cut / at.whole << " times as many, at worst " << at.worst);
    CHECK(at.cut <= 1.5 * at.whole);
  }
}

namespace {

/// A block of 40 × 40 × 20 mm, a place near its middle and a direction across it.
struct Across {
  decltype(make_body(2, 2, 2, BlockPattern::kuhn)) body;
  testing::SolidCutInvariants<decltype(body)> before;
  Place middle, ahead, aside;
  VolumeCutter<double> knife;

  explicit Across(std::uint64_t seed) : body(make_body(9, 9, 5, seed % 2 == 0 ? BlockPattern::kuhn : BlockPattern::alternating)), before(invariants_of(body)) {
    Random random(Seed{seed});
    double const turn = random.uniform(0.0, 6.28);
    middle = Place(0.02, 0.02, 0.01) + 0.003 * Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
    ahead = Place(std::cos(turn), std::sin(turn), 0), aside = Place(-ahead[1], ahead[0], 0);
  }
  /// An upright blade, longer than the block is high, is here now.
  void go(VolumeCutter<double>& blade, Place const& at) { blade.advance(body, {at - Place(0, 0, 0.03), at + Place(0, 0, 0.04)}); }
  void go(Place const& at) { go(knife, at); }
  void check(int pieces) {
    knife.lift(body);
    CHECK(palpate_test::pieces(body) == pieces);
    CHECK(testing::to_text(before.check(body)) == "");
  }
};

}  // namespace

// Both walls of a closed wound are as near. Yardsticks: the area that the stroke sweeps, of which a rim of an edge at the blade's ends may stay closed; points
// within tetrahedra, known by their weights.
TEMPLATE_LIST_TEST_CASE("a blade that is all within the tissue is found there, and cuts, beside closed wounds as well", "[volume_cutter][scenes]", Solids) {
  for (double const off : {-0.0016, -0.0012}) {
    auto body = make_body<TestType>(6, 5, 5, BlockPattern::kuhn);
    VolumeCutter<double> first;
    for (int tick = 0; tick <= 30; ++tick) first.advance(body, {{0.0113, -0.005 + 0.001 * tick, -0.01}, {0.0113, -0.005 + 0.001 * tick, 0.03}});
    first.lift(body);
    VolumeCutter<double> buried;
    for (int tick = 0; tick <= 30; ++tick)
      buried.advance(body, {{0.0113 + off, 0.004 + 0.0004 * tick, 0.0041}, {0.0113 + 2 * off, 0.004 + 0.0004 * tick, 0.0163}});
    CAPTURE(off);
    double const swept = 0.012 * std::hypot(0.0122, off);
    CHECK(buried.area() > 0.6 * swept);
    CHECK(buried.area() < swept);
  }
  auto body = make_body<TestType>(5, 5, 5, BlockPattern::kuhn);
  for (auto const& [from, way] : {std::pair(Place(0.0071, -0.005, 0), Place(0, 0.001, 0)), {Place(-0.005, 0.0121, 0), Place(0.001, 0, 0.0001)}}) {
    VolumeCutter<double> knife;
    for (int tick = 0; tick <= 30; ++tick) {
      Place const tip = from + tick * way;
      knife.advance(body, {tip - Place(0, 0, 0.01), tip + Place(0.001, 0.002, 0.03)});
    }
    knife.lift(body);
  }
  Random random(Seed{5});
  detail::TracedBlade<double> traced;
  int tetrahedra = 0;
  for (int t = 0; t < body.tissue().topology().tetrahedron_count(); ++t, ++tetrahedra) {
    auto const c = body.tissue().topology().corners(t);
    std::array<Place, 2> blade;
    for (Place& end : blade) {
      Eigen::Vector4d weights;
      for (double& w : weights) w = 0.05 + random.uniform<double>();
      weights /= weights.sum();
      end.setZero();
      for (int k = 0; k < 4; ++k) end += weights[k] * body.positions().col(c[static_cast<std::size_t>(k)]);
    }
    traced.clear();
    traced.trace(body, std::span<Place const>(blade));
    CAPTURE(t, blade[0].transpose(), blade[1].transpose());
    REQUIRE(traced.length_inside() == Approx((blade[1] - blade[0]).norm()));
  }
  CHECK(tetrahedra > 1000);
}

TEST_CASE("a blade that is shorter than the mesh resolves says so, and so does a slice too thin to come off", "[volume_cutter][scenes]") {
  // Yardstick: 5 mm edges. A blade of 0.6 mm between them cuts no face; one of 12 mm does. A second cut 0.2 and 0.5 mm beside the first is within what snaps.
  for (double const length : {0.0006, 0.012}) {
    INFO(length << " m long");
    auto body = make_body(5, 5, 5, BlockPattern::alternating);
    VolumeCutter<double> knife;
    auto const before = palpate_test::shape(body);
    palpate_test::stroke(knife, body, Place(0.0083, -0.002, 0.0112), Place(0.0083, -0.002, 0.0112 + length), Place(0, 0.024, 0), 60);
    bool const was_short = knife.report().unresolved;
    knife.lift(body);
    CHECK(knife.report().unresolved == was_short);
    CHECK(was_short == (length < 0.005));
    CHECK((knife.report().area > 0) == (length > 0.005));
    if (was_short) CHECK(palpate_test::pieces(body) == 1);
  }
  for (double const thin : {0.0002, 0.0005}) {
    INFO("a slice of " << thin << " m");
    auto body = make_body(6, 5, 5, BlockPattern::alternating);
    double area[2];
    VolumeCutReport report;
    for (int n = 0; n < 2; ++n) {
      VolumeCutter<double> knife;
      double const x = 0.0112 + n * thin;
      palpate_test::stroke(knife, body, Place(x, -0.01, -0.01), Place(x, -0.01, 0.03), Place(0, 0.04, 0), 60);
      knife.lift(body);
      report = knife.report(), area[n] = knife.area();
    }
    CHECK(area[0] == Approx(0.0004).epsilon(0.02));
    CHECK(area[1] == 0);
    CHECK(report.snapped > 10);
    CHECK(report.tetrahedra_added == 0);
    CHECK(palpate_test::pieces(body) == 2);
  }
}

TEST_CASE("a way that bends by up to 120 degrees, and a blade that does by up to 60, cuts through", "[volume_cutter][scenes]") {
  // Yardstick: the pieces that a surface from side to side makes.
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    for (double const bend : {45.0, 75.0, 90.0, 105.0, 120.0}) {
      INFO("seed " << seed << ", the way bends by " << bend << " degrees");
      Across scene(seed);
      double const turn = bend * std::numbers::pi / 180;
      Place const on = std::cos(turn) * scene.ahead + std::sin(turn) * scene.aside;
      for (int tick = -30; tick <= 30; ++tick) scene.go(scene.middle + 0.0015 * tick * (tick < 0 ? scene.ahead : on));
      scene.check(2);
    }
    for (double const bend : {30.0, 45.0, 60.0}) {
      INFO("seed " << seed << ", the blade bends by " << bend << " degrees");
      Across scene(seed);
      double const half = (180 - bend) * std::numbers::pi / 360;
      for (int tick = -30; tick <= 30; ++tick) {
        Place const at = scene.middle + 0.0012 * tick * Place::UnitY();
        std::array<Place, 3> const blade{at + 0.06 * Place(-std::sin(half), 0, std::cos(half)), at, at + 0.06 * Place(std::sin(half), 0, std::cos(half))};
        scene.knife.advance(scene.body, std::span<Place const>(blade));
      }
      scene.check(2);
    }
  }
}

TEST_CASE("a stroke that crosses its own way takes out what is within its loop, one that winds inwards nothing", "[volume_cutter][scenes]") {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    INFO("seed " << seed);
    {
      Across scene(seed);   // in, round a circle of 9 mm for three quarters, and out over the way in
      double const radius = 0.009;
      Place const from = scene.middle - 0.003 * scene.ahead - 0.006 * scene.aside;
      for (int tick = 40; tick > 0; --tick) scene.go(from - 0.00125 * tick * scene.ahead);
      Place at = from;
      for (int tick = 0; tick <= 80; ++tick) {
        double const turn = 1.5 * std::numbers::pi * tick / 80;
        at = from + radius * (scene.aside + std::sin(turn) * scene.ahead - std::cos(turn) * scene.aside);
        scene.go(at);
      }
      for (int tick = 1; tick <= 40; ++tick) scene.go(at - 0.00125 * tick * scene.aside);
      scene.check(3);
    }
    {
      Across scene(seed);   // 2 mm beside itself: less than half an edge
      for (int tick = 0; tick <= 160; ++tick) {
        double const turn = 2.8 * std::numbers::pi * tick / 160, radius = 0.01 - 0.003 * tick / 160;
        scene.go(scene.middle + radius * (std::cos(turn) * scene.ahead + std::sin(turn) * scene.aside));
      }
      scene.check(1);
    }
  }
}

TEST_CASE("a stroke that is forgotten half way goes on from there: lifted, with the body restored, with tissue taken away meanwhile", "[volume_cutter][scenes]") {
  for (std::uint64_t seed = 0; seed < 4; ++seed)
    for (std::string const what : {"lifted", "restored", "taken away"}) {
      INFO("seed " << seed << ", " << what);
      Across scene(seed);
      int const half = 27 + static_cast<int>(seed);
      for (int tick = 0; tick <= 60; ++tick) {
        scene.go(scene.middle + 0.0015 * (tick - 30) * scene.ahead);
        if (tick != half) continue;
        if (what == "lifted") scene.knife.lift(scene.body);
        if (what == "restored") scene.body.restore(scene.body.save());
        if (what == "taken away") {
          Aspirator<double> tool({.tip_radius = 0.002, .reach = 0.006, .max_tetrahedra = 1});
          std::size_t const before = scene.body.renumberings();
          for (int n = 0; n < 20 && scene.body.renumberings() == before; ++n) tool.advance(scene.body, Place::Constant(-0.005 + 0.0005 * n));
          REQUIRE(scene.body.renumberings() > before);
        }
      }
      scene.knife.lift(scene.body);
      CHECK(pieces(scene.body) == 2);
    }
}

TEST_CASE("two blades that cross while both are in the tissue, one an edge or two after the other, leave four pieces", "[volume_cutter][scenes]") {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    INFO("seed " << seed);
    Across scene(seed);
    VolumeCutter<double> other;
    double const turn = 1.0 + 0.15 * static_cast<double>(seed);
    Place const across = std::cos(turn) * scene.ahead + std::sin(turn) * scene.aside;
    for (int tick = 0; tick <= 68; ++tick) {
      scene.go(scene.middle + 0.0015 * (tick - 30) * scene.ahead);
      scene.go(other, scene.middle + 0.0015 * (tick - 38) * across);
    }
    other.lift(scene.body);
    scene.check(4);
  }
}

TEST_CASE("a small piece goes where the stroke that has cut it off ends, if that is wanted and nothing holds it", "[volume_cutter][scenes]") {
  // Yardstick: the same stroke without: how many tetrahedra the corner of the block has, and what they weigh.
  auto const cut_corner = [](auto& body, VolumeCutter<double>& knife) {
    Place const normal = Place(1, 0.9, 1.1).normalized(), blade = normal.unitOrthogonal(), way = normal.cross(blade), at(0.0071, 0, 0);
    stroke(knife, body, at - 0.03 * blade - 0.03 * way, at + 0.03 * blade - 0.03 * way, 0.06 * way, 40);
  };
  auto whole = make_body(5, 5, 5, BlockPattern::alternating);
  VolumeCutter<double> sharp;
  cut_corner(whole, sharp);
  auto const mesh = whole.rest_solid();
  auto const parts = connected_components(mesh);
  REQUIRE(parts.size() == 2);
  auto const& small = parts[0].size() < parts[1].size() ? parts[0] : parts[1];
  int count = 0;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) count += std::find(small.begin(), small.end(), mesh.tetrahedra(0, t)) != small.end() ? 1 : 0;
  double const volume = volumes(whole)[1];
  REQUIRE(count > 3);
  CHECK(sharp.debris().tetrahedra == 0);

  for (int const debris : {count, count + 1})
    for (char const* const holds : {"nothing", "a nail", "a hand"}) {
      INFO(debris << " of " << count << " tetrahedra, held by " << holds);
      auto body = make_body(5, 5, 5, BlockPattern::alternating);
      int corner = -1;
      for (int i = 0; i < body.size(); ++i)
        if (body.tissue().rest_position(i).norm() < 1e-9) corner = i;
      if (holds == std::string("a hand")) body.hold(corner);
      if (holds == std::string("a nail")) {
        auto tissue = body.tissue();
        tissue.nail(corner);
        body = SoftBody(std::move(tissue), BackwardEuler{.tolerance = 1e-3});
      }
      auto const saved = body.save();
      auto const before = invariants_of(body);
      bool const goes = debris > count && holds == std::string("nothing");
      VolumeCutter<double> knife({.debris = debris});
      cut_corner(body, knife);
      CHECK(pieces_of(body).size() == (goes ? 1u : 2u));
      CHECK(knife.debris().debris == (goes ? 1 : 0));
      CHECK(knife.debris().tetrahedra == (goes ? count : 0));
      CHECK(knife.debris().volume == Approx(goes ? volume : 0).epsilon(1e-12));
      CHECK(knife.debris().mass == Approx(goes ? 1000 * volume : 0).epsilon(1e-12));
      CHECK(body.tissue().tetrahedra() == mesh.tetrahedra.cols() - (goes ? count : 0));
      auto const now = [&] { return testing::to_text(before.check(body, {.volume = knife.debris().volume, .mass = knife.debris().mass})); };
      CHECK(now() == "");
      CHECK(body.step(1e-3));
      stroke(knife, body, Place(0.0112, -0.01, -0.01), Place(0.0112, -0.01, 0.03), Place(0, 0.04, 0), 40);   // the blade goes on with other numbers
      knife.lift(body);
      CHECK(pieces_of(body).size() == (goes ? 2u : 3u));
      CHECK(now() == "");
      body.restore(saved);
      CHECK(testing::to_text(before.check(body)) == "");
    }
  CHECK_THROWS_WITH(VolumeCutter<double>({.debris = -1}), Catch::Contains("debris is -1; it must not be negative"));
}

TEST_CASE("a tool that goes through a block from side to side cuts it in two at any speed, and what it has cut off goes as debris", "[volume_cutter][scenes]") {
  // Yardstick: by hand: 20 x 20 mm, 3.1 mm thick, of 1000 kg/m3; the plane goes through no vertex.
  for (double const toughness : {0.0, 60.0})
    for (int const debris : {0, 250})
      for (double const step : {2e-5, 3.7e-4, 1e-3, 6e-3}) {   // m a tick
        CAPTURE(toughness, debris, step);
        auto body = make_body(5, 5, 5, BlockPattern::alternating);
        auto const before = invariants_of(body);
        VolumeCutter<double> knife({.edge = {{0, 0, -0.03}, {0, 0, 0.01}}, .toughness = toughness, .debris = debris});
        double y = -0.0031;
        for (; y < 0.036; y += step) knife.advance(body, ToolPose<double>{.position = {0.0031, y, 0.019}});
        if (step < 2e-3) CHECK(knife.state() == CuttingPhase::no_contact);   // 6 m/s: it may be seen beside the edge for some ticks more
        CHECK(knife.area() == Approx(0.02 * 0.02).epsilon(1e-6));
        CHECK(knife.debris().debris == (debris > 0 ? 1 : 0));
        CHECK(knife.debris().volume == Approx(debris > 0 ? 0.0031 * 0.02 * 0.02 : 0).epsilon(1e-9));
        CHECK(knife.debris().mass == Approx(debris > 0 ? 1000 * 0.0031 * 0.02 * 0.02 : 0).epsilon(1e-9));
        auto const pieces = volumes(body);
        REQUIRE(pieces.size() == (debris > 0 ? 1u : 2u));
        CHECK(pieces[0] == Approx(0.0169 * 0.02 * 0.02).epsilon(1e-9));
        CHECK(testing::to_text(before.check(body, {.volume = knife.debris().volume, .mass = knife.debris().mass})) == "");
      }
}

// Yardstick: two pieces, and the area of the plane. With the rounding of a place a blade was out before it had cut the last corner.
TEMPLATE_LIST_TEST_CASE("a blade that stops where its way leaves the tissue, to rounding, has cut through", "[volume_cutter][scenes]", Solids) {
  for (auto const pattern : {BlockPattern::alternating, BlockPattern::kuhn})
    for (int const axis : {0, 1})
      for (double const aside : {0.0134, 0.0167, 0.0225})
        for (int ulps = -1; ulps <= 2; ++ulps) {
          auto body = make_body<TestType>(7, 7, 5, pattern);
          double end = 6 * edge;
          for (int k = 0; k < std::abs(ulps); ++k) end = std::nextafter(end, ulps > 0 ? 1.0 : 0.0);
          VolumeCutter<double> knife;
          auto const go = [&](double along) {
            Place const foot = axis == 0 ? Place(along, aside, -0.005) : Place(aside, along, -0.005);
            knife.advance(body, {foot, foot + Place(0, 0, 0.03)});
          };
          for (double along = -0.005; along < end - 2e-4; along += 1e-3) go(along);
          go(end), go(end + 1e-3), go(end + 0.01);
          CAPTURE(axis, aside, ulps);
          CHECK(pieces_of(body).size() == 2);
          CHECK(knife.area() == Approx(0.03 * 0.02));
        }
}

TEST_CASE("a tool that has left before its cut has come to where it went out cuts the rest all the same", "[volume_cutter][scenes]") {
  // Yardstick: the area of the plane, 20 x 20 mm, by hand.
  for (int const most : {1, 5, 20})
    for (double const toughness : {0.0, 60.0}) {
      CAPTURE(most, toughness);
      auto body = make_body(5, 5, 5, BlockPattern::alternating);
      auto const before = invariants_of(body);
      VolumeCutter<double> knife({.edge = {{0, 0, -0.03}, {0, 0, 0.01}}, .toughness = toughness, .max_tetrahedra = most});
      for (double y = -0.0031; y < 0.06; y += 0.009) knife.advance(body, ToolPose<double>{.position = {0.0031, y, 0.019}});
      for (int tick = 0; tick < 200 && knife.is_behind(); ++tick) {   // it waits above meanwhile
        knife.advance(body, ToolPose<double>{.position = {0.0031, 0.03, 0.06}});
        CHECK(testing::to_text(before.check(body)) == "");
      }
      CHECK(knife.state() == CuttingPhase::no_contact);
      CHECK(knife.area() == Approx(0.02 * 0.02).epsilon(1e-6));
      CHECK(volumes(body).size() == 2);
    }
}

TEST_CASE("a tool that comes down elsewhere before its last cut is done presses there first, and cuts nothing in between", "[volume_cutter][scenes]") {
  // Yardstick: the area of the plane, 40 x 20 mm, by hand; the flesh that is seen lies in that plane.
  for (int const most : {1, 5})
    for (int const wait : {0, 2}) {
      CAPTURE(most, wait);
      auto body = make_body(9, 9, 5, BlockPattern::alternating);
      auto const before = invariants_of(body);
      VolumeCutter<double> knife({.edge = {{0, 0, -0.03}, {0, 0, 0.03}}, .puncture_depth = 0.004, .max_tetrahedra = most});
      auto const go = [&](double x, double y, double z) { knife.advance(body, ToolPose<double>{.position = {x, y, z}}); };
      for (double y = -0.0031; y < 0.06; y += 0.009) go(0.0063, y, 0.009);
      CHECK(knife.is_behind());
      CHECK(knife.state() == CuttingPhase::no_contact);
      CHECK(!knife.grip());
      for (int tick = 0; tick < wait; ++tick) go(0.0063, 0.0589, 0.03);
      go(0.0163, 0.040, 0.03), go(0.0263, 0.030, 0.03), go(0.0313, 0.0223, 0.022);
      for (int tick = 0; tick < 5; ++tick) go(0.0313, 0.0223, 0.021 - 0.0005 * tick);   // a millimetre deep
      for (int tick = 0; tick < 300; ++tick) go(0.0313, 0.0223, 0.019);
      CHECK(knife.state() == CuttingPhase::indenting);
      CHECK(knife.area() == Approx(0.04 * 0.02).epsilon(1e-6));
      CHECK(volumes(body).size() == 2);
      double off = 0;
      auto const solid = body.rest_solid();
      for (int t = 0; t < body.tissue().surface().triangle_count(); ++t)
        for (int k = 0; k < 3 && body.tissue().is_wound(t); ++k) off = std::max(off, std::abs(solid.points(0, body.triangles()(k, t)) - 0.0063));
      CHECK(off < 1e-9);
      CHECK(testing::to_text(before.check(body)) == "");
    }
}

TEMPLATE_LIST_TEST_CASE("each piece that a cut has made has six modes without a force, and no more", "[volume_cutter][scenes]", Solids) {
  // Yardstick: the eigenvalues of the stiffness at rest, forces differenced.
  auto body = make_body<TestType>(4, 4, 3, BlockPattern::alternating);
  VolumeCutter<double> knife;
  stroke(knife, body, Place(0.0081, -0.01, -0.01), Place(0.0068, -0.01, 0.02), Place(0, 0.035, 0), 40);
  knife.lift(body);
  REQUIRE(pieces(body) == 2);
  Eigen::Index const n = 3 * body.size();
  Matrix3X<double> const rest = body.rest_solid().points, still = Matrix3X<double>::Zero(3, body.size());
  Eigen::MatrixXd stiffness(n, n);
  double const step = 1e-6 * edge;
  for (Eigen::Index k = 0; k < n; ++k) {
    Matrix3X<double> ahead = rest, behind = rest;
    ahead(k % 3, k / 3) += step, behind(k % 3, k / 3) -= step;
    for (int i = 0; i < body.size(); ++i)
      stiffness.col(k).segment<3>(3 * i) = (body.tissue().internal_force(i, behind, still) - body.tissue().internal_force(i, ahead, still)) / (2 * step);
  }
  Eigen::VectorXd const modes = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>((stiffness + stiffness.transpose()) / 2, Eigen::EigenvaluesOnly).eigenvalues();
  CHECK(modes[11] < 1e-6 * modes[n - 1]);
  CHECK(modes[0] > -1e-6 * modes[n - 1]);
  CHECK(modes[12] > 1e-4 * modes[n - 1]);
}
