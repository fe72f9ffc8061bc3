// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "brute_force.hpp"
#include "catch.hpp"

#include <palpate/collision/surface_tree.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// Compares the tree with all triangles and all vertices, for queries near and far.
template <class Scalar>
void check_queries(SurfaceTree<Scalar> const& tree, TriangleMesh<Scalar> const& mesh, Random& random, int queries) {
  Scalar const eps = std::numeric_limits<Scalar>::epsilon();
  Scalar const size = extent(mesh);
  int hint = -1;
  for (int i = 0; i < queries; ++i) {
    Vector3<Scalar> query = random_in_box<Scalar>(random, i % 4 == 3 ? 10 * size : size);
    if (i % 4 == 1) query = mesh.points.col(static_cast<int>(random() % static_cast<unsigned>(mesh.points.cols())));
    if (i % 4 == 2) {   // close to the surface, where many triangles compete
      auto const corner = mesh.triangles.col(static_cast<int>(random() % static_cast<unsigned>(mesh.triangles.cols())));
      query = (mesh.points.col(corner[0]) + mesh.points.col(corner[1]) + mesh.points.col(corner[2])) / 3 +
              random_in_box<Scalar>(random, size / 50);
    }
    CAPTURE(i, query.transpose());
    SurfacePoint<Scalar> const nearest = tree.nearest(mesh.points, query);
    REQUIRE(nearest.found());
    REQUIRE(nearest.triangle < tree.size());
    Scalar const tolerance = 64 * eps * (query.norm() + size);
    long double const expected = surface_distance(mesh, query);
    REQUIRE(std::abs(static_cast<long double>(nearest.distance) - expected) <= tolerance);
    auto const corner = mesh.triangles.col(nearest.triangle);
    Vector3<Scalar> const combined = nearest.barycentric.x() * mesh.points.col(corner[0]) +
                                     nearest.barycentric.y() * mesh.points.col(corner[1]) +
                                     nearest.barycentric.z() * mesh.points.col(corner[2]);
    REQUIRE((combined - nearest.point).norm() <= tolerance);
    REQUIRE(std::abs((query - nearest.point).norm() - nearest.distance) <= tolerance);

    REQUIRE(tree.nearest_vertex(mesh.points, query) == nearest_used_vertex(mesh, query));
    REQUIRE(tree.nearest_vertex(mesh.points, query, hint) == nearest_used_vertex(mesh, query));

    for (int const any : {hint, nearest.triangle, static_cast<int>(random() % static_cast<unsigned>(tree.size()))}) {
      SurfacePoint<Scalar> const again = tree.nearest(mesh.points, query, any);   // a hint changes nothing
      REQUIRE(again.triangle == nearest.triangle);
      REQUIRE(again.point == nearest.point);
    }
    hint = nearest.triangle;
  }
}

}  // namespace

TEMPLATE_TEST_CASE("The nearest point and vertex agree with a search through everything", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  Random random(Seed{21});
  SECTION("grid") {
    auto const mesh = make_grid<TestType>(17, 11, TestType(0.1));
    SurfaceTree<TestType> const tree(mesh.points, mesh.triangles);
    REQUIRE(tree.matches(mesh.points, mesh.triangles));
    check_queries(tree, mesh, random, 400);
  }
  SECTION("sphere, from its centre too") {
    auto const mesh = globe<TestType>(24, 12, TestType(0.3));
    SurfaceTree<TestType> const tree(mesh);
    REQUIRE(tree.matches(mesh.points, mesh.triangles));
    check_queries(tree, mesh, random, 400);
    auto const centre = tree.nearest(mesh.points, Vector3<TestType>::Zero());
    CHECK(std::abs(static_cast<long double>(centre.distance) - surface_distance<TestType>(mesh, Vector3<TestType>::Zero())) <=
          8 * std::numeric_limits<TestType>::epsilon());
  }
  SECTION("every small size, so that every shape of a small tree is met") {
    auto const all = make_grid<TestType>(7, 6, 1);
    for (int count = 1; count <= all.triangles.cols(); ++count) {
      TriangleMesh<TestType> const mesh{all.points, all.triangles.leftCols(count)};
      SurfaceTree<TestType> const tree(mesh);
      REQUIRE(tree.size() == count);
      REQUIRE(tree.matches(mesh.points, mesh.triangles));
      check_queries(tree, mesh, random, 20);
    }
  }
}

TEMPLATE_TEST_CASE("A refitted tree is exact on a deforming surface", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  Random random(Seed{22});
  auto const rest = globe<TestType>(24, 12, TestType(0.3));
  SurfaceTree<TestType> tree(rest);
  for (int shape = 0; shape < 12; ++shape) {
    auto mesh = rest;
    deform<TestType>(mesh, random, TestType(0.05) * TestType(1 << (shape / 2)), TestType(6));   // up to five times the radius
    tree.refit(mesh.points);
    REQUIRE(tree.matches(mesh.points, mesh.triangles));
    check_queries(tree, mesh, random, 100);
  }
  tree.refit(rest.points);
  REQUIRE(tree.matches(rest.points, rest.triangles));
}

TEMPLATE_TEST_CASE("Refitting the moved triangles equals refitting all", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  Random random(Seed{23});
  auto mesh = globe<TestType>(24, 12, TestType(0.3));
  SurfaceTree<TestType> tree(mesh);
  for (int push = 0; push < 60; ++push) {
    int const vertex = static_cast<int>(random() % static_cast<unsigned>(mesh.points.cols()));
    mesh.points.col(vertex) += random_in_box<TestType>(random, push % 3 == 0 ? TestType(0.5) : TestType(0.01));
    std::vector<int> moved{-1, tree.size()};   // ignored
    for (int t = 0; t < mesh.triangles.cols(); ++t)
      if ((mesh.triangles.col(t).array() == vertex).any()) moved.push_back(t);
    tree.refit(mesh.points, moved);
    REQUIRE(tree.matches(mesh.points, mesh.triangles));
  }
  check_queries(tree, mesh, random, 100);
}

TEMPLATE_TEST_CASE("Among equals the lowest index wins", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  auto mesh = make_grid<TestType>(9, 9, 1);
  SurfaceTree<TestType> const tree(mesh);
  using V = Vector3<TestType>;
  // Over the middle of a square all four corners are equally near; over a vertex up to six triangles meet.
  CHECK(tree.nearest_vertex(mesh.points, V(2.5, 3.5, 1)) == 3 * 9 + 2);
  CHECK(tree.nearest_vertex(mesh.points, V(4, 4.5, 0)) == 4 * 9 + 4);
  int lowest = -1;
  for (int t = static_cast<int>(mesh.triangles.cols()) - 1; t >= 0; --t)
    if ((mesh.triangles.col(t).array() == 4 * 9 + 4).any()) lowest = t;
  for (int hint = -1; hint < tree.size(); ++hint) REQUIRE(tree.nearest(mesh.points, V(4, 4, 2), hint).triangle == lowest);
  CHECK(tree.nearest(mesh.points, V(4, 4, 2)).point == V(4, 4, 0));

  // The same triangle many times: no split separates them, and the first is the answer.
  TriangleMesh<TestType> heap;
  heap.points = Matrix<TestType, 3, 3>::Identity();
  heap.triangles.resize(3, 100);
  heap.triangles.colwise() = Eigen::Vector3i(0, 1, 2);
  SurfaceTree<TestType> const piled(heap);
  REQUIRE(piled.matches(heap.points, heap.triangles));
  CHECK(piled.nearest(heap.points, V(1, 1, 1), 57).triangle == 0);
}

TEMPLATE_TEST_CASE("Degenerate triangles are found like others", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  Random random(Seed{24});
  TriangleMesh<TestType> mesh;
  mesh.points.resize(3, 90);
  for (int i = 0; i < 90; ++i) mesh.points.col(i) = random_in_box<TestType>(random, 1);
  mesh.triangles.resize(3, 90);
  for (int i = 0; i < 90; ++i) {   // points, segments and triangles
    int const b = i % 3 == 0 ? i : (i + 1) % 90, c = i % 3 == 2 ? (i + 2) % 90 : b;
    mesh.triangles.col(i) << i, b, c;
  }
  SurfaceTree<TestType> const tree(mesh);
  check_queries(tree, mesh, random, 300);
}

TEMPLATE_TEST_CASE("Vertices that no triangle uses are not found", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  TriangleMesh<TestType> mesh;
  mesh.points.resize(3, 4);
  mesh.points << 0, 5, 6, 5, 0, 0, 0, 1, 0, 0, 0, 0;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 1, 2, 3;
  SurfaceTree<TestType> const tree(mesh);
  CHECK(tree.nearest_vertex(mesh.points, Vector3<TestType>::Zero()) == 1);
  CHECK(tree.nearest(mesh.points, Vector3<TestType>::Zero()).distance == 5);
}

TEMPLATE_TEST_CASE("Nothing to find, or nothing asked", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  TestType const nan = std::numeric_limits<TestType>::quiet_NaN(), inf = std::numeric_limits<TestType>::infinity();
  Matrix3X<TestType> const no_points(3, 0);
  Matrix<int, 3, Dynamic> const no_triangles(3, 0);
  for (SurfaceTree<TestType> const& empty : {SurfaceTree<TestType>(), SurfaceTree<TestType>(no_points, no_triangles)}) {
    CHECK(empty.empty());
    CHECK(empty.depth() == 0);
    CHECK_FALSE(empty.nearest(no_points, V::Zero()).found());
    CHECK(empty.nearest(no_points, V::Zero()).distance == inf);
    CHECK(empty.nearest_vertex(no_points, V::Zero()) == -1);
    CHECK(empty.matches(no_points, no_triangles));
  }
  auto mesh = make_grid<TestType>(5, 5, 1);
  SurfaceTree<TestType> tree(mesh);
  for (V const& bad : {V(nan, 0, 0), V(0, inf, 0), V(0, 0, -inf)}) {
    CHECK_FALSE(tree.nearest(mesh.points, bad).found());
    CHECK(tree.nearest_vertex(mesh.points, bad) == -1);
  }

  mesh.points.col(12).setConstant(nan);   // a body that went wrong: its triangles drop out, the others stay
  tree.refit(mesh.points);
  CHECK(tree.nearest(mesh.points, V(2, 2, 0)).distance == Approx(std::sqrt(0.5)));   // the hole's border is a diagonal
  CHECK(tree.nearest_vertex(mesh.points, V(2, 2, 0)) == 7);

  SurfaceTree<TestType> const taken = std::move(tree);
  CHECK(taken.size() == 32);
  CHECK_FALSE(tree.nearest(mesh.points, V::Zero()).found());
  CHECK(tree.nearest_vertex(mesh.points, V::Zero()) == -1);
  tree.refit(mesh.points);
  CHECK(tree.add(mesh.points, {0, 1, 6}) == 0);   // empty, and good for use
}

TEMPLATE_TEST_CASE("A surface that can not be searched is refused", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  auto mesh = make_grid<TestType>(3, 3, 1);
  auto const build = [&] { return SurfaceTree<TestType>(mesh.points, mesh.triangles); };
  mesh.triangles(2, 5) = 9;
  CHECK_THROWS_AS(build(), InvalidMesh);
  auto const complaint = [&]() -> std::string {
    try {
      build();
    } catch (InvalidMesh const& error) {
      return error.what();
    }
    return "none";
  };
  CHECK(complaint().find("triangle 5 has corner 9, but there are 9 points") == 0);
  mesh.triangles(2, 5) = -1;
  CHECK_THROWS_AS(build(), InvalidMesh);
  mesh = make_grid<TestType>(3, 3, 1);
  mesh.points(1, 4) = std::numeric_limits<TestType>::quiet_NaN();
  CHECK(complaint().find("triangle 0 has corner 4, whose coordinates are not finite") == 0);
  mesh.points(1, 4) = 1;
  auto tree = build();
  CHECK_THROWS_AS(tree.corners(8), OutOfRange);
  CHECK_THROWS_AS(tree.corners(-1), OutOfRange);
  CHECK(tree.corners(7) == std::array<int, 3>{4, 8, 7});
}

TEMPLATE_TEST_CASE("Any 3 x n columns will do", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  auto const mesh = make_grid<TestType>(6, 5, 1);
  Matrix<TestType, 4, Dynamic> padded(4, mesh.points.cols());
  padded.setConstant(77);
  padded.topRows(3) = mesh.points;
  SurfaceTree<TestType> tree(padded.topRows(3), mesh.triangles);
  Vector3<TestType> const query(2, 3, 4);
  CHECK(tree.nearest(padded.topRows(3), query).distance == 4);
  Eigen::Map<Matrix3X<TestType> const> const map(mesh.points.data(), 3, mesh.points.cols());
  CHECK(tree.nearest_vertex(map, query) == 3 * 6 + 2);
  CHECK(tree.nearest(2 * mesh.points, 2 * query).distance == 8);   // an expression is evaluated first
}

TEMPLATE_TEST_CASE("Queries and refits do not allocate and do not throw", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  REQUIRE(trap_works());
  auto const mesh = globe<TestType>(40, 20, 1);
  SurfaceTree<TestType> tree(mesh);
  Matrix<TestType, 4, Dynamic> padded(4, mesh.points.cols());
  padded.topRows(3) = mesh.points;
  Vector3<TestType> const query(1, 2, 3);
  std::vector<int> const moved{1, 2, 3, 4, 5, 700};
  AllocationCount const allocations;
  int found = 0;
  for (int i = 0; i < 100; ++i) {
    tree.refit(padded.topRows(3));
    tree.refit(mesh.points, moved);
    found += tree.nearest(mesh.points, query).found();
    found += tree.nearest_vertex(mesh.points, query, i) >= 0;
  }
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(found == 200);
  auto const& points = std::as_const(mesh.points);
  typename SurfaceTree<TestType>::Points const ref(points);
  STATIC_REQUIRE(noexcept(tree.refit(ref)));
  STATIC_REQUIRE(noexcept(tree.nearest(ref, query)));
  STATIC_REQUIRE(noexcept(tree.nearest_vertex(ref, query)));
}

TEMPLATE_TEST_CASE("Two trees find the pairs of triangles whose boxes meet", "[collision][surface_tree]", PALPATE_TEST_SCALARS) {
  Random random(Seed{26});
  using Mesh = TriangleMesh<TestType>;
  auto const box = [](Mesh const& mesh, Eigen::Index t) {
    Matrix<TestType, 3, 3> corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = mesh.points.col(mesh.triangles(k, t));
    return std::pair(Vector3<TestType>(corners.rowwise().minCoeff()), Vector3<TestType>(corners.rowwise().maxCoeff()));
  };
  auto const check = [&](SurfaceTree<TestType> const& tree, Mesh const& a, SurfaceTree<TestType> const& other, Mesh const& b) {
    std::vector<std::pair<int, int>> expected, found;   // brute force over all pairs
    for (int i = 0; i < a.triangles.cols(); ++i)
      for (int j = 0; j < b.triangles.cols(); ++j) {
        auto const [low, high] = box(a, i);
        auto const [lowest, highest] = box(b, j);
        if ((low.array() <= highest.array()).all() && (lowest.array() <= high.array()).all()) expected.emplace_back(i, j);
      }
    tree.visit_overlaps(a.points, other, b.points, [&](int i, int j) { found.emplace_back(i, j); });
    std::sort(found.begin(), found.end());
    REQUIRE(found == expected);
    return found.size();
  };
  auto a = globe<TestType>(16, 8, 1), b = globe<TestType>(20, 10, TestType(0.7));
  SurfaceTree<TestType> tree(a), other(b);
  for (int push = 0; push < 8; ++push) {   // through each other, and away
    Mesh moved = b;
    moved.points.colwise() += Vector3<TestType>(TestType(0.35) * TestType(push), TestType(0.1), 0);
    deform<TestType>(moved, random, TestType(0.05), 3);
    other.refit(moved.points);
    CHECK((check(tree, a, other, moved) > 0) == (push < 5));
  }
  CHECK(check(tree, a, tree, a) > std::size_t(a.triangles.cols()));   // itself

  // Boxes that touch in a corner belong to it; nothing meets an empty tree.
  Mesh const grid = make_grid<TestType>(3, 3, 1);
  Mesh beside = grid;
  beside.points.colwise() += Vector3<TestType>(2, 2, 0);
  CHECK(check(SurfaceTree<TestType>(grid), grid, SurfaceTree<TestType>(beside), beside) == 4);
  tree.visit_overlaps(a.points, SurfaceTree<TestType>(), a.points, [](int, int) { FAIL("nothing is there"); });
}

TEST_CASE("Threads may ask at the same time", "[collision][surface_tree]") {
  auto const mesh = globe<double>(24, 12, 1);
  SurfaceTree<double> const tree(mesh);
  std::vector<double> sums(2, 0.0);
  auto const ask = [&](int who) {
    Random random(Seed{5});
    for (int i = 0; i < 500; ++i) sums[std::size_t(who)] += tree.nearest(mesh.points, random_in_box<double>(random, 2)).distance;
  };
  std::thread other(ask, 1);
  ask(0);
  other.join();
  CHECK(sums[0] == sums[1]);
}
