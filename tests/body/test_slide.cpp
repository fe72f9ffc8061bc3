// SPDX-License-Identifier: MIT
// A particle that slides over the surface of a moving body. Yardsticks: momentum and energy of motion before, the weighted mean of the
// triangle's corners, and a search of all triangles.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "body/random_edits.hpp"
#include "catch.hpp"
#include "collision/brute_force.hpp"

using namespace palpate;

namespace {

auto body_in_motion(Random& random, double prestrain) {
  SoftBody body(MassSpring<double>(make_sphere<double>(0.05, 3), {.mass = {.total = 0.3},
                                                                   .link = {.stiffness = 80.0, .damping = 0.02},
                                                                   .home = {.stiffness = 3.0, .damping = 0.01},
                                                                   .link_prestrain = prestrain}),
                LeapfrogVerlet{}, WholeBody{});
  for (int i = 0; i < body.size(); ++i) body.apply_force(i, 2.0 * palpate_test::random_in_box<double>(random, 1.0));
  for (int k = 0; k < 10; ++k) body.step(1e-3);
  return body;
}

}  // namespace

TEST_CASE("a particle slides to another point of the same surface, now, at home and undeformed") {
  Random random(Seed{31});
  auto body = body_in_motion(random, GENERATE(0.0, 0.05));
  for (int k = 0; k < 30; ++k) {
    int const p = static_cast<int>(random.below(static_cast<std::uint64_t>(body.size())));
    int const t = body.tissue().surface().triangles_at(p).front();
    auto const c = body.tissue().surface().corners(t);
    Vector3<double> w(0.2, 0.2, 0.2);
    w[body.tissue().surface().corner_of(t, p)] = 0.6;
    auto const mean = [&](auto const& at) { return Vector3<double>(w[0] * at(c[0]) + w[1] * at(c[1]) + w[2] * at(c[2])); };
    Vector3<double> const now = mean([&](int i) { return Vector3<double>(body.positions().col(i)); });
    Vector3<double> const home = mean([&](int i) { return body.reference_position(i); });
    Vector3<double> const rest = mean([&](int i) { return body.tissue().rest_position(i); });
    Vector3<double> const momentum = body.momentum();
    double const motion = body.kinetic_energy(), mass = body.total_mass();
    std::size_t const revision = body.topology_revision();
    if (k % 2 == 0) body.nearest_vertex(now);   // the tree is fitted, or not
    body.slide_particle(p, t, w);
    CHECK((body.positions().col(p) - now).norm() < 1e-15);
    CHECK((body.reference_position(p) - home).norm() < 1e-15);
    CHECK((body.tissue().rest_position(p) - rest).norm() < 1e-15);
    CHECK(body.reference_normal(p).norm() == Approx(1.0));
    CHECK(body.topology_revision() != revision);
    CHECK(body.momentum() == momentum);
    CHECK(body.kinetic_energy() == motion);
    CHECK(body.total_mass() == mass);
    auto const mesh = body.mesh();
    Vector3<double> const query = palpate_test::random_in_box<double>(random, 0.06);
    CHECK(body.nearest_point(query).distance == Approx(static_cast<double>(palpate_test::surface_distance(mesh, query))).epsilon(1e-9));
    REQUIRE(body.step(0.5 * body.stable_step()));
  }
}

TEST_CASE("a body whose particle has slid is stepped as one that was built so") {
  // Without pre-tension both start at rest; the masses are set alike, since a slide does not share them anew.
  auto mesh = make_sphere<double>(0.05, 3);
  MassSpring<double>::Options const options{.mass = {.total = 0.3, .lumping = Lumping::equal}, .link = {.stiffness = 80.0, .damping = 0.02}};
  SoftBody slid(MassSpring<double>(mesh, options), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 3});
  int const t = slid.tissue().surface().triangles_at(5).front();
  Vector3<double> w(0.15, 0.15, 0.15);
  w[slid.tissue().surface().corner_of(t, 5)] = 0.7;
  slid.apply_force(5, {0.0, 0.0, 0.1});
  slid.step(1e-4);
  auto const before = slid.save();
  slid.reset();
  slid.slide_particle(5, t, w);
  mesh.points.col(5) = slid.tissue().rest_position(5);
  SoftBody built(MassSpring<double>(mesh, options), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 3});
  for (int k = 0; k < 50; ++k)
    for (auto* const body : {&slid, &built}) {
      body->apply_force(5, {0.0, 0.0, 0.2});
      REQUIRE(body->step(2e-4));
    }
  CHECK((slid.positions() - built.positions()).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(slid.stable_step() == Approx(built.stable_step()).epsilon(1e-3));
  slid.restore(before);
  CHECK(slid.tissue().rest_position(5) == make_sphere<double>(0.05, 3).points.col(5));
}
