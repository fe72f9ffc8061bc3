// SPDX-License-Identifier: MIT
// Yardstick: areas, volumes and directions by hand: a straight slit of length l has two walls of area l · depth each.
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/wound_walls.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <limits>

using namespace palpate;

namespace {

/// A sheet with a cut along y = 4 cm from x = 2 cm to `to`.
template <class S>
SoftBody<MassSpring<S>, LeapfrogVerlet, WholeBody> slit(S to) {
  SoftBody body(MassSpring<S>(make_grid<S>(9, 9, S(0.01)), {.mass = {.total = S(0.1)}, .link = {.stiffness = S(60)}, .home = {.stiffness = S(4)}}));
  ProgressiveCutter<S> scalpel({.puncture_depth = S(0.002)});
  for (S const z : {S(0.01), S(0.001), S(-0.004)}) scalpel.advance(body, {S(0.02), S(0.04), z});
  for (S x = S(0.02); x <= to; x += S(0.005)) scalpel.advance(body, {x, S(0.04), S(-0.004)});
  scalpel.advance(body, {to, S(0.04), S(0.02)});
  return body;
}

}  // namespace

TEMPLATE_TEST_CASE("the walls of a slit are two, as deep as asked, and look into the wound", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const uncut = make_grid<S>(9, 9, S(0.01));
  auto const body = slit<S>(S(0.06));
  auto const edges = wound_edges(uncut, body.rest_mesh());
  REQUIRE(edges.size() == 8);   // four edges of a centimetre, two lips
  auto const walls = wound_walls(body.mesh(), edges, S(0.005), 2);
  CHECK(walls.mesh.triangles.cols() == 8 * 2 * 2);
  CHECK(static_cast<Eigen::Index>(walls.lip.size()) == walls.mesh.points.cols());
  CHECK(surface_area(walls.mesh) == Approx(2 * 0.04 * 0.005).epsilon(1e-5));
  for (Eigen::Index p = 0; p < walls.mesh.points.cols(); ++p) {
    auto const k = static_cast<std::size_t>(p);
    CHECK(walls.mesh.points(2, p) == Approx(-0.005 * walls.share[k]).margin(1e-9));
    CHECK((walls.mesh.points.col(p) - body.mesh().points.col(walls.lip[k])).norm() == Approx(0.005 * walls.share[k]).margin(1e-7));
  }
  // The lip whose tissue lies at larger y has its wall face to smaller y.
  for (Eigen::Index t = 0; t < walls.mesh.triangles.cols(); ++t) {
    auto const normal = triangle_normal<S>(walls.mesh, static_cast<int>(t));
    auto const [a, b] = edges[static_cast<std::size_t>(t) / 4];
    Vector3<S> const along = body.mesh().points.col(b) - body.mesh().points.col(a);
    CHECK(normal[1] == Approx(along[0] > 0 ? -1 : 1).margin(1e-5));   // the surface lies to the left of its border
  }
}

TEST_CASE("a border that was there before is no wound, cut or not") {
  auto const uncut = make_grid<double>(9, 9, 0.01);
  CHECK(wound_edges(uncut, uncut).empty());
  auto const to_the_border = slit<double>(0.08);
  CHECK(wound_edges(uncut, to_the_border.rest_mesh()).size() == 12);   // six edges, two lips
  auto const sphere = make_sphere<double>(0.05, 2);
  auto open = sphere;
  open.triangles = sphere.triangles.rightCols(sphere.triangles.cols() - 1).eval();
  CHECK(wound_edges(sphere, open).size() == 3);   // of a closed surface every border is one
}

TEST_CASE("walls that can not be made are refused") {
  auto const mesh = make_grid<double>(3, 3, 0.01);
  std::vector<std::array<int, 2>> const edges{{0, 1}};
  CHECK_THROWS_AS(wound_walls(mesh, edges, 0.0), InvalidArgument);
  CHECK_THROWS_AS(wound_walls(mesh, edges, std::numeric_limits<double>::quiet_NaN()), InvalidArgument);
  CHECK_THROWS_AS(wound_walls(mesh, edges, 0.01, 0), InvalidArgument);
  CHECK_THROWS_AS(wound_walls(mesh, {{0, 9}}, 0.01), OutOfRange);
  CHECK(wound_walls(mesh, {}, 0.01).mesh.points.cols() == 0);
}
