// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/volume/fill.hpp>
#include <palpate/volume/section.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

using namespace palpate;

// Yardstick: the section of a cube with a plane has a known area; across its space diagonal through the middle it is a regular hexagon, 3 sqrt(3)/4 a².
TEST_CASE("sections of a cube have the areas of the closed forms", "[volume][section]") {
  auto const cube = make_block<double>(5, 5, 5, 0.25, BlockPattern::alternating);
  auto const area = [&](Vector3<double> const& p, Vector3<double> const& n) { return surface_area(section(cube, p, n).mesh); };
  Vector3<double> const middle(0.5, 0.5, 0.5);
  CHECK(area({0.5, 0.5, 0.4}, {0, 0, 3}) == Approx(1.0).epsilon(1e-12));
  CHECK(area(middle, {1, 1, 0}) == Approx(std::sqrt(2.0)).epsilon(1e-12));
  CHECK(area(middle, {1, 1, 1}) == Approx(3 * std::sqrt(3.0) / 4).epsilon(1e-12));
  CHECK(area(middle, {-1, 1, -1}) == Approx(3 * std::sqrt(3.0) / 4).epsilon(1e-12));
  CHECK(area({0.5, 0.5, 0.5}, {0, 0, 1}) == Approx(1.0).epsilon(1e-12));   // through faces
  CHECK(validate(section<double>(cube, middle, {0, 0, 1}).mesh).empty());    // each corner once
  CHECK(section<double>(cube, middle, {0, 0, 1}).mesh.points.cols() == 25);
  CHECK(area({0.5, 0.5, 1.0}, {0, 0, 1}) == Approx(1.0).epsilon(1e-12));   // the top, below which it lies
  CHECK(section(cube, {0.5, 0.5, 0.0}, {0, 0, 1}).mesh.triangles.cols() == 0);   // the bottom, above which it lies
  CHECK(section(cube, {0.5, 0.5, 1.5}, {0, 0, 1}).mesh.triangles.cols() == 0);
}

// Yardstick: the volume is the integral of the area of its sections.
TEST_CASE("a section faces along the normal, has its tetrahedra, and areas add up to the volume", "[volume][section]") {
  auto const ball = fill(make_sphere<double>(0.03, 6), {.edge = 0.01}).mesh;
  std::srand(4);
  Vector3<double> const n = Vector3<double>::Random().normalized();
  double sum = 0;
  int const slices = 400;
  double const thick = 0.062 / slices;
  for (int k = 0; k < slices; ++k) {
    Vector3<double> const p = (-0.031 + (k + 0.5) * thick) * n;
    auto const cut = section(ball, p, n);
    REQUIRE(cut.tetrahedron.size() == static_cast<std::size_t>(cut.mesh.triangles.cols()));
    if (cut.mesh.triangles.cols() == 0) continue;
    sum += thick * surface_area(cut.mesh);
    double off = 0, turned = 1;
    for (Eigen::Index t = 0; t < cut.mesh.triangles.cols(); ++t) {
      turned = std::min(turned, triangle_normal(cut.mesh, static_cast<int>(t)).dot(n));
      for (int c = 0; c < 3; ++c) off = std::max(off, std::abs(n.dot(cut.mesh.points.col(cut.mesh.triangles(c, t)) - p)));
    }
    CHECK(off < 1e-15);
    CHECK(turned > 0.9);
  }
  CHECK(sum == Approx(volume(ball)).epsilon(1e-3));
  CHECK_THROWS_AS(section(ball, {0, 0, 0}, {0, 0, 0}), InvalidArgument);
}

TEMPLATE_TEST_CASE("a section's normal may have any length", "[volume][section]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const cube = make_block<S>(3, 3, 3, S(0.5), BlockPattern::alternating);
  Vector3<S> const middle = Vector3<S>::Constant(S(0.5)), across(0, S(0.75), S(-1));
  auto const expected = section(cube, middle, across).mesh;
  REQUIRE(surface_area(expected) == Approx(1.25).epsilon(1e-6));   // slope 3/4 over an edge of 1
  using Limits = std::numeric_limits<S>;
  for (S const length : {Limits::max(), std::sqrt(Limits::max()) * 64, Limits::min(), Limits::denorm_min() * 64}) {
    auto const found = section(cube, middle, Vector3<S>(length * across)).mesh;
    REQUIRE(found.triangles.cols() == expected.triangles.cols());
    CHECK((found.points - expected.points).cwiseAbs().maxCoeff() <= 4 * Limits::epsilon());
  }
  for (S const bad : {S(0), Limits::infinity(), Limits::quiet_NaN()}) CHECK_THROWS_AS(section(cube, middle, Vector3<S>(0, 0, bad)), InvalidArgument);
}
