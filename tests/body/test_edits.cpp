// SPDX-License-Identifier: MIT
// A body in motion whose surface is edited. Yardsticks: momentum and energy before, and a search of all triangles.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "body/random_edits.hpp"
#include "catch.hpp"
#include "collision/brute_force.hpp"

#include <algorithm>
#include <array>
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

// Yardsticks: a twin without it, and the surface that it divides.
TEST_CASE("a temporary subdivision is drawn, and the body moves as without it") {
  Random random(Seed{24});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  auto twin = body;
  auto const c = body.tissue().surface().corners(9);
  auto const id = body.insert_temporary(9, {0.5, 0.2, 0.3}, 0, {c[0], c[0]});
  CHECK(body.topology_revision() > twin.topology_revision());   // what is drawn has changed
  CHECK(body.save().tissue.size() == 31);                       // saved as if the cut ended here
  for (int k = 0; k < 50; ++k) {
    for (auto* one : {&body, &twin}) one->apply_force(c[0], {0.1, 0.0, -0.5}), one->step(1e-3);
  }
  CHECK(body.positions() == twin.positions());
  CHECK(body.triangles() == twin.triangles());
  CHECK(body.mesh().points.cols() == 30);
  for (Vector3<double> const& w : {Vector3<double>(0.5, 0.2, 0.3), Vector3<double>(0.1, 0.1, 0.8)}) {
    body.move_temporary(id, w);
    auto const drawn = body.drawn_mesh();
    REQUIRE(drawn.points.cols() == 31);
    REQUIRE(drawn.triangles.cols() == twin.triangles().cols() + 2);
    CHECK((drawn.points.col(30) - body.mesh().points(Eigen::all, body.triangles().col(9)) * w).norm() < 1e-15);
    CHECK(surface_area(drawn) == Approx(surface_area(twin.mesh())).epsilon(1e-13));
    CHECK(validate(drawn).size() == validate(twin.mesh()).size());
    Matrix3X<double> speeds;
    body.draw_columns(body.velocities(), speeds);
    CHECK((speeds.col(30) - body.velocities()(Eigen::all, body.triangles().col(9)) * w).norm() < 1e-15);
  }
  check_search(body, random);
  body.remove_temporary(id);
  CHECK(body.find_temporary(id) == nullptr);
  CHECK(body.take_kept(id) == -1);
  CHECK(body.drawn_mesh().triangles == twin.triangles());
}

TEST_CASE("a temporary subdivision is drawn open where its cut has opened the corner") {
  Random random(Seed{26});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  auto const& surface = body.tissue().surface();
  int const p = 14, host = surface.triangle_with_edge(14, 15);   // in the middle
  auto const around = palpate_test::ordered_fan(surface, p);
  auto const at = static_cast<std::size_t>(std::find(around.begin(), around.end(), host) - around.begin());
  int const beside = surface.triangle_with_edge(15, 14) == around[(at + 1) % 6] ? around[(at + 1) % 6] : around[(at + 5) % 6];   // on the right
  int const copy = body.split_particle(p, std::array{beside});
  auto const id = body.insert_temporary(host, {0.4, 0.3, 0.3}, surface.corner_of(host, p), {p, copy});
  body.apply_force(copy, {0.3, -0.5, 0.2});
  for (int k = 0; k < 10; ++k) body.step(1e-3);
  REQUIRE((body.positions().col(copy) - body.positions().col(p)).norm() > 1e-4);
  auto const drawn = body.drawn_mesh();
  int const blade = body.size();
  // Both lips end at the blade, which lies between the copies; by hand.
  Vector3<double> expected = Vector3<double>::Zero();
  for (int k = 0; k < 3; ++k) {
    int const corner = surface.corners(host)[static_cast<std::size_t>(k)];
    double const w = corner == p ? 0.2 : 0.3;
    expected += w * body.positions().col(corner);
    if (corner == p) expected += w * body.positions().col(copy);
  }
  CHECK((drawn.points.col(blade) - expected).norm() < 1e-15);
  SurfaceTopology const shown(blade + 1, drawn.triangles);
  CHECK(shown.triangle_with_edge(copy, 15) >= 0);   // the part on the right is at the copy, beside the triangle that was split off
  CHECK(shown.triangle_with_edge(15, copy) == beside);
  CHECK(shown.triangle_with_edge(p, blade) >= 0);
  CHECK(shown.triangle_with_edge(blade, p) < 0);    // a lip
  CHECK(shown.triangle_with_edge(blade, copy) >= 0);
  // Made permanent it is what was drawn.
  auto const corners = drawn.triangles;
  int const n = body.make_permanent(id);
  CHECK(n == blade);
  CHECK(body.take_kept(id) == n);
  CHECK(body.triangles() == corners);
  CHECK(testing::to_text(testing::CutInvariants(body).check(body)) == "");
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

TEST_CASE("an edge of a triangle that a blade is in can be divided") {
  // The wound is open at one end of the edge: on its right hangs a copy, on its left the triangle that is divided for the eye.
  Random random(Seed{25});
  auto body = moving_body(make_grid<double>(6, 5, 0.01), random);
  auto const& surface = body.tissue().surface();
  int const p = 14, q = 15, host = surface.triangle_with_edge(p, q), beside = surface.triangle_with_edge(q, p);   // in the middle
  int const copy = body.split_particle(p, std::array{beside});
  auto const id = body.insert_temporary(host, {0.4, 0.3, 0.3}, surface.corner_of(host, p), {p, copy});
  auto const triangles = body.triangles().cols();
  int const n = body.insert_on_edge(copy, q, 0.25);   // with the blade's point permanent, its part on the right is at the copy
  CHECK(body.triangles().cols() == triangles + 2 + 2);
  CHECK(surface.triangles_at(n).size() == 4);
  CHECK(body.take_kept(id) >= 0);
  CHECK(body.temporary_subdivisions().empty());
  CHECK(testing::to_text(testing::CutInvariants(body).check(body)) == "");
  check_search(body, random);
}
