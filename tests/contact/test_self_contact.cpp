// SPDX-License-Identifier: MIT
// A body in itself. Yardsticks: boxes in closed form; a ring that goes round more than once, by Pappus; the contact of two bodies, for one body of two pieces; weight;
// momentum and energy.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "contact/blocks.hpp"
#include "device/message.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/collision/near_triangles.hpp>
#include <palpate/collision/surface_intersection.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/contact/body_contact.hpp>
#include <palpate/contact/self_contact.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/region/whole_body.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

using Place = Vector3<double>;

/// Both in one mesh.
template <class Mesh>
Mesh together(Mesh const& a, Mesh const& b) {
  Mesh both;
  both.points.resize(3, a.points.cols() + b.points.cols()), both.elements().resize(a.elements().rows(), a.elements().cols() + b.elements().cols());
  both.points << a.points, b.points;
  both.elements().leftCols(a.elements().cols()) = a.elements();
  both.elements().rightCols(b.elements().cols()) = b.elements().array() + static_cast<int>(a.points.cols());
  return both;
}
struct Folded {
  TriangleMesh<double> skin;
  SurfaceTopology topology{static_cast<int>(skin.points.cols()), skin.triangles};
  SurfaceTree<double> tree{skin};
  NearTriangles<double> near{};
  SurfaceIntersection<double> own{};

  MovingSurface<double> now() { return (tree.refit(skin.points), MovingSurface<double>{topology, tree, skin.points}); }
  void find(bool presses = true) {
    near.follow(now(), 0.004);
    own.find_own(now(), near, [=](int, int) { return presses; });
  }
};
template <class Solid>
double energy(Solid const& body) {
  return body.kinetic_energy() + body.potential_energy();
}

}  // namespace

TEST_CASE("two boxes of one surface are in each other by a box, as two surfaces are", "[contact][intersection]") {
  auto const lower = skin_of(make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating));
  for (Place const& at : {Place(0.0211, 0.0132, 0.0253), Place(0.0087, 0.0053, 0.0249), Place(-0.0212, 0.0031, 0.0288)}) {
    auto upper = skin_of(make_block<double>(5, 5, 5, 0.0075, BlockPattern::alternating));
    upper.points.colwise() += at;
    Place const low = at.cwiseMax(0), high = (at + Place::Constant(0.03)).cwiseMin(0.03);
    Folded both{together(lower, upper)};
    both.find();
    REQUIRE(both.own.regions().size() == 1);
    CHECK(both.own.folds() == 0);
    CHECK(both.own.volume() == Approx((high - low).prod()).epsilon(1e-9));
    CHECK((both.own.regions()[0].middle - (low + high) / 2).norm() < 1e-9);
    // The two of them, one beside the other.
    Folded first{lower}, second{upper};
    SurfaceIntersection<double> pair;
    pair.find(first.now(), second.now());
    Matrix3X<double> gradients = Matrix3X<double>::Zero(3, both.skin.points.cols());
    double size = 0;
    for (int side = 0; side < 2; ++side) {
      for (auto const& one : both.own.gradient(side)) gradients.col(one.vertex) += one.gradient;
      for (auto const& one : pair.gradient(side)) gradients.col(one.vertex + (side == 0 ? 0 : lower.points.cols())) -= one.gradient, size = std::max(size, one.gradient.norm());
    }
    CHECK(gradients.cwiseAbs().maxCoeff() < 1e-8 * size);
    both.find(false);
    CHECK(both.own.volume() == 0);
    CHECK(both.own.gradient(0).empty());
  }
}

TEST_CASE("boxes of one surface whose faces and vertices coincide are in each other by a box, too", "[contact][intersection]") {
  auto const lower = skin_of(make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating));
  for (Place const& at : {Place(0.01, 0, 0), Place(0.01, 0.02, 0), Place(0.005, 0.005, 0.02), Place(0, 0, 0.015), Place(0.02, 0.02, 0.02), Place(0, 0, 0)}) {
    auto upper = lower;
    upper.points.colwise() += at;
    Folded both{together(lower, upper)};
    both.find();
    CAPTURE(at.transpose(), both.own.pairs(), both.own.folds());
    CHECK(both.own.volume() == Approx((Place::Constant(0.03) - at).prod()).epsilon(1e-6));
    Place sum = Place::Zero();
    for (int sheet = 0; sheet < 2; ++sheet)
      for (auto const& one : both.own.gradient(sheet)) sum += one.gradient;
    CHECK(sum.norm() < 1e-12 * 0.03 * 0.03);
  }
}

TEST_CASE("a place that is crumpled does not end the contact of another one", "[contact][intersection]") {
  Random random(Seed{3});
  auto const smooth = skin_of(coil(3, 78, 1.3, 0.05, 0.012, 0.009, 0.0023));
  Folded coiled{smooth};
  coiled.find();
  double const volume = coiled.own.volume();
  int crumpled = 0;
  for (int round = 0; round < 100; ++round) {
    Folded one{smooth};
    for (Eigen::Index i = 0; i < one.skin.points.cols(); ++i)
      if (Place const p = smooth.points.col(i); p[0] < -0.045) for (int k = 0; k < 3; ++k) one.skin.points(k, i) += 0.004 * random.uniform(-1.0, 1.0);
    one.find();
    crumpled += one.own.pairs() != coiled.own.pairs() || one.own.folds() > 0 ? 1 : 0;
    CHECK(std::ranges::any_of(one.own.regions(), [&](auto const& region) { return region.volume == Approx(volume).epsilon(1e-9); }));   // beside small ones
  }
  CAPTURE(crumpled);
  CHECK(crumpled > 3);
}

TEST_CASE("what was held back does not throw a body apart as it begins to press", "[contact]") {
  auto const below = block<double>(4, 4, 4, 0.01, {0, 0, 0}), above = block<double>(4, 4, 4, 0.01, {0.0013, 0.0017, 0.031});
  for (double const apart : {0.0, 0.006}) {   // with the second they are neighbours in the rest shape: they press where they are shifted by more
    auto body = solid<double>(together(below, above), SymplecticEuler{}, 1e4, 0, 0);
    for (int i = 0; i < body.size(); ++i) throw_particle(body, i, i < body.size() / 2 ? Place(0, 0, 0) : Place(0.25, 0, -0.25));
    SelfContact contact(body, {.friction = 0, .apart = apart});
    double const h = 5e-5, begun = energy(body);
    double highest = begun;
    int pressed = 0;
    for (int k = 0; k < 4000; ++k) {
      contact.apply(body, h);
      REQUIRE(body.step(h));
      pressed += std::ranges::any_of(contact.regions(), [](auto const& region) { return region.pressure > 0; }) ? 1 : 0;
      highest = std::max(highest, energy(body));
    }
    CAPTURE(apart, pressed, highest / begun);
    CHECK(pressed > 50);
    CHECK(highest < 1.002 * begun);
  }
}

TEST_CASE("a coil whose turns are in each other by a known volume", "[contact][intersection]") {
  double const radius = 0.05, side = 0.012, rise = 0.009, spread = 0.0023, turns = 1.3;
  double const exact = (side - rise) * (side - spread) * 2 * std::numbers::pi * (turns - 1) * (radius + spread * turns / 2);
  double last = 1;
  for (int const segments : {39, 78, 156}) {
    Folded coiled{skin_of(coil(3, segments, turns, radius, side, rise, spread))};
    coiled.find();
    CAPTURE(segments, coiled.own.pairs(), coiled.own.folds());
    REQUIRE(coiled.own.regions().size() == 1);
    double const off = std::abs(coiled.own.volume() / exact - 1);
    CHECK(off < std::max(0.5 * last, 2e-3));
    last = off;
    Place sum = Place::Zero(), moment = Place::Zero();
    for (int sheet = 0; sheet < 2; ++sheet)
      for (auto const& one : coiled.own.gradient(sheet)) sum += one.gradient, moment += Place(coiled.skin.points.col(one.vertex)).cross(one.gradient);
    CHECK(sum.norm() < 1e-12 * side * radius);
    CHECK(moment.norm() < 1e-12 * side * radius * radius);
  }
  CHECK(last < 3e-3);
}

TEST_CASE("which triangles are near does not change what is found", "[contact][intersection]") {
  auto const sunk_by = [](double way) { return skin_of(coil(2, 60, 1.3, 0.05, 0.012, 0.014 - way, 0.001)); };
  Folded kept{sunk_by(0)};
  int met = 0;
  for (int k = 0; k < 60; ++k) {
    kept.skin.points = sunk_by(1e-4 * k).points;
    kept.find();
    Folded fresh{kept.skin};
    fresh.find();
    REQUIRE(kept.own.volume() == fresh.own.volume());
    REQUIRE(kept.own.pairs() == fresh.own.pairs());
    met += kept.own.regions().empty() ? 0 : 1;
  }
  CHECK(met > 30);
  Folded flat{skin_of(make_block<double>(6, 6, 6, 0.01, BlockPattern::alternating))};
  flat.find();
  CHECK(flat.own.visited() == 0);
}

TEMPLATE_TEST_CASE("one body of two pieces is two bodies on one another", "[contact]", LeapfrogVerlet, BackwardEuler) {
  auto const below = block<double>(5, 5, 3, 0.01, {-0.02, -0.02, -0.02});
  auto const above = block<double>(4, 4, 3, 0.01, {-0.0143, -0.0157, 0.0005});
  auto whole = solid<double>(together(below, above), TestType{}, 2e4);
  auto lower = solid<double>(below, TestType{}, 2e4), upper = solid<double>(above, TestType{}, 2e4);
  for (int i = 0; i < lower.size(); ++i)
    if (lower.positions()(2, i) < -0.019) lower.nail(i), whole.nail(i);
  for (auto* one : {&whole, &lower, &upper}) one->set_gravity({0.5, 0, -9.81});
  SelfContact own(whole, {.friction = 0.4});
  BodyContact pair(upper, lower, {.friction = 0.4});
  constexpr bool is_implicit = std::is_same_v<TestType, BackwardEuler>;
  double const h = is_implicit ? 2e-3 : 1e-4, weight = 1000 * 9.81 * 0.03 * 0.03 * 0.02;
  double worst = 0;
  for (double t = 0; t < 0.4; t += h) {
    own.apply(whole, h), pair.apply(upper, lower, h);
    REQUIRE(whole.step(h));
    REQUIRE(upper.step(h));
    REQUIRE(lower.step(h));
    if (t < 0.03) worst = std::max(worst, (whole.positions().rightCols(upper.size()) - upper.positions()).cwiseAbs().maxCoeff());
  }
  REQUIRE(own.regions().size() == 1);
  auto const& region = own.regions()[0];
  CHECK(region.force().dot(Place::UnitZ()) * (region.normal[2] > 0 ? -1 : 1) == Approx(weight).epsilon(0.01));
  CHECK((region.force() * (region.normal[2] > 0 ? 1 : -1) + pair.force()).norm() < 0.01 * weight);   // whichever sheet is its first
  CHECK(worst < (is_implicit ? 1e-6 : 1e-9));
  CHECK((whole.positions().rightCols(upper.size()) - upper.positions()).cwiseAbs().maxCoeff() < 2e-5);
}

TEST_CASE("a bar that folds on itself keeps momentum, makes no energy, and opens again", "[contact][random]") {
  Random random(Seed{5});
  int met = 0, folds = 0;
  double worst_momentum = 0, worst_energy = 0;
  for (int round = 0; round < 4; ++round) {
    // A coil of 0.8 turns whose ends fly towards each other.
    auto body = solid<double>(coil(2, 24, 0.8, 0.03, 0.01, 0.004 * random.uniform(-1.0, 1.0), 0.002), SymplecticEuler{}, 2e4, 0, 0);
    for (int i = 0; i < body.size(); ++i) {
      Place const x = body.positions().col(i);
      double const turn = std::atan2(x[1], x[0]) / std::numbers::pi;   // the gap is at −0.2 π
      double const share = std::clamp(1 - std::abs(turn + 0.2) / 0.6, 0.0, 1.0);
      throw_particle(body, i, Place(0.1, 0, 0.02) + (turn > -0.2 ? -1 : 1) * 2.0 * share * Place(-std::sin(-0.2 * std::numbers::pi), std::cos(-0.2 * std::numbers::pi), 0));
    }
    SelfContact contact(body, {.pressure = 2e4, .friction = round % 2 == 0 ? 0.0 : 0.5});
    double const h = 2e-5, begun = energy(body);
    Place const start = momentum(body);
    for (int k = 0; k < 4000; ++k) {
      contact.apply(body, h);
      REQUIRE(body.step(h));
      folds += contact.intersection().folds();
      if (contact.regions().empty()) worst_energy = std::max(worst_energy, (energy(body) - begun) / begun);
      else ++met;
    }
    CHECK(contact.regions().empty());
    worst_momentum = std::max(worst_momentum, (momentum(body) - start).norm() / start.norm());
  }
  CAPTURE(met, folds, worst_momentum, worst_energy);
  CHECK(met > 400);
  CHECK(folds == 0);
  CHECK(worst_momentum < 1e-11);
  CHECK(worst_energy < 1e-3);
}

TEMPLATE_TEST_CASE("a body in itself goes on as it did after it is restored, and allocates nothing", "[contact]", LeapfrogVerlet, BackwardEuler) {
  REQUIRE(trap_works());
  auto body = solid<double>(coil(2, 40, 1.4, 0.03, 0.01, 0.0103, 0.0007), TestType{}, 8e3);
  for (int i = 0; i < body.size(); ++i)
    if (body.positions()(2, i) < 0.002) body.nail(i);
  body.set_gravity({2, 0, -9.81});
  SelfContact contact(body, {.pressure = 5e3, .friction = 0.4});
  constexpr bool is_implicit = std::is_same_v<TestType, BackwardEuler>;
  double const h = is_implicit ? 2e-3 : 1e-4;
  auto const advance = [&](int steps) {
    for (int k = 0; k < steps; ++k) contact.apply(body, h), body.advance(h);
  };
  advance(is_implicit ? 60 : 1200);
  REQUIRE(!contact.regions().empty());
  auto const saved = body.save();
  auto const anchors = contact.save();
  advance(100);
  Matrix3X<double> const once = body.positions();
  body.restore(saved), contact.restore(anchors, body);
  advance(1);
  AllocationCount const allocations;
  advance(99);
  CHECK(allocations.count() == 0);
  CHECK((body.positions() - once).cwiseAbs().maxCoeff() == 0);
}

TEST_CASE("what SelfContact refuses", "[contact][errors]") {
  auto body = solid<double>(block<double>(3, 3, 3, 0.01, {0, 0, 0}), LeapfrogVerlet{});
  CHECK(unsaid(message_of([&] { SelfContact(body, {.apart = -1}); }), "SelfContact", ".apart", "-1 m") == "");
  CHECK(unsaid(message_of([&] { SelfContact(body, {.depth = 0}); }), "SelfContact", ".depth", "0 m") == "");
  CHECK(unsaid(message_of([&] { SelfContact(body).apply(body, 0); }), "SelfContact", "0 s") == "");
}
