// SPDX-License-Identifier: MIT
// The zone of influence. Yardsticks: the whole body, the undeformed shape, rings counted by hand.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>

#include "body/naive_twin.hpp"
#include "body/random_edits.hpp"
#include "catch.hpp"

#include <set>
#include <span>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::GridScene;

namespace {

/// The thesis's second scene: 20 × 20 particles, 1 kg, its border nailed.
template <class S = double>
auto square(int rings) {
  auto const skin = make_grid<S>(20, 20, S(1));
  MassSpring<S> tissue(skin, {.mass = {.total = S(1), .lumping = Lumping::equal},
                              .link = {.stiffness = S(2), .damping = S(0.05)},
                              .home = {.stiffness = S(1), .damping = S(0.05)}});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = rings});
}

constexpr double h = 1e-3;
int at(int i, int j) { return 20 * j + i; }

template <class Body>
double farthest_from_home(Body const& body) {
  return double((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff());
}

template <class Body>
int press(Body& body, int particle, double seconds, double force = -2.0) {
  using S = typename Body::Scalar;
  int moving = 0;
  for (int k = 0; k < static_cast<int>(seconds / h); ++k) {
    body.apply_force(particle, {S(0), S(0), S(force)});
    auto const report = body.step(S(h));
    REQUIRE(report.status == StepStatus::ok);
    moving = report.moving;
  }
  return moving;
}

/// Steps without touch until nothing moves; returns the seconds that took, or −1.
template <class Body>
double let_go(Body& body, double at_most) {
  using S = typename Body::Scalar;
  for (int k = 0; k < static_cast<int>(at_most / h); ++k)
    if (body.step(S(h)).moving == 0) return k * h;
  return -1;
}

}  // namespace

TEST_CASE("two rings are nineteen particles, and nobody else moves by a bit") {
  auto body = square(2);
  CHECK(body.step(h).moving == 0);
  CHECK(press(body, at(9, 9), 1.0) == 19);
  std::set<int> const inside = [] {   // by hand: (i, j) with neighbours ±(1, 0), ±(0, 1), ±(1, 1)
    std::set<int> zone{at(9, 9)};
    for (int ring = 0; ring < 2; ++ring)
      for (int const p : std::set<int>(zone))
        for (int const step : {1, 20, 21}) zone.insert(p + step), zone.insert(p - step);
    return zone;
  }();
  REQUIRE(inside.size() == 19);
  auto const rest = body.rest_mesh().points;
  for (int i = 0; i < body.size(); ++i) {
    if (inside.count(i) > 0) {
      CHECK(body.displacement(i).norm() > 0);
    } else {
      CHECK(body.positions().col(i) == rest.col(i));
      CHECK(body.velocities().col(i).norm() == 0);
    }
  }
}

TEST_CASE("after the release a zone comes home, empties and costs nothing") {
  auto body = square(2);
  press(body, at(9, 9), 3.0);
  CHECK(body.step(h).moving == 19);
  CHECK(let_go(body, 60.0) > 0);
  CHECK(farthest_from_home(body) < 2e-5);
  CHECK(body.velocities().cwiseAbs().maxCoeff() == 0);
  auto const resting = body.positions().eval();
  CHECK(body.step(h).moving == 0);
  CHECK(body.positions() == resting);
}

TEST_CASE("a touch that jumps leaves nothing frozen deformed") {
  auto body = square(1);
  // Held long next to the first place: the particles between are then in balance, deformed, outside the rings.
  press(body, at(8, 8), 5.0);
  press(body, at(10, 8), 40.0);
  CHECK(std::abs(body.displacement(at(9, 8)).z()) > 0.05);
  CHECK(let_go(body, 100.0) > 0);
  CHECK(farthest_from_home(body) < 2e-5);

  Random random(Seed{31});
  for (int k = 0; k < 60; ++k) press(body, static_cast<int>(random.below(400)), 0.15, -3.0);
  CHECK(farthest_from_home(body) > 0.01);
  CHECK(let_go(body, 100.0) > 0);
  CHECK(farthest_from_home(body) < 2e-5);
}

TEST_CASE("a held copy that is joined again holds no zone, whoever gets its number") {
  auto body = square(2);
  int const copy = body.split_particle(at(9, 9), std::span<int const>(palpate_test::ordered_fan(body.tissue().surface(), at(9, 9))).first(2));
  body.hold(copy);
  body.merge_last_particle(at(9, 9));
  REQUIRE(body.insert_in_triangle(0, {0.3, 0.3, 0.4}) == copy);
  CHECK_FALSE(body.is_held(copy));
  CHECK(let_go(body, 60.0) >= 0);
}

TEST_CASE("a stroke leaves a trail that closes behind the tool") {
  auto body = square(2);
  int largest = 0;
  for (int i = 3; i < 17; ++i) largest = std::max(largest, press(body, at(i, 9), 2.0));
  CHECK(largest > 19);
  CHECK(largest < 190);   // not the whole length of the stroke times its width of five, and more
  CHECK(let_go(body, 100.0) > 0);
  CHECK(farthest_from_home(body) < 2e-5);
}

TEST_CASE("a zone as large as the body is the body, to the last bit") {
  auto zone = square(40);
  SoftBody whole(zone.tissue(), LeapfrogVerlet{}, WholeBody{});
  for (int k = 0; k < 2000; ++k) {
    Vector3<double> const force(0.1, 0.0, -2.0);
    zone.apply_force(at(9, 9), force);
    whole.apply_force(at(9, 9), force);
    CHECK(zone.step(h).moving == whole.step(h).moving);
  }
  CHECK(zone.positions() == whole.positions());
  CHECK(zone.velocities() == whole.velocities());
}

TEST_CASE("what a zone leaves out is small, and less with every ring") {
  SoftBody whole(square(1).tissue(), LeapfrogVerlet{}, WholeBody{});
  press(whole, at(9, 9), 4.0);
  double const depth = -whole.displacement(at(9, 9)).z();
  double last = depth;
  for (int const rings : {1, 2, 3, 5, 8}) {
    auto zone = square(rings);
    press(zone, at(9, 9), 4.0);
    double const error = (zone.positions() - whole.positions()).cwiseAbs().maxCoeff();
    CAPTURE(rings, error, depth);
    CHECK(error < 0.6 * last);
    last = error;
  }
  CHECK(last < 1e-3 * depth);
}

TEST_CASE("two hands make two zones") {
  auto body = square(1);
  for (int k = 0; k < 100; ++k) {
    body.apply_force(at(4, 4), {0.0, 0.0, -1.0});
    body.apply_force(at(14, 14), {0.0, 0.0, 1.0});
    CHECK(body.step(h).moving == 14);
  }
  CHECK(body.displacement(at(4, 4)).z() < 0);
  CHECK(body.displacement(at(14, 14)).z() > 0);
}

TEST_CASE("a zone in float empties too, as near to home as its digits allow") {
  auto body = square<float>(2);
  press(body, at(9, 9), 2.0);
  press(body, at(11, 9), 2.0);
  CHECK(let_go(body, 100.0) > 0);
  CHECK(farthest_from_home(body) < 5e-3);
}

TEST_CASE("settled tissue with pre-tension sleeps in its zone and comes back to its own home") {
  GridScene const scene{.nx = 14, .ny = 12, .home_damping = 0.05, .prestrain = 0.05, .nails = {0, 13, 154, 167, 80}};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  CHECK(body.step(1e-4).moving == 0);
  for (int round = 0; round < 3; ++round)
    for (int k = 0; k < 500; ++k) {
      body.apply_force(47 + 2 * round, {0.0, 0.0, -0.1});
      body.step(1e-4);
    }
  int moving = 1;
  for (int k = 0; k < 100000 && moving > 0; ++k) moving = body.step(1e-4).moving;
  CHECK(moving == 0);
  double most = 0;
  for (int i = 0; i < body.size(); ++i) most = std::max(most, (body.positions().col(i) - body.reference_position(i)).norm());
  CHECK(most < 3e-5 * scene.spacing);
}

TEST_CASE("two tools that meet and part again leave nothing deformed, not even while they stay") {
  auto body = square(2);
  for (int const gap : {8, 5, 2, 1, 2, 5, 8}) {   // particles between them
    for (int k = 0; k < 1500; ++k) {
      body.apply_force(at(9 - gap / 2, 9), {0.0, 0.0, -2.0});
      body.apply_force(at(9 - gap / 2 + gap, 9), {0.5, 0.0, 1.5});
      REQUIRE(body.step(h).moving >= 19);
    }
  }
  int moving = 0;
  for (int k = 0; k < 60000; ++k) {   // what they left between them comes to balance while they stay
    body.apply_force(at(5, 9), {0.0, 0.0, -2.0});
    body.apply_force(at(13, 9), {0.5, 0.0, 1.5});
    moving = body.step(h).moving;
  }
  CHECK(moving >= 38);
  CHECK(moving < 80);
  SoftBody whole(body.tissue(), LeapfrogVerlet{}, WholeBody{});
  whole.apply_force(at(5, 9), {0.0, 0.0, -2.0});
  whole.apply_force(at(13, 9), {0.5, 0.0, 1.5});
  whole.solve_statics();
  CHECK((body.positions() - whole.positions()).colwise().norm().maxCoeff() < 3 * body.truncation_error());
  CHECK(let_go(body, 100.0) > 0);
  CHECK(farthest_from_home(body) < 2e-5);
}

TEST_CASE("two far touches are each as they would be alone") {
  auto both = square(2), left = square(2), right = square(2);
  for (int k = 0; k < 2000; ++k) {
    for (auto* body : {&both, &left}) body->apply_force(at(4, 9), {0.0, 0.3, -2.0});
    for (auto* body : {&both, &right}) body->apply_force(at(14, 9), {0.0, 0.0, -1.0});
    CHECK(both.step(h).moving == 38);
    left.step(h), right.step(h);
  }
  CHECK((both.displacement(at(4, 9)) - left.displacement(at(4, 9))).norm() < 1e-12);
  CHECK((both.displacement(at(14, 9)) - right.displacement(at(14, 9))).norm() < 1e-12);
}

TEST_CASE("one of two touches ends: its part comes home, the other goes on") {
  auto body = square(2);
  int moving = 0;
  for (int k = 0; k < 3000; ++k) {
    body.apply_force(at(4, 9), {0.0, 0.0, -2.0});
    body.apply_force(at(14, 9), {0.0, 0.0, -2.0});
    body.step(h);
  }
  for (int k = 0; k < 60000; ++k) {
    body.apply_force(at(4, 9), {0.0, 0.0, -2.0});
    moving = body.step(h).moving;
  }
  CHECK(moving == 19);
  CHECK(body.displacement(at(14, 9)).norm() < 2e-5);
  CHECK(body.displacement(at(4, 9)).z() < -0.1);
}

namespace {

/// Counts what is asked of the tissue.
class Counting : public MassSpring<double> {
 public:
  static inline long questions = 0;
  using MassSpring<double>::MassSpring;
  double mass(int i) const { return ++questions, MassSpring::mass(i); }
  bool nailed(int i) const { return ++questions, MassSpring::nailed(i); }
  Vector3<double> rest_position(int i) const { return ++questions, MassSpring::rest_position(i); }
  double stiffness_bound(int i) const { return ++questions, MassSpring::stiffness_bound(i); }
  template <class X>
  double stiffness_bound(int i, X const& x) const { return ++questions, MassSpring::stiffness_bound(i, x); }
  double damping_bound(int i) const { return ++questions, MassSpring::damping_bound(i); }
  HomeSpring<double> home(int i) const { return ++questions, MassSpring::home(i); }
  template <class X, class V>
  Vector3<double> internal_force(int i, X const& x, V const& v) const { return ++questions, MassSpring::internal_force(i, x, v); }
  template <class Visit>
  void for_each_neighbour(int i, Visit visit) const {
    ++questions;
    MassSpring::for_each_neighbour(i, visit);
  }
  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }
};

/// Questions after the first step: a touch that stays, one that wanders, and a release.
std::vector<long> questions_in_a_zone(int n, ZoneOfInfluence zone) {
  Counting tissue(make_grid<double>(n, n, 1.0), {.mass = {.total = n * n / 512.0, .lumping = Lumping::equal},
                                                 .link = {.stiffness = 2.0, .damping = 0.05},
                                                 .home = {.stiffness = 1.0, .damping = 0.05}});
  SoftBody body(std::move(tissue), LeapfrogVerlet{}, zone);
  body.step(h);
  std::vector<long> counts;
  for (int const stride : {0, 1}) {
    long const before = Counting::questions;
    for (int k = 0; k < 200; ++k) {
      body.apply_force(n * 8 + 8 + stride * (k / 40), {0.0, 0.0, -0.5});
      body.step(h);
    }
    counts.push_back(Counting::questions - before);
  }
  long const before = Counting::questions;
  for (int k = 0; k < 200; ++k) body.step(h);
  counts.push_back(Counting::questions - before);
  return counts;
}

}  // namespace

TEST_CASE("a step in a zone asks as much of a body of 400 particles as of one of 40,000") {
  for (ZoneOfInfluence const& zone : {ZoneOfInfluence{.rings = 2}, ZoneOfInfluence{.rings = 2, .tolerance = 0.01}}) {
    auto const small = questions_in_a_zone(20, zone);
    auto const large = questions_in_a_zone(200, zone);   // its mean edge, what is small is counted in, differs by 1 %
    for (std::size_t k = 0; k < small.size(); ++k) CHECK(double(large[k]) == Approx(double(small[k])).epsilon(0.01));
    CHECK(small[0] < 200 * (zone.tolerance > 0 ? 800 : 200));
  }
}
