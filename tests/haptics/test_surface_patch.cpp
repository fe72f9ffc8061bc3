// SPDX-License-Identifier: MIT
// Yardsticks: the distance from a ball's centre in long double, written down once more, and a plane's equation.
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <cmath>
#include <limits>

using namespace palpate;

namespace {

template <RealScalar S>
Vector3<S> any_way(Random& random) {
  Vector3<S> v;
  do v = {random.normal<S>(), random.normal<S>(), random.normal<S>()};
  while (!(v.norm() > S(0.1)));
  return v.normalized();
}

using Long = Eigen::Matrix<long double, 3, 1>;

}  // namespace

TEMPLATE_TEST_CASE("a patch is a plane, a ball or a hollow, and a ball of a kilometre is a plane", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const eps = std::numeric_limits<S>::epsilon();
  Random random(Seed{1});
  for (int round = 0; round < 1000; ++round) {
    SurfacePatch<S> patch{.point = S(0.05) * any_way<S>(random), .normal = any_way<S>(random), .stiffness = 500};
    Long const n = patch.normal.template cast<long double>().normalized();
    for (S const curvature : {S(50), S(-50), S(1), S(-1), S(1e-3), S(1e-7), S(-1e-12), S(0)}) {
      patch.curvature = curvature;
      Vector3<S> const p = patch.point + S(0.008) * any_way<S>(random);
      Long const q = p.template cast<long double>() - patch.point.template cast<long double>();
      long double const k = curvature;
      Long const from_centre = q + (k == 0 ? Long(Long::Zero()) : Long(n / k));
      // Below 1e-3 the radius swallows long double too: the parabola is exact to κ² |q|³ there.
      long double const expected = std::abs(k) < 1e-3L ? q.dot(n) + k / 2 * (q.squaredNorm() - q.dot(n) * q.dot(n))
                                                       : (k > 0 ? 1 : -1) * (from_centre.norm() - 1 / std::abs(k));
      REQUIRE(double(patch.distance(p)) == Approx(double(expected)).margin(8 * eps * 0.05).epsilon(1e-12));
      Long const outward = std::abs(k) < 1e-3L ? Long((n + k * q).normalized()) : Long((k > 0 ? 1 : -1) * from_centre.normalized());
      REQUIRE((patch.normal_at(p).template cast<long double>() - outward).norm() <= 16 * eps);
    }
  }
}

TEMPLATE_TEST_CASE("anchored elsewhere a patch is the same surface", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const close = 16 * std::numeric_limits<S>::epsilon();
  Random random(Seed{2});
  for (int round = 0; round < 1000; ++round) {
    SurfacePatch<S> const patch{.point = S(0.05) * any_way<S>(random), .normal = any_way<S>(random),
                                .curvature = random.uniform(S(-50), S(50)), .stiffness = 500,
                                .velocity = any_way<S>(random), .angular_velocity = any_way<S>(random), .reach = S(0.02)};
    Vector3<S> const p = patch.point + S(0.01) * any_way<S>(random), other = patch.point + S(0.01) * any_way<S>(random);
    auto const there = patch.anchored_at(p);
    REQUIRE(there.valid());
    REQUIRE(double(std::abs(patch.distance(there.point))) <= close * 0.1);
    REQUIRE(double((p - there.point).norm()) == Approx(double(std::abs(patch.distance(p)))).margin(close * 0.1));   // the nearest point
    REQUIRE(double(there.distance(other)) == Approx(double(patch.distance(other))).margin(close * 0.1));
    REQUIRE(double((there.normal_at(other) - patch.normal_at(other)).norm()) <= 4 * close);
    REQUIRE(double((there.velocity_at(other) - patch.velocity_at(other)).norm()) <= close * 8);
    REQUIRE(double(there.reach + (there.point - patch.point).norm()) == Approx(0.02).epsilon(1e-5));
    // A ball of radius r touches where its centre is r above the surface.
    S const r = S(0.004);
    REQUIRE(double(patch.offset_by(r).distance(p)) == Approx(double(patch.distance(p) - r)).margin(close * 0.1));
  }
}

TEST_CASE("a tool that is a ball meets an edge or a corner as a ball of its own radius") {
  SurfacePatch<double> const corner{.normal = Vector3<double>(1, 1, 1).normalized(), .curvature = 1e12, .stiffness = 500};   // a point of tissue
  auto const out = corner.offset_by(0.004);
  CHECK(out.curvature == Approx(250.0));
  Random random(Seed{3});
  for (int k = 0; k < 100; ++k) {
    Vector3<double> const p = 0.003 * any_way<double>(random);
    CHECK(out.distance(p) == Approx(p.norm() - 0.004).margin(1e-9));
    CHECK(out.force(p).norm() == Approx(0.5).epsilon(1e-6));
  }
}

TEST_CASE("a tool that does not fit into a hollow meets a plane, and no hollow is turned inside out") {
  double last = -250.0;
  for (double width = 0.016; width > 0.0035; width -= 1e-5) {   // a ball of 4 mm
    SurfacePatch<double> const hollow{.curvature = -1 / width, .stiffness = 500};
    auto const out = hollow.offset_by(0.004);
    REQUIRE(out.valid());
    REQUIRE(out.curvature <= 0.0);
    REQUIRE(out.point.z() == Approx(0.004));
    if (width >= 0.008)
      REQUIRE(out.curvature == Approx(-1 / (width - 0.004)));
    else
      REQUIRE(out.curvature >= last);   // ever flatter
    last = out.curvature;
    if (width <= 0.004) REQUIRE(out.curvature == 0.0);
  }
}

TEST_CASE("a patch that goes on turns about its point, and its velocity is that of a rigid piece") {
  SurfacePatch<double> const patch{.point = {0.1, 0, 0}, .normal = Vector3<double>::UnitZ(), .velocity = {0, 0.01, 0}, .angular_velocity = {0, 2, 0}};
  CHECK(patch.moves());
  CHECK_FALSE(SurfacePatch<double>{}.moves());
  auto const later = patch.moved(0.25);
  CHECK((later.point - Vector3<double>(0.1, 0.0025, 0)).norm() < 1e-15);
  CHECK((later.normal - Vector3<double>(std::sin(0.5), 0, std::cos(0.5))).norm() < 1e-15);
  CHECK((patch.velocity_at({0.1, 0, 0.02}) - Vector3<double>(0.04, 0.01, 0)).norm() < 1e-15);
  CHECK(patch.moved(0.0) == patch);
}

TEST_CASE("a patch pushes out of the tissue only, and a tip that is no number feels nothing") {
  SurfacePatch<double> patch{.point = {0, 0, 0.01}, .stiffness = 400, .reach = 0.01};
  CHECK((patch.force({0.3, 0, 0.0075}) - Vector3<double>(0, 0, 1)).norm() < 1e-12);
  CHECK(patch.force({0.3, 0, 0.0101}).isZero(0));
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(patch.force({nan, 0, 0}).isZero(0));
  CHECK(patch.covers({0.009, 0, 0.01}));
  CHECK_FALSE(patch.covers({0.011, 0, 0.01}));
  patch.curvature = 100;
  CHECK((patch.force({0, 0, 0}) - Vector3<double>(0, 0, 4)).norm() < 1e-12);   // its centre
  CHECK(patch.valid());
  for (auto const& broken : {SurfacePatch<double>{.point = {nan, 0, 0}}, SurfacePatch<double>{.normal = {0, 0, 2}},
                             SurfacePatch<double>{.curvature = nan}, SurfacePatch<double>{.stiffness = -1},
                             SurfacePatch<double>{.velocity = {0, nan, 0}}, SurfacePatch<double>{.reach = nan}})
    CHECK_FALSE(broken.valid());
}
