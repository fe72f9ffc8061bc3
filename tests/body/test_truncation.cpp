// SPDX-License-Identifier: MIT
// What a zone's cut-off costs. Yardstick: the same scene with the whole body.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace palpate;

namespace {

/// A body pressed at one particle by a force that grows for half of the time and then stays.
struct Scene {
  char const* name;
  MassSpring<double> tissue;
  int touched;
  Vector3<double> force;
  double seconds;

  template <class RegionType>
  auto pressed(RegionType region) const {
    SoftBody body(tissue, LeapfrogVerlet{}, region);
    double const step = 0.9 * body.stable_step();   // the same for every region
    int const steps = static_cast<int>(seconds / step);
    for (int k = 0; k < steps; ++k) {
      body.apply_force(touched, std::min(1.0, 2 * (k + 0.5) / steps) * force);
      REQUIRE(body.step(step));
    }
    return body;
  }
};

MassSpring<double> tissue(TriangleMesh<double> const& mesh, double mass, LinearSpring<double> link, HomeSpring<double> home, bool nail,
                          double prestrain = 0) {
  MassSpring<double> result(mesh, {.mass = {.total = mass, .lumping = Lumping::equal}, .link = link, .home = home, .link_prestrain = prestrain});
  if (nail) result.nail(boundary_vertices(mesh));
  return result;
}

Scene ten() {   // the thesis's squares
  return {"10 x 10", tissue(make_grid<double>(10, 10, 1.0), 1, {.stiffness = 1, .damping = 1}, {.stiffness = 2, .damping = 1}, true), 44, {0, 0, -10}, 14};
}
Scene twenty() {
  return {"20 x 20", tissue(make_grid<double>(20, 20, 1.0), 1, {.stiffness = 2, .damping = 1}, {.stiffness = 1, .damping = 0.5}, true), 189, {0, 0, -7}, 20};
}
Scene ball() {
  return {"ball", tissue(make_sphere<double>(0.05, 8), 0.1, {.stiffness = 100, .damping = 0.05}, {.stiffness = 10, .damping = 0.05}, false), 3, {0, 0, -0.3}, 1};
}

template <class Zone, class Whole>
double true_error(Zone const& zone, Whole const& whole) {
  return (zone.positions() - whole.positions()).colwise().norm().maxCoeff();
}

}  // namespace

TEST_CASE("the estimate is within a factor of three of the largest error, in bodies held by stiff and by soft homes") {
  auto const organ = make_organ<double>({.vertices = 1000});
  int top = 0;
  organ.points.row(2).maxCoeff(&top);
  auto const wide = make_grid<double>(20, 20, 1.0);
  for (Scene const& scene :
       {ten(), twenty(), ball(),
        Scene{"sideways", tissue(wide, 1, {.stiffness = 2, .damping = 1}, {.stiffness = 1, .damping = 0.5}, true), 189, {3, 1, -1}, 20},
        Scene{"soft homes", tissue(wide, 1, {.stiffness = 2, .damping = 0.1}, {.stiffness = 0.05, .damping = 0.1}, true), 189, {0.3, 0, -0.5}, 60},
        Scene{"pre-tension", tissue(wide, 1, {.stiffness = 2, .damping = 0.3}, {.stiffness = 0.2, .damping = 0.1}, true, 0.1), 189, {0, 0, -1}, 30},
        Scene{"organ", tissue(organ, 0.3, {.stiffness = 100, .damping = 0.05}, {.stiffness = 10, .damping = 0.1}, false), top, {0.1, 0, -0.3}, 1}}) {
    auto const whole = scene.pressed(WholeBody{});
    CHECK(whole.truncation_error() == 0);
    for (int const rings : {0, 1, 2, 3, 5}) {
      auto const zone = scene.pressed(ZoneOfInfluence{.rings = rings});
      double const estimate = zone.truncation_error(), error = true_error(zone, whole);
      double const there = (zone.positions().col(scene.touched) - whole.positions().col(scene.touched)).norm();
      CAPTURE(scene.name, rings, estimate, error, there);
      CHECK(error < 3 * estimate);
      CHECK(estimate < 3 * error);
      CHECK(there < 3 * estimate);
      if (rings >= 2) CHECK(there < 1.5 * estimate);
    }
  }
}

TEST_CASE("the estimate bounds what the published square is off by with one, two and three rings") {
  // -2.13427 m whole, -2.12335 m with one ring, -2.13352 m with two: an adaptive integration of eighth order, made with another program.
  double const whole = -2.13427, zones[] = {-2.12335, -2.13352};
  for (int const rings : {1, 2, 3}) {
    SoftBody body(ten().tissue, LeapfrogVerlet{}, ZoneOfInfluence{.rings = rings});
    for (int step = 0; step < 7000; ++step) {
      body.apply_force(44, {0.0, 0.0, -10.0 * (step + 0.5) * 1e-3 / 7.0});
      body.step(1e-3);
    }
    if (rings < 3) CHECK(body.displacement(44).z() == Approx(zones[rings - 1]).margin(6e-6));
    CHECK(std::abs(body.displacement(44).z() - whole) < body.truncation_error());
  }
}

TEMPLATE_TEST_CASE("the estimate is zero where nothing is touched, and in float what it is in double", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  MassSpring<S> matter(make_sphere<S>(S(0.05), 6), {.mass = {.total = S(0.1)}, .link = {.stiffness = S(100), .damping = S(0.05)},
                                                    .home = {.stiffness = S(10), .damping = S(0.05)}});
  SoftBody body(std::move(matter), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  static_assert(noexcept(body.truncation_error()));
  CHECK(body.truncation_error() == 0);
  for (int k = 0; k < 10000; ++k) {
    body.apply_force(7, {S(0), S(0.1), S(-0.3)});
    body.step(S(1e-4));
  }
  CHECK(double(body.truncation_error()) == Approx(1.1e-3).epsilon(0.5));
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  S const error = body.truncation_error();
  CHECK(allocations.count() == 0);
  CHECK(error > 0);
  int moving = 1;
  for (int k = 0; k < 100000 && moving > 0; ++k) moving = body.step(S(1e-4)).moving;
  CHECK(moving == 0);
  CHECK(body.truncation_error() == 0);
}

TEST_CASE("a zone with a tolerance grows until its largest error is within three times that, the farther the smaller it is") {
  for (Scene const& scene : {twenty(), ball()}) {
    auto const whole = scene.pressed(WholeBody{});
    int least = 0;
    for (double const tolerance : {0.1, 0.03, 0.01, 0.003}) {
      auto zone = scene.pressed(ZoneOfInfluence{.rings = 1, .tolerance = tolerance});
      double const allowed = tolerance * zone.mean_edge();
      zone.apply_force(scene.touched, scene.force);
      int const moving = zone.step(1e-5).moving;
      CAPTURE(scene.name, tolerance, moving);
      CHECK(true_error(zone, whole) < 3 * allowed);
      CHECK(zone.truncation_error() <= 1.1 * allowed);   // it is looked at every eight steps
      CHECK(moving > least);
      least = moving;
    }
  }
}

TEST_CASE("a zone that grew has its own rings back after a rest, and a saved one goes on as it would have") {
  Scene const scene = ball();
  auto body = scene.pressed(ZoneOfInfluence{.rings = 1, .tolerance = 0.01});
  auto const push = [&](auto& b, double force) {
    b.apply_force(scene.touched, {0.0, 0.0, force});
    return b.step(1e-4).moving;
  };
  int const grown = push(body, -0.3);
  auto const saved = body.save();
  int before = 0, after = 0;
  for (int k = 0; k < 200; ++k) before += push(body, -0.3 - 1e-3 * k);
  auto const there = body.positions().eval();
  body.restore(saved);
  for (int k = 0; k < 200; ++k) after += push(body, -0.3 - 1e-3 * k);
  CHECK(before == after);
  CHECK(body.positions() == there);
  int moving = 1;
  for (int k = 0; k < 200000 && moving > 0; ++k) moving = body.step(1e-4).moving;
  REQUIRE(moving == 0);
  CHECK(push(body, -1e-6) == 6);   // one ring: one of the ball's twelve corners and its five neighbours
  CHECK(grown > 30);
}

TEST_CASE("a zone gives rings back when it is pressed less") {
  Scene const scene = ten();
  auto body = scene.pressed(ZoneOfInfluence{.rings = 0, .tolerance = 0.003});
  double const step = 0.9 * body.stable_step();
  int pressed = 0, gentle = 0;
  for (int k = 0; k < 100; ++k) {
    body.apply_force(scene.touched, scene.force);
    pressed = body.step(step).moving;
  }
  for (int k = 0; k < 100000; ++k) {
    body.apply_force(scene.touched, Vector3<double>(1e-3 * scene.force));
    gentle = body.step(step).moving;
  }
  CHECK(pressed > 19);
  CHECK(gentle < 19);
}

TEST_CASE("a zone that chooses its rings does not allocate") {
  REQUIRE(palpate_test::trap_works());
  Scene const scene = ball();
  SoftBody body(scene.tissue, LeapfrogVerlet{}, ZoneOfInfluence{.rings = 0, .tolerance = 0.01});
  body.apply_force(scene.touched, scene.force);
  body.step(1e-4);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 3000; ++k) {
    body.apply_force((k / 300) * 11, scene.force);
    body.step(1e-4);
  }
  CHECK(allocations.count() == 0);
}

TEST_CASE("a tolerance that is none is answered in a sentence") {
  for (double const tolerance : {-0.1, std::nan("")})
    CHECK_THROWS_AS(SoftBody(ball().tissue, LeapfrogVerlet{}, ZoneOfInfluence{.tolerance = tolerance}), InvalidArgument);
}
