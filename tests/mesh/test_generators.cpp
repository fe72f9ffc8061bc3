// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "meshes.hpp"

#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/box.hpp>
#include <palpate/mesh/capsule.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/heart.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/quality.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

using namespace palpate;
using namespace palpate_test;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// Independent of the library's own checks: every directed edge once, its reverse too; V − E + F = 2.
template <class Scalar>
void check_closed_ball(TriangleMesh<Scalar> const& mesh, int vertices) {
  REQUIRE(mesh.points.cols() == vertices);
  REQUIRE(mesh.triangles.cols() == 2 * vertices - 4);
  REQUIRE(mesh.points.allFinite());
  std::map<std::pair<int, int>, int> sides;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int c = 0; c < 3; ++c) ++sides[{mesh.triangles(c, t), mesh.triangles((c + 1) % 3, t)}];
  REQUIRE(sides.size() == 3 * std::size_t(mesh.triangles.cols()));
  bool paired = true;
  for (auto const& [side, count] : sides) paired = paired && count == 1 && sides.count({side.second, side.first}) == 1;
  REQUIRE(paired);
  REQUIRE(connected_components(mesh).size() == 1);
  REQUIRE(volume(mesh) > 0);
}

}  // namespace

TEMPLATE_TEST_CASE("a grid has the agreed indices, diagonals and normals", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const mesh = make_grid<TestType>(4, 3, TestType(0.5));
  REQUIRE(mesh.points.cols() == 12);
  REQUIRE(mesh.triangles.cols() == 12);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 4; ++i)
      REQUIRE(mesh.points.col(j * 4 + i) == Vector3<TestType>(TestType(0.5) * TestType(i), TestType(0.5) * TestType(j), 0));
  for (Eigen::Index t = 0; t < 12; ++t) REQUIRE(triangle_normal(mesh, static_cast<int>(t)).z() == 1);
  auto const sides = edges(mesh);
  REQUIRE(std::count(sides.begin(), sides.end(), std::array<int, 2>{0, 5}) == 1);   // lower left to upper right
  REQUIRE(std::count(sides.begin(), sides.end(), std::array<int, 2>{1, 4}) == 0);
  REQUIRE(validate(mesh).empty());
}

// Yardstick: the volume 5/12 (3 + √5) a³ and area 5 √3 a² of the icosahedron, a = r / sin 72°; counts of a geodesic sphere.
TEMPLATE_TEST_CASE("a sphere is a geodesic icosahedron", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const ico = make_sphere<TestType>(2, 1);
  double const a = 2 / std::sin(72 * degree);
  REQUIRE(volume(ico) == Approx(5.0 / 12 * (3 + std::sqrt(5.0)) * a * a * a));
  REQUIRE(surface_area(ico) == Approx(5 * std::sqrt(3.0) * a * a));
  for (int const f : {1, 2, 3, 7, 16}) {
    auto const mesh = make_sphere<TestType>(TestType(0.1), f);
    check_closed_ball(mesh, 10 * f * f + 2);
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i)
      REQUIRE(std::abs(mesh.points.col(i).norm() - TestType(0.1)) < 0.2 * std::numeric_limits<TestType>::epsilon());
    auto const q = quality(mesh);
    REQUIRE(q.smallest_angle > 50 * degree);
    REQUIRE(q.largest_angle < 75 * degree);
    REQUIRE(validate(mesh, {.closed = true}).empty());
  }
}

// Yardstick: the volume of a box; each tetrahedron a sixth of a cube; the top cut as a grid.
TEMPLATE_TEST_CASE("a block is cut into equal tetrahedra", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const mesh = make_block<TestType>(3, 4, 2, TestType(0.5));
  REQUIRE(mesh.points.cols() == 24);
  REQUIRE(mesh.tetrahedra.cols() == 6 * 2 * 3 * 1);
  REQUIRE(mesh.points.col((1 * 4 + 2) * 3 + 1) == Vector3<TestType>(TestType(0.5), 1, TestType(0.5)));
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    Vector3<TestType> const o = mesh.points.col(mesh.tetrahedra(0, t)), u = mesh.points.col(mesh.tetrahedra(1, t)) - o,
                            v = mesh.points.col(mesh.tetrahedra(2, t)) - o, w = mesh.points.col(mesh.tetrahedra(3, t)) - o;
    REQUIRE(u.cross(v).dot(w) == Approx(0.125));
  }
  REQUIRE(validate(mesh).empty());
  REQUIRE(validate(surface(mesh), {.closed = true, .no_unused_points = false}).empty());
  auto const sides = edges(surface(mesh));
  REQUIRE(std::count(sides.begin(), sides.end(), std::array<int, 2>{12, 16}) == 1);   // on top, lower left to upper right
  REQUIRE(std::count(sides.begin(), sides.end(), std::array<int, 2>{13, 15}) == 0);
}

// Yardstick: the volume of a cube's corner and of the regular tetrahedron between; faces, dihedral angles and edges of the tiling by counting.
TEMPLATE_TEST_CASE("a block of alternating cubes has five tetrahedra in each, which fit together", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const mesh = make_block<TestType>(4, 3, 5, TestType(0.5), BlockPattern::alternating);
  REQUIRE(mesh.points == make_block<TestType>(4, 3, 5, TestType(0.5)).points);
  REQUIRE(mesh.tetrahedra.cols() == 5 * 3 * 2 * 4);
  REQUIRE(validate(mesh).empty());
  int large = 0;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto const p = [&](int k) { return Vector3<TestType>(mesh.points.col(mesh.tetrahedra(k, t))); };
    double const part = double((p(1) - p(0)).cross(p(2) - p(0)).dot(p(3) - p(0))) / 0.125;   // six volumes over that of a cube
    REQUIRE((part == Approx(1) || part == Approx(2)));
    large += part > 1.5 ? 1 : 0;
  }
  REQUIRE(large == 3 * 2 * 4);
  auto const skin = surface(mesh);   // the six sides alone: faces of neighbouring cubes are the same
  REQUIRE(skin.triangles.cols() == 2 * 2 * (3 * 2 + 3 * 4 + 2 * 4));
  REQUIRE(surface_area(skin) == Approx(0.25 * 2 * (3 * 2 + 3 * 4 + 2 * 4)));
  REQUIRE(volume(skin) == Approx(0.125 * 3 * 2 * 4));
  // Sides of cubes, and one diagonal in each square: none through a cube.
  REQUIRE(edges(mesh).size() == (3u * 3 * 5 + 4 * 2 * 5 + 4 * 3 * 4) + (3u * 2 * 5 + 3 * 3 * 4 + 4 * 2 * 4));
  // Mirrored from cube to cube: of two squares side by side the diagonals meet in a vertex.
  auto const sides = edges(mesh);
  REQUIRE(std::count(sides.begin(), sides.end(), std::array<int, 2>{0, 5}) == 1);
  REQUIRE(std::count(sides.begin(), sides.end(), std::array<int, 2>{2, 5}) == 1);
}

// Yardstick: the ellipsoid's volume 4/3 π a b c; every vertex on it.
TEST_CASE("an implicit surface has the asked vertices, on the surface", "[mesh]") {
  auto const field = [](Vector3<double> const& p) { return Vector3<double>(p.x(), p.y() / 0.6, p.z() / 0.4).norm() - 1; };
  Eigen::AlignedBox<double, 3> const box(Vector3<double>(-1.2, -0.8, -0.6), Vector3<double>(1.2, 0.8, 0.6));
  double before = 1;
  for (int const n : {60, 61, 240, 961, 3844}) {
    auto const mesh = make_implicit<double>(field, box, n);
    check_closed_ball(mesh, n);
    for (Eigen::Index i = 0; i < n; ++i) REQUIRE(std::abs(field(mesh.points.col(i))) < 1e-6);
    double const missing = 1 - volume(mesh) / (4 * std::numbers::pi / 3 * 0.24);
    REQUIRE(missing > 0);
    REQUIRE(missing < 8.0 / n);   // first order in the area of a triangle
    if (n > 61) REQUIRE(missing < before);
    before = missing;
  }
}

// Yardstick: Euler's formula for the torus, and two balls.
TEST_CASE("an implicit surface keeps the topology of its field", "[mesh]") {
  auto const ring = [](Vector3<double> const& p) {
    double const r = std::sqrt(p.x() * p.x() + p.y() * p.y()) - 1;
    return std::sqrt(r * r + p.z() * p.z()) - 0.4;
  };
  Eigen::AlignedBox<double, 3> const box(Vector3<double>(-1.6, -1.6, -0.6), Vector3<double>(1.6, 1.6, 0.6));
  auto const torus_mesh = make_implicit<double>(ring, box, 1000);
  REQUIRE(euler_characteristic(torus_mesh) == 0);
  REQUIRE(torus_mesh.points.cols() == 1000);
  REQUIRE(validate(torus_mesh, {.closed = true}).empty());
  REQUIRE(volume(torus_mesh) == Approx(2 * std::numbers::pi * std::numbers::pi * 0.16).epsilon(0.02));

  auto const balls = [](Vector3<double> const& p) {
    return std::min((p - Vector3<double>(-1, 0, 0)).norm(), (p - Vector3<double>(1, 0, 0)).norm()) - 0.5;
  };
  auto const two = make_implicit<double>(balls, box, 800);
  REQUIRE(connected_components(two).size() == 2);
  REQUIRE(euler_characteristic(two) == 4);
}

TEST_CASE("an implicit surface says why it can not be made", "[mesh]") {
  auto const ball = [](Vector3<double> const& p) { return p.norm() - 1; };
  Eigen::AlignedBox<double, 3> const box(Vector3<double>::Constant(-1.5), Vector3<double>::Constant(1.5));
  Eigen::AlignedBox<double, 3> const small(Vector3<double>::Constant(-0.9), Vector3<double>::Constant(0.9));
  Eigen::AlignedBox<double, 3> const away(Vector3<double>::Constant(2), Vector3<double>::Constant(3));
  REQUIRE_THROWS_WITH(make_implicit<double>(ball, box, 5), says("an implicit surface of 5 vertices", "12 … 10000000"));
  REQUIRE_THROWS_WITH(make_implicit<double>(ball, small, 100), says("border of its box", "larger"));
  REQUIRE_THROWS_WITH(make_implicit<double>(ball, away, 100), says("nowhere negative", "sign"));
  REQUIRE_THROWS_AS(make_implicit<double>(ball, Eigen::AlignedBox<double, 3>(), 100), InvalidArgument);
}

// The promises of the header, for several sizes and seeds.
TEMPLATE_TEST_CASE("an organ is closed, well-shaped and of the asked size", "[mesh]", PALPATE_TEST_SCALARS) {
  for (int const n : {300, 501, 1000, 2000})
    for (std::uint64_t const seed : {1u, 2u, 99u}) {
      CAPTURE(n, seed);
      auto const mesh = make_organ<TestType>({.vertices = n, .seed = seed, .length = 0.2});
      check_closed_ball(mesh, n);
      auto const q = quality(mesh);
      REQUIRE(q.smallest_angle > (n < 2000 ? 20 : 34) * degree);
      REQUIRE(q.mean_quality > (n < 2000 ? 0.95 : 0.98));
      REQUIRE(q.longest_edge < (n < 2000 ? 3 : 2.2) * q.shortest_edge);
      REQUIRE(double(bounding_box(mesh).sizes().x()) == Approx(0.2).epsilon(1e-6));
      REQUIRE(double(bounding_box(mesh).center().norm()) < 1e-7);
      REQUIRE(validate(mesh, {.closed = true}).empty());
    }
}

// A liver and not an egg: yardsticks are shape, convexity and proportions.
TEST_CASE("an organ looks like a liver", "[mesh]") {
  auto const mesh = make_organ<double>({.vertices = 3000});
  auto const box = bounding_box(mesh);
  REQUIRE(box.sizes().y() > 0.55 * box.sizes().x());
  REQUIRE(box.sizes().y() < 0.85 * box.sizes().x());
  REQUIRE(box.sizes().z() < 0.5 * box.sizes().x());
  REQUIRE(volume(mesh) > 4e-4);   // 0.4 … 0.8 litres at 18 cm
  REQUIRE(volume(mesh) < 8e-4);

  // The height of the surface over a grid of columns, upper and lower side.
  auto const column = [&](double x, double y) {
    std::pair<double, double> side{1, -1};   // lowest, highest
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      Vector3<double> const a = mesh.points.col(mesh.triangles(0, t)), b = mesh.points.col(mesh.triangles(1, t)),
                            c = mesh.points.col(mesh.triangles(2, t));
      double const area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
      double const u = ((b.x() - x) * (c.y() - y) - (c.x() - x) * (b.y() - y)) / area;
      double const v = ((c.x() - x) * (a.y() - y) - (a.x() - x) * (c.y() - y)) / area;
      if (!(u >= 0 && v >= 0 && u + v <= 1)) continue;
      double const z = u * a.z() + v * b.z() + (1 - u - v) * c.z();
      side = {std::min(side.first, z), std::max(side.second, z)};
    }
    return side;
  };
  auto const thickness = [&](double x, double y) { auto const [low, high] = column(x, y); return high - low; };
  REQUIRE(thickness(-0.04, 0.0) > 1.6 * thickness(0.06, 0.01));   // a thick right lobe, a thin left one
  REQUIRE(thickness(-0.03, 0.04) > 1.5 * thickness(-0.03, -0.045));   // a blunt back, a thin front edge

  // A dome: along a stroke of 6 cm on top every point lies above the chord, and the surface faces up.
  for (double const y : {-0.01, 0.01, 0.03}) {
    double const left = column(-0.07, y).second, right = column(-0.01, y).second;
    for (double x = -0.06; x < -0.015; x += 0.01) {
      double const chord = left + (right - left) * (x + 0.07) / 0.06;
      REQUIRE(column(x, y).second > chord);
    }
  }
  // A hollow: the underside above the line between two of its points.
  auto const under = [&](double x, double y) { return column(x, y).first; };
  REQUIRE(under(0.0, 0.0) > (under(-0.05, 0.0) + under(0.05, 0.0)) / 2 + 0.002);
}

TEST_CASE("an organ is the same in every run and differs between seeds", "[mesh]") {
  auto const one = make_organ<double>({.vertices = 700, .seed = 5}), again = make_organ<double>({.vertices = 700, .seed = 5});
  REQUIRE(one.points == again.points);
  REQUIRE(one.triangles == again.triangles);
  auto const other = make_organ<double>({.vertices = 700, .seed = 6});
  REQUIRE(std::abs(volume(one) - volume(other)) > 1e-3 * volume(one));
  auto const rounded = make_organ<float>({.vertices = 700, .seed = 5});
  REQUIRE(rounded.triangles == one.triangles);
  REQUIRE(rounded.points == one.points.cast<float>());
}

// Yardstick: the vertex count of the thesis, Euler's formula for a closed surface.
TEMPLATE_TEST_CASE("a heart has the size of the thesis's, closed", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const mesh = make_heart<TestType>();
  check_closed_ball(mesh, 961);
  REQUIRE(edges(mesh).size() == 2877);
  auto const q = quality(mesh);
  REQUIRE(q.smallest_angle > 25 * degree);
  REQUIRE(q.mean_quality > 0.97);
  REQUIRE(q.longest_edge < 3 * q.shortest_edge);
  REQUIRE(double(bounding_box(mesh).sizes().z()) == Approx(0.12).epsilon(1e-6));
  REQUIRE(volume(mesh) > 2e-4);   // a heart holds some 0.3 litres
  REQUIRE(volume(mesh) < 4e-4);
  REQUIRE(validate(mesh, {.closed = true}).empty());
}

// Two vertices that are near in memory are near on the surface: the sum over edges stays far below that of a random order.
TEST_CASE("generated surfaces are numbered for the cache", "[mesh]") {
  auto const mesh = make_organ<double>({.vertices = 2000});
  double sum = 0;
  auto const sides = edges(mesh);
  for (auto const& e : sides) sum += e[1] - e[0];
  REQUIRE(sum / double(sides.size()) < 2000 / 3.0 / 5);   // random: a third of the vertices
}

TEST_CASE("generators refuse what has no mesh", "[mesh]") {
  REQUIRE_THROWS_WITH(make_grid<double>(1, 5, 1.0), says("1 x 5", "2 x 2"));
  REQUIRE_THROWS_WITH(make_grid<double>(3, 3, -1.0), says("grid spacing is -1 m", "positive"));
  REQUIRE_THROWS_AS(make_grid<float>(3, 3, std::numeric_limits<float>::infinity()), InvalidArgument);
  REQUIRE_THROWS_AS(make_grid<float>(100000, 100000, 1.0f), InvalidArgument);
  REQUIRE_THROWS_AS(make_block<double>(2, 2, 1, 1.0), InvalidArgument);
  REQUIRE_THROWS_AS(make_block<double>(2, 2, 2, 0.0), InvalidArgument);
  REQUIRE_THROWS_AS(make_block<double>(2000, 2000, 2000, 1.0), InvalidArgument);
  REQUIRE_THROWS_WITH(make_sphere<double>(1.0, 0), says("sphere frequency is 0", "1 (icosahedron) … 1000"));
  REQUIRE_THROWS_AS(make_sphere<double>(std::nan(""), 3), InvalidArgument);
  REQUIRE_THROWS_WITH(make_organ<double>({.vertices = 100}), says("an organ of 100 vertices", "300 … 10000000"));
  REQUIRE_THROWS_WITH(make_organ<double>({.length = 0}), says("organ length is 0 m", "positive"));
  REQUIRE_THROWS_AS(make_heart<float>({.vertices = 500}), InvalidArgument);
}

TEMPLATE_TEST_CASE("a box and a capsule are closed, outward, and as large as they should be", "[mesh]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  using Place = Vector3<S>;
  auto const box = make_box<S>({S(-0.02), S(-0.03), S(0.01)}, {S(0.04), S(0.01), S(0.06)});
  check_closed_ball(box, 8);
  CHECK(double(volume(box)) == Approx(0.06 * 0.04 * 0.05).epsilon(1e-5));
  for (double const length : {0.0, 0.001, 0.1}) {
    double last = 1;
    for (int const around : {8, 16, 32, 64}) {
      auto const rod = make_capsule<S>({S(0.01), S(0.02), S(0.03)}, Place(S(0.01), S(0.02), S(0.03)) + S(length) * Place(1, 2, -2) / 3, S(0.006), around);
      check_closed_ball(rod, int(rod.points.cols()));
      double const exact = std::numbers::pi * 0.006 * 0.006 * (length + 4.0 / 3 * 0.006), off = 1 - double(volume(rod)) / exact;
      CAPTURE(length, around, off);
      CHECK(off > 0);
      CHECK(off < 0.35 * last + 1e-5);
      last = off;
    }
    CHECK(last < 0.005);
  }
  CHECK_THROWS_AS(make_capsule<S>({0, 0, 0}, {0, 0, 1}, S(0.1), 6), InvalidArgument);
  CHECK_THROWS_AS(make_capsule<S>({0, 0, 0}, {0, 0, 1}, S(0)), InvalidArgument);
  CHECK_THROWS_AS(make_box<S>({0, 0, 0}, {1, 0, 1}), InvalidArgument);
}
