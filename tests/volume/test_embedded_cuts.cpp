// SPDX-License-Identifier: MIT
// A fine skin that follows cuts through the tetrahedra that carry it. Yardsticks: its area at rest; the skin clipped by the plane of the cut, here; wounds and
// pieces of the tetrahedra, searched one by one; an affine motion of each piece, in closed form.
// PALPATE_SKIN_STROKES sets how many random strokes (36 if not set), PALPATE_SEED with which seed they begin.
#include "catch.hpp"
#include "device/message.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of, palpate_test::unsaid;

namespace {

using Vector = Vector3<double>;
using Mesh = TriangleMesh<double>;

template <class S>
auto solid_body(TetrahedralMesh<S> const& mesh) {
  return SoftBody(FiniteElements<S, StableNeoHookean<S>>(mesh, {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.4)}}), BackwardEuler{});
}
/// Each triangle in four, so many times.
Mesh refined(Mesh mesh, int times) {
  for (; times > 0; --times) {
    std::map<std::pair<int, int>, int> middles;
    std::vector<Vector> points;
    for (auto const& p : mesh.points.colwise()) points.push_back(p);
    auto const middle = [&](int a, int b) {
      auto const [found, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (fresh) points.push_back((mesh.points.col(a) + mesh.points.col(b)) / 2);
      return found->second;
    };
    Matrix<int, 3, Dynamic> triangles(3, 4 * mesh.triangles.cols());
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      int const a = mesh.triangles(0, t), b = mesh.triangles(1, t), c = mesh.triangles(2, t), ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      triangles.middleCols(4 * t, 4) << a, ab, ca, ab, ab, b, bc, bc, ca, bc, c, ca;
    }
    mesh.points.resize(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) mesh.points.col(static_cast<Eigen::Index>(i)) = points[i];
    mesh.triangles = triangles;
  }
  return mesh;
}
Mesh border_of(TetrahedralMesh<double> const& solid) {
  Mesh mesh = surface(solid);
  std::vector<int> now(static_cast<std::size_t>(mesh.points.cols()), -1);
  Mesh used;
  used.points.resize(3, mesh.points.cols());
  int count = 0;
  for (auto& v : mesh.triangles.reshaped()) {
    int& at = now[static_cast<std::size_t>(v)];
    if (at < 0) used.points.col(at = count++) = mesh.points.col(v);
    v = at;
  }
  used.points.conservativeResize(Eigen::NoChange, count);
  used.triangles = mesh.triangles;
  return used;
}
Mesh moved(Mesh mesh, Vector const& by) {
  mesh.points.colwise() += by;
  return mesh;
}
template <class S>
TetrahedralMesh<S> as(TetrahedralMesh<double> const& mesh) {
  return {mesh.points.cast<S>(), mesh.tetrahedra};
}
template <class S>
TriangleMesh<S> as(Mesh const& mesh) {
  return {mesh.points.cast<S>(), mesh.triangles};
}
/// Area of each triangle in double.
double area(auto const& mesh, Eigen::Index t) {
  auto const p = [&](int k) { return Vector(mesh.points.col(mesh.triangles(k, t)).template cast<double>()); };
  return (p(1) - p(0)).cross(p(2) - p(0)).norm() / 2;
}

/// The tetrahedron of a carrier's particles.
int tetrahedron_of(auto const& topology, std::array<int, 4> const& particles) {
  for (int const t : topology.tetrahedra_at(particles[0]))
    if (topology.corners(t) == particles) return t;
  return -1;
}

/// What is wrong with a skin on its body: triangles that span pieces or an open face, carriers that are no tetrahedra, points where they should not be, area.
template <class S>
std::string faults(EmbeddedSurface<S> const& skin, auto const& body, double whole_area) {
  std::string wrong;
  auto const tell = [&](auto const&... parts) {
    if (wrong.size() < 500) wrong += detail::message(parts..., "\n");
  };
  double const digits = sizeof(S) == sizeof(float) ? 1e-5 : 1e-12;
  auto const& topology = body.tissue().topology();
  auto const rest = body.rest_solid();
  std::vector<int> piece(static_cast<std::size_t>(body.size()), -1);
  auto const pieces = connected_components(rest);
  for (std::size_t n = 0; n < pieces.size(); ++n)
    for (int const i : pieces[n]) piece[static_cast<std::size_t>(i)] = static_cast<int>(n);

  EmbeddedSurface<S> still = skin;
  still.update(rest.points);
  auto const mesh = still.mesh();
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) sum += area(mesh, t);
  if (!(std::abs(sum - whole_area) <= digits * whole_area)) tell("the area is ", sum, ", it was ", whole_area, ", off by ", sum / whole_area - 1);

  // No side of a triangle's shadow goes through a wound; all are searched.
  struct Wound {
    Vector a, b, c, low, high;
  };
  std::vector<Wound> wounds;
  for (int w = 0; w < body.tissue().surface().triangle_count(); ++w)
    if (body.tissue().is_wound(w)) {
      auto const c = body.tissue().surface().corners(w);
      auto const p = [&](std::size_t k) { return Vector(rest.points.col(c[k]).template cast<double>()); };
      wounds.push_back({p(0), p(1), p(2), p(0).cwiseMin(p(1)).cwiseMin(p(2)), p(0).cwiseMax(p(1)).cwiseMax(p(2))});
    }
  auto const spans = [&](Vector const& p, Vector const& q) {
    Vector const low = p.cwiseMin(q), high = p.cwiseMax(q);
    return std::any_of(wounds.begin(), wounds.end(), [&](Wound const& w) {
      if ((w.low.array() > high.array()).any() || (w.high.array() < low.array()).any()) return false;
      Vector const n = (w.b - w.a).cross(w.c - w.a);
      double const before = (p - w.a).dot(n), after = (q - w.a).dot(n), small = (sizeof(S) == sizeof(float) ? 1e-4 : 1e-7) * n.norm() * std::sqrt(n.norm());
      if (!(before < -small && after > small) && !(before > small && after < -small)) return false;
      Vector const through = p - before / (after - before) * (q - p);
      auto const share = [&](Vector const& from, Vector const& to) { return (to - from).cross(through - from).dot(n) / n.squaredNorm(); };
      return std::min({share(w.a, w.b), share(w.b, w.c), share(w.c, w.a)}) > 1e-3;
    });
  };
  // Where a triangle lies across a notch of the tetrahedra, its shadow lies beyond them, and may go round a wound there.
  auto const is_beyond = [&](int t, Vector const& p) {
    Eigen::Matrix4d corners;
    for (int k = 0; k < 4; ++k) corners.col(k) << rest.points.col(topology.corners(t)[static_cast<std::size_t>(k)]).template cast<double>(), 1;
    return Eigen::Vector4d(corners.inverse() * Eigen::Vector4d(p.x(), p.y(), p.z(), 1)).minCoeff() < (sizeof(S) == sizeof(float) ? -1e-3 : -1e-6);
  };
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    std::array<int, 3> at;
    for (int k = 0; k < 3; ++k) {
      int const i = mesh.triangles(k, t);
      at[static_cast<std::size_t>(k)] = tetrahedron_of(topology, skin.carrier(i).particle);
      if (at[static_cast<std::size_t>(k)] < 0) tell("point ", i, " of triangle ", t, " is carried by no tetrahedron");
    }
    if (*std::min_element(at.begin(), at.end()) < 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      int const a = at[k], b = at[(k + 1) % 3];
      auto const piece_of = [&](int tetrahedron) { return piece[static_cast<std::size_t>(topology.corners(tetrahedron)[0])]; };
      if (piece_of(a) != piece_of(b)) tell("triangle ", t, " spans two pieces");
      int const i = mesh.triangles(static_cast<int>(k), t), j = mesh.triangles(static_cast<int>((k + 1) % 3), t);
      if (spans(skin.shadow(i), skin.shadow(j)) && !is_beyond(a, skin.shadow(i)) && !is_beyond(b, skin.shadow(j))) tell("triangle ", t, " spans an open face");
    }
  }
  if (!still.mesh().points.allFinite()) tell("a point is not finite");
  return wrong;
}

/// A triangle clipped by the plane x = at: its area on the side of small x.
double area_before(Mesh const& mesh, Eigen::Index t, double at) {
  std::vector<Vector> polygon;
  for (int k = 0; k < 3; ++k) {
    Vector const p = mesh.points.col(mesh.triangles(k, t)), q = mesh.points.col(mesh.triangles((k + 1) % 3, t));
    if (p.x() < at) polygon.push_back(p);
    if ((p.x() < at) != (q.x() < at)) polygon.push_back(p + (at - p.x()) / (q.x() - p.x()) * (q - p));
  }
  Vector sum = Vector::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k) sum += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]) / 2;
  return sum.norm();
}

/// Cuts a body through at x, along y, and lets the skin follow each tick.
void cut_through(auto& skin, auto& body, double x, Vector const& low, Vector const& high, int ticks) {
  VolumeCutter<double> knife;
  for (int tick = 0; tick <= ticks; ++tick) {
    double const y = low.y() - 0.005 + (high.y() - low.y() + 0.01) * tick / ticks;
    knife.advance(body, {{x, y, low.z() - 0.01}, {x, y, high.z() + 0.01}});
    skin.follow(body);
  }
}

struct Parted {
  double before = 0, after = 0;   // area on either side of x
  int pieces = 0, euler = 0;
  bool lips_in_plane = true;
};
Parted parted(Mesh const& mesh, double x) {
  Parted found;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    double const middle = (mesh.points(0, mesh.triangles(0, t)) + mesh.points(0, mesh.triangles(1, t)) + mesh.points(0, mesh.triangles(2, t))) / 3;
    (middle < x ? found.before : found.after) += area(mesh, t);
  }
  found.pieces = static_cast<int>(connected_components(mesh).size()), found.euler = euler_characteristic(mesh);
  for (auto const& edge : boundary_edges(mesh))
    for (int const end : edge) found.lips_in_plane = found.lips_in_plane && std::abs(mesh.points(0, end) - x) < 1e-11;
  return found;
}

}  // namespace

TEST_CASE("a plane through a sphere inside a block leaves two caps with the areas of the sphere clipped by it", "[volume][embedded_cuts]") {
  auto const block = make_block<double>(9, 9, 9, 0.005, BlockPattern::alternating);
  Mesh const ball = moved(make_sphere<double>(0.017, 12), Vector::Constant(0.02));
  for (double const x : {0.0213, 0.020}) {   // through the tetrahedra, and along their faces, where vertices of the sphere lie as well
    INFO("x = " << x);
    auto body = solid_body(block);
    EmbeddedSurface<double> skin(ball, block);
    cut_through(skin, body, x, Vector::Zero(), Vector::Constant(0.04), 60);
    REQUIRE(connected_components(body.rest_solid()).size() == 2);
    double before = 0;
    for (Eigen::Index t = 0; t < ball.triangles.cols(); ++t) before += area_before(ball, t, x);
    double const all = surface_area(ball);
    auto const found = parted(skin.mesh(), x);
    CHECK(found.before == Approx(before).epsilon(1e-12));
    CHECK(found.after == Approx(all - before).epsilon(1e-12));
    CHECK(found.pieces == 2);
    CHECK(found.euler == 2);   // two discs
    CHECK(found.lips_in_plane);
    CHECK(faults(skin, body, all) == "");
  }
}

TEST_CASE("a plane through a filled ball parts a skin that lies outside of the tetrahedra as it parts them", "[volume][embedded_cuts]") {
  Mesh const ball = make_sphere<double>(0.03, 24);
  auto const solid = fill(ball, {.edge = 0.012});
  auto body = solid_body(solid.mesh);
  EmbeddedSurface<double> skin(ball, solid.mesh);
  REQUIRE(skin.farthest_outside() > 3e-4);
  double const x = 0.0017, all = surface_area(ball);
  cut_through(skin, body, x, Vector::Constant(-0.03), Vector::Constant(0.03), 60);
  REQUIRE(connected_components(body.rest_solid()).size() == 2);
  double before = 0;
  for (Eigen::Index t = 0; t < ball.triangles.cols(); ++t) before += area_before(ball, t, x);
  auto const found = parted(skin.mesh(), x);
  CHECK(found.before == Approx(before).epsilon(1e-3));   // by its shadow, which lies along its normals
  CHECK(found.before + found.after == Approx(all).epsilon(1e-12));
  CHECK(found.pieces == 2);
  CHECK(found.euler == 2);
  CHECK(faults(skin, body, all) == "");
  // The strip between skin and wound begins at the lips, one at each edge, and ends on walls: it has a foot for each point.
  auto const strip = skin.skirt(body);
  auto const lips = boundary_edges(skin.mesh());
  CHECK(strip.triangles.cols() == 2 * std::ssize(lips));
  for (Eigen::Index i = 1; i < strip.points.cols(); i += 2) {
    double nearest = 1;
    auto const& surface = body.tissue().surface();
    Vector const foot = strip.points.col(i);
    for (int w = 0; w < surface.triangle_count(); ++w) {
      auto const c = surface.corners(w);
      auto const corner = [&](std::size_t k) { return Vector(body.positions().col(c[k])); };
      if (body.tissue().is_wound(w)) nearest = std::min(nearest, (closest_point_on_triangle<double>(foot, corner(0), corner(1), corner(2)).point - foot).norm());
    }
    CHECK(nearest < 1e-11);
  }
  for (Eigen::Index i = 0; i < strip.points.cols(); i += 2) CHECK((strip.points.col(i) - strip.points.col(i + 1)).norm() < 3 * skin.farthest_outside());
}

TEST_CASE("each piece of a skin goes with any affine motion of its piece of the body", "[volume][embedded_cuts]") {
  Mesh const ball = make_sphere<double>(0.03, 16);
  auto const solid = fill(ball, {.edge = 0.012});
  auto body = solid_body(solid.mesh);
  EmbeddedSurface<double> skin(ball, solid.mesh);
  cut_through(skin, body, 0.0017, Vector::Constant(-0.03), Vector::Constant(0.03), 30);
  Matrix3X<double> const rest = skin.points();
  auto const pieces = connected_components(body.rest_solid());
  REQUIRE(pieces.size() == 2);
  Matrix3X<double> x = body.positions();
  std::array<Eigen::Matrix3d, 2> A;
  std::srand(3);
  for (std::size_t n = 0; n < 2; ++n) {
    A[n] = Eigen::Matrix3d::Identity() + 0.4 * Eigen::Matrix3d::Random();
    for (int const i : pieces[n]) x.col(i) = A[n] * x.col(i) + Vector(n == 0 ? -0.02 : 0.02, 0.01, 0);
  }
  skin.update(x);
  for (int const i : skin.triangles().reshaped()) {
    bool const first = std::binary_search(pieces[0].begin(), pieces[0].end(), skin.carrier(i).particle[0]);
    Vector const expected = A[first ? 0 : 1] * rest.col(i) + Vector(first ? -0.02 : 0.02, 0.01, 0);
    CHECK((skin.points().col(i) - expected).norm() < 1e-12 * 0.03 * 10);
  }
}

TEMPLATE_TEST_CASE("a skin goes with what is taken away under it", "[volume][embedded_cuts]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const block = make_block<double>(5, 5, 5, 0.005, BlockPattern::alternating);
  Mesh const box = refined(border_of(block), 2);
  auto body = solid_body(as<S>(block));
  EmbeddedSurface<S> skin(as<S>(box), as<S>(block));
  auto const whole = body.save();
  auto const skin_area = [&] {   // of the body: its border, but for the walls of what is gone
    double sum = 0;
    auto const rest = body.rest_mesh();
    for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) sum += body.tissue().is_wound(t) ? 0 : area(rest, t);
    return sum;
  };
  double const all = skin_area();
  VolumeCutter<S> knife;   // through a corner of it first
  for (int tick = 0; tick <= 20; ++tick)
    knife.advance(body, {Vector(0.0133, 0.0013 * tick - 0.003, 0.03).cast<S>(), Vector(0.0133, 0.0013 * tick - 0.003, 0.007).cast<S>()});
  Aspirator<S> tool({.tip_radius = S(0.004), .reach = S(0.007), .max_tetrahedra = 5});
  for (int tick = 0; tick < 30; ++tick) {
    tool.advance(body, Vector(0.006 + 0.0003 * tick, 0.009, 0.034 - 0.0006 * tick).cast<S>());
    skin.follow(body);
    if (tick % 5 == 4) REQUIRE(faults(skin, body, skin_area()) == "");
  }
  REQUIRE(tool.report().tetrahedra > 40);
  CHECK(skin_area() < 0.98 * all);
  CHECK(skin.nearest(Vector(0.0125, 0.009, 0.02).cast<S>()).found());
  body.restore(whole);
  skin.follow(body);
  CHECK(faults(skin, body, all) == "");
  CHECK(skin.triangles().cols() == box.triangles.cols());
}

TEMPLATE_TEST_CASE("no triangle of a skin spans a wound, whatever is cut", "[volume][embedded_cuts][random]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const from_environment = [](char const* name, std::uint64_t otherwise) {
    char const* const asked = std::getenv(name);
    return asked != nullptr ? std::stoull(asked) : otherwise;
  };
  std::uint64_t const strokes = from_environment("PALPATE_SKIN_STROKES", 36), first = from_environment("PALPATE_SEED", 1);
  auto const block = make_block<double>(4, 4, 4, 0.005, BlockPattern::alternating);
  Mesh const box = refined(border_of(block), 2), round = make_sphere<double>(0.01, 10), organ = make_organ<double>({.vertices = 1500});
  auto const ball = fill(round, {.edge = 0.006}).mesh, liver = fill(organ, {.edge = 0.016}).mesh;
  int parted_most = 0;
  std::vector<std::uint64_t> seeds((strokes + 2) / 3);
  std::iota(seeds.begin(), seeds.end(), first);
  if (std::getenv("PALPATE_SEED") == nullptr) seeds.push_back(1213);   // two cuts cross an edge 2e-7 of it apart, where 1e-10 of the area was lost
  for (std::uint64_t const seed : seeds) {
    Random random(Seed{seed});
    auto const any = [&] { return Vector(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    auto const kind = seed % 3;
    Mesh const& fine = kind == 0 ? box : kind == 1 ? round : organ;
    auto const& solid = kind == 0 ? block : kind == 1 ? ball : liver;
    auto body = solid_body(as<S>(solid));
    EmbeddedSurface<S> skin(as<S>(fine), as<S>(solid));
    double all = 0;
    auto const start = skin.mesh();
    for (Eigen::Index t = 0; t < start.triangles.cols(); ++t) all += area(start, t);
    auto const whole = body.save();
    Vector const low = fine.points.rowwise().minCoeff(), high = fine.points.rowwise().maxCoeff(), size = high - low;
    VolumeCutter<S> knife;
    std::string wrong;
    auto const check = [&](char const* when, int n) {
      wrong = faults(skin, body, all);
      if (!wrong.empty()) wrong = "seed " + std::to_string(seed) + ", stroke " + std::to_string(n) + when + wrong;
      return wrong.empty();
    };
    for (int n = 0; n < 3 && wrong.empty(); ++n) {
      Vector const middle = (low + high) / 2 + 0.4 * size.cwiseProduct(any()), blade = any().normalized(), way = any().normalized();
      double const length = random.uniform(0.2, 1.5) * size.minCoeff(), far = random.uniform(0.2, 1.0) * size.minCoeff();
      int const ticks = 4 + static_cast<int>(random.below(12));
      for (int tick = 0; tick <= ticks; ++tick) {
        Vector const at = middle + (2.0 * tick / ticks - 1) * far * way;
        knife.advance(body, {Vector(at - length / 2 * blade).cast<S>(), Vector(at + length / 2 * blade).cast<S>()});
        if (tick % 3 == 0) body.step(S(1e-3)), skin.follow(body);
        if (tick == ticks / 2 && (skin.follow(body), !check(", half way: ", n))) break;
      }
      if (n < 2) knife.lift(body);
      skin.follow(body);
      if (wrong.empty() && !check(": ", n)) break;
      auto const mesh = skin.mesh();
      CHECK(skin.nearest(mesh.points.col(mesh.triangles(0, mesh.triangles.cols() - 1))).distance < S(1e-6) * S(size.norm()));
    }
    CHECK(wrong == "");
    parted_most = std::max(parted_most, static_cast<int>(skin.triangles().cols() - fine.triangles.cols()));
    body.restore(whole);
    skin.follow(body);
    CHECK(skin.triangles().cols() == fine.triangles.cols());
    CHECK(skin.mesh().points.leftCols(fine.points.cols()).isApprox(start.points, S(1e-5)));
    CHECK(faults(skin, body, all) == "");
  }
  CHECK(parted_most > 100);
}
