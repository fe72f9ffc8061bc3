// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "meshes.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/quality.hpp>
#include <palpate/mesh/sphere.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;
using namespace palpate_test;

// Yardstick: closed forms of plane, cube corner, torus.
TEMPLATE_TEST_CASE("area, volume, centroid and box of known shapes", "[mesh]", PALPATE_TEST_SCALARS) {
  double const eps = std::numeric_limits<TestType>::epsilon();
  auto const grid = make_grid<TestType>(11, 6, TestType(0.5));
  REQUIRE(surface_area(grid) == Approx(5 * 2.5).epsilon(8 * eps));
  REQUIRE(double(centroid(grid).x()) == Approx(2.5).epsilon(8 * eps));
  REQUIRE(double(centroid(grid).y()) == Approx(1.25).epsilon(8 * eps));
  REQUIRE(bounding_box(grid).min() == Vector3<TestType>(0, 0, 0));
  REQUIRE(bounding_box(grid).max() == Vector3<TestType>(5, TestType(2.5), 0));
  REQUIRE(mean_edge_length(grid) ==
          Approx((10 * 6 * 0.5 + 11 * 5 * 0.5 + 50 * 0.5 * std::sqrt(2.0)) / (60 + 55 + 50)).epsilon(8 * eps));

  auto corner = tetrahedron<TestType>();
  REQUIRE(surface_area(corner) == Approx(1.5 + std::sqrt(3.0) / 2).epsilon(8 * eps));
  REQUIRE(volume(corner) == Approx(1.0 / 6).epsilon(8 * eps));
  corner.points.row(2) *= -1;   // mirrored: inward
  REQUIRE(volume(corner) == Approx(-1.0 / 6).epsilon(8 * eps));

  auto const block = make_block<TestType>(3, 4, 2, TestType(0.25));
  REQUIRE(volume(block) == Approx(2 * 3 * 1 / 64.0).epsilon(8 * eps));
  REQUIRE((centroid(block) - Vector3<TestType>(0.25, 0.375, 0.125)).norm() < 8 * eps);
  REQUIRE(mean_edge_length(block) > 0.25);

  // A fine torus: 2 π² R r², 4 π² R r, to the second order of its angles.
  auto const ring = torus<TestType>(400, 200, 2, 0.5);
  double const pi2 = std::numbers::pi * std::numbers::pi;
  REQUIRE(volume(ring) == Approx(2 * pi2 * 2 * 0.25).epsilon(1e-3));
  REQUIRE(surface_area(ring) == Approx(4 * pi2 * 2 * 0.5).epsilon(1e-3));
}

// Yardstick: the ball. The error of a geodesic sphere falls as frequency⁻², so it quarters when the frequency doubles.
TEST_CASE("area and volume of the sphere converge with second order", "[mesh]") {
  double const area = 4 * std::numbers::pi, ball = 4 * std::numbers::pi / 3;
  double area_error = 0, volume_error = 0;
  for (int const frequency : {4, 8, 16, 32}) {
    auto const mesh = make_sphere<double>(1.0, frequency);
    double const a = area - surface_area(mesh), v = ball - volume(mesh);
    REQUIRE(a > 0);
    REQUIRE(v > 0);
    if (frequency > 4) {
      REQUIRE(area_error / a == Approx(4).epsilon(0.05));
      REQUIRE(volume_error / v == Approx(4).epsilon(0.05));
    }
    area_error = a, volume_error = v;
  }
  REQUIRE(area_error < 2e-2);
}

// Yardstick: translation changes neither area nor volume; float loses only the digits of its coordinates.
TEMPLATE_TEST_CASE("measures do not depend on where the mesh is", "[mesh]", PALPATE_TEST_SCALARS) {
  auto mesh = make_sphere<TestType>(TestType(0.5), 6);
  TestType const area = surface_area(mesh), inside = volume(mesh);
  mesh.points.colwise() += Vector3<TestType>(64, -32, 16);
  double const lost = 64 * double(std::numeric_limits<TestType>::epsilon()) / 0.05;
  REQUIRE(surface_area(mesh) == Approx(area).epsilon(lost));
  REQUIRE(volume(mesh) == Approx(inside).epsilon(lost));
  REQUIRE(centroid(mesh).x() == Approx(64).epsilon(lost));
}

// Yardstick: χ = 2 − 2 · handles for closed surfaces, 1 for a disc, 0 for a band; sums over pieces.
TEST_CASE("Euler characteristic counts handles and holes", "[mesh]") {
  REQUIRE(euler_characteristic(tetrahedron<double>()) == 2);
  REQUIRE(euler_characteristic(make_sphere<double>(1, 5)) == 2);
  REQUIRE(euler_characteristic(torus<double>(12, 7, 2, 1)) == 0);
  REQUIRE(euler_characteristic(make_grid<double>(9, 4, 1)) == 1);
  REQUIRE(euler_characteristic(together<double>(tetrahedron<double>(), torus<double>(5, 5, 2, 1), {9, 0, 0})) == 2);
  auto pierced = make_grid<double>(4, 4, 1);   // without its middle square: a band
  Matrix<int, 3, Dynamic> kept(3, 16);
  kept << pierced.triangles.leftCols(8), pierced.triangles.rightCols(8);
  pierced.triangles = kept;
  REQUIRE(euler_characteristic(pierced) == 0);
  auto loose = tetrahedron<double>();
  loose.points.conservativeResize(3, 9);
  loose.points.rightCols(5).setZero();
  REQUIRE(euler_characteristic(loose) == 2);   // unused vertices do not count
  REQUIRE(euler_characteristic(TriangleMesh<double>{}) == 0);
}

TEST_CASE("measures of nothing are refused", "[mesh]") {
  REQUIRE(surface_area(TriangleMesh<double>{}) == 0);
  REQUIRE(volume(TetrahedralMesh<float>{}) == 0);
  REQUIRE(bounding_box(TriangleMesh<double>{}).isEmpty());
  REQUIRE_THROWS_WITH(mean_edge_length(TriangleMesh<double>{}), says("no edge", "one element"));
  REQUIRE_THROWS_AS(centroid(TriangleMesh<float>{}), InvalidMesh);
  REQUIRE_THROWS_AS(centroid(TetrahedralMesh<double>{}), InvalidMesh);
  REQUIRE_THROWS_AS(quality(TriangleMesh<double>{}), InvalidMesh);
}

// Yardstick: the normal of a sphere is its radius. The error is at least of first order in the side; at icosahedron corners exact.
TEMPLATE_TEST_CASE("vertex normals of a sphere are radial", "[mesh]", PALPATE_TEST_SCALARS) {
  for (auto const weight : {NormalWeight::angle, NormalWeight::area}) {
    double before = 0;
    for (int const frequency : {5, 10, 20}) {
      auto const mesh = make_sphere<TestType>(TestType(0.03), frequency);
      auto const normals = vertex_normals(mesh, weight);
      double worst = 0;
      for (Eigen::Index i = 0; i < normals.cols(); ++i) {
        REQUIRE(std::abs(normals.col(i).norm() - 1) < 4 * std::numeric_limits<TestType>::epsilon());
        worst = std::max(worst, double((normals.col(i) - mesh.points.col(i).normalized()).norm()));
      }
      REQUIRE(worst < 0.1 / frequency);
      if (before > 0 && worst > 1e-5) REQUIRE(before / worst > 1.5);
      before = worst;
    }
  }
  // At a corner of the icosahedron symmetry makes the normal exact.
  auto const ico = make_sphere<TestType>(1, 1);
  REQUIRE((vertex_normals(ico) - ico.points).norm() < 20 * std::numeric_limits<TestType>::epsilon());
}

// Yardstick: at a cube corner the angle weights give the diagonal however the faces are cut; area weights do not.
TEMPLATE_TEST_CASE("angle weights do not depend on how a face is cut", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const skin = surface(make_block<TestType>(2, 2, 2, TestType(1)));
  auto const normals = vertex_normals(skin, NormalWeight::angle);
  for (Eigen::Index i = 0; i < 8; ++i) {
    Vector3<TestType> const outward = (skin.points.col(i).array() - TestType(0.5)).matrix().normalized();
    REQUIRE((normals.col(i) - outward).norm() < 8 * std::numeric_limits<TestType>::epsilon());
  }
}

TEMPLATE_TEST_CASE("normals of flat, tiny and degenerate triangles", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const grid = make_grid<TestType>(4, 4, TestType(1e-9));   // areas of 1e-18 m² do not vanish in float
  for (auto const weight : {NormalWeight::angle, NormalWeight::area}) {
    auto const normals = vertex_normals(grid, weight);
    for (Eigen::Index i = 0; i < normals.cols(); ++i)
      REQUIRE((normals.col(i) - Vector3<TestType>(0, 0, 1)).norm() < 4 * std::numeric_limits<TestType>::epsilon());
  }
  REQUIRE(triangle_normal(grid, 3) == Vector3<TestType>(0, 0, 1));
  REQUIRE(triangle_normal(grid, 5) == Vector3<TestType>(0, 0, 1));
  REQUIRE_THROWS_AS(triangle_normal(grid, 18), OutOfRange);

  auto const flat = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {7, 7, 7}}, {{0, 1, 2}});
  REQUIRE(vertex_normals(flat) == (Matrix<TestType, 3, Dynamic>::Zero(3, 4)));
  REQUIRE(triangle_normal(flat, 0) == Vector3<TestType>::Zero());
}

// Yardstick: equilateral triangle 1, half a square √3/2, angles of the 3-4-5 triangle.
TEMPLATE_TEST_CASE("quality of known triangles", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const equilateral = surface_of<TestType>({{0, 0, 0}, {2, 0, 0}, {1, std::sqrt(3.0), 0}}, {{0, 1, 2}});
  auto const best = quality(equilateral);
  REQUIRE(best.worst_quality == Approx(1));
  REQUIRE(best.smallest_angle == Approx(std::numbers::pi / 3));
  REQUIRE(best.longest_edge == Approx(2));
  REQUIRE(quality(make_grid<TestType>(5, 5, TestType(0.1))).mean_quality == Approx(std::sqrt(3.0) / 2));
  auto const right = quality(surface_of<TestType>({{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}, {{0, 1, 2}}));
  REQUIRE(right.smallest_angle == Approx(std::atan2(3.0, 4.0)));
  REQUIRE(right.largest_angle == Approx(std::numbers::pi / 2));
  REQUIRE(right.mean_quality == Approx(4 * std::sqrt(3.0) * 6 / 50));
  REQUIRE(right.shortest_edge == Approx(3));
  REQUIRE(right.longest_edge == Approx(5));
  REQUIRE(quality(surface_of<TestType>({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{0, 1, 2}})).worst_quality == 0);
}
