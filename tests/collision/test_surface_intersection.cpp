// SPDX-License-Identifier: MIT
// The volume that two surfaces have in common. Yardsticks: boxes and half a ball in closed form; convex bodies whose faces are cut by each other's planes here; points
// of a fine raster and small triangles for what is not convex.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/collision/surface_intersection.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/volume/winding_number.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

using Place = Vector3<double>;

template <class S>
struct Body {
  TriangleMesh<S> mesh;
  SurfaceTopology topology;
  SurfaceTree<S> tree;
  explicit Body(TriangleMesh<S> skin) : mesh(std::move(skin)), topology(static_cast<int>(mesh.points.cols()), mesh.triangles), tree(mesh) {}
  MovingSurface<S> now() { return (tree.refit(mesh.points), MovingSurface<S>{topology, tree, mesh.points}); }
  void move(Place const& by) { mesh.points.colwise() += by.cast<S>(); }
};
template <class S>
Body<S> block(int n, double edge) {
  TriangleMesh<S> skin = surface(make_block<S>(n, n, n, S(edge), BlockPattern::alternating));
  repair(skin);
  return Body<S>(skin);
}

/// Of two convex bodies: the faces of each, cut by the planes of the other.
double convex_volume(TriangleMesh<double> const& a, TriangleMesh<double> const& b) {
  double sum = 0;
  Place const o = a.points.col(0);
  for (auto const& [of, by] : {std::pair{&a, &b}, std::pair{&b, &a}})
    for (Eigen::Index t = 0; t < of->triangles.cols(); ++t) {
      std::vector<Place> face;
      for (int k = 0; k < 3; ++k) face.push_back(of->points.col(of->triangles(k, t)));
      Place const normal = (face[1] - face[0]).cross(face[2] - face[0]).normalized();
      for (Eigen::Index p = 0; p < by->triangles.cols() && !face.empty(); ++p) {
        Place const q = by->points.col(by->triangles(0, p)), u = by->points.col(by->triangles(1, p)), v = by->points.col(by->triangles(2, p));
        Place const out = (u - q).cross(v - q).normalized();
        std::vector<Place> kept;
        for (std::size_t k = 0; k < face.size(); ++k) {
          Place const &from = face[k], &to = face[(k + 1) % face.size()];
          double const at_from = out.dot(from - q), at_to = out.dot(to - q);
          if (at_from <= 0) kept.push_back(from);
          if ((at_from <= 0) != (at_to <= 0)) kept.push_back(from + at_from / (at_from - at_to) * (to - from));
        }
        face = kept;
      }
      for (std::size_t k = 2; k < face.size(); ++k) sum += normal.dot((face[k - 1] - face[0]).cross(face[k] - face[0])) / 2 * normal.dot(face[0] - o) / 3;
    }
  return sum;
}

/// Sum and moment of the gradients of one surface.
template <class S>
std::pair<Place, Place> sums(SurfaceIntersection<S> const& common, int k, Body<S> const& body) {
  std::pair<Place, Place> all{Place::Zero(), Place::Zero()};
  for (auto const& one : common.gradient(k)) {
    Place const g = one.gradient.template cast<double>(), x = Vector3<S>(body.mesh.points.col(one.vertex)).template cast<double>();
    all.first += g, all.second += x.cross(g);
  }
  return all;
}

/// A ball that is stretched and turned at random: convex.
Body<double> ellipsoid(Random& random, double radius, int frequency) {
  auto mesh = make_sphere<double>(radius, frequency);
  auto const any = [&] { return random.uniform(-1.0, 1.0); };
  Eigen::Matrix3d const turn = Eigen::Quaterniond(Eigen::Vector4d(any(), any(), any(), any()).normalized()).toRotationMatrix();
  Eigen::Vector3d const stretch(random.uniform(0.5, 1.5), random.uniform(0.5, 1.5), random.uniform(0.5, 1.5));
  mesh.points = turn * stretch.asDiagonal() * mesh.points;
  return Body<double>(mesh);
}

}  // namespace

TEMPLATE_TEST_CASE("what two boxes have in common is a box, also where faces lie in one plane", "[collision][intersection]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const close = std::is_same_v<S, float> ? 1e-4 : 2e-8;   // of what is 0.1 mm thick
  struct Case {
    int n;
    double edge;
    Place at, common;
  };
  for (auto const& [n, edge, at, common] : std::vector<Case>{{5, 0.0075, {0.02, 0.013, 0.025}, {0.01, 0.017, 0.005}},
                                                              {5, 0.0075, {0, 0, 0.025}, {0.03, 0.03, 0.005}},
                                                              {4, 0.01, {0, 0, 0.025}, {0.03, 0.03, 0.005}},
                                                              {4, 0.01, {0.01, 0, 0.0299}, {0.02, 0.03, 0.0001}},
                                                              {3, 0.03, {-0.015, -0.015, 0.02}, {0.03, 0.03, 0.01}}}) {
    auto a = block<S>(4, 0.01), b = block<S>(n, edge);
    b.move(at);
    SurfaceIntersection<S> both;
    both.find(a.now(), b.now());
    CAPTURE(n, edge, at[0], at[2]);
    CHECK(both.volume() == Approx(common.prod()).epsilon(close));
    // On a box, what is inside another is a corner, a rim or a face: the sums are its areas.
    Place const face(at[0] > 0 ? common[1] * common[2] : 0, at[1] > 0 ? common[0] * common[2] : 0, common[0] * common[1]);
    auto const first = sums(both, 0, a), second = sums(both, 1, b);
    CHECK(first.first[2] == Approx(face[2]).epsilon(close));
    if (at[0] > 0) CHECK(first.first[0] == Approx(face[0]).epsilon(close));
    CHECK((first.first + second.first).norm() < (std::is_same_v<S, float> ? 1e-6 : 1e-13) * face.norm());
    CHECK((first.second + second.second).norm() < (std::is_same_v<S, float> ? 1e-5 : 1e-9) * face.norm() * 0.05);
  }
}

TEST_CASE("faces that are in one plane but for rounding, and a surface on itself", "[collision][intersection]") {
  double worst = 0;
  for (double const off : {1e-18, 4e-18, 1e-17, 3e-16, 5e-15, 1e-14, 2e-13, 5e-13, 3e-12, 1e-10, 1e-8})
    for (int axis = 0; axis < 3; ++axis)
      for (double const sign : {-1.0, 1.0}) {
        auto a = block<double>(4, 0.01), b = block<double>(4, 0.01);
        Place by(0.0113, 0.0113, 0.0113);
        by[axis] = sign * off;
        b.move(by);
        SurfaceIntersection<double> both;
        both.find(a.now(), b.now());
        Place left = Place::Constant(0.03) - by.cwiseAbs();
        worst = std::max(worst, std::abs(both.volume() - left.prod()) / left.prod());
      }
  CHECK(worst < 1e-8);
  Body<double> organ(make_organ<double>({.vertices = 300})), twin = organ;
  for (double const off : {0.0, 1e-17, 1e-13, 1e-9}) {
    twin.mesh.points = organ.mesh.points;
    twin.move({off, 0, -off});
    SurfaceIntersection<double> both;
    both.find(organ.now(), twin.now());
    CHECK(both.volume() == Approx(volume(organ.mesh)).epsilon(1e-6));
  }
}

// Yardstick: sides a, b, c of the common box; of its border ∫ x² dA = a²/2 · bc + a³(b + c)/6 about its middle, and nothing of mixed products.
TEST_CASE("what two boxes have in common has the middle and the second moments of a box", "[collision][intersection]") {
  auto one = block<double>(4, 0.01), other = block<double>(6, 0.007);
  one.move({0.1, -0.2, 0.3}), other.move(Place(0.1, -0.2, 0.3) + Place(0.0213, 0.0177, 0.0121));
  SurfaceIntersection<double> common;
  common.find(one.now(), other.now());
  REQUIRE(common.regions().size() == 1);
  auto const& region = common.regions()[0];
  Place const sides = Place::Constant(0.03) - Place(0.0213, 0.0177, 0.0121), middle = Place(0.1, -0.2, 0.3) + Place::Constant(0.03) - sides / 2;
  CHECK((region.middle - middle).norm() < 1e-9);
  for (int k = 0; k < 3; ++k) {
    double const a = sides[k], b = sides[(k + 1) % 3], c = sides[(k + 2) % 3], wanted = a * a / 2 * b * c + a * a * a * (b + c) / 6;
    CHECK(region.spread(k, k) == Approx(wanted / 2).epsilon(1e-6));
    CHECK(std::abs(region.spread(k, (k + 1) % 3)) < 1e-6 * wanted);
  }
}

TEST_CASE("half a ball is in a block, by its own volume", "[collision][intersection]") {
  auto a = block<double>(2, 0.1);
  Body<double> b(make_sphere<double>(0.02, 9));
  b.move({0.05, 0.047, 0.1});
  SurfaceIntersection<double> both;
  both.find(a.now(), b.now());
  CHECK(both.volume() == Approx(volume(b.mesh) / 2).epsilon(1e-9));
  CHECK(both.pairs() > 0);
}

TEST_CASE("convex bodies at random have the volume in common that their planes cut, and its change as they move is the gradient", "[collision][intersection]") {
  Random random(Seed{5});
  int met = 0;
  double worst_volume = 0, worst_force = 0, worst_balance = 0, worst_moment = 0;
  for (int round = 0; round < 40; ++round) {
    auto a = ellipsoid(random, 0.05, 3 + round % 4), b = ellipsoid(random, 0.04, 3 + round % 3);
    Place const way = Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)).normalized();
    b.move(random.uniform(0.03, 0.1) * way);
    SurfaceIntersection<double> both;
    both.find(a.now(), b.now());
    double const exact = convex_volume(a.mesh, b.mesh);
    if (!both.touches()) {   // apart, or one in the other
      CHECK((exact < 1e-15 || exact > 0.99 * std::min(volume(a.mesh), volume(b.mesh))));
      continue;
    }
    ++met;
    worst_volume = std::max(worst_volume, std::abs(both.volume() - exact) / exact);
    auto const first = sums(both, 0, a), second = sums(both, 1, b);
    Place slope;
    double const step = 1e-6;
    for (int k = 0; k < 3; ++k) {
      auto ahead = a.mesh, behind = a.mesh;
      ahead.points.row(k).array() += step, behind.points.row(k).array() -= step;
      slope[k] = (convex_volume(ahead, b.mesh) - convex_volume(behind, b.mesh)) / (2 * step);
    }
    double const scale = first.first.norm();
    worst_force = std::max(worst_force, (first.first - slope).norm() / std::pow(exact, 2.0 / 3));
    worst_balance = std::max(worst_balance, (first.first + second.first).norm() / scale);
    worst_moment = std::max(worst_moment, (first.second + second.second).norm() / (scale * 0.1));
  }
  CAPTURE(met, worst_volume, worst_force, worst_balance, worst_moment);
  CHECK(met > 20);
  CHECK(worst_volume < 1e-6);
  CHECK(worst_force < 1e-5);
  CHECK(worst_balance < 1e-12);
  CHECK(worst_moment < 1e-6);
}

TEST_CASE("the gradient of each vertex is the integral of its shape function over what is inside", "[collision][intersection]") {
  // Small triangles, and whether their middle is inside by the winding number: to a hundredth.
  Body<double> a(make_organ<double>({.vertices = 300})), b(make_sphere<double>(0.045, 4));
  b.move(Place(a.mesh.points.rowwise().mean()) + Place(0.01, 0.02, 0.05));
  SurfaceIntersection<double> both;
  both.find(a.now(), b.now());
  REQUIRE(both.touches());
  for (int k = 0; k < 2; ++k) {
    auto const& own = k == 0 ? a : b;
    WindingNumber const other((k == 0 ? b : a).mesh);
    Matrix3X<double> sum = Matrix3X<double>::Zero(3, own.mesh.points.cols());
    constexpr int parts = 24;
    for (Eigen::Index t = 0; t < own.mesh.triangles.cols(); ++t) {
      Place const o = own.mesh.points.col(own.mesh.triangles(0, t)), u = Place(own.mesh.points.col(own.mesh.triangles(1, t))) - o,
                  v = Place(own.mesh.points.col(own.mesh.triangles(2, t))) - o, area = u.cross(v) / (2 * parts * parts);
      for (int i = 0; i < parts; ++i)
        for (int j = 0; i + j < parts; ++j)
          for (double const third : {1 / 3.0, 2 / 3.0}) {   // those that stand upright, and on their head
            double const p = (i + third) / parts, q = (j + third) / parts;
            if (p + q > 1 || other(Place(o + p * u + q * v)) < 0.5) continue;
            double const share[] = {1 - p - q, p, q};
            for (int c = 0; c < 3; ++c) sum.col(own.mesh.triangles(c, t)) += share[c] * area;
          }
    }
    double const largest = sum.colwise().norm().maxCoeff();
    for (auto const& one : both.gradient(k)) sum.col(one.vertex) -= one.gradient;
    CHECK(sum.colwise().norm().maxCoeff() < 0.02 * largest);
  }
}

TEST_CASE("the cost of a contact is that of the triangles that meet and lie inside, and a second one allocates nothing", "[collision][intersection]") {
  REQUIRE(trap_works());
  std::vector<double> share;
  for (int const frequency : {8, 16, 32}) {
    Body<double> a(make_sphere<double>(0.05, frequency)), b(make_sphere<double>(0.05, frequency));
    b.move({0.09, 0.011, 0.013});
    SurfaceIntersection<double> both;
    both.find(a.now(), b.now());
    REQUIRE(both.pairs() > 0);
    share.push_back(static_cast<double>(both.visited()) / both.pairs());
    b.move({1e-5, 0, 0});
    auto const first = a.now(), second = b.now();
    AllocationCount const allocations;
    both.find(first, second);
    CHECK(allocations.count() == 0);
  }
  CAPTURE(share[0], share[1], share[2]);
  CHECK(share[2] < 2 * share[0]);
}

TEST_CASE("a body that touches another in two places has two regions, each with its own volume and balance", "[collision][intersection]") {
  // A bar across two blocks; by hand.
  auto bar_mesh = surface(make_block<double>(13, 3, 3, 0.01, BlockPattern::alternating));
  repair(bar_mesh);
  Body<double> bar(bar_mesh);
  auto legs_mesh = surface(make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating)), leg = legs_mesh;
  leg.points.row(0).array() += 0.08;
  TriangleMesh<double> both_legs{Matrix3X<double>(3, 2 * leg.points.cols()), Matrix<int, 3, Dynamic>(3, 2 * leg.triangles.cols())};
  both_legs.points << legs_mesh.points, leg.points;
  both_legs.triangles << legs_mesh.triangles, (leg.triangles.array() + static_cast<int>(leg.points.cols())).matrix();
  repair(both_legs);
  Body<double> legs(both_legs);
  bar.move({0.0013, 0.0047, 0.028});
  SurfaceIntersection<double> common;
  common.find(legs.now(), bar.now());
  REQUIRE(common.regions().size() == 2);
  CHECK(common.volume() == Approx(0.02 * 0.002 * (0.0287 + 0.03)).epsilon(1e-8));
  for (auto const& region : common.regions()) {
    CHECK((std::abs(region.volume - 0.02 * 0.002 * 0.0287) < 1e-13 || std::abs(region.volume - 0.02 * 0.002 * 0.03) < 1e-13));
    Place sum = Place::Zero();
    double size = 0;
    for (int k = 0; k < 2; ++k)
      for (auto const& one : common.gradient(k, region)) sum += one.gradient, size += one.gradient.norm();
    CHECK(sum.norm() < 1e-13 * size);
  }
}

TEST_CASE("bodies apart and one in the other have no contour", "[collision][intersection]") {
  Body<double> a(make_sphere<double>(0.05, 5)), b(make_sphere<double>(0.01, 5));
  SurfaceIntersection<double> both;
  both.find(a.now(), b.now());
  CHECK_FALSE(both.touches());
  CHECK(both.volume() == 0);
  b.move({0.08, 0, 0});
  both.find(a.now(), b.now());
  CHECK_FALSE(both.touches());
  CHECK(both.gradient(0).empty());
}
