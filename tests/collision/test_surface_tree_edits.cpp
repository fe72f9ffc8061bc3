// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "brute_force.hpp"
#include "catch.hpp"

#include <palpate/collision/surface_tree.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

using namespace palpate;
using namespace palpate_test;

namespace {

/// A mesh that is edited as a cutter does it, and the tree that follows: the model is the plain list of triangles.
template <class Scalar>
struct Edited {
  TriangleMesh<Scalar> mesh;
  SurfaceTree<Scalar> tree;

  explicit Edited(TriangleMesh<Scalar> start) : mesh(std::move(start)), tree(mesh) {}

  int triangles() const { return static_cast<int>(mesh.triangles.cols()); }
  int points() const { return static_cast<int>(mesh.points.cols()); }
  std::array<int, 3> corners(int t) const { return {mesh.triangles(0, t), mesh.triangles(1, t), mesh.triangles(2, t)}; }

  int add_point(Vector3<Scalar> const& point) {
    mesh.points.conservativeResize(3, points() + 1);
    mesh.points.col(points() - 1) = point;
    return points() - 1;
  }
  int add(std::array<int, 3> const& corners, int sibling) {
    mesh.triangles.conservativeResize(3, triangles() + 1);
    mesh.triangles.col(triangles() - 1) << corners[0], corners[1], corners[2];
    int const index = tree.add(mesh.points, corners, sibling);
    REQUIRE(index == triangles() - 1);
    return index;
  }
  void replace(int t, std::array<int, 3> const& corners) {
    mesh.triangles.col(t) << corners[0], corners[1], corners[2];
    tree.replace(mesh.points, t, corners);
  }
  void relabel(int t, std::array<int, 3> const& corners) {
    mesh.triangles.col(t) << corners[0], corners[1], corners[2];
    tree.relabel(mesh.points, t, corners);
  }
  void remove(int t) {
    mesh.triangles.col(t) = mesh.triangles.col(triangles() - 1).eval();
    mesh.triangles.conservativeResize(3, triangles() - 1);
    tree.remove(mesh.points, t);
  }

  /// A new particle in the triangle splits it in three.
  void split(int t, Random& random) {
    auto const c = corners(t);
    Scalar const u = random.uniform<Scalar>(), w = (1 - u) * random.uniform<Scalar>();
    int const p = add_point(mesh.points.col(c[0]) + u * (mesh.points.col(c[1]) - mesh.points.col(c[0])) +
                            w * (mesh.points.col(c[2]) - mesh.points.col(c[0])));
    if (p % 2 == 0) {
      add({c[1], c[2], p}, t);   // first, as a body does
      replace(t, {c[0], c[1], p});
    } else {
      replace(t, {c[0], c[1], p});
      add({c[1], c[2], p}, t);
    }
    add({c[2], c[0], p}, t);
    int const twin = add_point(mesh.points.col(p));
    relabel(t, {c[0], c[1], twin});
  }

  bool in_step() const { return tree.matches(mesh.points, mesh.triangles) && tree.depth() <= SurfaceTree<Scalar>::depth_limit; }

  void check_answers(Random& random, int queries) const {
    Scalar const size = extent(mesh), tolerance = 64 * std::numeric_limits<Scalar>::epsilon() * size;
    for (int i = 0; i < queries; ++i) {
      auto const query = random_in_box<Scalar>(random, size);
      auto const nearest = tree.nearest(mesh.points, query, i);
      REQUIRE(nearest.found());
      REQUIRE(std::abs(static_cast<long double>(nearest.distance) - surface_distance(mesh, query)) <= tolerance);
      REQUIRE(tree.nearest_vertex(mesh.points, query) == nearest_used_vertex(mesh, query));
    }
  }
};

int pick(Random& random, int size) { return static_cast<int>(random() % static_cast<unsigned>(size)); }

}  // namespace

TEMPLATE_TEST_CASE("Random edits keep queries exact, without a rebuild", "[collision][surface_tree]", float, double) {
  for (unsigned seed = 31; seed < 35; ++seed) {
    CAPTURE(seed);
    Random random(Seed{seed});
    Edited<TestType> body(seed % 2 ? make_grid<TestType>(6, 5, TestType(0.2)) : globe<TestType>(10, 6, TestType(0.5)));
    for (int edit = 0; edit < 800; ++edit) {
      // First the surface grows, then it shrinks, then both go on.
      int const kind = pick(random, 10), growth = edit < 250 ? 6 : edit < 550 ? 1 : 4;
      int const t = pick(random, body.triangles());
      if (kind < growth) {
        body.split(t, random);
      } else if (kind < 8 && body.triangles() > 1) {
        body.remove(t);
      } else if (kind == 8) {
        body.replace(t, {pick(random, body.points()), pick(random, body.points()), pick(random, body.points())});
      } else {
        body.add({pick(random, body.points()), pick(random, body.points()), pick(random, body.points())}, -1);
      }
      REQUIRE(body.in_step());
      if (edit % 50 == 0) {   // the body deforms between the edits
        deform<TestType>(body.mesh, random, TestType(0.05), 3);
        body.tree.refit(body.mesh.points);
        REQUIRE(body.in_step());
      }
      if (edit % 10 == 0) body.check_answers(random, 2);
    }
    body.check_answers(random, 50);
    while (body.triangles() > 0) {
      body.remove(pick(random, body.triangles()));
      REQUIRE(body.in_step());
    }
    CHECK(body.tree.empty());
    CHECK_FALSE(body.tree.nearest(body.mesh.points, Vector3<TestType>::Zero()).found());
    CHECK(body.add({0, 1, 2}, -1) == 0);
    CHECK(body.in_step());
  }
}

TEMPLATE_TEST_CASE("A surface may be built from nothing by edits", "[collision][surface_tree]", float, double) {
  Random random(Seed{41});
  auto const whole = globe<TestType>(20, 10, 1);
  Edited<TestType> body(TriangleMesh<TestType>{whole.points, Matrix<int, 3, Dynamic>(3, 0)});
  for (Eigen::Index t = 0; t < whole.triangles.cols(); ++t) {
    body.add({whole.triangles(0, t), whole.triangles(1, t), whole.triangles(2, t)}, -1);
    REQUIRE(body.in_step());
  }
  body.check_answers(random, 100);
}

TEMPLATE_TEST_CASE("The depth is bounded, however one-sided the edits", "[collision][surface_tree]", float, double) {
  Random random(Seed{42});
  Edited<TestType> body(make_grid<TestType>(3, 3, 1));
  int const point = body.add_point({TestType(0.3), TestType(0.2), 0});
  int last = 0;
  TestType offset = 1;
  for (int i = 0; i < 1200; ++i) {   // each beside the one before, towards one corner: the worst for a tree
    offset *= TestType(0.9);
    int const p = body.add_point({offset, offset / 2, 0});
    last = body.add({0, point, p}, last);
  }
  REQUIRE(body.in_step());
  CHECK(body.tree.depth() <= SurfaceTree<TestType>::depth_limit);
  body.check_answers(random, 50);
  for (int i = 0; i < 1150; ++i) body.remove(pick(random, body.triangles()));
  REQUIRE(body.in_step());
  body.check_answers(random, 50);
}

TEMPLATE_TEST_CASE("Triangles that come and go leave nothing behind", "[collision][surface_tree]", float, double) {
  REQUIRE(trap_works());
  Edited<TestType> body(make_grid<TestType>(8, 8, 1));
  auto const before = body.mesh;
  int const t = 40;
  auto const c = body.corners(t);
  int const p = body.add_point(before.points.col(c[0]));
  int const most = body.triangles() + 12;
  body.tree.reserve(most);
  auto const& points = body.mesh.points;
  long allocated = 0;
  for (int tick = 0; tick < 2000; ++tick) {   // the blade rests in one triangle: twelve come and go each tick
    AllocationCount const allocations;
    body.tree.replace(points, t, {c[0], c[1], p});
    for (std::size_t i = 0; i < 12; ++i) body.tree.add(points, {c[i % 3], c[(i + 1) % 3], p}, t);
    for (int i = 0; i < 12; ++i) body.tree.remove(points, body.tree.size() - 1);
    body.tree.replace(points, t, c);
    allocated += allocations.count();
  }
  CHECK(allocated == 0);
  CHECK(body.in_step());
  CHECK(body.tree.depth() <= 5);
}

TEMPLATE_TEST_CASE("Edits within what was reserved do not allocate", "[collision][surface_tree]", float, double) {
  REQUIRE(trap_works());
  Random random(Seed{44});
  auto const mesh = make_grid<TestType>(20, 20, 1);
  SurfaceTree<TestType> tree(mesh);
  int const most = 3000;
  tree.reserve(most);
  AllocationCount const allocations;
  for (int round = 0; round < 4; ++round) {
    while (tree.size() < most) {
      int const t = pick(random, tree.size());
      tree.add(mesh.points, tree.corners(t), round % 2 ? t : -1);
    }
    while (tree.size() > 10) tree.remove(mesh.points, pick(random, tree.size()));
  }
  int deepest = 0, depth = 0;
  while (tree.size() < most && depth >= deepest) {   // each beside the one before, until the tree is built anew
    deepest = std::max(deepest, depth);
    tree.add(mesh.points, tree.corners(tree.size() - 1), tree.size() - 1);
    depth = tree.depth();
  }
  CHECK(deepest == SurfaceTree<TestType>::depth_limit);
  CHECK(depth < deepest / 2);
  long const counted = allocations.count();
  CHECK(counted == 0);
}

TEMPLATE_TEST_CASE("A wrong edit throws and changes nothing", "[collision][surface_tree]", float, double) {
  Edited<TestType> body(make_grid<TestType>(3, 3, 1));
  auto& tree = body.tree;
  auto points = body.mesh.points;
  CHECK_THROWS_AS(tree.add(points, {0, 1, 9}, 0), InvalidArgument);
  CHECK_THROWS_AS(tree.add(points, {0, 1, -1}), InvalidArgument);
  CHECK_THROWS_AS(tree.add(points, {0, 1, 2}, 8), OutOfRange);
  CHECK_THROWS_AS(tree.add(points, {0, 1, 2}, -2), OutOfRange);
  CHECK_THROWS_AS(tree.replace(points, 8, {0, 1, 2}), OutOfRange);
  CHECK_THROWS_AS(tree.replace(points, 0, {0, 1, 9}), InvalidArgument);
  CHECK_THROWS_AS(tree.remove(points, -1), OutOfRange);
  points(0, 1) = std::numeric_limits<TestType>::infinity();
  CHECK_THROWS_AS(tree.add(points, {0, 1, 2}), InvalidArgument);
  CHECK(body.in_step());
  SurfaceTree<TestType> empty;
  CHECK_THROWS_AS(empty.remove(points, empty.size() - 1), OutOfRange);
}
