// SPDX-License-Identifier: MIT
// What README and docs/cutting.md promise of mass and rest area, for each cutter. Yardstick: the area of the undeformed mesh, summed over its
// triangles before the stroke and after it.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/measures.hpp>

#include <cmath>

using namespace palpate;

namespace {

struct Change {
  double area, mass;   // share of what it was before
};

template <class S, class Cutter>
Change after_a_stroke(Cutter& cutter) {
  auto const sphere = make_sphere<S>(S(0.05), 6);
  S const edge = mean_edge_length(sphere);
  SoftBody body(make_tissue(sphere), LeapfrogVerlet{}, WholeBody{});
  auto const area = [&] {
    auto const mesh = body.rest_mesh();
    return surface_area(TriangleMesh<double>{mesh.points.template cast<double>(), mesh.triangles});
  };
  auto const mass = [&] {
    double sum = 0;
    for (int i = 0; i < body.size(); ++i) sum += static_cast<double>(body.tissue().mass(i));
    return sum;
  };
  double const area_before = area(), mass_before = mass();
  Random random(Seed{3});
  for (auto const& tip : stroke_along<S>(sphere, random, edge, S(8), edge / 5)) cutter.advance(body, tip);
  cutter.reset(body);
  REQUIRE(cutter.report().particles_added > 3);
  return {area() / area_before - 1, mass() / mass_before - 1};
}

}  // namespace

TEMPLATE_TEST_CASE("a cut keeps the mass; the rest area stays with ProgressiveCutter and changes as reported with SeparatingCutter", "[cutting]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const digits = sizeof(S) == 4 ? 1e-5 : 1e-12;
  SECTION("ProgressiveCutter") {
    ProgressiveCutter<S> cutter({.puncture_depth = S(0.001)});
    Change const change = after_a_stroke<S>(cutter);
    CHECK(std::abs(change.mass) < digits);
    CHECK(std::abs(change.area) < digits);
  }
  SECTION("SeparatingCutter") {
    SeparatingCutter<S> cutter({.puncture_depth = S(0.001)});
    Change const change = after_a_stroke<S>(cutter);
    double const area = surface_area(TriangleMesh<double>{make_sphere<double>(0.05, 6)});
    CHECK(std::abs(change.mass) < digits);
    CHECK(std::abs(change.area) > 1e-5);
    CHECK(change.area == Approx(static_cast<double>(cutter.report().area_change) / area).epsilon(1e-3));
  }
}
