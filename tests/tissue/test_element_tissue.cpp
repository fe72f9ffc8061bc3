// SPDX-License-Identifier: MIT
// Tissue of a user's elements. Yardsticks: affine displacements (patch test), rigid motions, mass-spring tissue of the same springs, the closed forms of a
// bar under stretch and of a particle on its home spring, and bytes that do not depend on the threads.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/element_tissue.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/spring_elements.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"
#include "statics/solvers.hpp"
#include "tissue/user_elements.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

template <RealScalar S>
using Tetrahedra = ElementTissue<S, UserTetrahedron<S>>;

/// A block of nx × ny × nz points, those inside moved at random by up to a fifth of an edge.
template <RealScalar S>
TetrahedralMesh<S> distorted(int nx, int ny, int nz) {
  auto mesh = make_block<S>(nx, ny, nz, S(0.01));
  Random random(Seed{11});
  for (int k = 1; k + 1 < nz; ++k)
    for (int j = 1; j + 1 < ny; ++j)
      for (int i = 1; i + 1 < nx; ++i)
        for (int axis = 0; axis < 3; ++axis) mesh.points(axis, (k * ny + j) * nx + i) += random.uniform(S(-0.002), S(0.002));
  return mesh;
}

template <RealScalar S>
Tetrahedra<S> solid(TetrahedralMesh<S> const& mesh, S poisson = S(0.3)) {
  return Tetrahedra<S>(mesh, make_elements(mesh.points, mesh.tetrahedra, [&](auto const& rest) { return UserTetrahedron<S>(rest, S(3000), poisson); }));
}

template <RealScalar S>
auto membrane(TriangleMesh<S> const& mesh) {
  return ElementTissue(mesh, {.total = S(0.1)},
                       make_elements(mesh.points, mesh.triangles, [](auto const& rest) { return MembraneTriangle<S>(rest, S(3000), S(0.3), S(0.001), S(0.01)); }));
}

template <class Tissue>
std::string broken(Tissue const& tissue, testing::TissueChecks const& checks = {}) {
  return testing::to_text(testing::check_tissue(tissue, checks));
}

/// u = A X + b of small strain.
template <RealScalar S>
Matrix3X<S> affine(Matrix3X<S> const& points) {
  Matrix<S, 3, 3> a;
  a << S(0.02), S(-0.01), S(0.005), S(0.015), S(-0.01), S(0.02), S(-0.004), S(0.01), S(0.03);
  return points + a * points + Vector3<S>(S(0.001), S(-0.002), S(0.003)).replicate(1, points.cols());
}

/// Blocks in threads of their own, and the last one first.
struct AtOnce {
  template <class Work>
  void operator()(int n, Work const& work) const {
    std::vector<std::thread> threads;
    for (int k = 0; k < n; ++k) threads.emplace_back([&work, k] { work(k); });
    for (auto& thread : threads) thread.join();
  }
};
struct Backwards {
  template <class Work>
  void operator()(int n, Work const& work) const {
    for (int k = n - 1; k >= 0; --k) work(k);
  }
};

}  // namespace

static_assert(TissueModel<Tetrahedra<float>> && HasStiffnessBlocks<Tetrahedra<float>> && HasFusedForces<Tetrahedra<double>> && HasTangentOperator<Tetrahedra<double>> &&
              HasStiffnessProduct<Tetrahedra<double>> && HasStiffnessRowBoundsAt<Tetrahedra<double>> && HasPotentialEnergy<Tetrahedra<double>> &&
              ReservesMemory<Tetrahedra<double>> && !CuttableTissue<Tetrahedra<double>>);

TEMPLATE_TEST_CASE("tissue of elements obeys the laws of tissue", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  CHECK(broken(solid(distorted<S>(4, 4, 5))) == "");
  auto const sheet = make_grid<S>(6, 5, S(0.01));
  CHECK(broken(membrane(sheet), {.isolated = true}) == "");
  auto const homes = make_elements(sheet.points, [](auto const& rest) { return AnchorSpring<S>{rest, {S(3), S(0.05)}}; });
  CHECK(broken(ElementTissue(sheet, {.total = S(0.1)}, homes)) == "");
  auto const triangles = make_elements(sheet.points, sheet.triangles, [](auto const& rest) { return MembraneTriangle<S>(rest, S(3000), S(0.3), S(0.001)); });
  CHECK(broken(ElementTissue(sheet, {.total = S(0.1)}, homes, triangles)) == "");
}

TEMPLATE_TEST_CASE("springs as elements are mass-spring tissue", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_grid<S>(7, 6, S(0.01));
  MassSpring<S> const springs(mesh, {.mass = {.total = S(0.1)}, .link = {.stiffness = S(50), .damping = S(0.1)}, .home = {.stiffness = S(3), .damping = S(0.05)}});
  auto const sides = edges(mesh);
  Matrix<int, 2, Dynamic> ends(2, static_cast<Eigen::Index>(sides.size()));
  for (std::size_t e = 0; e < sides.size(); ++e) ends.col(static_cast<Eigen::Index>(e)) << sides[e][0], sides[e][1];
  ElementTissue const tissue(mesh, {.total = S(0.1)}, make_elements(mesh.points, [](auto const& rest) { return AnchorSpring<S>{rest, {S(3), S(0.05)}}; }),
                             make_elements(mesh.points, ends, [](auto const& rest) {
                               return LinkSpring<S>{(rest.col(0) - rest.col(1)).norm(), S(1), {.stiffness = S(50), .damping = S(0.1)}};
                             }));
  Random random(Seed{4});
  Matrix3X<S> x = mesh.points, v = x, d = x, y = Matrix3X<S>::Zero(3, x.cols()), other_y = y;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    x.data()[k] += random.uniform(S(-0.003), S(0.003)), v.data()[k] = random.uniform(S(-1), S(1)), d.data()[k] = random.uniform(S(-1), S(1));
  S const digits = 64 * std::numeric_limits<S>::epsilon();
  tissue.add_stiffness_product(x, d, y), springs.add_stiffness_product(x, d, other_y);
  CHECK((y - other_y).norm() <= digits * y.norm());
  CHECK(tissue.potential_energy(x) == Approx(springs.potential_energy(x)));
  testing::detail::WholeTissue whole(tissue);
  testing::detail::WholeTissue other(springs);
  Matrix3X<S> const force = whole.forces(x, v);
  CHECK((force - other.forces(x, v)).norm() <= digits * force.norm());
  for (int i = 0; i < tissue.size(); ++i) {
    CHECK(tissue.mass(i) == springs.mass(i));
    CHECK((tissue.internal_force(i, x, v) - springs.internal_force(i, x, v)).norm() <= digits * force.norm());
    CHECK(tissue.stiffness_bound(i) == Approx(springs.stiffness_bound(i)));
    CHECK(tissue.stiffness_bound(i, x) == Approx(springs.stiffness_bound(i, x)));
    CHECK(tissue.damping_bound(i) == Approx(springs.damping_bound(i)));
  }
}

TEMPLATE_TEST_CASE("patch test: an affine displacement of a distorted mesh leaves no force inside", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = distorted<S>(5, 5, 6);
  auto const tissue = solid(mesh);
  testing::detail::WholeTissue whole(tissue);
  Matrix3X<S> const x = affine<S>(mesh.points), force = whole.forces(x, Matrix3X<S>::Zero(3, x.cols()));
  S inside = 0;
  int count = 0;
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.surface().triangles_at(i).empty()) inside = std::max(inside, force.col(i).norm()), ++count;
  CHECK(count == 3 * 3 * 4);
  S const strain = S(0.03), size = S(6);   // of the displacement; of the solid in edges: x is rounded to size · ε edges, which is a strain
  CHECK(inside <= 8 * size * std::numeric_limits<S>::epsilon() / strain * force.colwise().norm().maxCoeff());
  CHECK(force.colwise().norm().maxCoeff() > S(1e-3));
}

TEST_CASE("a free piece of linear tetrahedra has its six rigid motions as null modes and no other") {
  auto const mesh = distorted<double>(3, 3, 4);
  auto const tissue = solid(mesh);
  int const n = 3 * tissue.size();
  Matrix<double, Dynamic, Dynamic> k(n, n);
  Matrix3X<double> const x = mesh.points;
  for (int c = 0; c < n; ++c) {
    Matrix3X<double> d = Matrix3X<double>::Zero(3, tissue.size()), y = d;
    d(c % 3, c / 3) = 1;
    tissue.add_stiffness_product(x, d, y);
    k.col(c) = y.reshaped();
  }
  CHECK((k - k.transpose()).norm() <= 1e-14 * k.norm());
  for (int mode = 0; mode < 6; ++mode) {
    Matrix3X<double> u = Matrix3X<double>::Zero(3, tissue.size());
    for (int i = 0; i < tissue.size(); ++i) u.col(i) = mode < 3 ? Vector3<double>::Unit(mode) : Vector3<double>::Unit(mode - 3).cross(x.col(i));
    CHECK((k * u.reshaped()).norm() <= 1e-14 * k.norm() * u.norm());
  }
  auto const values = Eigen::SelfAdjointEigenSolver<Matrix<double, Dynamic, Dynamic>>(k, Eigen::EigenvaluesOnly).eigenvalues();
  CHECK(values[5] <= 1e-13 * values[n - 1]);
  CHECK(values[6] > 1e-4 * values[n - 1]);
}

TEMPLATE_TEST_CASE("the tangent operator is m M + c C + k K", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_grid<S>(5, 4, S(0.01));
  auto const tissue = membrane(mesh);
  int const n = tissue.size();
  Random random(Seed{9});
  Matrix3X<S> x = mesh.points, d = x, stiffness = Matrix3X<S>::Zero(3, n), damping = stiffness;
  for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] += random.uniform(S(-0.002), S(0.002)), d.data()[k] = random.uniform(S(-1), S(1));
  tissue.add_stiffness_product(x, d, stiffness), tissue.add_damping_product(x, d, damping);
  testing::detail::WholeTissue whole(tissue);
  Matrix<S, 4, Dynamic> wide_x = Matrix<S, 4, Dynamic>::Zero(4, n), wide_d = wide_x, out = wide_x, column = wide_x;
  wide_x.topRows(3) = x, wide_d.topRows(3) = d;
  std::vector<S> inverse_mass;
  Matrix3X<S> expected = S(0.3) * damping + S(0.7) * stiffness;
  for (int i = 0; i < n; ++i) inverse_mass.push_back(1 / tissue.mass(i)), expected.col(i) += 2 * tissue.mass(i) * d.col(i);
  whole.assembly.linearise(wide_x, inverse_mass.data());
  whole.assembly.multiply_tangent(S(2), S(0.3), S(0.7), wide_d.data(), out.data());
  S const digits = 256 * std::numeric_limits<S>::epsilon();
  CHECK((out.topRows(3) - expected).norm() <= digits * expected.norm());
  CHECK(out.row(3).norm() == 0);
  whole.assembly.tangent_diagonal(S(2), S(0.3), S(0.7), out.data());
  for (int i = 0; i < n; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      wide_d.setZero();
      wide_d(axis, i) = 1;
      whole.assembly.multiply_tangent(S(2), S(0.3), S(0.7), wide_d.data(), column.data());
      CHECK(std::abs(out(axis, i) - column(axis, i)) <= digits * out(axis, i));
    }
}

TEST_CASE("every solver of statics finds a stretched bar: u = ε x, and its reaction E A ε") {
  auto const mesh = make_block<double>(7, 3, 3, 0.01);
  double const stretch = 0.01;
  std::vector<int> ends;
  for (int i = 0; i < mesh.points.cols(); ++i)
    if (mesh.points(0, i) < 1e-9 || mesh.points(0, i) > 0.06 - 1e-9) ends.push_back(i);
  for_each_solver([&](char const* name, auto const& solver) {
    SoftBody body(solid(mesh, 0.0), LeapfrogVerlet{}, WholeBody{});
    for (int const i : ends) body.drag(i, (1 + stretch * Vector3<double>::UnitX().array()).matrix().cwiseProduct(mesh.points.col(i)));
    body.solve_statics(solver, 1e-10);
    double worst = 0, pull = 0;
    for (int i = 0; i < body.size(); ++i) {
      Vector3<double> const u = body.displacement(i);
      worst = std::max(worst, (u - Vector3<double>(stretch * mesh.points(0, i), 0, 0)).norm());
      if (mesh.points(0, i) < 1e-9) pull -= body.reaction(i).x();
    }
    CAPTURE(name);
    CHECK(worst < 1e-6 * stretch * 0.06);
    CHECK(pull == Approx(3000.0 * 0.02 * 0.02 * stretch).epsilon(1e-5));
  });
}

TEST_CASE("BackwardEuler takes such a bar there in steps far above the stable one of an explicit integrator") {
  auto const mesh = make_block<double>(7, 3, 3, 0.01);
  SoftBody body(solid(mesh, 0.0), BackwardEuler{}, WholeBody{});
  SoftBody explicitly(solid(mesh, 0.0), LeapfrogVerlet{}, WholeBody{});
  for (int i = 0; i < body.size(); ++i)
    if (mesh.points(0, i) < 1e-9)
      body.nail(i);
    else if (mesh.points(0, i) > 0.06 - 1e-9)
      body.drag(i, mesh.points.col(i) + Vector3<double>(6e-4, 0, 0));
  double const h = 100 * explicitly.stable_step();
  for (int k = 0; k < 200; ++k) REQUIRE(body.step(h));
  double worst = 0;
  for (int i = 0; i < body.size(); ++i) worst = std::max(worst, (body.displacement(i) - Vector3<double>(0.01 * mesh.points(0, i), 0, 0)).norm());
  CHECK(worst < 1e-8);
  CHECK(explicitly.guaranteed_stable_step() < explicitly.stable_step());
}

TEST_CASE("a zone moves what is touched as the whole body does") {
  auto const mesh = make_block<double>(9, 9, 5, 0.01);
  auto const homes = make_elements(mesh.points, [](auto const& rest) { return AnchorSpring<double>{rest, {2.0, 0.02}}; });
  auto const solid_parts = make_elements(mesh.points, mesh.tetrahedra, [](auto const& rest) { return UserTetrahedron<double>(rest, 300.0, 0.3); });
  ElementTissue const tissue(mesh, {.total = 0.3}, homes, solid_parts);
  SoftBody zone(tissue, LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  SoftBody whole(tissue, LeapfrogVerlet{}, WholeBody{});
  int const top = 4 * 81 + 40;
  for (int k = 0; k < 30; ++k) {
    zone.apply_force(top, {0.0, 0.0, -0.05}), whole.apply_force(top, {0.0, 0.0, -0.05});
    auto const report = zone.step(2e-4);
    CHECK(report.moving < zone.size() / 2);
    REQUIRE(whole.step(2e-4));
  }
  CHECK(zone.displacement(top).z() < -1e-5);
  CHECK(zone.displacement(top).z() == Approx(whole.displacement(top).z()).epsilon(2e-2));
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) {
    zone.apply_force((37 * k) % zone.size(), {0.0, 0.0, -0.05});
    zone.step(2e-4);
  }
  CHECK(allocations.count() == 0);
}

TEST_CASE("particles on home springs move by the closed form") {
  auto const mesh = make_grid<double>(3, 3, 0.01);
  ElementTissue tissue(mesh, {.total = 0.9, .lumping = Lumping::equal}, make_elements(mesh.points, [](auto const& rest) { return AnchorSpring<double>{rest, {10.0, 0.2}}; }));
  tissue.nail(0);
  SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
  for (int k = 0; k < 1000; ++k) {
    body.apply_force(4, {0.0, 0.0, -0.02});
    body.apply_force(0, {0.0, 0.0, -0.02});
    REQUIRE(body.step(1e-3));
  }
  double const w = std::sqrt(99.0);   // 0.1 x″ + 0.2 x′ + 10 x = F from rest: ω² − (γ/2)² = 100 − 1
  CHECK(body.displacement(4).z() == Approx(-0.002 * (1.0 - std::exp(-1.0) * (std::cos(w) + std::sin(w) / w))).epsilon(1e-4));
  CHECK(body.displacement(0).norm() == 0);
  CHECK(body.reaction(0).z() == Approx(0.02));
}

TEMPLATE_TEST_CASE("blocks of elements walked at once or backwards give the bytes of one thread", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_block<S>(17, 17, 17, S(0.01));
  auto const live = [&](auto body) {
    REQUIRE(body.size() == 4913);   // two blocks
    body.set_gravity({0, 0, S(-9.81)});
    for (int step = 0; step < 20; ++step) {
      for (int i = 7; i < body.size(); i += 97) body.apply_force(i, {S(0.03) * static_cast<S>(std::sin(0.3 * step + i)), S(0.02), S(0.05)});
      REQUIRE(body.step(S(1e-4)));
    }
    Matrix3X<S> both(3, 2 * body.size());
    both << body.positions(), body.velocities();
    return both;
  };
  auto tissue = solid(mesh);
  tissue.nail(boundary_vertices(TriangleMesh<S>{mesh.points, tissue.surface().triangles().leftCols(32)}));   // some
  auto const one = live(SoftBody(tissue, LeapfrogVerlet{}, WholeBody{}));
  CHECK((one.leftCols(4913) - mesh.points).cwiseAbs().maxCoeff() > S(1e-6));
  CHECK(live(SoftBody(tissue, LeapfrogVerlet{}, WholeBody{}, AtOnce{})) == one);
  CHECK(live(SoftBody(tissue, LeapfrogVerlet{}, WholeBody{}, Backwards{})) == one);
}

TEST_CASE("what no tissue can be made of is refused in a sentence") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01);
  auto const list = make_elements(mesh.points, mesh.tetrahedra, [](auto const& rest) { return UserTetrahedron<double>(rest, 3000.0, 0.3); });
  auto wrong = list;
  wrong.nodes[3][1] = 27;
  CHECK_THROWS_WITH(ElementTissue(mesh, {}, wrong), Catch::Matchers::Contains("particle index 27"));
  wrong = list;
  wrong.nodes[3][1] = wrong.nodes[3][2];
  CHECK_THROWS_WITH(ElementTissue(mesh, {}, wrong), Catch::Matchers::Contains("element 3 joins a particle with itself"));
  wrong = list;
  wrong.elements.pop_back();
  CHECK_THROWS_AS(ElementTissue(mesh, {}, wrong), InvalidArgument);
  CHECK_THROWS_WITH(ElementTissue(mesh, {.total = -1.0}, list), Catch::Matchers::Contains("-1 kg"));
  auto light = list;
  for (auto& element : light.elements) element.density = 0;
  CHECK_THROWS_WITH(ElementTissue(mesh, light), Catch::Matchers::Contains("particle 0 weighs 0 kg"));
  Matrix<int, 4, Dynamic> outside = mesh.tetrahedra;
  outside(2, 5) = -1;
  CHECK_THROWS_AS(make_elements(mesh.points, outside, [](auto const& rest) { return UserTetrahedron<double>(rest, 1.0, 0.0); }), OutOfRange);
  ElementTissue tissue(mesh, {}, list);
  CHECK_THROWS_AS(tissue.nail(27), OutOfRange);
  CHECK_THROWS_AS(tissue.set_mass(3, 0.0), InvalidArgument);
}
