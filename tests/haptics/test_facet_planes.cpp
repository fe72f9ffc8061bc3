// SPDX-License-Identifier: MIT
// Yardsticks: the planes that a valley, a ridge and a corner of triangles are made of; a plate that a tip passes through in a tick.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "haptics/skin.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/core/random.hpp>
#include <palpate/haptics/facet_planes.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/surface_proxy.hpp>
#include <palpate/haptics/surface_sensor.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

using namespace palpate;
using palpate_test::Skin;

namespace {

/// A sheet folded along x = 0, z = slope · |x|: a valley, or a ridge for a slope below zero.
template <RealScalar S>
TriangleMesh<S> folded(S slope, int vertices = 9) {
  auto mesh = make_grid<S>(vertices, vertices, S(0.04) / S(vertices - 1));
  mesh.points.row(0).array() -= S(0.02), mesh.points.row(1).array() -= S(0.02);
  mesh.points.row(2) = slope * mesh.points.row(0).cwiseAbs();
  return mesh;
}

/// The triangle of such a mesh above or below a point.
template <RealScalar S>
int under(TriangleMesh<S> const& mesh, S x, S y) {
  for (int t = 0; t < mesh.triangles.cols(); ++t) {
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      auto const a = mesh.points.col(mesh.triangles(k, t)), b = mesh.points.col(mesh.triangles((k + 1) % 3, t));
      inside = inside && (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x()) >= 0;
    }
    if (inside) return t;
  }
  return -1;
}

}  // namespace

TEMPLATE_TEST_CASE("in a valley it is the same two planes from either side, and the tip is held on its bottom line", "[haptics]",
    PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = folded<S>(S(0.75));
  Skin<S> const skin(mesh);
  Random random(Seed{1});
  double const close = 256 * std::numeric_limits<S>::epsilon();
  for (int round = 0; round < 200; ++round) {
    S const x = random.uniform(S(-0.0045), S(0.0045)), y = random.uniform(S(-0.018), S(0.018));
    int const t = under(mesh, x, y);
    REQUIRE(t >= 0);
    bool at_bottom = false;
    for (int k = 0; k < 3; ++k) at_bottom = at_bottom || mesh.points(0, mesh.triangles(k, t)) == S(0);
    REQUIRE(at_bottom);
    Vector3<S> const tip(S(0.1) * x, y, S(-0.002));
    auto const planes = facet_planes(skin, t, tip);
    REQUIRE(planes.count() == 2);
    CHECK(double(planes[0].normal.x() * (x < 0 ? 1 : -1)) == Approx(0.6).epsilon(close));   // its own first
    CHECK(double((planes.project(tip).point - Vector3<S>(0, y, 0)).norm()) < close * 0.02);
    S const r = S(0.003);   // a ball's centre is held over it
    CHECK(double((facet_planes(skin, t, tip, r).project(tip).point - Vector3<S>(0, y, r / S(0.8))).norm()) < close * 0.02);
  }
}

TEST_CASE("over a ridge, on a ball and on a plane it is the touched facet alone", "[haptics]") {
  auto const roof = folded<double>(-0.75);
  Skin<double> const ridge(roof), ball(make_sphere<double>(0.05, 6)), plane(folded<double>(0.0));
  for (double const x : {-0.003, -0.0001, 0.0001, 0.003}) {
    Vector3<double> const tip(x, 0.001, -0.004);   // behind both sides of the roof
    auto const planes = facet_planes(ridge, under(roof, x, 0.001), tip);
    REQUIRE(planes.count() == 1);
    CHECK(planes[0].normal.x() * (x < 0 ? -1 : 1) == Approx(0.6));
  }
  for (int t = 0; t < 100; ++t) {
    CHECK(facet_planes(ball, t, {0, 0, 0}).count() == 1);
    CHECK(facet_planes(plane, t, {0, 0, -0.001}).count() == 1);
  }
}

TEST_CASE("in a hollow it is the three planes that hold the tip, and of more than three those that matter to it", "[haptics]") {
  // The inner side of a corner: floor and two walls.
  TriangleMesh<double> mesh;
  mesh.points.resize(3, 7);
  mesh.points << 0, 1, 0, 0, 1, 0, 1,   //
      0, 0, 1, 0, 1, 1, 0,              //
      0, 0, 0, 1, 0, 1, 1;
  mesh.points *= 0.01;
  mesh.triangles.resize(3, 6);
  mesh.triangles << 0, 0, 0, 0, 0, 0,   //
      1, 4, 2, 5, 3, 6,                 //
      4, 2, 5, 3, 6, 1;
  Skin<double> const corner(mesh);
  for (int t = 0; t < 6; ++t) {
    Vector3<double> const tip(-0.001, -0.002, -0.003);
    auto const planes = facet_planes(corner, t, tip);
    REQUIRE(planes.count() == 3);
    CHECK(planes.project(tip).point.norm() < 1e-15);
    CHECK((planes.project({0.001, -0.002, -0.003}).point - Vector3<double>(0.001, 0, 0)).norm() < 1e-15);
  }
  // A hollow ball has as many planes as facets around: those taken hold the tip at least as far out as the facet alone does, and as all together do
  // where no more than three of them push.
  auto shell = make_sphere<double>(0.05, 3);
  shell.triangles.row(1).swap(shell.triangles.row(2));
  Skin<double> const hollow(shell);
  Random random(Seed{2});
  for (int t = 0; t < shell.triangles.cols(); ++t) {
    auto const c = hollow.tissue().surface().corners(t);
    Vector3<double> const mean = (hollow.points.col(c[0]) + hollow.points.col(c[1]) + hollow.points.col(c[2])) / 3;
    Vector3<double> const tip = mean * 1.05 + 0.002 * Vector3<double>(random.normal(), random.normal(), random.normal());
    auto const planes = facet_planes(hollow, t, tip);
    REQUIRE(planes.count() == 3);
    auto const found = planes.project(tip);
    double worst = 0;   // behind any of the facets around
    for (int const v : c)
      for (int const s : hollow.tissue().surface().triangles_at(v)) worst = std::max(worst, -(facet_planes(hollow, s, tip)[0].distance(found.point)));
    if (found.count < 3) CHECK(worst <= 1e-12);
  }
}

// Yardstick: a plate of 0.1 mm that the tip passes at 1 m/s, ten times as thick in a tick: the force goes on pointing to where it came from.
TEST_CASE("C2-P6: a tip that passes through a thin wall in a tick is held on the side that it came from", "[haptics]") {
  auto mesh = surface(make_block<double>(9, 9, 2, 0.005));
  mesh.points.row(2) = (mesh.points.row(2).array() / 0.005 - 1.0) * 1e-4;
  for (double const side : {1.0, -1.0}) {
    MassSpring<double> tissue(mesh, {.mass = {.total = 0.05}, .link = {.stiffness = 80, .damping = 0.2}, .home = {.stiffness = 8, .damping = 0.1}});
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
    Touch<double> touch;
    PlaneHandover<double> handover({.ticks = 1});
    SurfaceProxy<double> proxy({.stiffness = 500});
    double const face = side > 0 ? 0.0 : -1e-4;
    std::uint64_t sequence = 0;
    for (int k = 0; k <= 20; ++k) {
      Vector3<double> const tip(0.0171, 0.0203, face + side * (0.0055 - 0.001 * k));
      auto const& contact = touch.update(body, tip);
      handover.take(contact.touching ? facet_planes(body, contact.triangle, tip) : PlaneSet<double>{}, 500, ++sequence, tip);
      Vector3<double> const force = proxy(handover(tip), tip);
      double const deep = std::max(0.0, 0.001 * k - 0.0055);
      REQUIRE((force - Vector3<double>(0, 0, side * 500 * deep)).norm() < 1e-9);
    }
  }
}

// Closed form: how far the felt tool, at the tip where nothing is felt, is behind both planes of the fold, or in front of the surface that they make. The
// yardstick is the tip's way in a step of the body.
TEST_CASE("a tip that slides over a ridge or into a valley meets the other side no later than after its way in a step of the body", "[haptics]") {
  struct Fold {
    double inside = 0, outside = 0;   // m
  };
  auto const slide = [](double slope, int vertices, int every, double speed) {
    MassSpring<double> tissue(folded(slope, vertices), {.mass = {.total = 0.05}, .link = {.stiffness = 80, .damping = 0.2}, .home = {.stiffness = 8, .damping = 0.1}});
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
    double const length = std::sqrt(1 + slope * slope), side = slope < 0 ? 1.0 : -1.0;
    Vector3<double> const normal(slope / length, 0, 1 / length), other(-slope / length, 0, 1 / length);
    Vector3<double> const down(1 / length, 0, -slope / length), on(1 / length, 0, slope / length);
    double const cut = 0.001 * std::abs(slope);   // along either side, where the two ways 1 mm deep cross
    Fold worst;
    for (int start = 0; start < 4; ++start) {
      Touch<double> touch;
      SurfaceSensor<double> sensor(SurfaceKind::facets);
      PlaneHandover<double> handover({.ticks = every});
      SurfaceProxy<double> proxy({.stiffness = 500});
      double way = -0.012 - 0.25e-3 * start * speed * every, height = 0.002;
      for (int k = 0; way < 0.006; ++k) {
        bool const slides = height <= -0.001;
        if (slides)
          way += 1e-3 * speed;
        else
          height -= 5e-5;
        // Over a ridge it goes on 1 mm below the other side; in a valley straight on, into the other side.
        Vector3<double> tip = (way - (side > 0 ? cut : 0.0)) * down + height * normal;
        if (side > 0 && way > 0) tip = (way + cut) * on + height * other;
        tip.y() = 3e-4;
        if (k % every == 0) {
          auto const& contact = touch.update(body, tip);
          auto const& surface = sensor.look(body, contact, contact.touching ? CuttingPhase::indenting : CuttingPhase::no_contact, tip, 0.0, 500.0);
          handover.take(surface.planes, 500, surface.sequence, tip);
        }
        Vector3<double> const felt = tip + proxy(handover(tip), tip) / 500;
        double const a = felt.dot(normal), b = felt.dot(other), above = side > 0 ? std::max(a, b) : std::min(a, b);
        if (slides) worst = {std::max(worst.inside, -above), std::max(worst.outside, above)};
      }
    }
    return worst;
  };
  for (int const vertices : {9, 41})
    for (int const every : {1, 33})
      for (double const speed : {0.05, 0.1}) {
        CAPTURE(vertices, every, speed);
        double const in_a_step = 1e-3 * every * speed;
        Fold const ridge = slide(-0.75, vertices, every, speed), valley = slide(0.75, vertices, every, speed);
        CHECK(ridge.inside <= (every == 1 ? 1e-9 : 0.3 * in_a_step));   // the touched facet, drawn out, lies in front of the other one: it is the hand-over
        CHECK(ridge.outside <= in_a_step);
        CHECK(valley.inside <= 0.01 * in_a_step);   // it is seen in time
        CHECK(valley.outside < 1e-9);
      }
}

TEST_CASE("planes of facets cost no allocation, and a triangle without area has none", "[haptics]") {
  auto const mesh = folded<double>(0.75);
  Skin<double> skin(mesh);
  Vector3<double> const tip(0, 0, -0.001);
  int const t = under(mesh, 0.001, 0.001);
  palpate_test::AllocationCount const allocations;
  auto const planes = facet_planes(skin, t, tip);
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(planes.count() == 2);
  skin.points.setZero();
  CHECK(facet_planes(skin, 0, tip).count() == 0);
  static_assert(noexcept(facet_planes(skin, 0, tip)));
}
