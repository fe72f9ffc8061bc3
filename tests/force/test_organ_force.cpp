// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/organ_force.hpp>

#include "catch.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
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
  S const unlimited = std::numeric_limits<S>::infinity();
  OrganForce<S> const thesis{.coefficient = S(1.8e5), .max_damping = unlimited};
  CHECK(double(thesis(cut_at<S>(S(0.018), {S(0.001), S(0), S(0)})).x()) == Approx(-3.24).epsilon(1e-5));
  // The same with its damper of 3240 N·s/m limited to 11.
  OrganForce<S> const safe{.coefficient = S(1.8e5)};
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
  CHECK_THROWS_WITH((Force{.wall_normal = {0.0, 0.0, 0.0}}.validate()), says(".wall_normal is (0, 0, 0)", "other than zero"));
  CHECK_THROWS_WITH((Force{.coefficient = -1.0}.validate()), says(".coefficient is -1 N·s/m²", "zero or more"));
  CHECK_THROWS_AS((Force{.coefficient = nan}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.wall_normal = {nan, 0.0, 0.0}}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.wall_normal = {1e-200, 0.0, 0.0}}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.wall_normal = {1e200, 0.0, 0.0}}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.max_damping = 0.0}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Force{.max_damping = nan}.validate()), InvalidArgument);
  using Friction = OrganFriction<double>;
  CHECK_NOTHROW(Friction{}.validate());
  CHECK_THROWS_WITH((Friction{.speed = 0.0}.validate()), says(".speed is 0 m/s", "above zero"));
  CHECK_THROWS_AS((Friction{.stiffness = nan}.validate()), InvalidArgument);
  CHECK_THROWS_AS((Friction{.wall_normal = {0.0, 0.0, 0.0}}.validate()), InvalidArgument);
  // Used without validation they are still silent, not NaN.
  CHECK((Force{.coefficient = 1.0, .wall_normal = {0.0, 0.0, 0.0}})(cut_at<double>(0.01, {1, 1, 1})).norm() == 0.0);
  CHECK((Friction{.wall_normal = {0.0, 0.0, 0.0}})(cut_at<double>(0.01, {1, 1, 1})).norm() == 0.0);
}

// Yardstick: the sum of the single walls, each by the formula of OrganForce; and for the limit two walls at right angles and one between them,
// whose D = 100 (x xᵀ + y yᵀ) + 100 (x + y)(x + y)ᵀ/2 has the eigenvalues 200 and 100.
TEMPLATE_TEST_CASE("several walls add up, and are limited together", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  using V = Vector3<S>;
  std::vector<OrganWall<S>> const walls{{S(100), V(1, 0, 0)}, {S(100), V(0, -2, 0)}, {S(100), V(3, 3, 0)}};
  Random random(Seed{4});
  OrganWalls<S> const free(walls, std::numeric_limits<S>::infinity()), limited(walls, S(3));
  for (int k = 0; k < 200; ++k) {
    V const v(random.normal<S>(), random.normal<S>(), random.normal<S>());
    auto const contact = cut_at<S>(random.uniform(S(-0.01), S(0.03)), v);
    V sum = V::Zero();
    for (auto const& wall : walls) sum += OrganForce<S>{.coefficient = wall.coefficient, .wall_normal = wall.wall_normal}(contact);
    REQUIRE((free(contact) - sum).norm() <= S(1e-5) * (sum.norm() + v.norm() * S(0.01)));
    V const less = limited(contact);
    REQUIRE(less.dot(v) <= S(0));
    REQUIRE(less.norm() <= S(3.00001) * v.norm());
    S const share = std::min(S(1), S(3) / (S(200) * std::abs(contact.depth)));
    REQUIRE((less - share * sum).norm() <= S(1e-5) * (sum.norm() + v.norm() * S(0.01)));
  }
  CHECK(double(free.largest_damping(S(0.01))) == Approx(2.0).epsilon(1e-5));
  CHECK(double(limited.largest_damping(S(0.02))) == Approx(3.0).epsilon(1e-5));
  CHECK(double(limited(cut_at<S>(S(0.02), V(1, 1, 0).normalized())).norm()) == Approx(3.0).epsilon(1e-5));
  auto before = cut_at<S>(S(0.02), V(1, 1, 1));
  before.phase = CuttingPhase::indenting;
  CHECK(free(before).norm() == S(0));
  CHECK(OrganWalls<S>({})(cut_at<S>(S(0.02), V(1, 1, 1))).norm() == S(0));
  CHECK_THROWS_WITH(OrganWalls<S>({{S(1), V(0, 0, 0)}}), says(".wall_normal is (0, 0, 0)", "other than zero"));
  CHECK_THROWS_AS(OrganWalls<S>({{S(-1), V(1, 0, 0)}}), InvalidArgument);
  CHECK_THROWS_AS(OrganWalls<S>({{S(1), V(1, 0, 0)}}, S(0)), InvalidArgument);
  S const large = std::numeric_limits<S>::max();
  CHECK_THROWS_AS(OrganWalls<S>({{large, V(1, 0, 0)}, {large, V(1, 0, 0)}}), InvalidArgument);
}

// Yardstick: a free mass of 75 g in a 1 kHz loop by its own equations: zero-order hold, x⁺ = x + T v + T²/2 F/m, the speed measured as the
// difference of the last two positions. Stable: the kinetic energy never exceeds what it began with. Unstable where it should be: the thesis's
// coefficient without a limit.
TEST_CASE("a 75 g device in a 1 kHz loop stays stable in the organ at every depth and speed") {
  constexpr double mass = 0.075, period = 1e-3;
  auto const largest_speed = [=](auto const& organ, double depth, Vector3<double> v) {
    Vector3<double> x = Vector3<double>::Zero(), before = x - period * v;
    double largest = 0;
    for (int tick = 0; tick < 3000; ++tick) {
      Vector3<double> const force = organ(cut_at<double>(depth, (x - before) / period));
      before = x;
      x += period * v + period * period / 2 / mass * force;
      v += period / mass * force;
      largest = std::max(largest, v.norm());
    }
    return std::pair(largest, v.norm());
  };
  double const limit = mass / (4 * period);   // 18.75 N·s/m
  OrganFriction<double> const friction{};     // the liver's
  OrganForce<double> const damper{.coefficient = 1.8e5, .max_damping = limit};
  OrganWalls<double> const walls({{1.8e5, {1, 0, 0}}, {9e4, {0, 1, 0}}, {1.8e5, {1, 1, 1}}}, limit);
  for (double const depth : {1e-4, 1e-3, 0.003, 0.01, 0.018, 0.03})
    for (double const speed : {1e-4, 1e-3, 0.02, 0.2, 1.0, 3.0}) {
      CAPTURE(depth, speed);
      Vector3<double> const v = speed * Vector3<double>(0.9, -0.3, std::sqrt(0.1));
      auto const check = [&](auto const& organ, double const across) {
        auto const [largest, last] = largest_speed(organ, depth, v);
        CHECK(largest <= speed * 1.0000001);
        CHECK(last <= speed * across);
      };
      check(friction, 1.0);
      check(damper, 1.0);
      check(walls, 1.0);
    }
  CHECK(largest_speed(damper, 0.018, Vector3<double>(0.1, 0, 0)).second < 1e-12);
  CHECK(largest_speed(OrganForce<double>{.coefficient = 1.8e5, .max_damping = std::numeric_limits<double>::infinity()}, 0.018, Vector3<double>(0.1, 0, 0)).first > 1e6);
}
