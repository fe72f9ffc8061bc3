// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/haptics/patch_handover.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/plane_set.hpp>
#include <palpate/haptics/surface_proxy.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

using namespace palpate;

namespace {

using Vector = Vector3<double>;
constexpr double stiffness = 500.0, depth = 0.002, rough = 0.5, smooth = 0.3;

PlaneSet<double> floor_at(double height = 0.0, Vector const& normal = Vector::UnitZ()) {
  PlaneSet<double> set;
  set.add({normal, height});
  return set;
}
SurfaceProxy<double> with_friction() { return SurfaceProxy<double>({.stiffness = stiffness, .static_friction = rough, .dynamic_friction = smooth}); }

}  // namespace

// Yardstick: by hand, F = K d n on a plane; nothing in front of it.
TEMPLATE_TEST_CASE("C2-P1: without friction the hand is pushed out along the normal", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  PlaneSet<S> planes;
  planes.add({Vector3<S>(S(0.6), S(0), S(0.8)), S(0)});
  SurfaceProxy<S> proxy({.stiffness = 500.0});
  Vector3<S> const n(S(0.6), S(0), S(0.8)), side(S(0.8), S(0), S(-0.6));
  CHECK(proxy(planes, S(0.01) * n).norm() == S(0));
  for (int k = 0; k < 50; ++k) {
    Vector3<S> const force = proxy(planes, S(0.001 * k) * side - S(0.003) * n);
    CHECK((force - S(1.5) * n).norm() < S(1e-4));
    CHECK(proxy.touches());
  }
  CHECK(proxy(planes, S(0.01) * n).norm() == S(0));
  CHECK_FALSE(proxy.touches());
}

// Yardsticks by hand: it sticks up to μ_s d of way and not a bit moves; then |F_t| = μ_d |F_n|.
TEST_CASE("C3-F1 C3-F2 C3-F3: friction holds up to the static cone and slides on the dynamic one") {
  auto proxy = with_friction();
  auto const planes = floor_at();
  double x = 0;
  auto const at = [&](double to) {
    x = to;
    Vector const force = proxy(planes, {x, 0, -depth});
    CHECK(force.z() == Approx(stiffness * depth));
    CHECK(std::hypot(force.x(), force.y()) <= rough * force.z() * (1 + 1e-12));
    return force.x();
  };
  at(0);
  Vector const stuck = proxy.position();
  while (x < rough * depth - 2e-6) {
    at(x + 1e-6);
    CHECK(proxy.position() == stuck);
  }
  CHECK_FALSE(proxy.slides());
  at(rough * depth + 1e-6);
  CHECK(proxy.slides());
  for (int k = 0; k < 1000; ++k) CHECK(at(x + 1e-5) == Approx(-smooth * stiffness * depth).epsilon(1e-12));
}

// Yardstick by hand: the lag goes from μ_d d on one side to μ_d d on the other, a dead band of 2 μ_d d, where one coefficient holds and where nothing sticks
// on the way. A proxy that sticks again on the way, μ_s > μ_d, slides beyond μ_s d on the other side: (μ_s + μ_d) d.
TEST_CASE("C3-F7: on reversal nothing slides for a dead band of 2 μ_d d") {
  constexpr double way = 1.3e-7;   // no whole number of them in the dead band: no tick lags by nothing at all
  struct Case {
    double sticks, slides, restick, band;
  };
  for (Case const c : {Case{0.3, 0.3, 0.6, 0.6}, Case{0.5, 0.5, 1.0, 1.0}, Case{0.5, 0.3, 1e-5, 0.6}, Case{0.5, 0.3, 0.6, 0.8}}) {
    CAPTURE(c.sticks, c.slides, c.restick);
    SurfaceProxy<double> proxy({.stiffness = stiffness, .static_friction = c.sticks, .dynamic_friction = c.slides, .restick = c.restick});
    auto const planes = floor_at();
    double x = 0;
    for (int k = 0; k <= 300; ++k) proxy(planes, {x = 1e-5 * k, 0, -depth});
    CHECK(proxy.slides());
    Vector const held = proxy.position();
    double const turned = x;
    while (proxy.position() == held && turned - x < 10 * depth) proxy(planes, {x -= way, 0, -depth});
    CHECK(turned - x == Approx(c.band * depth).epsilon(0).margin(2 * way));
    CHECK(proxy.slides());
    x -= 1e-5;
    CHECK(proxy(planes, {x, 0, -depth}).x() == Approx(c.slides * stiffness * depth).epsilon(1e-12));
  }
}

TEST_CASE("C3-F4: a proxy that sticks does not drift in a million ticks, with a hand that trembles within the cone") {
  auto proxy = with_friction();
  Vector const n = Vector(1, 2, 3).normalized(), across = n.cross(Vector::UnitX()).normalized(), along = n.cross(across);
  auto const planes = floor_at(0.01, n);
  Vector const point = 0.01 * n;
  proxy(planes, point - depth * n);
  Vector const held = proxy.position();
  bool drifted = false;
  for (int k = 0; k < 1000000; ++k) {
    double const angle = 0.01 * k;
    proxy(planes, point - depth * n + 0.9 * rough * depth * (std::cos(angle) * across + std::sin(1.3 * angle) * along) / std::sqrt(2.0));
    drifted = drifted || proxy.position() != held;
  }
  CHECK_FALSE(drifted);
}

// Yardstick: the work of the hand, −∫ F dx: over a slide of length s it is μ_d K d s and what the spring holds; over closed ways it is never negative
// beyond what sampling leaks, K |Δx|²/2 a tick.
TEST_CASE("C3-F6: friction dissipates what it should, and every closed way costs energy") {
  auto proxy = with_friction();
  auto const planes = floor_at();
  double work = 0, last = proxy(planes, {0, 0, -depth}).x();
  constexpr double way = 1e-5, length = 0.05;
  for (double x = way; x <= length; x += way) {
    double const force = proxy(planes, {x, 0, -depth}).x();
    work -= (last + force) / 2 * way;
    last = force;
  }
  CHECK(work == Approx(smooth * stiffness * depth * length).epsilon(0.01));

  Random random(Seed{5});
  for (int round = 0; round < 200; ++round) {
    auto other = with_friction();
    Vector tip(0, 0, -depth);
    Vector force = other(planes, tip);
    double energy = 0, leak = 0;
    auto const go = [&](Vector const& to) {
      int const ticks = 1 + static_cast<int>((to - tip).norm() / 2e-5);
      Vector const step = (to - tip) / ticks;
      for (int k = 0; k < ticks; ++k) {
        tip += step;
        Vector const now = other(planes, tip);
        energy -= (force + now).dot(step) / 2;
        leak += stiffness * step.squaredNorm() / 2;
        force = now;
      }
    };
    auto const lap = [&] {
      for (int corner = 0; corner < 5; ++corner)
        go(corner == 4 ? Vector(0, 0, -depth) : Vector(random.uniform(-0.004, 0.004), random.uniform(-0.004, 0.004), -random.uniform(0.0, 0.004)));
    };
    lap();
    energy = leak = 0;
    lap();
    double const stored = stiffness * std::pow(rough * 0.004, 2) / 2;   // the drawn spring, at most
    REQUIRE(energy >= -leak - stored);
  }
}

TEST_CASE("C3-F8: the cone is round") {
  Random random(Seed{6});
  for (int k = 0; k < 100; ++k) {
    auto proxy = with_friction();
    double const angle = random.uniform(0.0, 6.28);
    Vector const way(std::cos(angle), std::sin(angle), 0);
    Vector force;
    for (int t = 0; t <= 400; ++t) force = proxy(floor_at(), 1e-5 * t * way - Vector(0, 0, depth));
    CHECK(force.dot(way) == Approx(-smooth * stiffness * depth).epsilon(1e-9));
    CHECK(std::abs(force.cross(way).z()) < 1e-9);
  }
}

// Yardstick: (0, 0, K d) by hand, to the bit, whatever the tip did along the plane before.
TEST_CASE("C3-F5: friction of zero is no friction to the bit") {
  Random random(Seed{6});
  SurfaceProxy<double> proxy({.stiffness = stiffness, .static_friction = 0.0, .dynamic_friction = 0.0});
  for (int k = 0; k < 1000; ++k) {
    Vector const tip(0.001 * random.normal(), 0.001 * random.normal(), -depth * random.uniform(0.01, 1.0));
    CHECK(proxy(floor_at(), tip) == Vector(0, 0, stiffness * -tip.z()));
    CHECK(proxy.position() == Vector(tip.x(), tip.y(), 0));
    CHECK_FALSE(proxy.slides());
  }
}

TEST_CASE("C3-F9: with a position of steps of 55 µm it does not switch between stick and slip at every tick") {
  auto proxy = with_friction();
  Random random(Seed{7});
  int switches = 0, quick = 0, since = 100;
  bool slid = false;
  for (int k = 0; k < 20000; ++k) {
    double const x = 55e-6 * std::round((2e-6 * k + 20e-6 * random.normal()) / 55e-6);
    proxy(floor_at(), {x, 0, -depth});
    ++since;
    if (proxy.slides() != slid) {
      slid = !slid;
      ++switches;
      if (since < 2) ++quick;
      since = 0;
    }
  }
  CHECK(switches > 0);
  CHECK(quick == 0);
}

// Yardstick: the residual and the lag are each no faster than the tip: |ΔF| ≤ K (2 + μ_s) |Δp| while it sticks; where it begins to slide the fall from the
// static to the dynamic cone.
TEST_CASE("in a valley of two planes, over an edge and in a corner, friction has no step") {
  PlaneSet<double> valley = floor_at(0.0, Vector(0.6, 0, 0.8));
  valley.add({Vector(-0.6, 0, 0.8), 0.0});
  PlaneSet<double> corner = valley;
  corner.add({Vector(0, 1, 0), 0.0});
  Random random(Seed{9});
  for (auto const& planes : {valley, corner})
    for (int round = 0; round < 100; ++round) {
      SurfaceProxy<double> proxy({.stiffness = stiffness, .static_friction = 0.8, .dynamic_friction = 0.8});
      Vector tip(random.uniform(-0.02, 0.02), random.uniform(-0.01, 0.02), -0.01), last = proxy(planes, tip);
      Vector way = Vector(random.normal(), random.normal(), 0.3 * random.normal()).normalized();
      for (int k = 0; k < 20000; ++k) {
        if (k % 2000 == 0) way = Vector(random.normal(), random.normal(), 0.3 * random.normal()).normalized();
        tip += 2e-6 * way;
        Vector const now = proxy(planes, tip);
        if (!((now - last).norm() <= stiffness * (2 + 2 * 0.8) * 2e-6 + 1e-9) && proxy.touches())
          FAIL("a step of " << (now - last).norm() << " N in round " << round << ", tick " << k);
        last = now;
      }
    }
}

// Yardstick: a floor that moves by 10 mm under a tip that moves with it: the force is that of the floor at rest.
TEST_CASE("C2-P9: moving tissue carries the proxy") {
  auto moving = with_friction(), resting = with_friction();
  for (int k = 0; k <= 1000; ++k) {
    Vector const shift = Vector(1e-5, 2e-6, -3e-6) * k, tip(2e-7 * k, 0, -depth);
    if (k > 0) moving.carry({1e-5, 2e-6, -3e-6});
    Vector const force = moving(floor_at(shift.z()), tip + shift);
    CHECK((force - resting(floor_at(), tip)).norm() < 1e-9);
  }
  CHECK(moving.slides() == resting.slides());
}

// Yardsticks: a tool that is a point loses the whole force where it leaves the edge, K d and no more, straight along the face's normal until then;
// one that is a ball loses it as r − √(x² + (r − d)²) does, and never faster than the tip moves.
TEST_CASE("C2-P8: over the outer edge of a box the force is let go, not turned", "[haptics]") {
  constexpr double way = 1e-4, radius = 0.004;
  for (int const ticks : {1, 20}) {
    SurfaceProxy<double> proxy({.stiffness = stiffness});
    PlaneHandover<double> handover({.ticks = ticks});
    double last = stiffness * depth, fall = 0;
    std::uint64_t sequence = 0;
    handover.take(floor_at(), stiffness, ++sequence, {-0.02, 0, 0.001});
    for (int k = 0; k <= 200; ++k) {
      Vector const tip(-0.01 + way * k, 0, -depth);   // the box is x < 0, z < 0
      handover.take(tip.x() < 0 ? floor_at() : PlaneSet<double>{}, stiffness, ++sequence, tip);
      Vector const force = proxy(handover(tip), tip, handover.stiffness());
      CHECK(std::hypot(force.x(), force.y()) < 1e-12);   // never aside, as a mean of two faces' normals would be
      CHECK(force.z() >= 0);                             // never inward
      fall = std::max(fall, last - force.z());
      last = force.z();
    }
    CHECK(last == Approx(0.0).margin(1e-12));
    CHECK(fall == Approx(stiffness * depth / ticks));
  }
  PatchHandover<double> handover({.ticks = 1});
  Vector last(0, 0, stiffness * depth);
  std::uint64_t sequence = 0;
  int between = 0;
  for (int k = 0; k <= 200; ++k) {
    Vector const centre(-0.01 + way * k, 0, radius - depth);
    Vector const nearest(std::min(0.0, centre.x()), 0, 0), normal = (centre - nearest).normalized();
    // an edge is a ball of no size
    SurfacePatch<double> const box{.point = nearest, .normal = normal, .curvature = centre.x() < 0 ? 0.0 : 1e9, .stiffness = stiffness};
    handover.take(box.offset_by(radius), ++sequence, centre);
    Vector const force = handover(centre).force(centre);
    double const deep = std::max(0.0, radius - (centre - nearest).norm());
    CHECK((force - stiffness * deep * normal).norm() < 1e-6);
    CHECK((force - last).norm() <= stiffness * way * (1 + 1e-6));
    if (force.z() > 0 && force.x() > 0) ++between;
    last = force;
  }
  CHECK(last.isZero(0));
  CHECK(between == Approx(std::sqrt(radius * radius - (radius - depth) * (radius - depth)) / way).margin(1.5));
}

// Yardstick: the same way of the same tip in another frame.
TEST_CASE("C3-F8: friction is the same in every direction and in every frame", "[haptics]") {
  Random random(Seed{10});
  for (int frame = 0; frame < 100; ++frame) {
    Eigen::Quaterniond const turn = Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
    Vector const shift(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)), n = (turn * Vector::UnitZ()).normalized();
    auto here = with_friction(), there = with_friction();
    auto const planes = floor_at(n.dot(shift), n);
    double worst = 0;
    for (int k = 0; k < 500; ++k) {
      Vector const tip(0.0031 * std::sin(0.013 * k), 0.0023 * std::sin(0.029 * k + 1), -0.001 * (1 + 0.7 * std::sin(0.007 * k)));
      worst = std::max(worst, (turn * here(floor_at(), tip) - there(planes, turn * tip + shift)).norm());
    }
    CHECK(worst < 1e-10);
    CHECK(here.slides() == there.slides());
  }
}

TEST_CASE("malformed proxies are refused, what is no number pulls at nobody, and a tick allocates nothing") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  using Proxy = SurfaceProxy<double>;
  CHECK_THROWS_WITH(Proxy({.stiffness = 0.0}), says(".stiffness is 0 N/m", "above zero"));
  CHECK_THROWS_WITH(Proxy({.static_friction = 0.1, .dynamic_friction = 0.2}), says(".static_friction is 0.1", "not below .dynamic_friction"));
  CHECK_THROWS_AS(Proxy({.restick = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(Proxy({.dynamic_friction = nan}), InvalidArgument);
  auto proxy = with_friction();
  auto const planes = floor_at();
  proxy(planes, {0, 0, -depth});
  Vector const held = proxy.position();
  CHECK(proxy(planes, {nan, 0, 0}).norm() == 0.0);
  proxy.carry({nan, 0, 0});
  CHECK(proxy.position() == held);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) proxy(planes, {1e-4 * k, 0, -depth});
  long const counted = allocations.count();
  CHECK(counted == 0);
}
