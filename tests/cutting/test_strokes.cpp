// SPDX-License-Identifier: MIT
// Yardstick: what no cut may change (testing/cut_invariants.hpp), along random strokes with a printed seed.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>

using namespace palpate;

namespace {

/// A gently curved stroke of `edges` mean edges over a surface, from a random point in a random direction, on undeformed points.
template <class S>
Points<S> random_stroke(TriangleMesh<S> const& mesh, Random& random, S edge, S edges, S tick) {
  Vector3<S> const start = mesh.points.col(static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(mesh.points.cols()))));
  Vector3<S> way(random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)));
  Vector3<S> const bend = S(0.3) * edges * edge * Vector3<S>(random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)), S(0));
  way *= edges * edge / way.norm();
  Points<S> const corners{start, start + way / 2 + bend, start + way};
  return stroke_over<S>(mesh, sampled<S>(corners, tick), S(0.4) * edge, S(0.3) * edge);
}

template <class S, class Region>
void cut_at_random(TriangleMesh<S> const& mesh, Region region, std::uint64_t seed, int strokes, bool steps, S prestrain) {
  CAPTURE(seed);
  Random random(Seed{seed});
  S const edge = mean_edge_length(mesh);
  for (int k = 0; k < strokes; ++k) {
    CAPTURE(k);
    SoftBody body(make_tissue(mesh, prestrain), LeapfrogVerlet{}, region);
    testing::CutInvariants const before(body);
    ProgressiveCutter<S> cutter({.puncture_depth = S(0.2) * edge});
    S const tick = edge * std::exp(random.uniform(std::log(S(0.05)), std::log(S(3))));
    auto const tips = random_stroke(mesh, random, edge, S(6), tick);
    int drawn = 0;
    auto const between = [&](auto& moved) {
      if (!steps || ++drawn > 60) return;
      S const h = moved.stable_step();
      for (int i = 0; i < 3; ++i) REQUIRE(moved.step(h));
    };
    REQUIRE(violations_along(body, cutter, tips, before, between) == "");
  }
}

}  // namespace

TEMPLATE_TEST_CASE("strokes over a sheet at rest keep every invariant", "", PALPATE_TEST_SCALARS) {
  cut_at_random<TestType>(make_grid<TestType>(12, 12, TestType(0.01)), WholeBody{}, 11, 40, false, 0);
}

TEMPLATE_TEST_CASE("strokes over a sphere at rest keep every invariant", "", PALPATE_TEST_SCALARS) {
  cut_at_random<TestType>(make_sphere<TestType>(TestType(0.05), 6), WholeBody{}, 12, 25, false, 0);
}

TEST_CASE("strokes over a moving, pre-tensioned organ keep every invariant") {
  cut_at_random<double>(make_organ<double>({.vertices = 400}), WholeBody{}, 13, 6, true, 0.08);
}

TEST_CASE("strokes over a moving sheet, a zone computed, keep every invariant") {
  cut_at_random<double>(make_grid<double>(12, 12, 0.01), ZoneOfInfluence{.rings = 3}, 14, 10, true, 0.0);
}
