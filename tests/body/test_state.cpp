// SPDX-License-Identifier: MIT
// Save, restore and reset. Yardstick: a run that was never interrupted, to the last bit.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>

#include "body/naive_twin.hpp"
#include "body/random_edits.hpp"
#include "catch.hpp"

#include <span>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::GridScene;

namespace {

template <class Body>
void play(Body& body, int from, int to) {
  for (int k = from; k < to; ++k) {
    body.apply_force(20 + k % 7, {0.1, -0.05, -0.3});
    if (k % 40 == 10) body.drag(33, body.positions().col(33) + Vector3<double>(0, 0, 1e-3), {0, 0, 0.1});
    if (k % 40 == 30) body.release(33);
    body.step(1e-4);
  }
}

template <class Body>
void check_same(Body const& a, Body const& b) {
  CHECK(a.size() == b.size());
  CHECK(a.positions() == b.positions());
  CHECK(a.velocities() == b.velocities());
  CHECK(a.time() == b.time());
  CHECK(a.triangles() == b.triangles());
  for (int i = 0; i < a.size(); ++i) {
    CHECK(a.reaction(i) == b.reaction(i));
    CHECK(a.is_held(i) == b.is_held(i));
  }
}

}  // namespace

TEMPLATE_PRODUCT_TEST_CASE("a restored body goes on as if nothing had been", "", std::pair,
                           ((LeapfrogVerlet, WholeBody), (LeapfrogVerlet, ZoneOfInfluence), (RungeKutta4, ZoneOfInfluence))) {
  GridScene const scene{.nx = 10, .ny = 8, .prestrain = 0.02, .nails = palpate_test::grid_border(10, 8)};
  SoftBody body(scene.tissue(), typename TestType::first_type{}, typename TestType::second_type{});
  for (int const moment : {0, 7, 15, 120}) {   // at rest, moving, held, later
    play(body, 0, moment);
    body.apply_force(50, {0.0, 0.3, 0.0});   // waits for the next step
    auto const saved = body.save();
    SoftBody straight = body;
    play(straight, moment, moment + 60);
    play(body, 500, 533);
    Random random(Seed{5});
    palpate_test::random_split(body, body.tissue().surface(), random);
    palpate_test::random_insertion(body, body.tissue().surface(), random);
    body.set_gravity({0.0, 0.0, -3.0});
    body.nail(41);
    play(body, 600, 650);
    body.restore(saved);
    CHECK(body.nearest_vertex({0.031, 0.041, 0.0}) == straight.nearest_vertex({0.031, 0.041, 0.0}));
    play(body, moment, moment + 60);
    check_same(body, straight);
    SoftBody fresh(scene.tissue(), typename TestType::first_type{}, typename TestType::second_type{});
    fresh.restore(saved);
    play(fresh, moment, moment + 60);
    check_same(fresh, straight);
  }
}

// Lips that are parted and joined again between two steps: what moved in the last step may be gone, what the edits have disturbed has not moved yet.
TEST_CASE("a body restored between edits and the next step goes on as if nothing had been") {
  GridScene const scene{.nx = 10, .ny = 8, .prestrain = 0.02, .nails = palpate_test::grid_border(10, 8)};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{});
  play(body, 0, 35);
  auto const part = [&](int p) {
    return body.split_particle(p, std::span<int const>(palpate_test::ordered_fan(body.tissue().surface(), p)).first(2));
  };
  int const copy = part(24);
  play(body, 35, 36);   // it moves
  body.hold(copy);
  body.merge_last_particle(24);
  int const inserted = body.insert_in_triangle(body.tissue().surface().triangle_count() - 1, {0.3, 0.3, 0.4});   // far from what is touched
  REQUIRE(inserted == copy);
  part(44), part(54);
  body.merge_last_particle(54), body.merge_last_particle(44);
  SoftBody straight = body;
  auto const saved = body.save();
  play(straight, 36, 100);
  body.restore(saved);
  play(body, 36, 100);
  check_same(body, straight);
}

TEST_CASE("a zone that adapts to its error goes on from a restore as it would have") {
  GridScene const scene{.nx = 16, .ny = 14, .nails = palpate_test::grid_border(16, 14)};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1, .tolerance = 1e-4});
  for (int k = 0; k < 20; ++k) {
    auto const saved = body.save();
    SoftBody straight = body, fresh(scene.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1, .tolerance = 1e-4});
    fresh.restore(saved);
    CHECK(fresh.truncation_error() == straight.truncation_error());
    play(straight, k, k + 30);
    play(fresh, k, k + 30);
    CAPTURE(k);
    check_same(fresh, straight);
    play(body, k, k + 1);
  }
}

TEST_CASE("what a restored body says of its stable step is what it would have said") {
  GridScene const scene{.nx = 10, .ny = 8, .prestrain = 0.02, .nails = palpate_test::grid_border(10, 8)};
  SoftBody body(scene.tissue(), LeapfrogVerlet{}, WholeBody{});
  auto const say = [&](int from, int to) {
    std::vector<double> said;
    for (int k = from; k < to; ++k) {
      play(body, k, k + 1);
      if (body.stable_step_fell()) said.push_back(k);
      if (k % 20 == 0) said.push_back(body.stable_step());
      said.push_back(static_cast<double>(body.advance(2.7 * said[0], {.most = 9}).steps));
    }
    return said;
  };
  say(0, 50);
  auto const saved = body.save();
  auto const said = say(60, 200);
  say(0, 30);   // another past
  body.restore(saved);
  CHECK(say(60, 200) == said);
}

TEMPLATE_TEST_CASE("a reset body is as new", "", WholeBody, ZoneOfInfluence) {
  GridScene const scene{.nx = 10, .ny = 8, .prestrain = 0.02, .nails = palpate_test::grid_border(10, 8)};
  SoftBody fresh(scene.tissue(), LeapfrogVerlet{}, TestType{});
  SoftBody used = fresh;
  play(used, 0, 55);
  CHECK(used.is_held(33));
  used.apply_force(3, {1.0, 1.0, 1.0});
  used.reset();
  check_same(used, fresh);
  play(used, 0, 100);
  play(fresh, 0, 100);
  check_same(used, fresh);
}

TEST_CASE("a copy is a body of its own") {
  SoftBody body(GridScene{}.tissue(), LeapfrogVerlet{}, WholeBody{});
  SoftBody copy = body;
  copy.apply_force(7, {0.0, 0.0, -1.0});
  copy.step(1e-4);
  CHECK(body.displacement(7).norm() == 0);
  CHECK(copy.displacement(7).norm() > 0);
}
