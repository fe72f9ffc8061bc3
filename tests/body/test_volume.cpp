// SPDX-License-Identifier: MIT
// Tissue of tetrahedra. Yardstick: a plain loop over the edges of a block, written from its indices.
#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/tetrahedral_topology.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "body/naive_body.hpp"
#include "catch.hpp"

#include <utility>
#include <vector>

using namespace palpate;

namespace {

constexpr int nx = 3, ny = 3, nz = 7;
constexpr double spacing = 0.01;

/// Six tetrahedra around the diagonal of each cube: edges along the axes, the face diagonals and the space diagonal that rise.
palpate_test::NaiveBody plain_bar() {
  palpate_test::Points points(3, nx * ny * nz);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) points.col((k * ny + j) * nx + i) << i * spacing, j * spacing, k * spacing;
  palpate_test::NaiveBody body(points);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        for (int way = 1; way < 8; ++way) {
          int const a = i + (way & 1), b = j + (way >> 1 & 1), c = k + (way >> 2 & 1);
          if (a < nx && b < ny && c < nz) body.join((k * ny + j) * nx + i, (c * ny + b) * nx + a, 60.0, 0.05);
        }
  body.mass.assign(body.mass.size(), 0.05 / (nx * ny * nz));
  for (std::size_t i = 0; i < nx * ny; ++i) body.fixed[i] = 1;
  return body;
}

MassSpring<double> bar() {
  MassSpring<double> tissue(make_block<double>(nx, ny, nz, spacing),
                            {.mass = {.total = 0.05, .lumping = Lumping::equal}, .link = {.stiffness = 60.0, .damping = 0.05}});
  for (int i = 0; i < nx * ny; ++i) tissue.nail(i);
  return tissue;
}

}  // namespace

TEST_CASE("a bar of tetrahedra has the springs, forces and energy of the plain loop") {
  auto plain = plain_bar();
  auto const tissue = bar();
  CHECK(tissue.links().size() == static_cast<int>(plain.edges.size()));
  for (auto const& edge : plain.edges) CHECK(tissue.links().find(edge.a, edge.b) >= 0);
  CHECK(tissue.total_mass() == Approx(0.05).epsilon(1e-14));
  CHECK_FALSE(tissue.cuttable());
  for (Eigen::Index k = 0; k < plain.x.size(); ++k) plain.x.data()[k] += 0.002 * std::sin(3.0 * double(k) * double(k));
  auto const forces = plain.forces(plain.x, plain.v);
  for (int i = 0; i < plain.size(); ++i) CHECK((tissue.internal_force(i, plain.x, plain.v) - forces.col(i)).norm() < 1e-13);
  CHECK(tissue.potential_energy(plain.x) == Approx(plain.energy(plain.x)).epsilon(1e-12));
}

TEST_CASE("a bar moves as the plain loop, and bends to balance under gravity") {
  auto plain = plain_bar();
  plain.gravity << 1.5, 0.0, -3.0;
  SoftBody body(bar(), LeapfrogVerlet{}, WholeBody{});
  body.set_gravity(plain.gravity);
  for (int k = 0; k < 4000; ++k) body.step(5e-6);
  plain.advance(0.02, 100);
  CHECK((plain.x - plain.home).cwiseAbs().maxCoeff() > 1e-4);
  CHECK((body.positions() - plain.x).cwiseAbs().maxCoeff() < 1e-8);

  body.settle();
  auto forces = plain.forces(body.positions(), body.velocities());
  Vector3<double> ground = Vector3<double>::Zero();
  for (int i = 0; i < nx * ny; ++i) {
    CHECK((body.reaction(i) + forces.col(i)).norm() < 1e-13);
    ground += body.reaction(i);
  }
  CHECK(forces.rightCols(nx * ny * (nz - 1)).cwiseAbs().maxCoeff() < 1e-8 * 0.013 * 60.0 * 2 * 14);   // settle()'s own measure
  CHECK((ground + 0.05 * plain.gravity).norm() < 1e-5);   // the foot carries the whole weight
  CHECK(body.displacement(nx * ny * nz - 1).x() > 2 * body.displacement(nx * ny * 2).x());   // it bends over
}

TEST_CASE("a tool finds the skin of a bar, and a zone works in its inside") {
  SoftBody body(bar(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  CHECK(body.nearest_vertex({0.021, 0.021, 0.061}) == nx * ny * nz - 1);
  auto const nearest = body.nearest_point({0.012, 0.009, 0.07});
  CHECK((nearest.point - Vector3<double>(0.012, 0.009, 0.06)).norm() < 1e-15);
  body.apply_force(nx * ny * nz - 1, {0.0, 0.0, -0.1});
  // The upper far corner is in all six tetrahedra of its cube: seven neighbours.
  CHECK(body.step(1e-5).moving == 8);
}

// Yardstick: surface(mesh), which sorts all faces; the tetrahedra that were given; the whole bar, which moves the same.
TEST_CASE("a body from a volume keeps its tetrahedra, and so does a piece of it") {
  auto const mesh = make_block<double>(nx, ny, nz, spacing);
  auto const tissue = bar();
  CHECK(tissue.solid().tetrahedra() == mesh.tetrahedra);
  CHECK(tissue.surface().triangles() == surface(mesh).triangles);
  CHECK(&tissue.surface() == &tissue.solid().border());
  CHECK(testing::to_text(testing::check_tetrahedral_topology(tissue.solid(), mesh.points, volume(mesh), {.manifold = true})) == "");
  MassSpring<double> const sheet(make_grid<double>(3, 3, spacing), {});
  CHECK(sheet.solid().tetrahedron_count() == 0);
  CHECK(sheet.surface().triangle_count() == 8);
  double area = 0;
  for (int t = 0; t < tissue.surface().triangle_count(); ++t) area += tissue.triangle_area(t);
  CHECK(area == Approx(surface_area(surface(mesh))).epsilon(1e-12));

  // Two bars side by side, in one mesh: the second is taken out.
  TetrahedralMesh<double> two{Matrix3X<double>(3, 2 * mesh.points.cols()), Matrix<int, 4, Dynamic>(4, 2 * mesh.tetrahedra.cols())};
  int const n = static_cast<int>(mesh.points.cols());
  two.points << mesh.points, mesh.points.colwise() + Vector3<double>(0.1, 0, 0);
  two.tetrahedra << mesh.tetrahedra, (mesh.tetrahedra.array() + n).matrix();
  SoftBody body(MassSpring<double>(two, {.mass = {.total = 0.1}, .link = {.stiffness = 60.0, .damping = 0.05}}), LeapfrogVerlet{}, WholeBody{});
  auto const pieces = connected_components(two);
  REQUIRE(pieces.size() == 2);
  body.apply_force(n + 5, {0.0, 0.01, 0.02});
  auto part = part_of(body, pieces[1]);
  CHECK(part.tissue().solid().tetrahedra() == mesh.tetrahedra);
  CHECK(part.triangles() == surface(mesh).triangles);
  CHECK(testing::to_text(testing::check_tetrahedral_topology(part.tissue().solid(), part.positions(), volume(mesh), {.manifold = true})) == "");
  CHECK_FALSE(part.tissue().cuttable());
  for (int t = 0; t < part.triangles().cols(); ++t) REQUIRE(part.tissue().triangle_area(t) == Approx(tissue.triangle_area(t)).epsilon(1e-12));
  for (int k = 0; k < 100; ++k) REQUIRE((part.step(1e-5) && body.step(1e-5)));
  CHECK((part.positions() - two.points.rightCols(n)).cwiseAbs().maxCoeff() > 1e-9);
  CHECK((part.positions() - body.positions().rightCols(n)).cwiseAbs().maxCoeff() < 1e-15);
  auto torn = pieces[1];
  torn.pop_back();
  CHECK_THROWS_AS(part_of(body, torn), InvalidArgument);
}
