// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "meshes.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/detail/close_points.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;
using Kind = MeshDefectKind;

namespace {

/// The mesh has this one defect and no other; its text says these words.
template <class Mesh>
void check_only(Mesh const& mesh, Kind kind, int index, int other, palpate_test::Says const& words, MeshRequirements const& wanted = {}) {
  auto const defects = validate(mesh, wanted);
  for (auto const& d : defects) UNSCOPED_INFO(to_string(d));
  REQUIRE(defects.size() == 1);
  REQUIRE(defects[0].kind == kind);
  REQUIRE(defects[0].index == index);
  REQUIRE(defects[0].other == other);
  REQUIRE_THAT(to_string(defects[0]), words);
  REQUIRE_THROWS_WITH(require_valid(mesh, wanted, "liver.obj"), says("liver.obj has 1 defect") && words);
}

template <class Scalar>
void drop_triangle(TriangleMesh<Scalar>& mesh) {
  mesh.triangles.conservativeResize(3, mesh.triangles.cols() - 1);
}

template <class Scalar>
void add_triangle(TriangleMesh<Scalar>& mesh, int a, int b, int c) {
  mesh.triangles.conservativeResize(3, mesh.triangles.cols() + 1);
  mesh.triangles.col(mesh.triangles.cols() - 1) << a, b, c;
}

template <class Scalar>
void add_point(TriangleMesh<Scalar>& mesh, double x, double y, double z) {
  mesh.points.conservativeResize(3, mesh.points.cols() + 1);
  mesh.points.col(mesh.points.cols() - 1) << Scalar(x), Scalar(y), Scalar(z);
}

}  // namespace

// Each mesh is made by hand with one mistake; the defect and its text are the expected ones.
TEMPLATE_TEST_CASE("every defect of a surface is named with its place, value and remedy", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const good = tetrahedron<TestType>();
  REQUIRE(validate(good, {.closed = true}).empty());
  REQUIRE_NOTHROW(require_valid(good, {.closed = true}));
  auto mesh = good;

  SECTION("empty") {
    check_only(TriangleMesh<TestType>{}, Kind::empty, -1, -1, says("no triangle", "read to its end"));
  }
  SECTION("not finite") {
    mesh.points(1, 2) = std::numeric_limits<TestType>::quiet_NaN();
    mesh.points(2, 2) = std::numeric_limits<TestType>::infinity();   // one defect a vertex
    check_only(mesh, Kind::not_finite, 2, 1, says("vertex 2", "y = nan", "correct it at the source"), {.closed = true});
  }
  SECTION("index out of range") {
    mesh.triangles(2, 3) = 17;
    check_only(mesh, Kind::vertex_out_of_range, 3, 17, says("triangle 3", "vertex 17", "4 points", "correct the index or drop"));
    mesh.triangles(2, 3) = -1;
    REQUIRE(validate(mesh).at(0).other == -1);
  }
  SECTION("repeated corner") {
    add_triangle(mesh, 1, 3, 1);
    check_only(mesh, Kind::repeated_corner, 4, 1, says("triangle 4", "vertex 1 more than once", "`repair`"), {.closed = true});
  }
  SECTION("no area") {
    auto const flat = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}}, {{0, 1, 2}});
    check_only(flat, Kind::no_area, 0, -1, says("triangle 0", "side: 0)", "`repair`"));
    auto const needle = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {0.5, 1e-4, 0}}, {{0, 1, 2}});
    REQUIRE(validate(needle).empty());   // thin is not flat
  }
  SECTION("unused vertex") {
    add_point(mesh, 3, 3, 3);
    check_only(mesh, Kind::unused_vertex, 4, -1, says("vertex 4", "no mass", "`repair`"), {.closed = true});
    REQUIRE(validate(mesh, {.no_unused_points = false}).empty());
  }
  SECTION("duplicate vertex") {
    auto two = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 1}},
                                    {{0, 1, 2}, {3, 4, 5}});
    check_only(two, Kind::duplicate_vertex, 3, 1, says("vertex 3", "vertex 1", "0 m", "`repair`"));
    REQUIRE(validate(two, {.distinct_points = false}).empty());
    two.points(0, 3) += TestType(4e-6);   // within the tolerance of the median side
    REQUIRE(validate(two).size() == 1);
    two.points(0, 3) += TestType(1e-4);
    REQUIRE(validate(two).empty());
  }
  SECTION("duplicate triangle") {
    add_triangle(mesh, 2, 1, 0);
    check_only(mesh, Kind::duplicate_element, 4, 0, says("triangle 4", "triangle 0", "`repair`"),
               {.closed = true});
  }
  SECTION("non-manifold edge") {
    add_point(mesh, 1, 1, 1);
    add_triangle(mesh, 1, 2, 4);
    check_only(mesh, Kind::non_manifold_edge, 1, 2, says("edge 1–2", "3 triangles", "mesh editor"));
  }
  SECTION("inconsistent orientation") {
    auto const folded = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 3, 2}});
    check_only(folded, Kind::inconsistent_orientation, 0, 2, says("edge 0–2", "opposite ways", "`repair`"));
    mesh.triangles.col(0) << 0, 1, 2;
    REQUIRE(validate(mesh, {.closed = true}).size() == 3);
  }
  SECTION("non-manifold vertex") {
    auto const bow_tie =
        surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 3, 4}});
    check_only(bow_tie, Kind::non_manifold_vertex, 0, -1, says("vertex 0", "2 separate fans", "mesh editor"));
    // Two closed bodies tip to tip: closed everywhere, yet not manifold.
    auto tips = together(good, good, {0, 0, 0});
    for (Eigen::Index k = 0; k < 12; ++k) {
      int& v = tips.triangles(k % 3, 4 + k / 3);
      v = v == 4 ? 0 : v - 1;
    }
    Matrix<TestType, 3, Dynamic> points(3, 7);
    points << good.points, -good.points.rightCols(3);
    tips.points = points;
    tips.triangles.rightCols(4).row(1).swap(tips.triangles.rightCols(4).row(2));   // mirrored: outward again
    REQUIRE(validate(tips, {.closed = true}).size() == 1);
    REQUIRE(validate(tips).at(0).kind == Kind::non_manifold_vertex);
  }
  SECTION("open border") {
    drop_triangle(mesh);
    check_only(mesh, Kind::open_border, 0, -1, says("3 edges", "vertex 0", "must be closed", "mesh editor"),
               {.closed = true});
    REQUIRE(validate(mesh).empty());
    REQUIRE(validate(make_grid<TestType>(5, 4, 1), {.closed = true}).at(0).value == 14);
  }
  SECTION("inward") {
    mesh.triangles.row(0).swap(mesh.triangles.row(1));
    check_only(mesh, Kind::inward, 0, -1, says("vertex 0", "-0.166666667 m³", "`repair`"),
               {.closed = true});
    REQUIRE(validate(mesh).empty());   // an open sheet may face either way, so only closed ones are asked
  }
}

// A hollow body is its outer surface and the inward wall of its cavity; two bodies beside each other must both face outward.
TEMPLATE_TEST_CASE("walls of cavities may face inward", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const outer = make_sphere<TestType>(2, 3);
  auto inner = make_sphere<TestType>(1, 2);
  inner.triangles.row(0).swap(inner.triangles.row(1));
  REQUIRE(validate(together(outer, inner, {0, 0, 0}), {.closed = true}).empty());
  auto const beside = validate(together(outer, inner, {4, 0, 0}), {.closed = true});
  REQUIRE(beside.size() == 1);
  REQUIRE(beside[0].kind == Kind::inward);
  REQUIRE(beside[0].index == outer.points.cols());
}

TEMPLATE_TEST_CASE("every defect of a volume is named", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const good = make_block<TestType>(2, 2, 2, TestType(1));
  REQUIRE(validate(good).empty());
  auto mesh = good;
  SECTION("empty") {
    check_only(TetrahedralMesh<TestType>{}, Kind::empty, -1, -1, says("no tetrahedron", "read to its end"));
  }
  SECTION("inverted") {
    std::swap(mesh.tetrahedra(0, 4), mesh.tetrahedra(1, 4));
    check_only(mesh, Kind::inverted, 4, -1, says("tetrahedron 4", "-0.166666667 m³", "`repair`"));
  }
  SECTION("no volume") {
    mesh.tetrahedra.conservativeResize(4, 7);
    mesh.tetrahedra.col(6) << 0, 1, 2, 3;   // a face of the cube
    auto const defects = validate(mesh);
    REQUIRE(defects.at(0).kind == Kind::no_volume);
    REQUIRE_THAT(to_string(defects[0]), says("tetrahedron 6", "`repair`"));
  }
  SECTION("repeated, out of range, unused, not finite, duplicate") {
    mesh.tetrahedra.conservativeResize(4, 9);
    mesh.tetrahedra.col(6) << 0, 1, 1, 7;
    mesh.tetrahedra.col(7) << 0, 1, 3, 8;
    mesh.tetrahedra.col(8) = good.tetrahedra.col(2);
    mesh.points.conservativeResize(3, 8);
    auto defects = validate(mesh);
    REQUIRE(defects.size() == 3);
    REQUIRE_THAT(to_string(defects[0]), says("tetrahedron 6", "vertex 1", "`repair`"));
    REQUIRE_THAT(to_string(defects[1]), says("tetrahedron 7", "vertex 8", "8 points", "correct the index or drop the tetrahedron"));
    REQUIRE_THAT(to_string(defects[2]), says("tetrahedron 8", "tetrahedron 2", "`repair`"));
    mesh = good;
    mesh.points.conservativeResize(3, 9);
    mesh.points.col(8) << 5, 5, std::numeric_limits<TestType>::infinity();
    defects = validate(mesh);
    REQUIRE(defects.size() == 2);
    REQUIRE_THAT(to_string(defects[0]), says("vertex 8", "z = inf", "correct it at the source"));
    REQUIRE_THAT(to_string(defects[1]), says("vertex 8", "`repair`"));
  }
  SECTION("non-manifold face") {
    mesh.points.conservativeResize(3, 10);
    mesh.points.col(8) << 2, 2, 5;
    mesh.points.col(9) << 3, 2, 6;
    mesh.tetrahedra.conservativeResize(4, 8);
    auto const t = good.tetrahedra.col(0);
    mesh.tetrahedra.col(6) << t[0], t[1], t[2], 8;
    mesh.tetrahedra.col(7) << t[0], t[1], t[2], 9;
    bool found = false;
    for (auto const& d : validate(mesh))
      if (d.kind == Kind::non_manifold_face)
        found = to_string(d) == "a face of tetrahedron 0 belongs to 3 tetrahedra, 6 among them, where a volume has one or two; "
                                "correct the overlap at the source";
    REQUIRE(found);
  }
}

// Two tetrahedra stand on one face, both upright; mirrored, they share it as neighbours do.
TEMPLATE_TEST_CASE("two tetrahedra on the same side of a face overlap", "[mesh]", PALPATE_TEST_SCALARS) {
  TetrahedralMesh<TestType> mesh;
  mesh.points.resize(3, 5);
  mesh.points << 0, 3, 0, 1, TestType(1.2), 0, 0, 3, 1, TestType(0.8), 0, 0, 0, 3, 2;
  mesh.tetrahedra.resize(4, 2);
  mesh.tetrahedra << 0, 0, 1, 1, 2, 2, 3, 4;
  check_only(mesh, Kind::overlap, 1, 0, says("tetrahedra 0 and 1", "same side of the face", "mesh anew"));
  auto repaired = mesh;
  auto const report = repair(repaired);
  REQUIRE(report.left.size() == 1);
  REQUIRE_FALSE(report.changed());
  mesh.points(2, 4) = -2;
  check_only(mesh, Kind::inverted, 1, -1, says("inside out"));   // one cause, one defect
  std::swap(mesh.tetrahedra(0, 1), mesh.tetrahedra(1, 1));
  REQUIRE(validate(mesh).empty());
}

// Yardstick: every pair of tetrahedra with three common corners, and on which side of them the fourth of each lies.
TEMPLATE_TEST_CASE("a folded volume has the overlaps that brute force finds", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const signed_volume = [](auto const& mesh, int a, int b, int c, int d) {
    auto const at = [&](int v) { return Vector3<double>(mesh.points.col(v).template cast<double>()); };
    return (at(b) - at(a)).cross(at(c) - at(a)).dot(at(d) - at(a));
  };
  int found = 0;
  for (unsigned const seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    CAPTURE(seed);
    Random random(Seed{seed});
    auto mesh = make_block<TestType>(4, 4, 4, TestType(1));
    for (int folds = 0; folds < 3; ++folds) {   // vertices that go through the faces about them
      auto const v = static_cast<Eigen::Index>(random() % 64);
      for (int k = 0; k < 3; ++k) mesh.points(k, v) += TestType(2.6) * random.template uniform<TestType>() - TestType(1.3);
    }
    int const count = static_cast<int>(mesh.tetrahedra.cols());
    for (int t = 0; t < count; ++t)   // as a reader turns them
      if (signed_volume(mesh, mesh.tetrahedra(0, t), mesh.tetrahedra(1, t), mesh.tetrahedra(2, t), mesh.tetrahedra(3, t)) < 0)
        std::swap(mesh.tetrahedra(2, t), mesh.tetrahedra(3, t));
    std::vector<std::pair<int, int>> expected, overlaps;
    for (int b = 0; b < count; ++b)
      for (int a = 0; a < b; ++a) {
        std::vector<int> common, own;
        for (int const v : mesh.tetrahedra.col(a)) (mesh.tetrahedra.col(b).array() == v).any() ? common.push_back(v) : own.push_back(v);
        if (common.size() != 3) continue;
        for (int const v : mesh.tetrahedra.col(b))
          if (!(mesh.tetrahedra.col(a).array() == v).any()) own.push_back(v);
        if (signed_volume(mesh, common[0], common[1], common[2], own[0]) * signed_volume(mesh, common[0], common[1], common[2], own[1]) > 0)
          expected.emplace_back(b, a);
      }
    for (auto const& d : validate(mesh)) {
      REQUIRE(d.kind == Kind::overlap);
      overlaps.emplace_back(d.index, d.other);
    }
    std::sort(overlaps.begin(), overlaps.end()), std::sort(expected.begin(), expected.end());
    REQUIRE(overlaps == expected);
    found += static_cast<int>(expected.size());
  }
  REQUIRE(found > 20);
}

TEST_CASE("the exception shows the first defects and counts the rest", "[mesh]") {
  auto mesh = make_grid<double>(4, 4, 1.0);
  for (int k = 0; k < 6; ++k) add_point(mesh, 10 + k, 0, 0);
  REQUIRE_THROWS_WITH(require_valid(mesh, {}, "skin"), says("skin has 6 defects", "(1) vertex 16", "(3) vertex 18", "`repair`", "3 more, `validate`"));
  REQUIRE_THROWS_AS(require_valid(mesh), InvalidMesh);
}

// Yardstick: the distance to every earlier first point.
TEMPLATE_TEST_CASE("points at one place are found as by brute force", "[mesh]", PALPATE_TEST_SCALARS) {
  Random random(Seed{11});
  for (double const distance : {0.0, 0.002, 0.01, 0.05}) {
    CAPTURE(distance);
    Matrix<TestType, 3, Dynamic> points(3, 600);
    for (Eigen::Index i = 0; i < 600; ++i)
      for (int k = 0; k < 3; ++k) points(k, i) = random.template uniform<TestType>() / TestType(k == 2 ? 10 : 2) - TestType(0.2);
    for (Eigen::Index i = 300; i < 400; ++i) points.col(i) = points.col(i - 200);
    points(0, 500) = std::numeric_limits<TestType>::quiet_NaN();
    points.col(501) = points.col(500);
    points.col(502) *= TestType(1e30);
    points.col(503) << TestType(0), TestType(0), TestType(0);
    points.col(504) << TestType(-0.0), TestType(0), TestType(0);
    std::vector<int> expected(600);
    for (int i = 0; i < 600; ++i) {
      expected[std::size_t(i)] = i;
      for (int j = 0; j < i; ++j)
        if (expected[std::size_t(j)] == j &&
            (points.col(i).template cast<double>() - points.col(j).template cast<double>()).norm() <= distance) {
          expected[std::size_t(i)] = j;
          break;
        }
    }
    REQUIRE(detail::first_close_point(points, distance) == expected);
  }
}

// Whatever the indices and coordinates are, validation returns (run with the sanitizers) and never calls a broken mesh sound.
TEST_CASE("validation survives meshes of random numbers", "[mesh]") {
  Random random(Seed{3});
  for (int round = 0; round < 300; ++round) {
    auto mesh = make_sphere<double>(1, 2);
    int const hits = 1 + static_cast<int>(random() % 6);
    for (int k = 0; k < hits; ++k) {
      auto const t = static_cast<Eigen::Index>(random() % 80);
      mesh.triangles(static_cast<int>(random() % 3), t) = static_cast<int>(random() % 60) - 9;
    }
    if (round % 3 == 0) mesh.points(1, static_cast<int>(random() % 42)) = std::numeric_limits<double>::quiet_NaN();
    bool const same = mesh.triangles == make_sphere<double>(1, 2).triangles && mesh.points.allFinite();
    REQUIRE(validate(mesh, {.closed = true}).empty() == same);
  }
}
