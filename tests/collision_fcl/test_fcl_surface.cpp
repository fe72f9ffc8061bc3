// SPDX-License-Identifier: MIT
#include "../collision/brute_force.hpp"
#include "catch.hpp"

#include <palpate/collision/fcl_surface.hpp>
#include <palpate/collision/surface_tree.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

using namespace palpate;
using namespace palpate_test;

TEST_CASE("Two searches that share no code find the same nearest point on a deforming surface", "[collision][fcl]") {
  Random random(Seed{71});
  auto mesh = globe<double>(24, 12, 0.3);
  SurfaceTree<double> tree(mesh);
  FclSurface surface(mesh);
  for (int shape = 0; shape < 6; ++shape) {
    for (int i = 0; i < 400; ++i) {
      auto const query = random_in_box<double>(random, 0.6);
      auto const ours = tree.nearest(mesh.points, query);
      auto const theirs = surface.distance(SphereTip<double>{0.0}, query);
      CAPTURE(shape, query.transpose());
      REQUIRE(std::abs(ours.distance - theirs.distance) <= 1e-12);
      REQUIRE((ours.point - theirs.point).norm() <= 1e-9);
      REQUIRE((theirs.other_point - query).norm() <= 1e-12);
    }
    deform<double>(mesh, random, 0.1, 6);
    tree.refit(mesh.points);
    surface.refit(mesh.points);
  }
}

TEST_CASE("A cut surface agrees with one that FCL builds anew", "[collision][fcl]") {
  Random random(Seed{72});
  auto mesh = make_grid<double>(12, 12, 0.01);
  SurfaceTree<double> tree(mesh);
  for (int edit = 0; edit < 300; ++edit) {
    int const t = static_cast<int>(random() % static_cast<unsigned>(mesh.triangles.cols()));
    int const last = static_cast<int>(mesh.triangles.cols()) - 1;
    if (edit % 3 == 2) {   // a hole
      mesh.triangles.col(t) = mesh.triangles.col(last).eval();
      mesh.triangles.conservativeResize(3, last);
      tree.remove(mesh.points, t);
      continue;
    }
    Eigen::Vector3i const c = mesh.triangles.col(t);   // an edge point splits the triangle in two
    int const p = static_cast<int>(mesh.points.cols());
    mesh.points.conservativeResize(3, p + 1);
    mesh.points.col(p) = (mesh.points.col(c[0]) + mesh.points.col(c[1])) / 2 + random_in_box<double>(random, 1e-3);
    mesh.triangles.conservativeResize(3, last + 2);
    mesh.triangles.col(t) << c[0], p, c[2];
    mesh.triangles.col(last + 1) << p, c[1], c[2];
    tree.replace(mesh.points, t, {c[0], p, c[2]});
    tree.add(mesh.points, {p, c[1], c[2]}, t);
  }
  FclSurface const surface(mesh);
  for (int i = 0; i < 1000; ++i) {
    Vector3<double> const query = Vector3<double>(0.055, 0.055, 0) + random_in_box<double>(random, 0.08);
    REQUIRE(std::abs(tree.nearest(mesh.points, query).distance - surface.distance(SphereTip<double>{0.0}, query).distance) <= 1e-12);
  }
}

TEST_CASE("Balls and rods near a surface", "[collision][fcl]") {
  auto const mesh = make_grid<double>(11, 11, 0.1);   // the square [0, 1]² in z = 0: distances by hand
  FclSurface const surface(mesh);
  CHECK(surface.triangles() == 200);
  CHECK(surface.vertices() == 121);
  SphereTip<double> const ball{0.05};
  auto const above = surface.distance(ball, {0.33, 0.41, 0.25});
  CHECK(above.distance == Approx(0.20));
  CHECK((above.point - Vector3<double>(0.33, 0.41, 0)).norm() < 1e-12);
  CHECK(above.triangle >= 0);
  CHECK(above.other_triangle == -1);
  CHECK_FALSE(surface.touches(ball, {0.33, 0.41, 0.25}));
  CHECK(surface.distance(ball, {0.33, 0.41, 0.02}).distance == Approx(-0.03));   // overlap has a depth too
  CHECK(surface.touches(ball, {0.33, 0.41, 0.02}));
  CHECK(surface.distance(ball, {0.33, 0.41, 0}).distance == Approx(-0.05));
  CHECK(surface.distance(ball, {-0.3, 0.5, 0.4}).distance == Approx(0.45));      // beside the border

  Capsule<double> const slanted{{0.2, 0.2, 0.1}, {0.6, 0.2, 0.4}, 0.02};
  CHECK(surface.distance(slanted).distance == Approx(0.08));
  CHECK((surface.distance(slanted).point - Vector3<double>(0.2, 0.2, 0)).norm() < 1e-12);
  Capsule<double> const through{{0.2, 0.2, 0.1}, {0.25, 0.22, -0.1}, 0.02};
  CHECK(surface.distance(through).distance == Approx(-0.02));
  CHECK(surface.touches(through));
}

TEST_CASE("A rod's distance is the least of the distances along its axis", "[collision][fcl]") {
  Random random(Seed{73});
  auto mesh = globe<double>(24, 12, 0.3);
  deform<double>(mesh, random, 0.05, 6);
  FclSurface const surface(mesh);
  SurfaceTree<double> const tree(mesh);
  for (int i = 0; i < 40; ++i) {
    Capsule<double> const rod{random_in_box<double>(random, 0.6), random_in_box<double>(random, 0.6), 0.01};
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= 4000; ++k)
      least = std::min(least, tree.nearest(mesh.points, rod.from + k / 4000.0 * (rod.to - rod.from)).distance);
    double const spacing = (rod.to - rod.from).norm() / 4000;
    double const asked = surface.distance(rod).distance + rod.radius;
    REQUIRE(asked <= least + 1e-12);
    REQUIRE(asked >= least - spacing);
  }
}

TEST_CASE("Surface against surface", "[collision][fcl]") {
  auto const mesh = globe<double>(24, 12, 0.3);
  FclSurface const left(mesh), right(mesh);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Vector3<double>(0, 0, 1);   // poles face each other: 1 − 2·0.3
  auto const apart = left.distance(right, pose);
  CHECK(apart.distance == Approx(0.4));
  CHECK((apart.point - Vector3<double>(0, 0, 0.3)).norm() < 1e-12);
  CHECK((apart.other_point - Vector3<double>(0, 0, 0.7)).norm() < 1e-12);
  CHECK(left.collide(right, pose).empty());

  pose.translation() = Vector3<double>(0.01, 0.02, 0.5);
  pose.rotate(Eigen::AngleAxisd(0.3, Vector3<double>(1, 2, 3).normalized()));
  CHECK(left.distance(right, pose).distance == Approx(0).margin(1e-12));
  auto const pairs = left.collide(right, pose);
  // Independent: an edge of one triangle meets the other one, tried on all pairs in long double.
  auto const corner = [&](int t, int k) -> Long3 { return mesh.points.col(mesh.triangles(k, t)).cast<long double>(); };
  auto const placed = [&](int t, int k) -> Long3 {
    return (pose * Vector3<double>(mesh.points.col(mesh.triangles(k, t)))).cast<long double>();
  };
  auto const pierces = [](Long3 const& p, Long3 const& q, Long3 const& a, Long3 const& b, Long3 const& c) {
    Long3 const n = (b - a).cross(c - a);
    long double const s = n.dot(p - a), e = n.dot(q - a);
    if (s * e > 0 || s == e) return false;
    Long3 const x = p + s / (s - e) * (q - p);
    return n.dot((b - a).cross(x - a)) >= 0 && n.dot((c - b).cross(x - b)) >= 0 && n.dot((a - c).cross(x - c)) >= 0;
  };
  std::set<std::pair<int, int>> expected, found;
  for (int s = 0; s < left.triangles(); ++s)
    for (int t = 0; t < right.triangles(); ++t)
      for (int k = 0; k < 3; ++k)
        if (pierces(corner(s, k), corner(s, (k + 1) % 3), placed(t, 0), placed(t, 1), placed(t, 2)) ||
            pierces(placed(t, k), placed(t, (k + 1) % 3), corner(s, 0), corner(s, 1), corner(s, 2)))
          expected.emplace(s, t);
  for (TrianglePair const& pair : pairs) found.emplace(pair.triangle, pair.other_triangle);
  CHECK(expected.size() > 50);
  CHECK(found == expected);
  CHECK(left.collide(right, pose, 3).size() == 3);
  CHECK(left.collide(right, pose, 0).empty());
}

TEST_CASE("A surface that FCL can not hold is refused", "[collision][fcl]") {
  auto const refused = [](TriangleMesh<double> const& mesh, std::string const& why) {
    try {
      FclSurface const surface(mesh);
    } catch (InvalidMesh const& error) {
      return std::string(error.what()).find(why) != std::string::npos;
    }
    return false;
  };
  auto mesh = make_grid<double>(3, 3, 1);
  CHECK(refused({mesh.points, Matrix<int, 3, Dynamic>(3, 0)}, "without triangles"));
  mesh.triangles(1, 2) = 9;
  CHECK(refused(mesh, "triangle 2 has corner 9, but there are 9 points"));
  mesh = make_grid<double>(3, 3, 1);
  mesh.points(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK(refused(mesh, "not finite"));
  auto const good = make_grid<double>(3, 3, 1);
  FclSurface surface(good);
  CHECK_THROWS_AS(surface.refit(good.points.leftCols(8)), InvalidArgument);
  CHECK_THROWS_AS(surface.refit(mesh.points), InvalidArgument);
  CHECK_THROWS_AS(surface.distance(SphereTip<double>{0.1}, {0, std::numeric_limits<double>::infinity(), 0}), InvalidArgument);
  CHECK_THROWS_AS(surface.distance(SphereTip<double>{-1}, {0, 0, 0}), InvalidArgument);
  CHECK(surface.distance(SphereTip<double>{0.5}, {1, 1, 2}).distance == Approx(1.5));   // still whole
}
