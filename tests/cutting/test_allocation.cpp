// SPDX-License-Identifier: MIT
// A stroke over a body that was reserved allocates nothing but what the cutter keeps for itself, and that once. Yardstick: the allocation trap.
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <vector>

using namespace palpate;

namespace {

using Body = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
using Vector = Vector3<double>;

Body body_of(TriangleMesh<double> const& mesh) {
  return Body(MassSpring<double>(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 10.0, .damping = 0.01}, .home = {.stiffness = 1.0, .damping = 0.01}}));
}

/// Down onto the surface, over it in `ticks` ticks and up again; `step` between the ticks where it is above 0. Counts what advance() allocates.
template <class Cutter>
long allocations_of(Cutter& cutter, Body& body, Vector const& from, Vector const& to, Vector const& up, int ticks, double step) {
  long count = 0;
  auto const tick = [&](Vector const& tip) {
    palpate_test::AllocationCount const allocations;
    cutter.advance(body, tip);
    count += allocations.count();
    if (step > 0) body.step(step);
  };
  tick(from + up);
  for (int k = 0; k <= ticks; ++k) tick(from + (to - from) * k / ticks - up);
  tick(to + up);
  return count;
}

struct Stroke {
  Vector from, to;
  int ticks;
};

/// Allocations on strokes over a body with room for three times what it has.
template <class Cutter>
long allocations_of(Cutter& cutter, TriangleMesh<double> const& mesh, std::vector<Stroke> const& strokes, Vector const& up, double step) {
  Body body = body_of(mesh);
  body.reserve(4 * body.size(), 4 * static_cast<int>(body.triangles().cols()));
  int const particles = body.size();
  long count = 0;
  for (auto const& [from, to, ticks] : strokes) count += allocations_of(cutter, body, from, to, up, ticks, step);
  CHECK(body.size() > particles + 30);
  CHECK(body.size() < 3 * particles);
  return count;
}

}  // namespace

TEMPLATE_TEST_CASE("strokes over a reserved body allocate nothing once the cutter has made strokes as long", "", ProgressiveCutter<double>,
                   SeparatingCutter<double>) {
  REQUIRE(palpate_test::trap_works());
  double const step = GENERATE(0.0, 1e-4);
  CAPTURE(step);
  TestType cutter({.puncture_depth = 0.001});

  SECTION("on a grid: along, many triangles a tick, across the others, over the border") {
    std::vector<Stroke> const strokes{{{0.0213, 0.0317, 0}, {0.1713, 0.0887, 0}, 300},
                                      {{0.0213, 0.0717, 0}, {0.1713, 0.0717, 0}, 10},
                                      {{0.1, 0.02, 0}, {0.11, 0.18, 0}, 300},
                                      {{0.0213, 0.1317, 0}, {0.25, 0.15, 0}, 300}};
    Vector const up(0, 0, 0.002);
    auto const grid = make_grid<double>(40, 40, 0.005);
    INFO("the first time " << allocations_of(cutter, grid, strokes, up, step));
    CHECK(allocations_of(cutter, grid, strokes, up, step) == 0);
  }

  SECTION("on a closed body") {
    std::vector<Stroke> const strokes{{{-0.02, -0.011, 0.045}, {0.02, -0.011, 0.045}, 50}, {{-0.02, 0.009, 0.045}, {0.02, 0.012, 0.045}, 50}};
    Vector const up(0, 0, 0.005);
    auto const sphere = make_sphere<double>(0.05, 24);
    INFO("the first time " << allocations_of(cutter, sphere, strokes, up, step));
    CHECK(allocations_of(cutter, sphere, strokes, up, step) == 0);
  }
}

TEST_CASE("a blade that cuts a solid which was reserved allocates only as the record of edits doubles", "[cutting][allocation]") {
  REQUIRE(palpate_test::trap_works());
  auto const pressure = GENERATE(Pressure::element, Pressure::nodal);
  bool const has_steps = GENERATE(false, true);
  SoftBody body(FiniteElements<double, StableNeoHookean<double>>(make_block<double>(13, 13, 9, 0.005, BlockPattern::alternating),
                                                                 {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}, .pressure = pressure}),
                BackwardEuler{.max_iterations = 1});
  body.reserve(8 * body.size(), 16 * static_cast<int>(body.triangles().cols()));
  VolumeCutter<double> knife;
  long counts[3];
  int cuts = 0;
  for (int stroke = 0; stroke < 3; ++stroke) {
    palpate_test::AllocationCount const allocations;
    for (int tick = 0; tick <= 200; ++tick) {
      double const x = 0.0137 + 0.0171 * stroke, y = -0.003 + 0.066 * tick / 200;
      int const before = body.tissue().tetrahedra();
      knife.advance(body, {{x, y, 0.0093}, {x, y, 0.06}});
      cuts += body.tissue().tetrahedra() > before ? 1 : 0;
      if (has_steps && tick % 4 == 0) body.step(1e-6);
    }
    knife.lift(body);
    counts[stroke] = allocations.count();
  }
  INFO((pressure == Pressure::nodal ? "nodal" : "element") << (has_steps ? ", with steps" : "") << ": the first stroke " << counts[0] << ", the second " << counts[1]);
  CHECK(cuts > 100);
  CHECK(counts[1] < 10);
  CHECK(counts[2] <= 2);
}
