// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/organ_force.hpp>

#include "catch.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <vector>

using namespace palpate;

static_assert(ForceModel<OrganForce<float>, float> && ForceModel<OrganFriction<float>, float>);
static_assert(!ForceModel<OrganForce<float>, double>);

namespace {

template <RealScalar S>
ToolContact<S> cut_at(S depth, Vector3<S> const& velocity) {
  return {.phase = CuttingPhase::moving, .depth = depth, .previous_depth = depth, .velocity = velocity};
}

}  // namespace

// Yardstick: the formula by hand, F = −2 · 0.012 · 0.02 = −0.00048 N along x.
TEMPLATE_TEST_CASE("the organ force is a damper across the wall that grows with depth", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  OrganForce<S> const organ{.coefficient = S(2), .wall_normal = {S(1), S(0), S(0)}};
  auto const f = organ(cut_at<S>(S(0.012), {S(0.02), S(0.5), S(-0.01)}));
  CHECK(double(f.x()) == Approx(-0.00048).epsilon(1e-6));
  CHECK(f.y() == S(0));
  CHECK(f.z() == S(0));

  // The thesis's numbers: 18000 N/cm² at 1 ms is 1.8e5 N·s/m²: 3.24 N at 18 mm and 1 mm/s.
  OrganForce<S> const thesis{.coefficient = S(1.8e5)};
  CHECK(double(thesis(cut_at<S>(S(0.018), {S(0.001), S(0), S(0)})).x()) == Approx(-3.24).epsilon(1e-5));
  // The same with its damper of 3240 N·s/m limited to 11.
  OrganForce<S> const safe{.coefficient = S(1.8e5), .max_damping = S(11)};
  CHECK(double(safe(cut_at<S>(S(0.018), {S(0.001), S(0), S(0)})).x()) == Approx(-0.011).epsilon(1e-5));
}

TEMPLATE_TEST_CASE("organ forces never give energy and do not depend on the wall normal's length or sign", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{1});
  for (int i = 0; i < 1000; ++i) {
    Vector3<S> n, v;
    for (int k = 0; k < 3; ++k) n[k] = random.normal<S>();
    for (int k = 0; k < 3; ++k) v[k] = random.normal<S>();
    auto const contact = cut_at<S>(random.uniform(S(-0.01), S(0.02)), v);
    auto const check = [&](auto const& model, auto longer) {
      Vector3<S> const f = model(contact);
      longer.wall_normal = S(-7) * n;
      REQUIRE(f.dot(v) <= S(0));
      // Up to rounding of v·n_v, relative to the largest force there could be at this depth and speed.
      REQUIRE((longer(contact) - f).norm() <= S(1e-5) * std::abs(contact.depth) * S(400) * v.norm());
      REQUIRE(f.cross(n).norm() <= S(1e-5) * f.norm() * n.norm());
    };
    OrganForce<S> const damper{.coefficient = S(3), .wall_normal = n};
    check(damper, damper);
    OrganFriction<S> const friction{.wall_normal = n};
    check(friction, friction);
    REQUIRE(friction(contact).norm() < S(180) * std::abs(contact.depth));
  }
}

// Yardstick: the formula by hand; s(x) = x/√(1+x²) at x = 3/4 is 3/5, far above it is 1.
TEST_CASE("organ friction saturates with speed") {
  OrganFriction<double> const friction{.stiffness = 180.0, .speed = 0.02, .wall_normal = {0.0, 2.0, 0.0}};
  CHECK(friction(cut_at<double>(0.01, {0.3, 0.015, 0.0})).y() == Approx(-180.0 * 0.01 * 0.6));
  CHECK(friction(cut_at<double>(0.01, {0.0, -2.0, 0.0})).y() == Approx(1.8).epsilon(1e-4));
  CHECK(friction(cut_at<double>(0.01, {0.0, -1e300, 0.0})).y() == Approx(1.8));
  CHECK(friction(cut_at<double>(0.0, {0.0, 1.0, 0.0})).norm() == 0.0);
}

TEST_CASE("there is no organ force before the puncture") {
  OrganForce<double> const damper{.coefficient = 100.0};
  OrganFriction<double> const friction{};
  for (auto phase : {CuttingPhase::no_contact, CuttingPhase::indenting}) {
    auto contact = cut_at<double>(0.01, {1.0, 1.0, 1.0});
    contact.phase = phase;
    CHECK(damper(contact).norm() == 0.0);
    CHECK(friction(contact).norm() == 0.0);
  }
}

TEST_CASE("malformed organ forces are refused with a reason") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  using Force = OrganForce<double>;
  CHECK_NOTHROW(Force{}.validate());
  CHECK_THROWS_WITH((Force{.wall_normal = {0.0, 0.0, 0.0}}.validate()),
                    "OrganForce: .wall_normal is (0, 0, 0); give a finite direction other than zero");
  CHECK_THROWS_WITH((Force{.coefficient = -1.0}.validate()),
                    "OrganForce: .coefficient is -1 N·s/m²; give a finite number, zero or more (a negative one would push the hand on)");
  CHECK_THROWS_AS((Force{.coefficient = nan}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.wall_normal = {nan, 0.0, 0.0}}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.wall_normal = {1e-200, 0.0, 0.0}}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.max_damping = 0.0}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.max_damping = nan}.validate()), InvalidArgument);
  using Friction = OrganFriction<double>;
  CHECK_NOTHROW(Friction{}.validate());
  CHECK_THROWS_WITH((Friction{.speed = 0.0}.validate()), "OrganFriction: .speed is 0 m/s; give a finite number above zero");
  CHECK_THROWS_AS((Friction{.stiffness = nan}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Friction{.wall_normal = {0.0, 0.0, 0.0}}.validate()), InvalidArgument);
  // Used without validation they are still silent, not NaN.
  CHECK((Force{.coefficient = 1.0, .wall_normal = {0.0, 0.0, 0.0}})(cut_at<double>(0.01, {1, 1, 1})).norm() == 0.0);
  CHECK((Friction{.wall_normal = {0.0, 0.0, 0.0}})(cut_at<double>(0.01, {1, 1, 1})).norm() == 0.0);
}
