// SPDX-License-Identifier: MIT
// Yardsticks: the radial direction of a ball; the vertex normals of the whole mesh, computed by mesh/normals.hpp; a rotation by Eigen.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "haptics/skin.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/shaded_normal.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/sphere.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;
using palpate_test::Skin;

namespace {

template <RealScalar S>
Vector3<S> shares(Random& random) {
  Vector3<S> w(random.uniform(S(0), S(1)), random.uniform(S(0), S(1)), random.uniform(S(0), S(1)));
  return w / w.sum();
}

template <RealScalar S>
Vector3<S> point_of(Skin<S> const& skin, int t, Vector3<S> const& w) {
  auto const c = skin.tissue().surface().corners(t);
  return w[0] * skin.points.col(c[0]) + w[1] * skin.points.col(c[1]) + w[2] * skin.points.col(c[2]);
}

/// The largest angle between the ball's own direction and the shaded and the facets' normals.
struct Tilts {
  double shaded = 0, facets = 0;
};
Tilts tilts(int frequency) {
  auto const ball = make_sphere<double>(0.05, frequency);
  Skin<double> const skin(ball);
  Random random(Seed{1});
  Tilts most;
  for (int t = 0; t < ball.triangles.cols(); ++t) {
    Vector3<double> const w = shares<double>(random), out = point_of(skin, t, w).normalized();
    most.shaded = std::max(most.shaded, std::asin(std::min(1.0, shaded_normal(skin, t, w).cross(out).norm())));
    most.facets = std::max(most.facets, std::asin(std::min(1.0, triangle_normal(ball, t).cross(out).norm())));
  }
  return most;
}

}  // namespace

TEST_CASE("on a ball of triangles the shaded normal is the ball's, to a fortieth of what a facet's is off", "[haptics]") {
  auto const coarse = tilts(8), fine = tilts(16);
  INFO("shaded " << coarse.shaded << ", " << fine.shaded << " rad, facets " << coarse.facets << ", " << fine.facets << " rad");
  CHECK(coarse.facets / fine.facets == Approx(2.0).epsilon(0.15));
  CHECK(coarse.shaded < coarse.facets / 40);
  CHECK(fine.shaded < fine.facets / 40);
  CHECK(coarse.shaded / fine.shaded > 2.5);   // of higher order than 1
}

TEMPLATE_TEST_CASE("at the corners it is the mesh's vertex normal, and from both sides of an edge the same", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const close = 64 * std::numeric_limits<S>::epsilon();
  auto mesh = make_sphere<S>(S(0.05), 6);
  Random random(Seed{2});
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) *= S(1) + S(0.02) * random.uniform(S(-1), S(1));
  Skin<S> const skin(mesh);
  auto const& surface = skin.tissue().surface();
  Matrix3X<S> const normals = vertex_normals(mesh);
  for (int t = 0; t < surface.triangle_count(); ++t) {
    auto const c = surface.corners(t);
    for (int const v : c) REQUIRE(double((smooth_normal(skin, v) - normals.col(v)).norm()) <= close);
    int const other = surface.triangle_with_edge(c[1], c[0]);
    auto const there = surface.corners(other);
    S const share = random.uniform(S(0), S(1));
    Vector3<S> here(share, S(1) - share, S(0)), across = Vector3<S>::Zero();
    for (int k = 0; k < 3; ++k) {
      int const v = there[static_cast<std::size_t>(k)];
      across[k] = v == c[0] ? share : v == c[1] ? S(1) - share : S(0);
    }
    REQUIRE(double((shaded_normal(skin, t, here, S(1.4)) - shaded_normal(skin, other, across, S(1.4))).norm()) <= close);
  }
}

TEST_CASE("it is never tilted by more than it may, so that no force points inward, also on a crumpled surface", "[haptics]") {
  auto mesh = make_sphere<double>(0.05, 4);
  Random random(Seed{3});
  bool was_cut = false;
  for (int round = 0; round < 50; ++round) {
    Skin<double> skin(mesh);
    for (Eigen::Index i = 0; i < skin.points.size(); ++i) skin.points(i) += 0.02 * random.normal();
    if (round % 2 == 0) skin.points.col(0) = skin.points.col(1) = skin.points.col(2);   // facets without area
    for (int t = 0; t < mesh.triangles.cols(); ++t) {
      auto const c = skin.tissue().surface().corners(t);
      Vector3<double> const facet = triangle_normal<double>(skin.points.col(c[0]), skin.points.col(c[1]), skin.points.col(c[2]));
      for (double const tilt : {0.0, 0.3, 1.0, 10.0}) {
        Vector3<double> const n = shaded_normal(skin, t, shares<double>(random), tilt);
        if (facet.isZero(0)) {
          REQUIRE((n.isZero(0) || std::abs(n.norm() - 1) < 1e-12));
          continue;
        }
        REQUIRE(std::abs(n.norm() - 1) < 1e-12);
        double const angle = std::atan2(facet.cross(n).norm(), facet.dot(n));
        REQUIRE(angle <= std::min(tilt, 1.484) + 1e-9);
        was_cut = was_cut || (tilt == 0.3 && angle > 0.299);
      }
    }
  }
  CHECK(was_cut);
}

TEST_CASE("a force turns with the normal, friction too", "[haptics]") {
  Random random(Seed{4});
  for (int round = 0; round < 200; ++round) {
    Vector3<double> const n = Vector3<double>(random.normal(), random.normal(), random.normal()).normalized();
    Vector3<double> const s = (n + 0.5 * Vector3<double>(random.normal(), random.normal(), random.normal()).normalized()).normalized();
    Vector3<double> const force(random.normal(), random.normal(), random.normal());
    Vector3<double> const expected = Eigen::Quaterniond::FromTwoVectors(n, s) * force;
    REQUIRE((shaded_force(force, n, s) - expected).norm() < 1e-12);
    REQUIRE((shaded_force(force, n, n) - force).norm() < 1e-14);
  }
}

TEST_CASE("shading allocates nothing", "[haptics]") {
  Skin<double> const skin(make_sphere<double>(0.05, 4));
  palpate_test::AllocationCount const allocations;
  Vector3<double> const n = shaded_normal(skin, 7, {0.2, 0.3, 0.5});
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(n.norm() == Approx(1.0));
}
