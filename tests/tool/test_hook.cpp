// SPDX-License-Identifier: MIT
// Yardsticks: how far the skin at the point stays behind a hook that is drawn 10 mm along it (less than 1 mm point down), and Coulomb's cone where it slides.
#include "catch.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/cutting/aspirator.hpp>
#include <palpate/mesh/box.hpp>
#include <palpate/tissue/cubes/cubes.hpp>
#include <palpate/tool/hook.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// The point turned by so many degrees about y: 0 looks down, 90 lies on the skin and looks against the way.
template <class S>
ToolPose<S> pose(Vector3<S> const& at, double degrees) {
  return {.position = at, .orientation = Eigen::Quaternion<S>(Eigen::AngleAxis<S>(S(degrees * std::numbers::pi / 180), Vector3<S>::UnitY()))};
}

/// What was seen of a hook that is pressed 3 mm in, in 0.15 s, drawn 10 mm along x in 0.5 s, and held.
struct Drawn {
  bool hooked = false, stayed = true;
  double slip = 0;      // m, the most that the tissue first touched was behind the tip, along x
  double cone = 0;      // the largest force along the rods' surface over that across it
  double side = 0;      // N, the force along x at the end
  double carried = 0;   // m, of the tissue first touched, along x
};

template <class S, class Body>
Drawn draw(Body body, Vector3<S> const& start, double degrees) {
  Hook<S> hook({.shape = {.radius = 0.001, .point = 0.01, .shaft = 0.03}, .friction = S(0.3)});
  Drawn seen;
  S const h = S(5e-4);
  int triangle = -1;
  Vector3<S> weights = Vector3<S>::Zero(), first = Vector3<S>::Zero();
  double on_tool = 0;
  for (int k = 0; k < 1500; ++k) {
    S const t = S(k) * h, down = std::min(S(1), t / S(0.15)), along = std::clamp((t - S(0.15)) / S(0.5), S(0), S(1));
    auto const at = pose<S>(start + Vector3<S>(S(0.01) * along, 0, S(0.002) - S(0.005) * down), degrees);
    hook.advance(body, at);
    Vector3<S> const force = hook.press(body, S(1), h);
    REQUIRE(force.allFinite());
    if (triangle < 0 && along > 0) {
      REQUIRE(hook.contact().touching);
      triangle = hook.contact().triangle, weights = hook.contact().barycentric;
      first = RodContact<S>::point_at(body, triangle, weights);
      on_tool = static_cast<double>((first - at.position).x());
      seen.hooked = hook.hooked();
    }
    if (triangle >= 0) {
      Vector3<S> const now = RodContact<S>::point_at(body, triangle, weights);
      seen.slip = std::max(seen.slip, static_cast<double>((at.position - now).x()) + on_tool);
      seen.stayed = seen.stayed && hook.hooked();
      seen.carried = static_cast<double>((now - first).x());
      seen.side = static_cast<double>(force.x());
      S pressed = 0, rubbed = 0;
      for (auto const& touch : hook.rods().touches()) pressed += touch.pressed, rubbed += touch.rubbed;
      if (pressed > S(0.05)) seen.cone = std::max(seen.cone, static_cast<double>(rubbed / pressed));
    }
    REQUIRE(body.step(h));
  }
  return seen;
}

template <class S>
void check_down(Drawn const& seen) {
  CAPTURE(seen.slip, seen.cone, seen.side, seen.carried);
  CHECK((seen.hooked && seen.stayed));
  CHECK(seen.slip < 0.001);
  CHECK(seen.carried > 0.009);
  CHECK(seen.side < -0.1);   // the tissue draws back
}

template <class S>
void check_flat(Drawn const& seen) {
  CAPTURE(seen.slip, seen.cone, seen.side, seen.carried);
  CHECK_FALSE(seen.hooked);
  CHECK(seen.slip > 0.005);
  CHECK(seen.cone == Approx(0.3).epsilon(256 * static_cast<double>(std::numeric_limits<S>::epsilon())));
}

}  // namespace

TEMPLATE_TEST_CASE("A hook drawn 10 mm along the skin point down holds it; turned by a right angle it slides", "[tool][hook]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Vector3<S> const on_skin(S(0.0263), S(0.0341), 0), on_block(S(0.0221), S(0.0187), S(0.018));
  SECTION("springs") {
    check_down<S>(draw<S>(skin<S>(), on_skin, 0));
    check_flat<S>(draw<S>(skin<S>(), on_skin, 90));
  }
  SECTION("finite elements, implicit") {
    check_down<S>(draw<S>(block<S>(), on_block, 0));
    check_flat<S>(draw<S>(block<S>(), on_block, 90));
  }
}

TEST_CASE("On a plate that can not give way a lying hook's force is Coulomb's to rounding, against the way", "[tool][hook]") {
  auto const mesh = make_grid<double>(2, 2, 0.2);   // the hook stays over one of two triangles
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 60}, .home = {.stiffness = 6}});
  for (int i = 0; i < 4; ++i) tissue.nail(i);
  SoftBody plate(std::move(tissue), LeapfrogVerlet{});
  Hook<double> hook({.shape = {.radius = 0.001, .point = 0.01, .shaft = 0.02}, .friction = 0.4});
  double const h = 1e-3;
  double worst = 0, lowest = 1e9;
  for (int k = 0; k < 100; ++k) {
    double const x = k < 20 ? 0.0 : 2e-4 * (k - 20);
    hook.advance(plate, pose<double>({0.13 + x, 0.03, 0.002 - std::min(k, 15) * 1e-4}, 90));
    Vector3<double> const force = hook.press(plate, 1.0, h);
    if (k > 25) worst = std::max({worst, std::abs(force.x() + 0.4 * force.z()), std::abs(force.y())}), lowest = std::min(lowest, force.z());
    plate.step(h);
  }
  CHECK_FALSE(hook.hooked());
  CHECK(lowest > 0.5);   // 2000 N/m, 0.5 mm, at one place or more
  CHECK(worst < 1e-9);
}

TEST_CASE("A hook lets go when it is turned away, pulled out, or loaded above what the tissue holds; and hooks in again", "[tool][hook]") {
  auto body = block<double>();
  HookOptions<double> options{.shape = {.radius = 0.001, .point = 0.01, .shaft = 0.03}, .hooking_force = 0.03, .tear_force = 0.4};
  Hook<double> hook(options);
  Vector3<double> const start(0.0221, 0.0187, 0.020);
  Vector3<double> at = start;
  double turned = 0, most = 0;
  bool held = true;
  auto const go = [&](Vector3<double> const& way, double degrees, int steps) {
    for (int k = 0; k < steps; ++k) {
      at += way / steps, turned += degrees / steps;
      hook.advance(body, pose<double>(at, turned));
      REQUIRE(hook.press(body, 1.0, 1e-3).allFinite());
      REQUIRE(body.step(1e-3));
      held = held && hook.hooked();
      most = std::max(most, hook.held().force.norm());
    }
  };
  go({0, 0, -0.005}, 0, 100);
  REQUIRE(hook.hooked());
  held = true;
  SECTION("turned by 54 degrees it holds, by 60 not") {
    go({0, 0, 0}, 54, 100);
    CHECK(hook.hooked());
    go({0, 0, 0}, 6, 20);
    CHECK_FALSE(hook.hooked());
  }
  SECTION("lifted it comes out, and nothing is left of its force") {
    go({0, 0, 0.01}, 0, 200);
    CHECK_FALSE(hook.hooked());
    CHECK(hook.force().norm() == 0);
    CHECK(hook.state() == CuttingPhase::no_contact);
    go({0, 0, -0.01}, 0, 200);
    CHECK(hook.hooked());
  }
  SECTION("drawn too far the tissue tears off") {
    go({0.003, 0, 0}, 0, 75);
    CHECK(held);
    go({0.006, 0, 0}, 0, 150);
    CHECK_FALSE(held);   // in the tick after which it hooks in anew, where it presses then
    CHECK((most > 0.39 && most < 0.4 * (1 + 1e-9)));
  }
  SECTION("restored, and taken away") {
    body.restore(body.save());
    hook.advance(body, pose<double>(at, 0));
    CHECK_FALSE(hook.hooked());
    hook.reset(body);
    CHECK(hook.state() == CuttingPhase::no_contact);
  }
}

TEST_CASE("In implicit steps of some ms a hook that is pressed in does not let go: what is pushed beside what it holds is load too", "[tool][hook]") {
  for (double const h : {1e-3, 2e-3, 4e-3}) {
    CAPTURE(h);
    auto body = block<double>();
    Hook<double> hook({.shape = {.radius = 0.002, .point = 0.01, .shaft = 0.03}, .friction = 0.5});
    Vector3<double> const start(0.0221, 0.0187, 0.0215);
    int let_go = 0;
    for (int k = 0; k < static_cast<int>(1.0 / h); ++k) {
      bool const was = hook.hooked();
      hook.advance(body, pose<double>(start - Vector3<double>(0, 0, std::min(0.006, 0.025 * h * k)), 14));
      let_go += was && !hook.hooked();
      REQUIRE(hook.press(body, 1.0, h).allFinite());
      REQUIRE(body.step(h));
    }
    CHECK(hook.hooked());
    CHECK(let_go == 0);
    CHECK(hook.force().z() > 0.1);   // it is pressed all the time
  }
}

TEST_CASE("In implicit steps that are too long to keep its point out of the tissue a hook holds what it has gone through", "[tool][hook]") {
  for (double const radius : {0.0005, 0.0015})
    for (double const h : {8e-3, 16e-3, 32e-3})
      for (double const speed : {0.01, 0.05}) {
        CAPTURE(radius, h, speed);
        auto body = block<double>();
        Hook<double> hook({.shape = {.radius = radius, .point = 0.01, .shaft = 0.03}, .friction = 0.5});
        Vector3<double> const start(0.0221, 0.0187, 0.0225);
        int const down = static_cast<int>(std::ceil(0.006 / (speed * h)));
        for (int k = 0; k < down + static_cast<int>(0.3 / h); ++k) {
          hook.advance(body, pose<double>(start - Vector3<double>(0, 0, std::min(0.006, speed * h * k)), 14));
          REQUIRE(hook.press(body, 1.0, h).allFinite());
          REQUIRE(body.step(h));
        }
        REQUIRE(hook.hooked());
        // Drawn aside by 6 mm it takes along what it holds, and feels it.
        auto const& corners = body.tissue().surface().corners(hook.held().triangle);
        auto const point = [&] { return RodContact<double>::point_at(body, hook.held().triangle, hook.held().barycentric); };
        Vector3<double> rest = Vector3<double>::Zero();
        for (std::size_t k = 0; k < 3; ++k) rest += hook.held().barycentric[static_cast<int>(k)] * body.tissue().rest_position(corners[k]);
        for (int k = 1; k <= static_cast<int>(2.0 / h); ++k) {
          hook.advance(body, pose<double>(start - Vector3<double>(-std::min(0.006, 0.02 * h * k), 0, 0.006), 14));
          hook.press(body, 1.0, h);
          REQUIRE(body.step(h));
        }
        CHECK(hook.hooked());
        CHECK((point() - rest).x() > (h < 0.02 ? 0.004 : 0.001));   // in long steps it comes slowly
        CHECK(hook.force().x() < 0);
      }
}

TEST_CASE("A hand that rests with a hook that has gone through feels the tissue alone, without vibration", "[tool][hook]") {
  // Yardstick: the force at rest is one that is held: what it holds is the whole of it, and nothing swings.
  int gone_through = 0;
  for (double const radius : {0.0005, 0.0015})
    for (double const h : {2e-3, 4e-3, 8e-3}) {
      CAPTURE(radius, h);
      auto body = block<double>();
      Hook<double> hook({.shape = {.radius = radius, .point = 0.01, .shaft = 0.03}, .friction = 0.5});
      Vector3<double> const start(0.0221, 0.0187, 0.0225);
      std::vector<double> forces;
      double farthest = 0;
      for (int k = 0; k * h < 0.7; ++k) {
        hook.advance(body, pose<double>(start - Vector3<double>(0, 0, std::min(0.006, 1.0 * h * k)), 14));
        Vector3<double> const force = hook.press(body, 1.0, h);
        REQUIRE(body.step(h));
        if (k * h < 0.5) continue;
        forces.push_back(force.norm());
        if (hook.held().through) farthest = std::max(farthest, (force - hook.held().force).norm());
      }
      CHECK(hook.hooked());
      gone_through += hook.held().through ? 1 : 0;
      double const mean = std::accumulate(forces.begin(), forces.end(), 0.0) / static_cast<double>(forces.size());
      double swing = 0;
      for (std::size_t k = 1; k < forces.size(); ++k) swing = std::max(swing, std::abs(forces[k] - forces[k - 1]));
      CHECK(swing < 0.02 * mean + 1e-6);
      CHECK(farthest < 0.02 * mean + 1e-6);
    }
  CHECK(gone_through >= 3);   // of six
}

TEST_CASE("A hook that is pressed harder than the tissue holds does not hook in again and again", "[tool][hook]") {
  auto body = block<double>();
  Hook<double> hook({.shape = {.radius = 0.0015, .point = 0.01, .shaft = 0.03}, .friction = 0.5, .tear_force = 0.1});
  int let_go = 0;
  for (int k = 0; k < 400; ++k) {
    bool const was = hook.hooked();
    hook.advance(body, pose<double>(Vector3<double>(0.0221, 0.0187, 0.0225 - std::min(0.006, 2e-4 * k)), 0));
    hook.press(body, 1.0, 1e-3);
    REQUIRE(body.step(1e-3));
    if (k >= 200) let_go += was && !hook.hooked() ? 1 : 0;   // the hand rests since 30 ms
  }
  CHECK(let_go == 0);
  CHECK(hook.force().z() > 0.1);
}

// Yardstick: between a hook and tissue millimetres away there is nothing to draw at.
TEST_CASE("A hook whose tissue is taken away lets go, and does not draw at what is left farther in", "[tool][hook]") {
  auto body = block<double>();
  Hook<double> hook({.friction = 0.5});
  Aspirator<double> aspirator({.tip_radius = 0.003, .reach = 0.009});
  Vector3<double> const start(0.027, 0.025, 0.018);
  auto const tick = [&](Vector3<double> const& at) {
    hook.advance(body, pose(at, 0));
    Vector3<double> const force = hook.press(body, 1.0, 2e-3);
    REQUIRE(body.step(2e-3));
    return force;
  };
  for (int k = 0; k <= 200; ++k) tick(start + Vector3<double>(0.004 * std::clamp(k / 100.0 - 1, 0.0, 1.0), 0, 0.005 - 0.008 * std::min(1.0, k / 100.0)));
  Vector3<double> const at = start + Vector3<double>(0.004, 0, -0.003);
  REQUIRE(hook.hooked());
  REQUIRE(tick(at).norm() > 0.1);
  Vector3<double> const held = RodContact<double>::point_at(body, hook.held().triangle, hook.held().barycentric);
  SECTION("all of it") {
    double farthest = 0;   // m, of what is held from where it would be
    Vector3<double> force = Vector3<double>::Zero();
    for (int k = 0; k <= 60; ++k) {
      aspirator.advance(body, Vector3<double>(at + Vector3<double>(0, 0, 0.02 - 0.0004 * k)));
      force = tick(at);
      if (hook.hooked())
        farthest = std::max(farthest, (RodContact<double>::point_at(body, hook.held().triangle, hook.held().barycentric) - at - hook.held().offset).norm());
    }
    REQUIRE(aspirator.report().tetrahedra > 30);
    REQUIRE(body.nearest_point(at).distance > 0.003);
    CHECK(farthest < 0.002);
    CHECK(!hook.hooked());
    CHECK(force == Vector3<double>::Zero());
  }
  SECTION("some beside it") {
    for (int k = 0; k <= 20; ++k) aspirator.advance(body, Vector3<double>(held + Vector3<double>(0, 0.013, 0.02 - 0.001 * k)));
    REQUIRE(aspirator.report().tetrahedra > 5);
    for (int k = 0; k < 5; ++k) {
      CHECK(tick(at).norm() > 0.05);
      CHECK(hook.hooked());
    }
  }
}

TEST_CASE("A hook refuses options that make no sense", "[tool][hook]") {
  CHECK_THROWS_WITH(Hook<double>({.friction = -1}), says(".friction is -1"));
  CHECK_THROWS_WITH(Hook<double>({.angle = 2}), says(".angle is 2 rad", "pi/2"));
  CHECK_THROWS_WITH(Hook<double>({.hooking_force = 0}), says(".hooking_force is 0 N", "above zero"));
  CHECK_THROWS_WITH(Hook<double>({.tear_force = -2}), says(".tear_force is -2 N"));
}

TEST_CASE("A hook holds on to the same tissue while a cut beside it is made and taken back", "[tool][hook]") {
  auto body = skin<double>();
  Hook<double> hook({.shape = {.radius = 0.001, .point = 0.01, .shaft = 0.03}, .friction = 0.3});
  Vector3<double> const start(0.0362, 0.0341, 0);
  auto const tick = [&](double depth) {
    hook.advance(body, pose<double>(start - Vector3<double>(0, 0, depth), 0));
    REQUIRE(hook.press(body, 1.0, 5e-4).allFinite());
    REQUIRE(body.step(5e-4));
  };
  for (int k = 0; k < 400; ++k) tick(-0.002 + 0.005 * k / 400);
  REQUIRE(hook.hooked());
  auto const rest_of = [&] {
    auto const corners = body.tissue().surface().corners(hook.held().triangle);
    Vector3<double> point = Vector3<double>::Zero();
    for (std::size_t k = 0; k < 3; ++k) point += hook.held().barycentric[static_cast<int>(k)] * body.reference_position(corners[static_cast<std::size_t>(k)]);
    return point;
  };
  Vector3<double> const held = rest_of();
  int const p = body.tissue().surface().corners(hook.held().triangle)[0];
  auto const side = [&](int t) {
    double x = 0;
    for (int const corner : body.tissue().surface().corners(t)) x += (body.reference_position(corner) - body.reference_position(p)).x();
    return x > 0;
  };
  std::vector<int> part;   // the triangles at p on the held one's side
  for (int const t : body.tissue().surface().triangles_at(p))
    if (side(t) == side(hook.held().triangle)) part.push_back(t);
  int const copy = body.split_particle(p, part);
  REQUIRE(body.tissue().surface().corners(hook.held().triangle)[0] == copy);
  tick(0.003);
  CHECK(hook.hooked());
  CHECK((rest_of() - held).norm() < 1e-6);
  // Another tool that cuts after the hook in the same tick: what the hook pulls at is still what it held.
  hook.advance(body, pose<double>(start - Vector3<double>(0, 0, 0.003), 0));
  auto const corners = body.tissue().surface().corners(hook.held().triangle);
  auto const undivided = body;
  auto const before = hook;
  Vector3<double> const place = rest_of();
  body.insert_on_edge(corners[0], corners[1], 0.5);
  body.insert_on_edge(corners[1], corners[2], 0.5);
  REQUIRE(hook.press(body, 1.0, 5e-4).allFinite());
  CHECK((rest_of() - place).norm() < 1e-9);
  body = undivided, hook = before;
  body.merge_last_particle(p);   // the copy's number is no particle's now
  tick(0.003);
  CHECK(hook.hooked());
  CHECK((rest_of() - held).norm() < 1e-4);   // nearest to where it was before that tick
}

TEST_CASE("a hook holds the same point of cubes as they are split", "[tool][hook][cubes]") {
  Cubes<double> body(make_box<double>({0, 0, 0}, {0.08, 0.08, 0.04}), {.edge = 0.01, .young = 5000, .levels = 1, .join_after = 20});
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i).z() < 0.001) body.nail(i);
  Hook<double> hook({.hooking_force = 0.02});
  Vector3<double> const tip(0.0427, 0.0413, 0.041), down(0, 0, -0.003);
  auto const home = [&] {   // of the point that is held
    auto const corners = body.tissue().surface().corners(hook.held().triangle);
    Vector3<double> sum = Vector3<double>::Zero();
    for (int k = 0; k < 3; ++k) sum += hook.held().barycentric[k] * body.reference_position(corners[static_cast<std::size_t>(k)]);
    return sum;
  };
  Vector3<double> held = Vector3<double>::Zero();
  auto const tick = [&](Vector3<double> const& place) {
    hook.advance(body, ToolPose<double>{.position = place});
    REQUIRE(hook.press(body, 1.0, 1e-3).allFinite());
    held = hook.hooked() ? home() : held;
    body.step(1e-3);
  };
  for (int k = 0; k <= 200; ++k) tick(tip + Vector3<double>(0, 0, 0.006 * std::max(0.0, 1 - k / 100.0)) + std::max(0.0, k / 100.0 - 1) * down);
  REQUIRE(hook.hooked());
  Vector3<double> const first = held;
  for (int k = 0; k <= 400; ++k) tick(tip + down + Vector3<double>(0.004 * k / 400, 0, 0));
  REQUIRE(hook.hooked());
  for (int cube = 0; cube < 3; ++cube) {   // elsewhere, as another tool does
    body.split(cube);
    tick(tip + down + Vector3<double>(0.004, 0, 0));
    REQUIRE(hook.hooked());
    CHECK((held - first).norm() < 1e-9);
  }
}
