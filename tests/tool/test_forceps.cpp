// SPDX-License-Identifier: MIT
// Yardsticks: Coulomb's cone of two pads (2 friction clamp_force), the reaction of a particle that a hand holds at the same place, the momentum of a free
// body, and the undisturbed shape after a hundred grasps.
#include "catch.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/mesh/box.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/cubes/cubes.hpp>
#include <palpate/tool/forceps.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

static_assert(Cutter<Forceps<double>, decltype(skin<double>())> && PressesTissue<Forceps<double>, decltype(skin<double>())>);
static_assert(ResettableCutter<Forceps<float>, decltype(block<float>())>);

constexpr int middle = 7 * 15 + 7;   // of the skin: at (0.035, 0.035, 0)

template <class S>
ToolPose<S> at(Vector3<S> const& tip, double opening) {
  return {.position = tip, .opening = S(opening)};
}

/// One tick of one step.
template <class S, class Body>
Vector3<S> tick(Forceps<S>& forceps, Body& body, ToolPose<S> const& pose, S h) {
  forceps.advance(body, pose);
  Vector3<S> const force = forceps.press(body, S(1), h);
  REQUIRE(force.allFinite());
  REQUIRE(body.step(h));
  return force;
}

/// Comes with open jaws in 0.1 s, rests as long, and closes them in 0.1 s.
template <class S, class Body>
void grasp(Forceps<S>& forceps, Body& body, Vector3<S> const& tip, S h, double closed = 0.2) {
  int const ticks = static_cast<int>(std::lround(0.1 / static_cast<double>(h)));
  for (int k = 0; k <= 2 * ticks; ++k) tick(forceps, body, at<S>(tip + Vector3<S>(0, 0, S(0.005) * std::max(S(0), 1 - S(k) / S(ticks))), 1), h);
  for (int k = 0; k <= ticks; ++k) tick(forceps, body, at<S>(tip, 1 - (1 - closed) * k / ticks), h);
}

/// Lifts by so much in so many seconds, and rests as long.
template <class S, class Body>
Vector3<S> lift(Forceps<S>& forceps, Body& body, Vector3<S> const& tip, Vector3<S> const& way, double seconds, S h, double opening = 0.2) {
  int const ticks = static_cast<int>(std::lround(seconds / static_cast<double>(h)));
  Vector3<S> force = Vector3<S>::Zero();
  for (int k = 1; k <= 2 * ticks; ++k) force = tick(forceps, body, at<S>(tip + std::min(S(1), S(k) / S(ticks)) * way, opening), h);
  return force;
}

Vector3<double> const on_skin(0.035, 0.035, 0.0005);

/// 40 × 32 × 16 mm, nailed at the bottom.
auto small_block() {
  auto const mesh = make_block<double>(6, 5, 3, 0.008, BlockPattern::alternating);
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1060, .material = {.young = 5e3, .poisson = 0.4}});
  tissue.nail(vertices_where(mesh, [](Vector3<double> const& p) { return p.z() < 1e-6; }));
  return SoftBody(std::move(tissue), BackwardEuler{});
}
Vector3<double> const on_block(0.02, 0.016, 0.0165);

}  // namespace

TEMPLATE_TEST_CASE("Jaws that close take hold of what is between them, and let go of it where they open", "[tool][forceps]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = skin<S>();
  Forceps<S> forceps;
  Vector3<S> const tip = on_skin.cast<S>();
  grasp(forceps, body, tip, S(5e-4));
  REQUIRE(forceps.grasp().particles().size() == 1);
  CHECK(forceps.grasp().particles()[0].particle == middle);
  CHECK(forceps.state() == CuttingPhase::indenting);
  CHECK(lift<S>(forceps, body, tip, {0, 0, S(0.005)}, 0.3, S(5e-4)).z() < S(-0.1));   // the tissue draws down
  CHECK(body.positions().col(middle).z() > S(0.004));
  CHECK((forceps.contact().touching && forceps.contact().home_point.isApprox(Vector3<S>(S(0.035), S(0.035), 0), S(1e-5))));
  Vector3<S> const up = tip + Vector3<S>(0, 0, S(0.005));
  tick(forceps, body, at<S>(up, 0.69), S(5e-4));
  CHECK(forceps.grasp().holds_any());
  Vector3<S> const force = tick(forceps, body, at<S>(up, 0.71), S(5e-4));
  CHECK(!forceps.grasp().holds_any());
  CHECK(force == Vector3<S>::Zero());
  for (int k = 0; k < 400; ++k) tick(forceps, body, at<S>(up, 1), S(5e-4));
  for (int k = 0; k < 100; ++k) tick(forceps, body, at<S>(up, 0.3), S(5e-4));
  CHECK(!forceps.grasp().holds_any());   // nothing was there
  for (int k = 0; k < 400; ++k) tick(forceps, body, at<S>(tip, 0.3), S(5e-4));
  CHECK(!forceps.grasp().holds_any());   // closed jaws do not take hold
}

TEST_CASE("The hand feels what holding the same particle there takes, at any step", "[tool][forceps]") {
  auto const run = [&](auto body, Vector3<double> const& tip, double h) {
    Forceps<double> forceps({.grasp = {.clamp_force = 20}});
    grasp(forceps, body, tip, h);
    REQUIRE(forceps.grasp().holds_any());
    Vector3<double> const force = lift<double>(forceps, body, tip, {0.001, 0.002, 0.004}, 1.0, h);
    auto held = body;
    Vector3<double> reaction = Vector3<double>::Zero();
    for (auto const& each : forceps.grasp().particles()) held.drag(each.particle, held.positions().col(each.particle));
    held.solve_statics();
    for (auto const& each : forceps.grasp().particles()) reaction += held.reaction(each.particle);
    CAPTURE(h, force.transpose(), reaction.transpose());
    CHECK((force + reaction).norm() < 0.01 * reaction.norm());
    return force;
  };
  auto const check = [&](auto const& body, Vector3<double> const& tip) {
    Vector3<double> const force = run(body, tip, 1e-3);
    CHECK(force.norm() > 0.1);
    for (double const h : {5e-4, 2e-3}) CHECK((run(body, tip, h) - force).norm() < 0.01 * force.norm());
  };
  // A sheet as heavy as leather, since springs are stepped explicitly: a skin's stable step is 1.5 ms.
  auto const mesh = make_grid<double>(15, 15, 0.005);
  MassSpring<double> leather(mesh, {.mass = {.total = 0.4}, .link = {.stiffness = 60, .damping = 0.04}, .home = {.stiffness = 6, .damping = 0.1}});
  leather.nail(boundary_vertices(mesh));
  check(SoftBody(std::move(leather), LeapfrogVerlet{}), on_skin);
  check(small_block(), on_block);
}

// Yardstick: its weight. In steps of 5 ms and more it diverged while each particle was taken to give way by itself, in a zone from 2 ms on.
TEMPLATE_TEST_CASE("A limp wall of 2.5 g that hangs from jaws draws with its weight, in implicit steps of 2 to 10 ms", "[tool][forceps]", WholeBody, ZoneOfInfluence) {
  for (double const h : {2e-3, 5e-3, 1e-2}) {
    MassSpring<double> wall(make_grid<double>(15, 15, 0.004), {.mass = {.total = 0.0025}, .link = {.stiffness = 30, .damping = 0.01}});
    SoftBody body(std::move(wall), BackwardEuler{}, TestType{});
    Forceps<double> forceps;
    Vector3<double> const tip(0.028, 0.028, 0);
    double least = 1, most = -1;
    for (double t = 0; t < 2.5; t += h) {
      if (t > 0.3) body.set_gravity({0, 0, -9.81});
      double const up = 0.08 * std::clamp((t - 0.3) / 0.7, 0.0, 1.0);
      Vector3<double> const force = tick(forceps, body, at<double>(tip + Vector3<double>(0, 0, up), std::clamp(1 - 7 * (t - 0.1), 0.3, 1.0)), h);
      if (t > 2) least = std::min(least, force.z()), most = std::max(most, force.z());
    }
    CAPTURE(h, least, most);
    REQUIRE(forceps.grasp().holds_any());
    CHECK(least > -1.05 * 0.0025 * 9.81);
    CHECK(most < -0.95 * 0.0025 * 9.81);
  }
}

TEST_CASE("A drawn fold slips out at the friction of two pads", "[tool][forceps]") {
  for (double const clamp : {0.05, 0.1}) {
    auto body = skin<double>();
    Forceps<double> forceps({.grasp = {.friction = 0.5, .clamp_force = clamp}});
    grasp(forceps, body, on_skin, 5e-4);
    double largest = 0;
    int k = 0;
    while (forceps.grasp().holds_any()) {
      Vector3<double> const force = tick(forceps, body, at<double>(on_skin + Vector3<double>(0, 1e-6 * k, 0), 0.2), 5e-4);
      if (forceps.grasp().holds_any()) largest = std::max(largest, std::hypot(force.y(), force.z()));
      REQUIRE(++k < 20000);
    }
    CAPTURE(clamp, largest);
    CHECK(largest <= 2 * 0.5 * clamp * (1 + 1e-12));
    CHECK(largest > 0.97 * 2 * 0.5 * clamp);
  }
}

TEST_CASE("What the hand gets is what the tissue gets: momentum of a free body", "[tool][forceps]") {
  auto body = block<double, LeapfrogVerlet>(false);
  Forceps<double> forceps({.grasp = {.clamp_force = 50}});
  Vector3<double> const tip(0.03, 0.024, 0.0185);
  double const h = 1e-4;
  double largest = 0;
  tick(forceps, body, at<double>(tip + Vector3<double>(0, 0, 0.005), 1), h);
  for (int k = 0; k < 1500; ++k) {
    Vector3<double> const before = body.momentum();
    double const up = std::max(0, k - 400) * 5e-6;
    Vector3<double> const force = tick(forceps, body, at<double>(tip + Vector3<double>(up / 3, 0, up), std::max(0.2, 1 - k / 400.0)), h);
    Vector3<double> const gained = (body.momentum() - before) / h;
    largest = std::max(largest, force.norm());
    REQUIRE((gained + force).norm() <= 1e-9 * std::max(1.0, largest));
    Vector3<double> sum = Vector3<double>::Zero();
    for (auto const& each : forceps.grasp().particles()) sum += each.force;
    for (auto const& touch : forceps.rods().touches()) sum += touch.force;
    REQUIRE((sum - force).norm() <= 1e-12 * std::max(1.0, largest));
  }
  CHECK(forceps.grasp().holds_any());
  CHECK(largest > 0.1);
}

TEST_CASE("A grasp that rests gives no energy", "[tool][forceps]") {
  auto body = skin<double>();
  Forceps<double> forceps({.grasp = {.clamp_force = 20}});
  grasp(forceps, body, on_skin, 5e-4);
  auto const pose = at<double>(on_skin + Vector3<double>(0, 0, 0.004), 0.2);
  for (int k = 0; k < 20; ++k) tick(forceps, body, pose, 5e-4);   // thrown up by 4 mm, it swings
  // What is stored in the tissue, its motion and the springs, whose far ends rest: the damped motion may only lose it.
  auto const energy = [&] {
    double sum = body.kinetic_energy() + body.potential_energy();
    for (auto const& each : forceps.grasp().particles()) sum += each.force.squaredNorm() / (2 * forceps.options().grasp.stiffness) * static_cast<double>(forceps.grasp().particles().size());
    return sum;
  };
  double const begin = energy();
  double most = begin;
  CHECK(body.kinetic_energy() > 1e-4 * begin);
  for (int k = 0; k < 8000; ++k) {
    tick(forceps, body, pose, 5e-4);
    most = std::max(most, energy());
  }
  CAPTURE(begin, most, energy());
  CHECK(forceps.grasp().holds_any());
  CHECK(most <= begin * 1.001);
  CHECK(body.kinetic_energy() < 1e-12 * begin);
}

TEST_CASE("A hundred grasps leave no trace", "[tool][forceps]") {
  auto const check = [](auto body, Vector3<double> const& tip, double h) {
    Matrix3X<double> const before = body.positions();
    Forceps<double> forceps;
    for (int k = 0; k < 100; ++k) {
      Vector3<double> const place = tip + Vector3<double>(0.004 * std::sin(k), 0.004 * std::cos(3 * k), 0);
      grasp(forceps, body, place, h);
      REQUIRE(forceps.grasp().holds_any());
      lift<double>(forceps, body, place, {0.002, 0, 0.003}, 0.02, h);
      tick(forceps, body, at<double>(place + Vector3<double>(0.002, 0, 0.02), 1), h);
    }
    body.solve_statics(DynamicRelaxation{}, 1e-12);
    CHECK((body.positions() - before).cwiseAbs().maxCoeff() < 1e-9);
  };
  check(skin<double>(), on_skin, 1e-3);
  check(small_block(), on_block, 4e-3);
}

TEST_CASE("A copy of what is held is held too, and a cut through the tissue between the jaws ends the grasp", "[tool][forceps]") {
  auto body = skin<double>();
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.clamp_force = 20, .width = 0.014}});   // jaws wide enough for three by three particles and more
  grasp(forceps, body, on_skin, 5e-4, 0.5);
  auto const particles = forceps.grasp().particles();
  REQUIRE(particles.size() == 9);
  REQUIRE(forceps.grasp().holds(middle));
  auto const& surface = body.tissue().surface();
  // Along the column x = 0.035, from its end at −y on: triangles to the right get the copy.
  auto const cut = [&](int p) {
    std::vector<int> right;
    for (int const t : surface.triangles_at(p)) {
      double x = 0;
      for (int const corner : surface.corners(t)) x += body.reference_position(corner).x() / 3;
      if (x > 0.035) right.push_back(t);
    }
    return body.split_particle(p, right);
  };
  int const first = cut(middle - 15);
  tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  CHECK(particles.size() == 9);
  CHECK(forceps.grasp().particles().size() == 10);
  CHECK((forceps.grasp().holds(first) && forceps.grasp().holds(middle - 15)));
  forceps.advance(body, at<double>(on_skin, 0.5));
  body.merge_last_particle(middle - 15);   // another tool, later in the same tick
  CHECK(forceps.press(body, 1.0, 5e-4).allFinite());
  tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  CHECK((forceps.grasp().particles().size() == 9 && !forceps.grasp().holds(first)));
  for (int const p : {middle - 15, middle}) cut(p);
  tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  CHECK(forceps.grasp().particles().size() == 11);
  cut(middle + 15);   // now what is between the jaws is in two
  Vector3<double> const force = tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  CHECK(!forceps.grasp().holds_any());
  CHECK(forceps.grasp().particles().empty());
  CHECK(force.allFinite());
}

// Yardstick: the map by which the whole sheet is turned and drawn out. A place beside what is held was turned with the jaws alone.
TEST_CASE("Tissue that was turned or drawn out when jaws took hold is let go by cuts that part it between them", "[tool][forceps]") {
  double const angle = GENERATE(0.0, 90.0, -90.0);   // degrees, about z, as the jaws
  double const stretch = GENERATE(1.0, 2.0);         // along y, where the jaws reach 7 mm
  double const y = GENERATE(0.0062, 0.008);          // m, from the middle: of what joins both sides of the cut
  Eigen::Quaternion<double> const turn(Eigen::AngleAxis<double>(angle * std::numbers::pi / 180, Vector3<double>::UnitZ()));
  auto body = skin<double>();
  for (int i = 0; i < body.size(); ++i) {
    Vector3<double> place = body.reference_position(i);
    place.y() = on_skin.y() + stretch * (place.y() - on_skin.y());
    body.drag(i, turn * place);
  }
  for (int i = 0; i < body.size(); ++i) body.release(i);
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.clamp_force = 20, .width = 0.014}});
  auto const close = [&](double opening) { forceps.advance(body, ToolPose<double>{.position = turn * on_skin, .orientation = turn, .opening = opening}); };
  close(1), close(0.5);
  int const rows = stretch == 1 ? 1 : 0;   // to either side, of 5 mm each
  REQUIRE(forceps.grasp().particles().size() == static_cast<std::size_t>(3 * (2 * rows + 1)));
  auto const& surface = body.tissue().surface();
  int const last = middle + 15 * rows;
  body.insert_on_edge(last, last + 15, y / stretch / 0.005 - rows);
  for (int p = middle - 15 * rows; p <= last; p += 15) {
    std::vector<int> right;
    for (int const t : surface.triangles_at(p)) {
      double x = 0;
      for (int const corner : surface.corners(t)) x += body.reference_position(corner).x() / 3;
      if (x > 0.035) right.push_back(t);
    }
    body.split_particle(p, right);
  }
  close(0.5);
  CAPTURE(angle, stretch, y);
  CHECK(forceps.grasp().holds_any() == (y < 0.007));
}

// Yardstick: how the tissue between the jaws hangs together. Drawn with more than a newton it leaves the place between the jaws by some millimetres.
TEST_CASE("A cut that parts nothing between the jaws ends no grasp, however hard the tissue is drawn", "[tool][forceps]") {
  auto body = block<double>();
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.clamp_force = 50, .width = 0.014}});
  Vector3<double> const tip(0.03, 0.024, 0.0185), up(0, 0.002, 0.014);
  grasp(forceps, body, tip, 2e-3, 0.4);
  REQUIRE(forceps.grasp().particles().size() == 9);
  REQUIRE(lift<double>(forceps, body, tip, up, 0.1, 2e-3, 0.4).norm() > 1);
  auto const pose = at<double>(tip + up, 0.4);
  auto const on_surface = [&](double x, double y) {
    int nearest = 0;
    auto const distance = [&](int i) { return (body.reference_position(i) - Vector3<double>(x, y, 0.018)).norm(); };
    for (int i = 0; i < body.size(); ++i)
      if (distance(i) < distance(nearest)) nearest = i;
    return nearest;
  };
  auto const& surface = body.tissue().surface();
  SECTION("edges are divided") {
    std::vector<std::pair<int, int>> edges;
    for (auto const& a : forceps.grasp().particles())
      for (auto const& b : forceps.grasp().particles())
        if (a.particle < b.particle && surface.triangle_with_edge(a.particle, b.particle) >= 0) edges.emplace_back(a.particle, b.particle);
    REQUIRE(edges.size() == 16);
    for (auto const& [a, b] : edges) body.insert_on_edge(a, b, 0.5);
    body.finish_edits();
    tick(forceps, body, pose, 2e-3);
    CHECK(forceps.grasp().particles().size() == 9);
  }
  SECTION("a blade goes in halfway, and then through") {
    VolumeCutter<double> knife;
    // The plane of x = 0.033 at rest, as it is now, seen from the side.
    auto const sweep = [&](double from, double to) {
      for (int k = 0; k <= 40; ++k) {
        double const y = from + (to - from) * k / 40;
        Vector3<double> const place = (body.positions().col(on_surface(0.03, 0.024)) + body.positions().col(on_surface(0.036, 0.024))) / 2;
        knife.advance(body, {{place.x(), y, -0.002}, {place.x(), y, 0.06}});
        tick(forceps, body, pose, 2e-3);
      }
    };
    sweep(-0.01, 0.022);
    REQUIRE(knife.report().lip_area > 0);
    CHECK(forceps.grasp().particles().size() >= 9);
    sweep(0.022, 0.06);
    CHECK(!forceps.grasp().holds_any());
  }
}

TEST_CASE("A copy that has slipped out does not come back where something else is cut", "[tool][forceps]") {
  auto body = skin<double>();
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.friction = 0.3, .clamp_force = 20, .width = 0.014}});
  grasp(forceps, body, on_skin, 5e-4, 0.5);
  auto const split = [&](int p) {
    std::vector<int> right;
    for (int const t : body.tissue().surface().triangles_at(p)) {
      double x = 0;
      for (int const corner : body.tissue().surface().corners(t)) x += body.reference_position(corner).x() / 3;
      if (x > body.reference_position(p).x()) right.push_back(t);
    }
    return body.split_particle(p, right);
  };
  int const copy = split(middle - 15);
  tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  REQUIRE((forceps.grasp().holds(copy) && forceps.grasp().particles().size() == 10));
  // Yardstick: the cone of two pads, for each of ten 2 · 0.3 · 20 / 10 N = 1.2 N; somebody draws with 5 N.
  forceps.advance(body, at<double>(on_skin, 0.5));
  body.apply_force(copy, {0, 5, 0});
  forceps.press(body, 1.0, 5e-4);
  REQUIRE(body.step(5e-4));
  CHECK(!forceps.grasp().holds(copy));
  CHECK(forceps.grasp().holds(middle - 15));
  split(middle + 60);   // beside the jaws
  forceps.advance(body, at<double>(on_skin, 0.5));   // without the next step, in which it would slip out again
  CHECK(!forceps.grasp().holds(copy));
  CHECK(forceps.grasp().holds(middle - 15));
  CHECK(forceps.grasp().particles().size() == 9);
}

// Yardstick: the same cut in a tick in which nothing slips, which ends the grasp.
TEST_CASE("A cut through the tissue between the jaws ends the grasp in a tick in which some of it slips out too", "[tool][forceps]") {
  bool const slips = GENERATE(false, true);
  bool const is_later = GENERATE(false, true);   // whether the blade comes after the forceps in that tick, or before them in the next
  auto body = skin<double>();
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.friction = 0.3, .clamp_force = 20, .width = 0.014}});
  grasp(forceps, body, on_skin, 5e-4, 0.5);
  REQUIRE(forceps.grasp().particles().size() == 9);
  auto const cut = [&] {
    for (int const p : {middle - 15, middle, middle + 15}) {
      std::vector<int> right;
      for (int const t : body.tissue().surface().triangles_at(p)) {
        double x = 0;
        for (int const corner : body.tissue().surface().corners(t)) x += body.reference_position(corner).x() / 3;
        if (x > 0.035) right.push_back(t);
      }
      body.split_particle(p, right);
    }
  };
  forceps.advance(body, at<double>(on_skin, 0.5));
  if (is_later) cut();
  if (slips) body.apply_force(middle - 16, {0, 60, 0});
  forceps.press(body, 1.0, 5e-4);
  REQUIRE(body.step(5e-4));
  REQUIRE((!slips || !forceps.grasp().holds(middle - 16)));
  if (!is_later) cut();
  forceps.advance(body, at<double>(on_skin, 0.5));
  CAPTURE(slips, is_later);
  CHECK(!forceps.grasp().holds_any());
}

// Yardstick: the same copy with no number given back before it.
TEST_CASE("A copy that gets a number which was given back since the jaws took hold is held too", "[tool][forceps]") {
  auto body = skin<double>();
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.clamp_force = 20, .width = 0.014}});
  auto const split = [&](int p) {
    std::vector<int> right;
    for (int const t : body.tissue().surface().triangles_at(p)) {
      double x = 0;
      for (int const corner : body.tissue().surface().corners(t)) x += body.reference_position(corner).x() / 3;
      if (x > body.reference_position(p).x()) right.push_back(t);
    }
    return body.split_particle(p, right);
  };
  bool const is_given_back = GENERATE(false, true);
  constexpr int aside = 3 * 15 + 3;
  int const last = is_given_back ? split(aside) : body.size();
  grasp(forceps, body, on_skin, 5e-4, 0.5);
  REQUIRE((forceps.grasp().particles().size() == 9 && !forceps.grasp().holds(aside)));
  if (is_given_back) body.merge_last_particle(aside);
  tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  REQUIRE(split(middle - 15) == last);
  tick(forceps, body, at<double>(on_skin, 0.5), 5e-4);
  CAPTURE(is_given_back);
  CHECK((forceps.grasp().holds(last) && forceps.grasp().particles().size() == 10));
}

TEST_CASE("Tissue that is taken away between the jaws is let go, what is left is held", "[tool][forceps]") {
  auto body = block<double>();
  Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.clamp_force = 20, .width = 0.014}});
  Vector3<double> const tip(0.03, 0.024, 0.0185);
  grasp(forceps, body, tip, 1e-3, 0.5);
  auto const count = forceps.grasp().particles().size();
  REQUIRE(count >= 4);
  int const gone = forceps.grasp().particles()[0].particle;
  auto const& solid = body.tissue().topology();
  for (int t = solid.tetrahedron_count(); t-- > 0;)
    if (t < solid.tetrahedron_count() && solid.corner_of(t, gone) >= 0) body.remove_tetrahedron(t);
  body.finish_edits();
  REQUIRE(body.tissue().surface().triangles_at(gone).empty());
  for (int k = 0; k < 20; ++k) tick(forceps, body, at<double>(tip, 0.5), 1e-3);
  CHECK(!forceps.grasp().holds(gone));
  auto const saved = body.save();
  body.restore(saved);
  CHECK(tick(forceps, body, at<double>(tip, 0.5), 1e-3).allFinite());
  CHECK(!forceps.grasp().holds_any());   // the tool has to come anew
}

TEST_CASE("Jaws press with about the clamp force, however fast they close, and opening them throws nothing apart", "[tool][forceps]") {
  double const clamp = 0.02;
  for (int const ticks : {1, 10, 200}) {
    CAPTURE(ticks);
    auto body = skin<double>();
    Forceps<double> forceps({.shape = {.opening = 0.024}, .grasp = {.friction = 5, .clamp_force = clamp, .width = 0.014}});
    for (int k = 0; k <= 400; ++k) tick(forceps, body, at<double>(on_skin + Vector3<double>(0, 0, 0.005 * std::max(0.0, 1 - k / 200.0)), 1), 5e-4);
    for (int k = 1; k <= ticks; ++k) tick(forceps, body, at<double>(on_skin, 1 - 0.5 * k / ticks), 5e-4);
    REQUIRE(forceps.grasp().particles().size() >= 6);
    for (int k = 1; k <= ticks; ++k) tick(forceps, body, at<double>(on_skin, 0.5 - 0.5 * k / ticks), 5e-4);
    for (int k = 0; k < 2000; ++k) tick(forceps, body, at<double>(on_skin, 0), 5e-4);
    REQUIRE(forceps.grasp().holds_any());
    double left = 0, right = 0;   // N, at rest
    for (auto const& each : forceps.grasp().particles()) (each.place.x() < 0 ? left : right) += each.force.x();
    CHECK(std::abs(right - clamp) < 0.5 * clamp);
    CHECK(std::abs(left + clamp) < 0.5 * clamp);
    for (int k = 0; k < 400; ++k) tick(forceps, body, at<double>(on_skin, 0.69), 5e-4);
    double farthest = 0;
    for (int i = 0; i < body.size(); ++i) farthest = std::max(farthest, body.displacement(i).norm());
    CHECK(farthest < 0.003);
  }
}

TEST_CASE("Where no particle is between the jaws the triangle there is held", "[tool][forceps]") {
  auto const mesh = make_grid<double>(4, 4, 0.03);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 60, .damping = 0.02}, .home = {.stiffness = 6, .damping = 0.05}});
  tissue.nail(boundary_vertices(mesh));
  SoftBody body(std::move(tissue), LeapfrogVerlet{});
  Forceps<double> forceps;
  Vector3<double> const tip(0.043, 0.04, 0.0005);
  grasp(forceps, body, tip, 5e-4);
  CHECK(forceps.grasp().particles().size() == 3);
  CHECK(lift<double>(forceps, body, tip, {0, 0, 0.004}, 0.3, 5e-4).z() < -0.02);
}

TEST_CASE("Options of forceps that make no sense are refused with what to give", "[tool][forceps]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(Forceps<double>({.grasp = {.clamp_force = 0}}), says("GraspOptions: .clamp_force is 0 N"));
  CHECK_THROWS_WITH(Forceps<double>({.grasp = {.stiffness = nan}}), says(".stiffness"));
  CHECK_THROWS_WITH(Forceps<double>({.grasp = {.width = -1}}), says(".width is -1 m"));
  CHECK_THROWS_WITH(Forceps<double>({.grasp_below = 1.5}), says(".grasp_below is 1.5"));
  CHECK_THROWS_WITH(Forceps<double>({.grasp_below = 0.5, .release_above = 0.5}), says("above .grasp_below"));
  CHECK_THROWS_WITH(Forceps<double>({.shape = {.opening = 0.001}}), says(".shape.opening is 0.001 m", "twice .shape.radius"));
  auto body = skin<double>();
  Forceps<double> forceps;
  grasp(forceps, body, on_skin, 5e-4);
  forceps.advance(body, at<double>(on_skin, nan));   // stays as it is
  CHECK(forceps.grasp().holds_any());
  CHECK(forceps.press(body, 1.0, 5e-4).allFinite());
}

// Cubes are split where the jaws touch, and joined: vertices get other numbers. Yardstick: the shape at rest, in which what is held has its place.
TEST_CASE("what forceps hold of cubes stays what it was as cubes are split and joined", "[tool][forceps][cubes]") {
  Cubes<double> body(make_box<double>({0, 0, 0}, {0.08, 0.08, 0.04}), {.edge = 0.01, .young = 5000, .levels = 1, .join_after = 20});
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i).z() < 0.001) body.nail(i);
  Forceps<double> forceps({.grasp = {.clamp_force = 2}});
  Vector3<double> const tip(0.042, 0.041, 0.0405);
  auto const go = [&](Vector3<double> const& by, double opening) {
    forceps.advance(body, at<double>(tip + by, opening));
    REQUIRE(forceps.press(body, 1.0, 1e-3).allFinite());
    REQUIRE_FALSE(body.step(1e-3).diverged);
    forceps.advance(body, at<double>(tip + by, opening));
  };
  auto const homes = [&] {
    std::vector<Vector3<double>> all;
    for (auto const& each : forceps.grasp().particles()) all.push_back(body.reference_position(each.particle));
    return all;
  };
  auto const before = body.renumberings();
  for (int k = 0; k <= 200; ++k) go({0, 0, 0.005 * std::max(0.0, 1 - k / 100.0)}, 1);
  std::vector<Vector3<double>> first;
  for (int k = 0; k <= 300; ++k) {
    if (k == 200) body.split(0);   // elsewhere, as another tool does
    go(Vector3<double>(0.003, 0, 0.003) * std::clamp(k / 100.0 - 1, 0.0, 1.0), std::max(0.2, 1 - 0.8 * k / 100.0));
    if (k == 100) first = homes();   // closed; one of the two corners that they took first has slipped out
    if (k < 100) continue;
    CHECK(homes() == first);
    for (auto const& each : forceps.grasp().particles()) CHECK(body.displacement(each.particle).norm() < 0.006);
  }
  CHECK(!first.empty());
  CHECK(body.renumberings() > before + 1);
}

// Where both lips have one place at rest. Yardstick: where the particles are, which a split elsewhere does not move.
TEST_CASE("forceps at a wound in cubes hold the same of its lips, each once, as cubes are split", "[tool][forceps][cubes]") {
  auto const shape = make_forceps_shape<double>({.opening = 0.003});
  for (double const pretension : {0.1, 0.0}) {   // the wound gapes, and is closed
    Cubes<double> body(make_box<double>({0, 0, 0}, {0.08, 0.08, 0.04}), {.edge = 0.01, .young = 5000, .pretension = pretension, .levels = 1});
    for (int i = 0; i < body.size(); ++i)
      if (body.reference_position(i).z() < 0.001) body.nail(i);
    for (int c = 0; c < body.cubes(); ++c)   // at the wound
      if (Vector3<double> const off = body.middle(c) - Vector3<double>(0.04, 0.045, 0.035); off.cwiseAbs().maxCoeff() < 0.006) body.split(c);
    REQUIRE(body.cut({0.0401, -1, 0.021}, {0.0401, -1, 1}, {0.0401, 1, 0.021}, {0.0401, 1, 1}) > 0);
    body.solve_statics(1e-4);
    Vector3<double> left(1, 0, 0), right(-1, 0, 0);   // the lips at the middle
    for (int i = 0; i < body.size(); ++i)
      if ((body.reference_position(i) - Vector3<double>(0.04, 0.04, 0.04)).norm() < 1e-6) {
        Vector3<double> const x = body.positions().col(i);
        if (x.x() < left.x()) left = x;
        if (x.x() > right.x()) right = x;
      }
    bool const gapes = pretension > 0;
    REQUIRE((right.x() - left.x() > 4e-4) == gapes);
    for (double const off : {0.0, 0.0013}) {   // both lips are between the jaws, and, where the wound gapes, the left one alone
      auto pressed = body;
      auto const pose = at<double>(left - Vector3<double>(off, 0, 0), 1);
      Grasp<double> grasp({.width = 0.025});
      grasp.take(pressed, pose, {shape.rods[0].at(1.0), shape.rods[1].at(1.0)});
      auto const places = [&] {
        std::vector<Vector3<double>> all;
        for (auto const& each : grasp.particles()) all.push_back(pressed.positions().col(each.particle));
        return all;
      };
      auto const before = places();
      CAPTURE(pretension, off);
      REQUIRE(before.size() == (gapes && off > 0 ? 4u : 8u));
      for (int const cube : {0, 63}) {
        pressed.split(cube);
        grasp.advance(pressed, pose);
        auto const now = places();
        REQUIRE(now.size() == before.size());
        for (std::size_t k = 0; k < now.size(); ++k) {
          CHECK((now[k] - before[k]).norm() < 1e-12);
          for (std::size_t other = 0; other < k; ++other) CHECK(grasp.particles()[k].particle != grasp.particles()[other].particle);
        }
      }
    }
  }
}
