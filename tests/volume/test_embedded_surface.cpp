// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "device/message.hpp"
#include "volume/surfaces.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <vector>

using namespace palpate;
using palpate_test::message_of, palpate_test::unsaid;

TEST_CASE("a skin is where it was at rest, and goes with any affine motion", "[volume][embedded_surface]") {
  auto const scan = make_organ<double>();
  auto const solid = fill(scan, {.edge = 0.016});
  EmbeddedSurface<double> skin(scan, solid.mesh);
  CHECK(skin.farthest_outside() <= solid.surface_to_skin * (1 + 1e-9));
  CHECK(skin.farthest_outside() > 0);
  skin.update(solid.mesh.points);
  CHECK((skin.mesh().points - scan.points).cwiseAbs().maxCoeff() < 1e-14);
  std::srand(2);
  Eigen::Matrix3d const A = Eigen::Matrix3d::Identity() + 0.4 * Eigen::Matrix3d::Random();
  Vector3<double> const b(0.1, -0.2, 0.3);
  skin.update(Matrix3X<double>((A * solid.mesh.points).colwise() + b));
  Matrix3X<double> const expected = (A * scan.points).colwise() + b;
  CHECK((skin.mesh().points - expected).cwiseAbs().maxCoeff() < 1e-13);
  auto const normals = vertex_normals(TriangleMesh<double>{expected, scan.triangles}, NormalWeight::area);
  CHECK((skin.normals() - normals).cwiseAbs().maxCoeff() < 1e-9);
}

// Yardstick: an arc. A beam bent to one: points at height z about the middle line go to radius R - z; linear elements of length e are off by e²/(8R) at most between
// their nodes, and a skin within them cannot be farther off.
TEST_CASE("a fine skin on a coarse bent beam is off by what linear elements are", "[volume][embedded_surface]") {
  double const R = 0.05;
  auto const beam = make_block<double>(11, 3, 3, 0.005, BlockPattern::alternating);
  auto const bent = [&](Matrix3X<double> points) {
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      double const a = points(0, i) / R, r = R - (points(2, i) - 0.005);
      points.col(i) << r * std::sin(a), points(1, i), R - r * std::cos(a);
    }
    return points;
  };
  TriangleMesh<double> fine;   // the top of the beam, eight times as fine
  int const n = 81, m = 17;
  fine.points.resize(3, n * m);
  fine.triangles.resize(3, 2 * (n - 1) * (m - 1));
  Eigen::Index t = 0;
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      fine.points.col(j * n + i) << 0.05 * i / (n - 1), 0.01 * j / (m - 1), 0.01;
      if (i + 1 == n || j + 1 == m) continue;
      int const a = j * n + i;
      fine.triangles.col(t++) << a, a + 1, a + n + 1;
      fine.triangles.col(t++) << a, a + n + 1, a + n;
    }
  EmbeddedSurface<double> skin(fine, beam);
  CHECK(skin.farthest_outside() < 1e-12);
  skin.update(bent(beam.points));
  double const off = (skin.mesh().points - bent(fine.points)).colwise().norm().maxCoeff();
  CHECK(off < 1.1 * 0.005 * 0.005 / (8 * R) * (R - 0.005) / R + 1e-6);
  CHECK(off > 1e-5);
}

TEST_CASE("a force on the skin keeps its sum and its moment", "[volume][embedded_surface]") {
  auto const scan = make_sphere<double>(0.03, 12);
  auto const solid = fill(scan, {.edge = 0.015});
  EmbeddedSurface<double> skin(scan, solid.mesh);
  Matrix3X<double> const x = solid.mesh.points.array() + 0.001 * Matrix3X<double>::Random(3, solid.mesh.points.cols()).array();
  skin.update(x);
  auto const touched = skin.nearest({0.02, 0.01, 0.04});
  REQUIRE(touched.found());
  Vector3<double> const force(0.3, -0.2, -1.0);
  Vector3<double> sum = Vector3<double>::Zero(), moment = sum;
  skin.for_each_weight(touched, [&](int particle, double weight) {
    sum += weight * force;
    moment += Vector3<double>(x.col(particle)).cross(weight * force);
  });
  CHECK((sum - force).norm() < 1e-12);
  CHECK((moment - touched.point.cross(force)).norm() < 1e-12);
  skin.for_each_weight(SurfacePoint<double>{}, [&](int, double) { FAIL("no point has no particles"); });
}

TEST_CASE("the skin of a body is felt without allocations", "[volume][embedded_surface]") {
  auto const scan = make_sphere<float>(0.03f, 12);
  auto const solid = fill(scan, {.edge = 0.012});
  EmbeddedSurface<float> skin(scan, solid.mesh);
  FiniteElements<float, StableNeoHookean<float>> tissue(solid.mesh, {.density = 1000, .material = {3000, 0.45f}});
  tissue.nail(vertices_where(solid.mesh, [](auto const& p) { return p.z() < -0.02f; }));
  SoftBody body(std::move(tissue), BackwardEuler{});
  body.step(0.01f);
  float const before = skin.mesh().points.row(2).maxCoeff();
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 30; ++k) {
    auto const touched = skin.nearest({0, 0, 0.04f});
    skin.for_each_weight(touched, [&](int particle, float weight) { body.apply_force(particle, weight * Vector3<float>(0, 0, -0.3f)); });
    body.step(0.01f);
    skin.update(body.positions());
  }
  CHECK(allocations.count() == 0);
  CHECK(skin.mesh().points.row(2).maxCoeff() < before - 1e-3f);
}

TEST_CASE("what can not carry a skin is refused", "[volume][embedded_surface]") {
  auto const scan = make_sphere<double>(0.03, 2);
  auto const solid = make_block<double>(2, 2, 2, 0.01);
  CHECK(unsaid(message_of([&] { EmbeddedSurface<double>(TriangleMesh<double>{}, solid); }), "skin", "no triangles") == "");
  CHECK(unsaid(message_of([&] { EmbeddedSurface<double>(scan, TetrahedralMesh<double>{}); }), "no tetrahedra") == "");
  auto flat = solid;
  flat.points.row(2).setZero();
  CHECK_THROWS_AS(EmbeddedSurface<double>(scan, flat), InvalidMesh);
  flat.points.setConstant(0.1);
  CHECK(unsaid(message_of([&] { EmbeddedSurface<double>(scan, flat); }), "flat") == "");
  flat.points(1, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK(unsaid(message_of([&] { EmbeddedSurface<double>(scan, flat); }), "vertex 3", "not finite") == "");
}

// Yardstick: a skin that has been there for it.
TEMPLATE_TEST_CASE("a skin refuses other tetrahedra, though nothing was cut, and goes back with a copy of its body", "[volume][embedded_surface]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const block = [](int nx, int ny, int nz, BlockPattern pattern = BlockPattern::kuhn) { return make_block<S>(nx, ny, nz, S(0.01), pattern); };
  auto const body_of = [](TetrahedralMesh<S> const& mesh) {
    return SoftBody(FiniteElements<S, StableNeoHookean<S>>(mesh, {.density = 1000, .material = {3000, S(0.3)}}), BackwardEuler{});
  };
  auto const made_of = block(5, 5, 5);
  EmbeddedSurface<S> const unused(surface(made_of), made_of);
  // Fewer, more, as many tetrahedra of other vertices.
  for (auto const& mesh : {block(2, 2, 2), block(6, 6, 6), block(9, 5, 3)}) {
    auto skin = unused;
    CHECK(unsaid(message_of([&] { skin.follow(body_of(mesh)); }), "384 tetrahedra of 125 vertices", "other ones") == "");
    CHECK((skin.points() - unused.points()).cwiseAbs().maxCoeff() == 0);
    CHECK_NOTHROW(skin.follow(body_of(made_of)));
  }

  auto const uncut = body_of(made_of);
  auto const cut = [&](S x, S depth) {
    auto body = uncut;
    VolumeCutter<S> knife;
    for (int k = 0; k <= 10; ++k) knife.advance(body, {{x, S(-0.01 + 0.006 * k), S(0.04) - depth}, {x, S(-0.01 + 0.006 * k), S(0.06)}});
    knife.lift(body);
    return body;
  };
  auto const shallow = cut(S(0.0253), S(0.007)), other = cut(S(0.0147), S(0.007)), deep = cut(S(0.0147), S(0.03));
  REQUIRE(shallow.solid_edits().size() < deep.solid_edits().size());
  auto skin = unused;
  auto const corners = [](EmbeddedSurface<S> const& of) {   // of each triangle [µm], in an order of their own
    auto const mesh = of.mesh();
    std::vector<std::array<long, 9>> all(static_cast<std::size_t>(mesh.triangles.cols()));
    for (std::size_t t = 0; t < all.size(); ++t)
      for (int k = 0; k < 9; ++k) all[t][static_cast<std::size_t>(k)] = std::lround(1e6 * static_cast<double>(mesh.points(k % 3, mesh.triangles(k / 3, static_cast<Eigen::Index>(t)))));
    std::sort(all.begin(), all.end());
    return all;
  };
  for (auto const* body : {&shallow, &uncut, &shallow, &other, &deep, &shallow, &deep, &uncut}) {
    auto fresh = unused;
    skin.follow(*body), fresh.follow(*body);
    CHECK(skin.triangles().cols() == fresh.triangles().cols());
    CHECK((corners(skin) == corners(fresh)));
  }
}
