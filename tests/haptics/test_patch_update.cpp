// SPDX-License-Identifier: MIT
// Yardsticks: the Jacobian by differences of the distance, and its pseudo-inverse by Eigen's orthogonal decomposition; a ball that moves, turns and
// grows, whose patch is known.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/surface_fit.hpp>

#include <Eigen/Geometry>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using namespace palpate;

namespace {

Vector3<double> updated_direction(Random& random) {
  Vector3<double> v;
  do v = {random.normal(), random.normal(), random.normal()};
  while (!(v.norm() > 0.1));
  return v.normalized();
}

SurfacePatch<double> patch_of(double curvature, Random& random) {
  return {.point = 0.05 * updated_direction(random), .normal = updated_direction(random), .curvature = curvature, .stiffness = 500};
}

/// Points on a patch, up to 8 mm from its own.
std::vector<Vector3<double>> points_on(SurfacePatch<double> const& patch, int count, Random& random) {
  std::vector<Vector3<double>> points;
  for (int k = 0; k < count; ++k) points.push_back(patch.anchored_at(patch.point + 0.008 * updated_direction(random)).point);
  return points;
}

}  // namespace

TEST_CASE("the parameters follow as the pseudo-inverse of the distance's Jacobian has it", "[haptics]") {
  Random random(Seed{1});
  for (double const curvature : {0.0, 30.0, -30.0})
    for (int round = 0; round < 50; ++round) {
      auto const patch = patch_of(curvature, random);
      auto const points = points_on(patch, 12, random);
      Vector3<double> const e = patch.normal.unitOrthogonal(), f = patch.normal.cross(e);
      Eigen::MatrixXd jacobian(12, 4);
      Eigen::VectorXd change(12);
      PatchUpdate<double> update(patch);
      for (int i = 0; i < 12; ++i) {
        auto const moved = [&](int parameter, double by) {
          Vector3<double> const tilt = (parameter == 1 ? by : 0) * e + (parameter == 2 ? by : 0) * f;
          PatchChange<double> const step{.height = parameter == 0 ? by : 0, .tilt = tilt, .curvature = parameter == 3 ? by : 0};
          return step.applied_to(patch).distance(points[static_cast<std::size_t>(i)]);
        };
        for (int p = 0; p < 4; ++p) {
          double const by = p == 0 ? 1e-6 : p == 3 ? 1e-3 : 1e-5;
          jacobian(i, p) = -(moved(p, by) - moved(p, -by)) / (2 * by);   // where the surface rises, the point's height over it falls
        }
        change[i] = 1e-4 * random.normal();
        update.add(points[static_cast<std::size_t>(i)], change[i]);
      }
      Eigen::VectorXd const expected = jacobian.colPivHouseholderQr().solve(change);
      auto const found = update.solve();
      double const size = change.norm();   // the curvature counts by what it is at 8 mm
      REQUIRE(std::abs(found.height - expected[0]) < 1e-4 * size);
      REQUIRE(std::abs(found.tilt.dot(e) - expected[1]) * 0.008 < 1e-4 * size);
      REQUIRE(std::abs(found.tilt.dot(f) - expected[2]) * 0.008 < 1e-4 * size);
      REQUIRE(std::abs(found.curvature - expected[3]) * 0.008 * 0.008 / 2 < 1e-4 * size);
      REQUIRE(std::abs(found.tilt.dot(patch.normal)) < 1e-12);
    }
}

TEST_CASE("a patch follows a ball that moves, turns and grows, to the second order", "[haptics]") {
  Random random(Seed{2});
  for (double const curvature : {25.0, -25.0})
    for (int round = 0; round < 50; ++round) {
      auto const patch = patch_of(curvature, random);
      auto const points = points_on(patch, 12, random);
      Vector3<double> const shift = 1e-3 * updated_direction(random), axis = updated_direction(random),
          centre = patch.point - patch.normal / curvature;
      auto const error = [&](double share) {
        Eigen::AngleAxisd const turn(0.05 * share, axis);
        double const grown = 1 + 0.03 * share;
        PatchUpdate<double> update(patch);
        for (auto const& p : points) update.add(p, Vector3<double>(centre + share * shift + grown * (turn * (p - centre)) - p));
        auto const next = update.solve().applied_to(patch);
        SurfacePatch<double> const truth{.point = centre + share * shift + grown / curvature * patch.normal, .normal = patch.normal,
            .curvature = curvature / grown};
        double worst = 0;
        for (auto const& p : points) worst = std::max(worst, std::abs(next.distance(p) - truth.distance(p)));
        return worst;
      };
      double const whole = error(1.0), half = error(0.5);
      REQUIRE(whole < 2e-4);   // m, of a way of 1 to 2 mm
      if (whole > 1e-6) REQUIRE(whole / half > 3.3);
    }
}

TEST_CASE("where the points say too little a patch moves and tilts, keeps its curvature, and stays finite", "[haptics]") {
  Random random(Seed{3});
  SurfacePatch<double> const patch{.normal = {0, 0, 1}, .curvature = 10, .stiffness = 500};
  PatchUpdate<double> nothing(patch), one(patch), line(patch), three(patch), same(patch), broken(patch);
  CHECK(nothing.solve().applied_to(patch) == patch);
  one.add(patch.point, 1e-3);
  CHECK(one.solve().height == Approx(1e-3).epsilon(1e-6));
  for (int k = -3; k <= 3; ++k) line.add(patch.anchored_at({0.002 * k, 0, 0}).point, 1e-3 * (1 + 0.1 * k));
  auto const along = line.solve();
  CHECK(along.height == Approx(1e-3).epsilon(1e-3));
  CHECK((along.tilt - Vector3<double>(-0.05, 0, 0)).norm() < 1e-3);
  for (int k = 0; k < 3; ++k) {
    Vector3<double> const around(0.004 * std::cos(2.1 * k), 0.004 * std::sin(2.1 * k), 0);
    three.add(patch.anchored_at(around).point, Vector3<double>(0, 0, 1e-3));
  }
  CHECK(three.solve().height == Approx(1e-3).epsilon(5e-3));
  CHECK(std::abs(three.solve().curvature) < 1.0);   // of the 125 that would move these three alone
  for (int k = 0; k < 10; ++k) same.add({0.001, 0, 0}, 1e-3);
  CHECK(std::abs(same.solve().height) < 2e-3);
  CHECK(same.solve().applied_to(patch).distance({0.001, 0, 0.001}) == Approx(0.0).margin(1e-5));
  double const nan = std::numeric_limits<double>::quiet_NaN();
  broken.add({nan, 0, 0}, 1.0);
  broken.add({0.001, 0, 0}, nan);
  CHECK(broken.count() == 0);
  PatchUpdate<double> flat(patch, false);
  for (auto const& p : points_on(patch, 10, random)) flat.add(p, 1e-3 * random.normal());
  CHECK(flat.solve().curvature == 0.0);
}

TEST_CASE("following allocates nothing", "[haptics]") {
  SurfacePatch<float> const patch{.curvature = 10, .stiffness = 500};
  palpate_test::AllocationCount const allocations;
  PatchUpdate<float> update(patch);
  for (int k = 0; k < 20; ++k) update.add({0.001f * float(k), 0.0005f * float(k * k % 7), 0}, 1e-3f);
  auto const next = update.solve().applied_to(patch);
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(next.distance({0, 0, 0}) == Approx(-1e-3).epsilon(0.02));
  static_assert(noexcept(update.solve()));
}
