// SPDX-License-Identifier: MIT
// A body in motion whose surface is edited. Yardsticks: momentum and energy before, and a search of all triangles.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "body/random_edits.hpp"
#include "catch.hpp"
#include "collision/brute_force.hpp"

#include <utility>

using namespace palpate;

namespace {

template <class Region = WholeBody>
auto moving_body(TriangleMesh<double> const& mesh, Random& random, Region region = {}, double prestrain = 0.0) {
  SoftBody body(MassSpring<double>(mesh, {.mass = {.total = 0.3},
                                          .link = {.stiffness = 80.0, .damping = 0.02},
                                          .home = {.stiffness = 3.0, .damping = 0.01},
                                          .link_prestrain = prestrain}),
                LeapfrogVerlet{}, region);
  for (int i = 0; i < body.size(); ++i)
    body.apply_force(i, 2.0 * palpate_test::random_in_box<double>(random, 1.0));
  for (int k = 0; k < 10; ++k) body.step(1e-3);
  return body;
}

template <class Body>
void check_search(Body& body, Random& random) {
  auto const mesh = body.mesh();
  for (int k = 0; k < 5; ++k) {
    Vector3<double> const query = palpate_test::random_in_box<double>(random, 0.06);
    auto const nearest = body.nearest_point(query);
    REQUIRE(nearest.found());
    CHECK(nearest.distance == Approx(static_cast<double>(palpate_test::surface_distance(mesh, query))).epsilon(1e-9).margin(1e-12));
    Vector3<double> const foot = body.mesh().points(Eigen::all, mesh.triangles.col(nearest.triangle)) * nearest.barycentric;
    CHECK((foot - nearest.point).norm() < 1e-12);
    int const vertex = palpate_test::nearest_used_vertex(mesh, query);
    CHECK((mesh.points.col(body.nearest_vertex(query)) - query).norm() == Approx((mesh.points.col(vertex) - query).norm()).epsilon(1e-12));
  }
}

}  // namespace

TEST_CASE("edits of a moving body keep its momentum and put no energy of motion in") {
  Random random(Seed{21});
  for (auto const& mesh : {make_grid<double>(6, 5, 0.01), make_sphere<double>(0.05, 3)}) {
    auto body = moving_body(mesh, random);
    for (int k = 0; k < 40; ++k) {
      Vector3<double> const momentum = body.momentum();
      double const motion = body.kinetic_energy();
      auto const& surface = body.tissue().surface();
      std::size_t const revision = body.topology_revision();
      if (k % 5 == 4) {
        auto const [p, copy] = palpate_test::random_split(body, surface, random);
        CHECK(body.positions().col(copy) == body.positions().col(p));
        CHECK(body.velocities().col(copy) == body.velocities().col(p));
        CHECK(body.reference_position(copy) == body.reference_position(p));
        CHECK(body.kinetic_energy() == Approx(motion).epsilon(1e-12));
      } else {
        palpate_test::random_insertion(body, surface, random);
        CHECK(body.kinetic_energy() <= motion * (1 + 1e-12));
      }
      CHECK(body.topology_revision() > revision);
      CHECK((body.momentum() - momentum).norm() < 1e-12 * (1 + momentum.norm()));
      CHECK(body.total_mass() == Approx(0.3).epsilon(1e-12));
      if (k % 4 == 0) check_search(body, random);
      body.step(1e-5);
      CHECK(body.positions().allFinite());
    }
    check_search(body, random);
  }
}

TEST_CASE("a particle is inserted where the surface is, not where it was") {
  Random random(Seed{22});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  auto const c = body.tissue().surface().corners(7);
  Vector3<double> const expected = 0.2 * body.positions().col(c[0]) + 0.3 * body.positions().col(c[1]) + 0.5 * body.positions().col(c[2]);
  Vector3<double> const speed = 0.2 * body.velocities().col(c[0]) + 0.3 * body.velocities().col(c[1]) + 0.5 * body.velocities().col(c[2]);
  int const n = body.insert_in_triangle(7, {0.2, 0.3, 0.5});
  CHECK((body.positions().col(n) - expected).norm() < 1e-15);
  CHECK((body.velocities().col(n) - speed).norm() < 1e-15);
  Vector3<double> const home = 0.2 * body.reference_position(c[0]) + 0.3 * body.reference_position(c[1]) + 0.5 * body.reference_position(c[2]);
  CHECK((body.reference_position(n) - home).norm() < 1e-15);
}

TEST_CASE("merging a split keeps momentum, mass and the force applied") {
  Random random(Seed{23});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  for (int k = 0; k < 20; ++k) {
    int const size = body.size();
    auto const [p, copy] = palpate_test::random_split(body, body.tissue().surface(), random);
    body.apply_force(copy, {0.0, 0.0, 1.0});
    body.step(1e-5);   // the lips part
    body.apply_force(copy, {0.5, 0.0, 0.0});
    Vector3<double> const momentum = body.momentum();
    double const motion = body.kinetic_energy();
    body.merge_last_particle(p);
    CHECK(body.size() == size);
    CHECK((body.momentum() - momentum).norm() < 1e-14);
    CHECK(body.kinetic_energy() <= motion * (1 + 1e-12));
    check_search(body, random);
    body.step(0.0);   // consumes the force
    CHECK((body.reaction(p) + body.tissue().internal_force(p, body.positions(), body.velocities()) + Vector3<double>(0.5, 0, 0)).norm() < 1e-12);
    body.step(0.0);
    CHECK((body.reaction(p) + body.tissue().internal_force(p, body.positions(), body.velocities())).norm() < 1e-12);
  }
}

TEST_CASE("a temporary particle follows its triangle and passes forces on to its corners") {
  Random random(Seed{24});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  auto twin = body;
  auto const c = body.tissue().surface().corners(9);
  auto const id = body.insert_temporary(9, {0.5, 0.2, 0.3});
  int const n = body.temporary_particle(id);
  CHECK(n == 30);
  CHECK(body.is_temporary(n));
  CHECK_THROWS_WITH(body.hold(n), says("particle 30", "cut in progress"));
  CHECK(body.save().tissue.size() == 31);
  for (int k = 0; k < 50; ++k) {
    body.apply_force(n, {0.1, 0.0, -0.5});
    for (std::size_t corner = 0; corner < 3; ++corner)
      twin.apply_force(c[corner], Vector3<double>(0.1, 0.0, -0.5) * std::array{0.5, 0.2, 0.3}[corner]);
    body.step(1e-3);
    twin.step(1e-3);
  }
  CHECK((body.positions().leftCols(30) - twin.positions()).cwiseAbs().maxCoeff() < 1e-13);   // it has no mass and no springs
  Vector3<double> const place = 0.5 * body.positions().col(c[0]) + 0.2 * body.positions().col(c[1]) + 0.3 * body.positions().col(c[2]);
  CHECK((body.positions().col(n) - place).norm() < 1e-14);
  check_search(body, random);
  body.remove_temporary(id);
  CHECK(body.temporary_particle(id) == -1);
  CHECK(body.size() == 30);
  CHECK(body.triangles() == twin.triangles());
  check_search(body, random);
}

TEST_CASE("a slit in a stretched sheet opens by itself, in a zone too, and far from any touch") {
  auto const skin = make_grid<double>(9, 9, 0.01);
  auto const opening = [&](auto region, double& settled) {
    MassSpring<double> tissue(skin, {.mass = {.total = 0.3}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 1.0, .damping = 0.05}, .link_prestrain = 0.1});
    tissue.nail(boundary_vertices(skin));
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, region);
    // 39 – 40 – 41 in the middle row: the middle one gets a copy, the ends stay.
    std::vector<int> above;
    for (int const t : palpate_test::ordered_fan(body.tissue().surface(), 40)) {
      Vector3<double> centre = Vector3<double>::Zero();
      for (int const corner : body.tissue().surface().corners(t)) centre += body.reference_position(corner) / 3;
      if (centre.y() > body.reference_position(40).y()) above.push_back(t);
    }
    int const copy = body.split_particle(40, above);
    int last = -1;
    for (int k = 0; k < 20000; ++k) last = body.step(2e-4).moving;
    CHECK(body.velocities().cwiseAbs().maxCoeff() < 1e-6);
    settled = static_cast<double>(last);
    double const wide = (body.positions().col(copy) - body.positions().col(40)).norm();
    body.reset();   // the home shape is closed, and opens again
    CHECK((body.positions().col(copy) - body.positions().col(40)).norm() == 0);
    for (int k = 0; k < 20000; ++k) body.step(2e-4);
    CHECK((body.positions().col(copy) - body.positions().col(40)).norm() > 0.9 * wide);
    return wide;
  };
  double moving_whole = 0, moving_zone = 0;
  double const whole = opening(WholeBody{}, moving_whole);
  double const zone = opening(ZoneOfInfluence{.rings = 2}, moving_zone);
  CHECK(whole > 1e-4);
  CHECK(zone > 0.3 * whole);   // only the slit's own neighbours move in the zone
  CHECK(moving_zone == 0);
}

TEST_CASE("an edge whose triangle on one side hangs on a copy for the eye can be divided") {
  // A blade has come along the edge p–q to p, and divides a triangle with that edge: the part at the edge hangs on a copy of p, so that the
  // wound is open up to the blade. Then the edge is a border of the triangle on its other side, and only that one is divided.
  Random random(Seed{25});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  auto const& surface = body.tissue().surface();
  int const p = 14, q = 15, host = surface.triangle_with_edge(p, q);   // in the middle
  REQUIRE(surface.triangles_at(p).size() == 6);
  int const copy = body.split_particle(p, {});
  auto const id = body.insert_temporary(host, {0.4, 0.3, 0.3});
  body.change_corner(surface.triangle_with_edge(p, q), p, copy);
  REQUIRE(surface.triangle_with_edge(p, q) < 0);
  REQUIRE(surface.triangle_with_edge(copy, q) >= 0);
  auto const triangles = body.triangles().cols();
  int const n = body.insert_on_edge(p, q, 0.25);
  CHECK(body.triangles().cols() == triangles + 1);
  CHECK(surface.triangles_at(n).size() == 2);
  CHECK(surface.triangle_with_edge(copy, q) >= 0);
  CHECK(body.take_kept(id) >= 0);   // the particle at the blade stays
  CHECK(body.temporary_count() == 0);
  CHECK(testing::to_text(testing::CutInvariants(body).check(body)) == "");
  check_search(body, random);
}
