// SPDX-License-Identifier: MIT
// Yardsticks: what no cut may change (testing/cut_invariants.hpp), momentum and energy of motion before the tick, and the quality of the
// triangles there were, along random strokes with a printed seed.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/quality.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using namespace palpate;

namespace {

template <class S>
Vector3<S> any(Random& random) {
  return {random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1))};
}

/// A bent stroke of `edges` mean edges from a random vertex in a random direction; on an open sheet it often leaves over the border and may
/// come back.
template <class S>
Points<S> random_stroke(TriangleMesh<S> const& mesh, Random& random, S edge, S edges, S tick) {
  Points<S> corners{mesh.points.col(static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(mesh.points.cols())))) + S(0.4) * edge * any<S>(random)};
  int const bends = 1 + static_cast<int>(random.below(4));
  for (int k = 0; k < bends; ++k) corners.push_back(corners.back() + edges * edge / S(bends) * any<S>(random).normalized());
  if (mesh.points.row(2).cwiseAbs().maxCoeff() > 0) return stroke_over<S>(mesh, sampled<S>(corners, tick), S(0.4) * edge, 2 * edge);
  Points<S> tips;   // over a flat sheet, and beside it
  for (Vector3<S> const& p : sampled<S>(corners, tick)) tips.push_back({p.x(), p.y(), S(-0.4) * edge});
  tips.insert(tips.begin(), tips.front() + Vector3<S>(0, 0, 2 * edge));
  tips.push_back(tips.back() + Vector3<S>(0, 0, 2 * edge));
  return tips;
}

double rest_area(auto const& body) {
  auto const mesh = body.rest_mesh();
  return surface_area(TriangleMesh<double>{mesh.points.template cast<double>(), mesh.triangles});
}

double momentum_scale(auto const& body) {
  double sum = 0;
  for (int i = 0; i < body.size(); ++i) sum += static_cast<double>(body.tissue().mass(i) * body.velocities().col(i).norm());
  return sum;
}

struct Seen {
  int opened = 0, moved = 0, left = 0, behind = 0;
};

/// Few edges in a fifth of the bodies, so that blades are behind.
int edges_per_tick(Random& random) { return random.below(5) == 0 ? 1 + static_cast<int>(random.below(4)) : 50; }

template <class S, class Region>
Seen separate_at_random(TriangleMesh<S> const& mesh, Region region, std::uint64_t seed, int bodies, int strokes, bool steps, S prestrain) {
  Random random(Seed{seed});
  S const edge = mean_edge_length(mesh);
  constexpr double digits = sizeof(S) == 4 ? 1e-5 : 1e-12;
  S const worst = std::min(S(0.4), quality(mesh).worst_quality);
  S const longest = quality(mesh).longest_edge;
  Seen seen;
  for (int b = 0; b < bodies; ++b) {
    SoftBody body(make_tissue(mesh, prestrain), LeapfrogVerlet{}, region);
    double const area = rest_area(body);
    double change = 0;
    testing::CutInvariants const before(body, {.moves_vertices = true});
    int const edges = edges_per_tick(random);
    for (int k = 0; k < strokes; ++k) {
      CAPTURE(seed, b, k, edges);
      SeparatingCutter<S> cutter({.puncture_depth = S(0.2) * edge, .edges_per_tick = edges});
      S const tick = edge * std::exp(random.uniform(std::log(S(0.05)), std::log(S(4))));
      int drawn = 0;
      for (auto const& tip : random_stroke<S>(mesh, random, edge, S(8), tick)) {
        auto const momentum = body.momentum().template cast<double>().eval();
        double const motion = static_cast<double>(body.kinetic_energy()), scale = momentum_scale(body);
        bool const goes_on = cutter.state() == CuttingPhase::moving || cutter.is_behind();
        double const change_before = static_cast<double>(cutter.report().area_change);
        cutter.advance(body, tip);
        if (goes_on || cutter.state() == CuttingPhase::moving)   // a new puncture begins a new report
          change += static_cast<double>(cutter.report().area_change) - (goes_on ? change_before : 0.0);
        seen.left += cutter.contact().off_surface ? 1 : 0;
        seen.behind += cutter.is_behind() ? 1 : 0;
        REQUIRE(testing::to_text(before.check(body)) == "");
        CHECK((body.momentum().template cast<double>() - momentum).norm() <= digits * scale);
        CHECK(static_cast<double>(body.kinetic_energy()) <= motion * (1 + digits));
        if (!steps || ++drawn > 60) continue;
        S const h = body.stable_step();
        for (int i = 0; i < 3; ++i) REQUIRE(body.step(h));
      }
      CHECK(cutter.state() == CuttingPhase::no_contact);
      double const change_before = static_cast<double>(cutter.report().area_change);
      cutter.reset(body);   // it may be behind
      auto const& report = cutter.report();
      change += static_cast<double>(report.area_change) - change_before;
      CHECK_FALSE(cutter.is_behind());
      REQUIRE(testing::to_text(before.check(body)) == "");
      CHECK(report.triangles_added == 0);
      CHECK(report.particles_added == static_cast<int>(cutter.lips().size()));
      CHECK(report.largest_move < longest);
      for (auto const& [p, q] : cutter.lips()) CHECK(body.tissue().rest_position(p) == body.tissue().rest_position(q));
      seen.opened += report.vertex_vertex, seen.moved += report.particles_moved;
    }
    CHECK(rest_area(body) - area == Approx(change).epsilon(1e-6).margin(digits * area));
    CHECK(quality(body.rest_mesh()).worst_quality >= worst * S(0.999));
  }
  return seen;
}

}  // namespace

TEMPLATE_TEST_CASE("separating strokes over a sheet at rest keep every invariant", "[cutting]", PALPATE_TEST_SCALARS) {
  Seen const seen = separate_at_random<TestType>(make_grid<TestType>(12, 12, TestType(0.01)), WholeBody{}, 41, 12, 8, false, 0);
  CHECK(seen.opened > 200);
  CHECK(seen.moved > 100);
  CHECK(seen.left > 10);
  CHECK(seen.behind > 10);
}

TEMPLATE_TEST_CASE("separating strokes over a sphere at rest keep every invariant", "[cutting]", PALPATE_TEST_SCALARS) {
  Seen const seen = separate_at_random<TestType>(make_sphere<TestType>(TestType(0.05), 6), WholeBody{}, 42, 8, 8, false, 0);
  CHECK(seen.opened > 200);
  CHECK(seen.moved > 100);
}

TEMPLATE_TEST_CASE("separating strokes over a moving, pre-tensioned organ keep every invariant", "[cutting]", PALPATE_TEST_SCALARS) {
  Seen const seen = separate_at_random<TestType>(make_organ<TestType>({.vertices = 400}), WholeBody{}, 43, 2, 5, true, TestType(0.06));
  CHECK(seen.opened > 30);
}

TEMPLATE_TEST_CASE("separating strokes over a moving sheet, a zone computed, keep every invariant", "[cutting]", PALPATE_TEST_SCALARS) {
  Seen const seen = separate_at_random<TestType>(make_grid<TestType>(12, 12, TestType(0.01)), ZoneOfInfluence{.rings = 3}, 44, 4, 4, true, 0);
  CHECK(seen.opened > 30);
}

TEST_CASE("separating blades at once, some of them behind, keep every invariant", "[cutting]") {
  Random random(Seed{45});
  int opened = 0, behind = 0;
  for (int b = 0; b < 24; ++b) {
    auto const mesh = b % 2 == 0 ? make_grid<double>(12, 12, 0.01) : make_sphere<double>(0.05, 6);
    double const edge = mean_edge_length(mesh);
    SoftBody body(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
    testing::CutInvariants const before(body, {.moves_vertices = true});
    for (int k = 0; k < 4; ++k) {
      std::vector<SeparatingCutter<double>> blades;
      std::vector<Points<double>> tips;
      std::size_t longest = 0;
      for (int i = 0; i < 3; ++i) {
        blades.emplace_back(SeparatingCutterOptions<double>{.puncture_depth = 0.2 * edge, .edges_per_tick = 1 + static_cast<int>(random.below(4))});
        tips.push_back(random_stroke<double>(mesh, random, edge, 8.0, edge * std::exp(random.uniform(std::log(0.5), std::log(8.0)))));
        longest = std::max(longest, tips.back().size());
      }
      for (std::size_t tick = 0; tick < longest; ++tick)
        for (std::size_t i = 0; i < blades.size(); ++i) {
          CAPTURE(b, k, tick, i);
          blades[i].advance(body, tips[i][std::min(tick, tips[i].size() - 1)]);
          REQUIRE(testing::to_text(before.check(body)) == "");
          behind += blades[i].is_behind() ? 1 : 0;
        }
      for (auto& blade : blades) {
        int ticks = 0;
        if (random.below(2) == 0)
          blade.reset(body);
        else
          while (blade.is_behind() && ++ticks < 1000) blade.advance(body, tips[0].front());
        CHECK_FALSE(blade.is_behind());
        REQUIRE(testing::to_text(before.check(body)) == "");
        opened += blade.report().vertex_vertex;
      }
    }
  }
  CHECK(opened > 200);
  CHECK(behind > 100);
}
