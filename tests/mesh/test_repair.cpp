// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "meshes.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>

#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

template <class Scalar>
TriangleMesh<Scalar> with_triangle(TriangleMesh<Scalar> mesh, int a, int b, int c) {
  mesh.triangles.conservativeResize(3, mesh.triangles.cols() + 1);
  mesh.triangles.col(mesh.triangles.cols() - 1) << a, b, c;
  return mesh;
}

constexpr RepairOptions closed{.wanted = {.closed = true}};

}  // namespace

TEMPLATE_TEST_CASE("a sound mesh is left alone", "[mesh]", PALPATE_TEST_SCALARS) {
  auto mesh = make_organ<TestType>({.vertices = 400});
  auto const before = mesh;
  auto const report = repair(mesh, closed);
  REQUIRE(report.sound());
  REQUIRE_FALSE(report.changed());
  REQUIRE(to_string(report) == "nothing to repair");
  REQUIRE(mesh.points == before.points);
  REQUIRE(mesh.triangles == before.triangles);
  for (int v = 0; v < 400; ++v) REQUIRE(report.new_index[std::size_t(v)] == v);
}

// Yardstick: a soup of separate triangles, as STL files hold it, becomes the sphere it was cut from.
TEMPLATE_TEST_CASE("a triangle soup is joined", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const sphere = make_sphere<TestType>(TestType(0.1), 5);
  TriangleMesh<TestType> soup;
  soup.points.resize(3, 3 * sphere.triangles.cols());
  soup.triangles.resize(3, sphere.triangles.cols());
  for (Eigen::Index t = 0; t < sphere.triangles.cols(); ++t)
    for (int c = 0; c < 3; ++c) {
      soup.triangles(c, t) = static_cast<int>(3 * t + c);
      soup.points.col(3 * t + c) = sphere.points.col(sphere.triangles(c, t)) * (1 + TestType(1e-7) * TestType(t % 3));
    }
  auto const report = repair(soup, closed);
  REQUIRE(report.sound());
  REQUIRE(soup.points.cols() == sphere.points.cols());
  REQUIRE(soup.triangles.cols() == sphere.triangles.cols());
  REQUIRE(report.merged_vertices == 3 * sphere.triangles.cols() - sphere.points.cols());
  REQUIRE(volume(soup) == Approx(volume(sphere)).epsilon(1e-5));
  REQUIRE(to_string(report) == "merged 1248 duplicate vertices");
  for (Eigen::Index t = 0; t < sphere.triangles.cols(); ++t)   // the map leads from each old vertex to its place
    for (int c = 0; c < 3; ++c)
      REQUIRE((soup.points.col(report.new_index[std::size_t(3 * t + c)]) - sphere.points.col(sphere.triangles(c, t))).norm() < 1e-6);
}

TEMPLATE_TEST_CASE("degenerate, repeated and unused parts go", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const good = make_sphere<TestType>(1, 3);
  auto mesh = with_triangle(with_triangle(good, 4, 4, 9), good.triangles(1, 7), good.triangles(0, 7), good.triangles(2, 7));
  mesh.points.conservativeResize(3, good.points.cols() + 2);
  mesh.points.col(92) << 7, 7, 7;
  mesh.points.col(93) << 8, std::numeric_limits<TestType>::quiet_NaN(), 8;   // unused, so not needed
  auto const report = repair(mesh, closed);
  REQUIRE(report.sound());
  REQUIRE(mesh.points == good.points);
  REQUIRE(mesh.triangles == good.triangles);
  REQUIRE(to_string(report) == "dropped 1 degenerate element, dropped 1 duplicate element, dropped 2 unused vertices");
  REQUIRE(report.new_index[91] == 91);
  REQUIRE(report.new_index[92] == -1);
}

// Yardstick: the closed surface stays closed, its volume and area do not change.
TEMPLATE_TEST_CASE("a flat triangle is removed without opening a slit", "[mesh]", PALPATE_TEST_SCALARS) {
  // The corner tetrahedron with a vertex 4 on the edge 1–2: the face 1, 2, 3 knows it, the face 0, 2, 1 does not; the flat
  // triangle 2, 1, 4 fills the gap of no width between them.
  auto mesh = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.5, 0}},
                                   {{0, 2, 1}, {0, 1, 3}, {1, 4, 3}, {4, 2, 3}, {0, 3, 2}, {1, 2, 4}});
  REQUIRE(validate(mesh, {.closed = true}).size() == 1);
  auto const report = repair(mesh, closed);
  REQUIRE(to_string(report) == "flipped 1 edge of a flat triangle");
  REQUIRE(report.sound());
  REQUIRE(mesh.triangles.cols() == 6);
  REQUIRE(euler_characteristic(mesh) == 2);
  REQUIRE(volume(mesh) == Approx(1.0 / 6));
  REQUIRE(surface_area(mesh) == Approx(1.5 + std::sqrt(3.0) / 2));

  // At a border there is no neighbour to cut: the flat triangle is dropped.
  auto rim = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}}, {{0, 3, 2}, {3, 1, 2}, {0, 1, 3}});
  REQUIRE(to_string(repair(rim)) == "dropped 1 degenerate element");
  REQUIRE(surface_area(rim) == Approx(0.5));
}

// Yardstick: volume, and the sense of the untouched mesh.
TEMPLATE_TEST_CASE("triangles are turned until all face outward", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const good = make_sphere<TestType>(1, 4);
  Random random(Seed{7});
  for (int round = 0; round < 20; ++round) {
    auto mesh = good;
    int turned = 0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
      if (random() % (2 + unsigned(round) % 4) != 0) {
        std::swap(mesh.triangles(1, t), mesh.triangles(2, t));
        ++turned;
      }
    auto const report = repair(mesh, closed);
    REQUIRE(report.sound());
    REQUIRE(report.turned == turned);
    REQUIRE(mesh.triangles == good.triangles);
  }
  // An open sheet keeps the sense of most of its triangles.
  auto sheet = make_grid<TestType>(6, 6, 1);
  sheet.triangles.col(11).reverseInPlace();
  REQUIRE(repair(sheet).turned == 1);
  REQUIRE(validate(sheet).empty());
  // The wall of a cavity stays inward, a body beside it is turned.
  auto inner = make_sphere<TestType>(TestType(0.5), 2);
  inner.triangles.row(1).swap(inner.triangles.row(2));
  auto hollow = together(together(good, inner, {0, 0, 0}), inner, {3, 0, 0});
  REQUIRE(repair(hollow, closed).turned == 80);
  REQUIRE(validate(hollow, {.closed = true}).empty());
}

TEMPLATE_TEST_CASE("what can not be repaired is reported", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const good = make_sphere<TestType>(1, 2);
  SECTION("not finite") {
    auto mesh = good;
    mesh.points(2, 5) = std::numeric_limits<TestType>::quiet_NaN();
    auto const report = repair(mesh, closed);
    REQUIRE_FALSE(report.sound());
    REQUIRE(to_string(report) == "nothing repaired; 1 defect is left, the first: vertex 5 has the coordinate z = nan; correct it at "
                                 "the source, a position can not be guessed");
  }
  SECTION("out of range") {
    auto mesh = with_triangle(good, 3, 99, 1);
    REQUIRE(repair(mesh).left.at(0).kind == MeshDefectKind::vertex_out_of_range);
    mesh = with_triangle(good, 3, -7, 1);
    REQUIRE(repair(mesh).left.at(0).kind == MeshDefectKind::vertex_out_of_range);
  }
  SECTION("non-manifold edge") {
    auto mesh = good;
    mesh.points.conservativeResize(3, 43);
    mesh.points.col(42) << 0, 0, 3;
    mesh = with_triangle(mesh, mesh.triangles(0, 0), mesh.triangles(1, 0), 42);
    auto const report = repair(mesh);
    REQUIRE(report.left.size() == 1);
    REQUIRE(report.left[0].kind == MeshDefectKind::non_manifold_edge);
  }
  SECTION("hole") {
    auto mesh = good;
    mesh.triangles.conservativeResize(3, 79);
    REQUIRE(repair(mesh, closed).left.at(0).kind == MeshDefectKind::open_border);
  }
  SECTION("one-sided") {   // a Möbius band of five squares
    TriangleMesh<TestType> band;
    band.points.resize(3, 10);
    band.triangles.resize(3, 10);
    for (int i = 0; i < 5; ++i) {
      double const u = 2 * 3.14159265358979 * i / 5;
      for (int s = 0; s < 2; ++s) {
        double const w = s == 0 ? -0.3 : 0.3, r = 1 + w * std::cos(u / 2);
        band.points.col(2 * i + s) << TestType(r * std::cos(u)), TestType(r * std::sin(u)), TestType(w * std::sin(u / 2));
      }
      int const a = 2 * i, b = 2 * i + 1, c = i < 4 ? a + 2 : 1, d = i < 4 ? b + 2 : 0;
      band.triangles.col(2 * i) << a, c, b;
      band.triangles.col(2 * i + 1) << c, d, b;
    }
    auto const report = repair(band);
    REQUIRE_FALSE(report.sound());
    REQUIRE(report.left[0].kind == MeshDefectKind::inconsistent_orientation);
  }
  SECTION("empty") {
    TriangleMesh<TestType> nothing;
    REQUIRE(repair(nothing).left.at(0).kind == MeshDefectKind::empty);
  }
}

TEMPLATE_TEST_CASE("cut lips are not merged where they are wanted", "[mesh]", PALPATE_TEST_SCALARS) {
  auto mesh = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {3, 5, 4}});
  auto copy = mesh;
  REQUIRE_FALSE(repair(mesh, {.wanted = {.distinct_points = false}}).changed());
  REQUIRE(mesh.points.cols() == 6);
  REQUIRE(repair(copy).merged_vertices == 2);
  REQUIRE(copy.points.cols() == 4);
}

TEMPLATE_TEST_CASE("a volume is repaired", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const good = make_block<TestType>(3, 3, 3, TestType(0.1));
  auto mesh = good;
  mesh.points.conservativeResize(3, 29);
  mesh.points.col(27) = mesh.points.col(4);
  mesh.points.col(28) << 1, 1, 1;
  mesh.tetrahedra.conservativeResize(4, 51);
  mesh.tetrahedra.col(48) = mesh.tetrahedra.col(9);
  mesh.tetrahedra.col(49) << 0, 1, 3, 27;
  mesh.tetrahedra.col(50) << 0, 1, 1, 5;
  for (Eigen::Index t : {2, 20, 30}) std::swap(mesh.tetrahedra(2, t), mesh.tetrahedra(3, t));
  auto const report = repair(mesh);
  REQUIRE(report.sound());
  REQUIRE(mesh.points == good.points);
  REQUIRE(mesh.tetrahedra == good.tetrahedra);
  REQUIRE(to_string(report) == "merged 1 duplicate vertex, dropped 2 degenerate elements, dropped 1 duplicate element, turned 3 "
                               "elements, dropped 1 unused vertex");
  REQUIRE(report.new_index[27] == 4);
}

// Random damage (run with the sanitizers): repair returns, is at peace with `validate`, and a second repair changes nothing.
TEST_CASE("repair survives meshes of random numbers", "[mesh]") {
  Random random(Seed{5});
  for (int round = 0; round < 300; ++round) {
    auto mesh = make_sphere<double>(1, 2);
    int const hits = 1 + static_cast<int>(random() % 8);
    for (int k = 0; k < hits; ++k) {
      mesh.triangles(static_cast<int>(random() % 3), static_cast<Eigen::Index>(random() % 80)) =
          static_cast<int>(random() % 60) - 9;
      if (random() % 2) mesh.points.col(static_cast<int>(random() % 42)) = mesh.points.col(static_cast<int>(random() % 42)).eval();
      if (random() % 4 == 0)
        mesh.points.col(static_cast<int>(random() % 42)) =
            (mesh.points.col(static_cast<int>(random() % 42)) + mesh.points.col(static_cast<int>(random() % 42))).eval() / 2;
    }
    if (round % 5 == 0) mesh.points(1, static_cast<int>(random() % 42)) = std::numeric_limits<double>::quiet_NaN();
    auto const report = repair(mesh, closed);
    auto const found = validate(mesh, {.closed = true});
    REQUIRE(report.left.size() == found.size());
    for (std::size_t i = 0; i < found.size(); ++i) REQUIRE(to_string(report.left[i]) == to_string(found[i]));
    for (auto const& d : report.left) {
      REQUIRE(d.kind != MeshDefectKind::repeated_corner);
      REQUIRE(d.kind != MeshDefectKind::no_area);
      REQUIRE(d.kind != MeshDefectKind::unused_vertex);
      REQUIRE(d.kind != MeshDefectKind::duplicate_element);
      REQUIRE(d.kind != MeshDefectKind::duplicate_vertex);
    }
    auto again = mesh;
    repair(again, closed);
    REQUIRE(again.triangles == mesh.triangles);
  }
}
