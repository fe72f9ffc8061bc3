// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "volume/surfaces.hpp"

#include <palpate/volume/winding_number.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

using namespace palpate;

namespace {

/// Girard's theorem: the solid angle is the excess of the angles of the spherical triangle; its sign is that of the determinant.
double by_girard(TriangleMesh<double> const& mesh, Vector3<double> const& q) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Vector3<double> d[3];
    for (int c = 0; c < 3; ++c) d[c] = (mesh.points.col(mesh.triangles(c, t)) - q).normalized();
    double excess = -std::numbers::pi;
    for (int c = 0; c < 3; ++c) {
      Vector3<double> const u = d[c].cross(d[(c + 1) % 3]), w = d[c].cross(d[(c + 2) % 3]);
      excess += std::acos(std::clamp(u.normalized().dot(w.normalized()), -1.0, 1.0));
    }
    sum += d[0].dot(d[1].cross(d[2])) > 0 ? excess : -excess;
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace

TEST_CASE("the tree's winding number is the sum of solid angles by Girard's theorem", "[volume][winding_number]") {
  std::srand(1);
  for (auto const& [name, mesh, edge, whole] : palpate_test::surfaces()) {
    INFO(name);
    WindingNumber const winding(mesh);
    double worst = 0;
    for (int round = 0; round < 30; ++round) {
      Vector3<double> const q = 0.06 * Vector3<double>::Random();
      worst = std::max(worst, std::abs(winding(q) - by_girard(mesh, q)));
    }
    CHECK(worst < 0.05);
  }
}

// Yardstick: a disc of radius R seen from h above its middle covers 2 pi (1 - h / sqrt(h² + R²)).
TEST_CASE("the winding number of an open disc is its solid angle", "[volume][winding_number]") {
  int const n = 720;
  TriangleMesh<double> disc;
  disc.points.resize(3, n + 1);
  disc.triangles.resize(3, n);
  disc.points.col(n).setZero();
  for (int i = 0; i < n; ++i) {
    double const a = 2 * std::numbers::pi * i / n;
    disc.points.col(i) << 0.02 * std::cos(a), 0.02 * std::sin(a), 0;
    disc.triangles.col(i) << n, i, (i + 1) % n;
  }
  WindingNumber const winding(disc);
  for (double const h : {0.001, 0.02, 0.3}) CHECK(-winding({0, 0, h}) == Approx((1 - h / std::hypot(h, 0.02)) / 2).margin(1e-4));
  CHECK(winding({0, 0, -0.02}) == Approx((1 - std::sqrt(0.5)) / 2).epsilon(1e-3));
}

TEST_CASE("a winding number of nothing is zero, of what is no mesh refused", "[volume][winding_number]") {
  CHECK(WindingNumber(TriangleMesh<double>{})({0, 0, 0}) == 0);
  auto mesh = make_sphere<double>(0.03, 2);
  mesh.points(0, 3) = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(WindingNumber(mesh), InvalidMesh);
}
