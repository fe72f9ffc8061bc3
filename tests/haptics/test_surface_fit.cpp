// SPDX-License-Identifier: MIT
// Yardsticks: the ball, the plane and the ellipsoid that the vertices lie on; the velocity of a rigid body; a fit made anew.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "haptics/sheet.hpp"
#include "haptics/skin.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/haptics/surface_fit.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;
using palpate_test::Sheet;
using palpate_test::Skin;

namespace {

/// The same surface with the tissue outside.
template <RealScalar S>
TriangleMesh<S> inside_out(TriangleMesh<S> mesh) {
  mesh.triangles.row(1).swap(mesh.triangles.row(2));
  return mesh;
}

template <RealScalar S>
Vector3<S> any_share(Random& random) {
  Vector3<S> w(random.uniform(S(0), S(1)), random.uniform(S(0), S(1)), random.uniform(S(0), S(1)));
  return w / w.sum();
}

}  // namespace

TEMPLATE_TEST_CASE("a ball and a hollow are found from the vertices around a triangle, a plane is a plane", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const eps = std::numeric_limits<S>::epsilon();
  S const radius = S(0.02);
  Random random(Seed{1});
  for (int const rings : {1, 2}) {
    SurfaceFit<S> fit({.rings = rings});
    for (bool const hollow : {false, true}) {
      auto const mesh = hollow ? inside_out(make_sphere<S>(radius, 8)) : make_sphere<S>(radius, 8);
      Skin<S> const skin(mesh);
      S const sign = hollow ? S(-1) : S(1);
      for (int t = 0; t < mesh.triangles.cols(); t += 7) {
        auto const& patch = fit.fit(skin, t, any_share<S>(random));
        REQUIRE(patch.valid());
        REQUIRE(double(patch.curvature) == Approx(double(sign / radius)).epsilon(1e-9 + 1e4 * eps));
        REQUIRE(double(fit.residual()) < 1e-12 + 8 * eps * double(radius));
        Vector3<S> const p = S(0.9) * patch.point;
        REQUIRE(double(patch.distance(p)) == Approx(double(sign * (p.norm() - radius))).margin(1e-11 + 64 * eps * double(radius)));
        REQUIRE(patch.stiffness == S(500));
        REQUIRE(patch.covers(patch.point));
      }
    }
    Skin<S> const flat(make_grid<S>(9, 9, S(0.005)));
    for (int t = 0; t < 128; t += 5) {
      auto const& patch = fit.fit(flat, t, any_share<S>(random));
      REQUIRE(patch.normal.z() == Approx(1.0));
      REQUIRE(std::abs(patch.curvature) < S(1e-3));
      REQUIRE(std::abs(patch.point.z()) < S(1e-7));
    }
  }
}

// Yardstick: the mean of the two curvatures of z = −(κ₁ x² + κ₂ y²)/2.
TEST_CASE("on a surface that is curved unevenly it is the mean curvature", "[haptics]") {
  auto mesh = make_grid<double>(15, 15, 0.001);
  mesh.points.row(0) -= mesh.points.row(1) / 2, mesh.points.row(1) *= std::sqrt(0.75);   // of even triangles
  int const top = 2 * (14 * 7 + 7);
  Vector3<double> origin = Vector3<double>::Zero();
  for (int k = 0; k < 3; ++k) origin += mesh.points.col(mesh.triangles(k, top)) / 3;
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
    double const x = mesh.points(0, i) - origin.x(), y = mesh.points(1, i) - origin.y();
    mesh.points.col(i) = Vector3<double>(x, y, -(20 * x * x - 5 * y * y) / 2);   // a saddle
  }
  Skin<double> const skin(mesh);
  Vector3<double> const w = Vector3<double>::Constant(1.0 / 3);
  SurfaceFit<double> ball({.rings = 2}), plane({.rings = 2, .curved = false});
  CHECK(ball.fit(skin, top, w).curvature == Approx((20 - 5) / 2.0).epsilon(0.03));
  CHECK(plane.fit(skin, top, w).curvature == 0.0);
  CHECK(plane.patch().normal.z() == Approx(1.0).epsilon(1e-4));
}

TEST_CASE("the patch goes with the tissue: its velocity and its turn are those of a rigid body", "[haptics]") {
  Random random(Seed{2});
  auto const mesh = make_sphere<double>(0.03, 6);
  Skin<double> skin(mesh);
  SurfaceFit<double> fit;
  for (int round = 0; round < 50; ++round) {
    Vector3<double> const linear(random.normal(), random.normal(), random.normal()), angular(random.normal(), random.normal(), random.normal());
    for (Eigen::Index i = 0; i < skin.points.cols(); ++i) skin.rates.col(i) = linear + angular.cross(Vector3<double>(skin.points.col(i)));
    int const t = static_cast<int>(random.below(static_cast<std::uint32_t>(mesh.triangles.cols())));
    Vector3<double> const w = any_share<double>(random);
    auto const c = skin.tissue().surface().corners(t);
    Vector3<double> const touched = w[0] * skin.points.col(c[0]) + w[1] * skin.points.col(c[1]) + w[2] * skin.points.col(c[2]);
    auto const& patch = fit.fit(skin, t, w);
    CHECK((patch.velocity - (linear + angular.cross(touched))).norm() < 1e-12);
    Vector3<double> const turn = angular - angular.dot(patch.normal) * patch.normal;   // a spin about the normal does not show
    CHECK((patch.angular_velocity - turn).norm() < 0.05 * angular.norm());
  }
}

// Yardstick: a fit made anew at each time.
TEST_CASE("between two fits the patch follows a body that is pressed", "[haptics]") {
  SoftBody body(Sheet{}.tissue(), LeapfrogVerlet{}, WholeBody{});
  int const pressed = 40, t = body.tissue().surface().triangles_at(pressed).front();
  Vector3<double> const w(0.3, 0.3, 0.4);
  SurfaceFit<double> follows({.rings = 2}), anew({.rings = 2});
  follows.fit(body, t, w);
  double worst = 0, deepest = 0;
  for (int k = 0; k < 400; ++k) {
    body.apply_force(pressed, {0, 0, -0.05});
    body.step(1e-3);
    if (k % 10 != 9) continue;
    auto const& kept = follows.follow(body);
    auto const& fresh = anew.fit(body, t, w);
    REQUIRE(kept.valid());
    worst = std::max(worst, std::abs(kept.distance(fresh.point)));
    deepest = std::max(deepest, -fresh.point.z());
  }
  INFO("followed to " << worst << " m of " << deepest << " m");
  CHECK(deepest > 5e-4);
  CHECK(worst < 0.05 * deepest);
  CHECK(follows.patch().curvature < 0);   // a dent is a hollow
}

TEST_CASE("a fit costs what the vertices near cost, allocates nothing, and malformed ones are refused", "[haptics]") {
  using Fit = SurfaceFit<double>;
  CHECK_THROWS_WITH(Fit({.rings = 5}), says(".rings is 5", "0 to 4"));
  CHECK_THROWS_WITH(Fit({.stiffness = 0}), says(".stiffness is 0 N/m", "above zero"));
  CHECK_THROWS_AS(Fit({.damping = std::numeric_limits<double>::quiet_NaN()}), InvalidArgument);
  Skin<double> const small(make_grid<double>(11, 11, 0.005)), large(make_grid<double>(61, 61, 0.005));
  Fit a({.rings = 2}), b({.rings = 2}), many({.rings = 4}), three({.rings = 0});
  Vector3<double> const w(0.2, 0.3, 0.5);
  int const in_small = small.tissue().surface().triangles_at(60).front(), in_large = large.tissue().surface().triangles_at(61 * 30 + 30).front();
  a.fit(small, in_small, w);
  palpate_test::AllocationCount const allocations;
  b.fit(large, in_large, w);
  b.follow(large);
  many.fit(large, in_large, w);
  three.fit(large, in_large, w);
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(a.vertices() == b.vertices());
  CHECK(many.vertices() == Fit::capacity);
  CHECK(three.vertices() == 3);
  CHECK(three.patch().valid());
  auto crushed = make_grid<double>(3, 3, 0.005);
  Skin<double> point(crushed);
  point.points.setZero();   // all in one place
  CHECK(a.fit(point, 0, w).valid());
  CHECK(a.follow(point).valid());
  static_assert(noexcept(a.fit(point, 0, w)) && noexcept(a.follow(point)));
}
