// SPDX-License-Identifier: MIT
// Yardstick: the same stroke over the body at rest. A cut depends on the path in material coordinates alone, so however the body is
// carried, turned, stretched or shaken meanwhile, the same triangles and the same rest positions come out.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>

using namespace palpate;

namespace {

using Vector = Vector3<double>;
using Path = Points<double>;

/// Where the material point that rests nearest to `point` is now, and the smooth normal of the undisturbed body there: every triangle
/// tried.
struct Place {
  Vector now, normal;
};
template <class Body>
Place place_of(Body const& body, Vector const& point) {
  auto const rest = body.rest_mesh();
  Place best{Vector::Zero(), Vector::UnitZ()};
  double best_off = std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t < rest.triangles.cols(); ++t) {
    auto const c = rest.triangles.col(t);
    Vector const a = rest.points.col(c[0]), b = rest.points.col(c[1]), d = rest.points.col(c[2]);
    Vector const n = (b - a).cross(d - a);
    if (!(n.norm() > 0)) continue;
    Eigen::Matrix3d frame;
    frame << b - a, d - a, n.normalized();
    Vector const uvh = frame.fullPivLu().solve(point - a);
    Vector const w(1 - uvh[0] - uvh[1], uvh[0], uvh[1]);
    double const off = std::max(0.0, -w.minCoeff()) + std::abs(uvh[2]);
    if (!(off < best_off)) continue;
    best_off = off;
    best.now = w[0] * body.positions().col(c[0]) + w[1] * body.positions().col(c[1]) + w[2] * body.positions().col(c[2]);
    best.normal = (w[0] * body.reference_normal(c[0]) + w[1] * body.reference_normal(c[1]) + w[2] * body.reference_normal(c[2])).normalized();
  }
  return best;
}

/// What a cut has left behind.
struct Outcome {
  TriangleMesh<double> rest;
  CutReport report;
  std::vector<std::array<int, 2>> lips;
};

/// Cuts along material points: the tip comes from outside onto the first, punctures by force and lies a hair under the tissue, so that
/// the line through it along any normal meets the surface at the material point itself. `move(body, tick)` runs before each tick.
template <class Body, class Move>
Outcome cut(Body body, Path const& path, Move move) {
  constexpr double hair = 1e-12;   // m
  ProgressiveCutter<double> scalpel({.puncture_depth = 1.0, .puncture_force = 1.0});
  testing::CutInvariants const before(body);
  int tick = 0;
  auto const advance = [&](Vector const& point, double height, double force) {
    move(body, tick++);
    Place const at = place_of(body, point);
    scalpel.advance(body, at.now + height * at.normal, force);
    REQUIRE(testing::to_text(before.check(body)) == "");
  };
  advance(path.front(), 0.002, 0.0);
  CHECK(scalpel.state() == CuttingPhase::no_contact);
  for (Vector const& point : path) {
    advance(point, -hair, 2.0);
    REQUIRE(scalpel.state() == CuttingPhase::moving);
  }
  advance(path.back(), 1.0, 0.0);
  CHECK(scalpel.state() == CuttingPhase::no_contact);
  return {body.rest_mesh(), scalpel.report(), scalpel.lips()};
}

/// Carries every particle to A X + b.
template <class Body>
void carry(Body& body, Eigen::Matrix3d const& A, Vector const& b) {
  for (int i = 0; i < body.size(); ++i) body.drag(i, A * body.tissue().rest_position(i) + b);
}

using Motion = std::function<void(SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>&, int)>;

struct NamedMotion {
  std::string name;
  Motion move;
};

Eigen::Matrix3d turned(double angle, Vector const& axis) { return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(); }

std::vector<NamedMotion> motions() {
  return {{"carried", [](auto& body, int k) { carry(body, Eigen::Matrix3d::Identity(), Vector(0.01, -0.02, 0.005) * k); }},
          {"turned", [](auto& body, int k) { carry(body, turned(0.6 * std::sin(0.3 * k), {0, 0, 1}), Vector(0.001 * k, 0, 0)); }},
          {"rocked", [](auto& body, int k) { carry(body, turned(0.5 * std::sin(0.9 * k), {1, 0.6, 0.2}), Vector(0, 0, 0.003 * k)); }},
          {"stretched",
           [](auto& body, int k) {
             carry(body, Vector(1 + 0.4 * std::sin(0.5 * k), 1 - 0.3 * std::sin(0.8 * k), 1).asDiagonal(), Vector::Zero());
           }},
          {"sheared",
           [](auto& body, int k) {
             Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
             A(0, 1) = 0.6 * std::sin(0.7 * k);
             A(2, 0) = 0.2 * std::cos(0.4 * k);
             carry(body, A, Vector(0, 0.004 * k, 0));
           }},
          {"shaken, and its wound gaping", [](auto& body, int k) {
             body.set_gravity(Vector(8 * std::sin(0.3 * k), 6 * std::cos(0.4 * k), -2));
             double const h = std::min(1e-3, 0.9 * body.stable_step());
             for (int i = 0; i < 5; ++i) REQUIRE(body.step(h));
           }}};
}

std::string difference(Outcome const& moved, Outcome const& still) {
  if (moved.rest.points.cols() != still.rest.points.cols()) return "another number of particles";
  if (moved.rest.triangles.cols() != still.rest.triangles.cols() || moved.rest.triangles != still.rest.triangles) return "other triangles";
  double const off = (moved.rest.points - still.rest.points).cwiseAbs().maxCoeff();
  if (!(off <= 1e-9)) return "rest positions differ by " + std::to_string(off * 1e9) + " nm";
  if (moved.lips != still.lips) return "other lips";
  CutReport const &a = moved.report, &b = still.report;
  if (a.vertex_edge != b.vertex_edge || a.vertex_vertex != b.vertex_vertex || a.edge_vertex != b.edge_vertex || a.edge_edge != b.edge_edge)
    return "other ways through the triangles";
  return {};
}

Vector any(Random& random) { return {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)}; }

/// A bent path from one random point of the surface, `edges` mean edges long, that keeps a mean edge away from the border: on the border
/// rounding decides whether the tip is still on the surface.
Path bent_path(TriangleMesh<double> const& mesh, Random& random, double edge, double edges, double tick) {
  SurfaceTree<double> const tree(mesh);
  double const radius = mesh.points.colwise().norm().minCoeff();
  Points<double> border;
  for (int const i : boundary_vertices(mesh)) border.push_back(mesh.points.col(i));
  while (true) {
    Vector const start = mesh.points.col(static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(mesh.points.cols())))) +
                         0.3 * edge * any(random);
    Vector const bend = 0.3 * edges * edge * any(random), way = edges * edge * any(random);
    Path path;
    double nearest = std::numeric_limits<double>::infinity(), length = 0;
    for (Vector const& p : sampled<double>({start, start + way / 2 + bend, start + way}, tick)) {
      // From inside a ball the nearest point is inside a facet; from outside it is often on an edge, and rounding chooses the triangle.
      Vector const from = border.empty() ? Vector(0.9 * radius * p.normalized()) : p;
      path.push_back(tree.nearest(mesh.points, from).point);
      for (Vector const& b : border) nearest = std::min(nearest, (b - path.back()).norm());
      if (path.size() > 1) length += (path.back() - path[path.size() - 2]).norm();
    }
    if (nearest > edge && length > 0.6 * edges * edge) return path;
  }
}

void same_cut_however_it_moves(TriangleMesh<double> const& mesh, std::uint64_t seed, int strokes) {
  double const edge = mean_edge_length(mesh);
  Random random(Seed{seed});
  for (int k = 0; k < strokes; ++k) {
    Path const path = bent_path(mesh, random, edge, 5, edge * std::exp(random.uniform(std::log(0.15), std::log(2.0))));
    SoftBody const body(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
    Outcome const still = cut(body, path, [](auto&, int) {});
    REQUIRE(still.report.particles_added >= 2);
    for (auto const& [name, move] : motions()) {
      CAPTURE(seed, k, name);
      CHECK(difference(cut(body, path, move), still) == "");
    }
  }
}

}  // namespace

TEST_CASE("a sheet is cut the same however it moves", "[cutting]") { same_cut_however_it_moves(make_grid<double>(12, 12, 0.01), 21, 15); }

TEST_CASE("a ball is cut the same however it moves", "[cutting]") { same_cut_however_it_moves(make_sphere<double>(0.05, 5), 22, 15); }

TEST_CASE("a cut along vertices and edges of a sheet is the same however it moves", "[cutting]") {
  auto const mesh = make_grid<double>(9, 7, 0.01);
  SoftBody const body(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
  // Along an edge, through a vertex and a diagonal, onto an edge; every corner within the snap distance of a vertex.
  Path const path = sampled<double>({{0.0205, 0.0302, 0}, {0.0403, 0.0297, 0}, {0.0601, 0.0502, 0}, {0.0655, 0.0451, 0}}, 0.003);
  Outcome const still = cut(body, path, [](auto&, int) {});
  CHECK(still.report.vertex_vertex >= 4);
  for (auto const& [name, move] : motions()) {
    CAPTURE(name);
    CHECK(difference(cut(body, path, move), still) == "");
  }
}

// With the depth from the undisturbed surface instead of a force: the sheet moves in its own plane, the tip comes down vertically.
TEST_CASE("a sheet punctured by depth is cut the same however it moves in its plane", "[cutting]") {
  auto const mesh = make_grid<double>(12, 12, 0.01);
  Random random(Seed{23});
  for (int k = 0; k < 4; ++k) {
    Path const path = bent_path(mesh, random, 0.01, 5, 0.002);
    auto const outcome = [&](auto move) {
      SoftBody body(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
      ProgressiveCutter<double> scalpel({.puncture_depth = 0.004});
      int tick = 0;
      auto const advance = [&](Vector const& point, double z) {
        move(body, tick++);
        Vector tip = place_of(body, point).now;
        tip.z() = z;
        scalpel.advance(body, tip);
      };
      for (double const z : {0.002, -0.001, -0.003}) advance(path.front(), z);
      CHECK(scalpel.state() == CuttingPhase::indenting);
      for (Vector const& point : path) advance(point, -0.005);
      CHECK(scalpel.state() == CuttingPhase::moving);
      advance(path.back(), 0.001);
      return Outcome{body.rest_mesh(), scalpel.report(), scalpel.lips()};
    };
    Outcome const still = outcome([](auto&, int) {});
    REQUIRE(still.report.particles_added >= 2);
    CAPTURE(k);
    CHECK(difference(outcome([](auto& body, int i) { carry(body, turned(0.2 * i, {0, 0, 1}), Vector(0.003 * i, 0, 0)); }), still) == "");
    CHECK(difference(outcome([](auto& body, int i) {
            carry(body, Vector(1 + 0.5 * std::sin(0.6 * i), 1 + 0.4 * std::cos(0.9 * i), 1).asDiagonal(), Vector::Zero());
          }), still) == "");
  }
}
