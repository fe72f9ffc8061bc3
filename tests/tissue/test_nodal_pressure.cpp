// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "cantilever.hpp"
#include "catch.hpp"
#include "yardstick.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::check_yardstick, palpate_test::tip_over_timoshenko, palpate_test::worse;

namespace {

template <class S>
TetrahedralMesh<S> shaken(int n, S spacing) {
  auto mesh = make_block<S>(n, n, n, spacing, BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) += S(0.15) * spacing * Vector3<S>::Random();
  return mesh;
}

template <class S, class M>
FiniteElements<S, M> averaged(TetrahedralMesh<S> const& mesh, M const& material, RayleighDamping<S> const& damping = {}) {
  return {mesh, {.density = 1000, .material = material, .damping = damping, .pressure = Pressure::nodal}};
}

template <class S, class Visit>
void for_each_averaged_material(Visit visit) {
  S const young = 3000, poisson = S(0.45);
  visit(Corotational<S>{young, poisson});
  visit(StVenantKirchhoff<S>{young, poisson});
  visit(NeoHookean<S>{young, poisson});
  visit(StableNeoHookean<S>{young, poisson});
}

}  // namespace

static_assert(HasBulkModulus<StableNeoHookeanLaw<double>, double>);
static_assert(!HasBulkModulus<LinearElasticLaw<double>, double>, "its energy does not say how much of it is volume");

// Yardstick: dense central differences of the energy and of the forces, on 50 random meshes of one and of two materials.
TEST_CASE("nodal pressure: forces, products, blocks and row bounds are those of dense differences", "[tissue][nodal_pressure][yardstick]") {
  std::srand(5);
  double force = 0, stiffness = 0;
  for (int round = 0; round < 50; ++round) {
    auto const mesh = shaken<double>(3, 0.01);
    auto tissue = averaged<double>(mesh, StableNeoHookean<double>{3000, 0.45});
    if (round % 2 == 1) tissue.set_material(std::vector<int>{0, 1, 2, 7, 11, 20}, {30000, 0.3}, 1100);
    int const n = tissue.size();
    testing::detail::WholeTissue<decltype(tissue)> whole(tissue);
    Matrix3X<double> const still = Matrix3X<double>::Zero(3, n);
    Matrix3X<double> x = mesh.points + 1e-3 * Matrix3X<double>::Random(3, n), gradient = still;
    Eigen::MatrixXd dense(3 * n, 3 * n), at_rest = dense;
    double const step = 1e-7;
    auto const differences = [&](Matrix3X<double> at, Eigen::MatrixXd& slope) {
      for (int k = 0; k < 3 * n; ++k) {
        double const before = at(k);
        at(k) = before + step;
        Matrix3X<double> const ahead = whole.forces(at, still);
        at(k) = before - step;
        slope.col(k) = (whole.forces(at, still) - ahead).reshaped() / (2 * step);
        at(k) = before;
      }
    };
    for (int k = 0; k < 3 * n; ++k) {
      double const before = x(k);
      x(k) = before + step;
      double const ahead = tissue.potential_energy(x);
      x(k) = before - step;
      gradient(k) = (ahead - tissue.potential_energy(x)) / (2 * step);
      x(k) = before;
    }
    force = worse(force, (whole.forces(x, still) + gradient).norm() / gradient.norm());
    differences(x, dense), differences(mesh.points, at_rest);

    Eigen::MatrixXd blocks = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    tissue.for_each_stiffness_block(mesh.points, [&](int i, int j, Matrix<double, 3, 3> const& block) { blocks.block<3, 3>(3 * i, 3 * j) += block; });
    stiffness = worse(stiffness, (blocks - at_rest).norm() / at_rest.norm());
    Matrix3X<double> const d = Matrix3X<double>::Random(3, n);
    Matrix3X<double> product = still;
    tissue.add_stiffness_product(mesh.points, d, product);
    stiffness = worse(stiffness, (product.reshaped() - at_rest * d.reshaped()).norm() / product.norm());
    for (int i = 0; i < n; ++i) {
      auto const row = [i, n](Eigen::MatrixXd const& matrix) {
        double sum = 0;
        for (int j = 0; j < n; ++j) sum += matrix.block<3, 3>(3 * i, 3 * j).operatorNorm();
        return sum;
      };
      CHECK(row(at_rest) < tissue.stiffness_bound(i) * (1 + 1e-6));
      CHECK(row(dense) < tissue.stiffness_bound(i, x) * (1 + 1e-6));
      CHECK(tissue.stiffness_bound(i) < 20 * row(at_rest));
    }
  }
  check_yardstick({.what = "forces of nodal pressure, 50 random meshes: difference over their norm", .source = "central differences of the energy", .expected = 0, .ours = force, .within = 1e-6});
  check_yardstick({.what = "stiffness of nodal pressure, blocks and product: difference over its norm", .source = "central differences of the forces", .expected = 0, .ours = stiffness, .within = 1e-6});
}

// Yardstick: the laws of tissues; the forces of one particle, of a part and of the whole are the same.
TEMPLATE_TEST_CASE("nodal pressure and Rayleigh damping keep the laws of tissues", "[tissue][nodal_pressure]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(7);
  auto const mesh = shaken<S>(4, S(0.01));
  for_each_averaged_material<S>([&](auto const& material) {
    auto const tissue = averaged<S>(mesh, material, {.alpha = 3, .beta = S(1e-3)});
    CHECK(testing::check_tissue(tissue, {.displacement = 0.05}) == testing::Violations{});
    CHECK(testing::check_tissue(averaged<S>(mesh, material, {.alpha = 0, .beta = S(1e-3)}), {.displacement = 0.05, .isolated = true, .turns = false}) == testing::Violations{});   // beta K of a stressed body turns it
    Matrix3X<S> const x = mesh.points + S(1e-3) * Matrix3X<S>::Random(3, tissue.size()), v = Matrix3X<S>::Random(3, tissue.size());
    Matrix3X<S> const all = testing::detail::WholeTissue<std::remove_cvref_t<decltype(tissue)>>(tissue).forces(x, v);
    for (int i = 0; i < tissue.size(); ++i) CHECK((tissue.internal_force(i, x, v) - all.col(i)).norm() < S(std::same_as<S, float> ? 1e-4 : 1e-11) * all.norm());
  });
}

// Yardstick: deflections over Timoshenko's beam as computed independently for these meshes, within 0.01.
TEST_CASE("nodal pressure cures a cantilever near the limit of volume", "[tissue][nodal_pressure][yardstick]") {
  for (auto const& beam : palpate_test::cantilevers)
    check_yardstick({.what = to_text(beam) + ", nodal pressure", .source = "computed independently", .expected = beam.nodal,
                     .ours = tip_over_timoshenko<StableNeoHookean<double>>(beam.through, beam.poisson, beam.pattern, {.pressure = Pressure::nodal}), .within = 0.01});
}

// Yardstick: what is squeezed to nothing or turned over has finite forces, of the stable law also with nodal pressure.
TEST_CASE("nodal pressure is finite for every shape, and says what is turned over", "[tissue][nodal_pressure]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto const tissue = averaged<double>(mesh, StableNeoHookean<double>{3000, 0.49});
  testing::detail::WholeTissue<std::remove_cvref_t<decltype(tissue)>> whole(tissue);
  Matrix3X<double> const still = Matrix3X<double>::Zero(3, tissue.size());
  Matrix3X<double> flat = mesh.points;
  flat.row(2).setZero();
  CHECK(is_finite(whole.forces(flat, still)));
  CHECK(is_finite(whole.forces(Matrix3X<double>(0.0 * flat), still)));
  CHECK(is_finite(whole.forces(Matrix3X<double>(-flat), still)));
  CHECK(tissue.lowest_determinant(flat).value == 0);
  Matrix3X<double> one = mesh.points;
  one(2, 26) -= 0.05;
  auto const lowest = tissue.lowest_determinant(one);
  CHECK(lowest.value < -1);
  auto const& nodes = tissue.list().nodes[static_cast<std::size_t>(lowest.element)];
  CHECK(std::find(nodes.begin(), nodes.end(), 26) != nodes.end());
  CHECK(tissue.lowest_determinant(mesh.points).value > 1 - 1e-12);
}

// Yardstick: the same step of the whole body, which holds still what the zone does not move.
TEST_CASE("nodal pressure: a zone moves as the whole body does where the rest is nailed", "[tissue][nodal_pressure]") {
  auto const mesh = make_block<double>(9, 3, 3, 0.01, BlockPattern::alternating);
  auto const press = [&](auto region, auto integrator) {
    auto tissue = averaged<double>(mesh, StableNeoHookean<double>{3000, 0.49});
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(0, i) < 0.035) tissue.nail(i);
    SoftBody body(std::move(tissue), integrator, region);
    int const tip = body.nearest_vertex({0.08, 0.02, 0.02});
    for (int k = 0; k < 20; ++k) {
      body.apply_force(tip, {0, 0, -0.05});
      body.step(1e-4);
    }
    palpate_test::AllocationCount const allocations;
    body.apply_force(tip, {0, 0, -0.05});
    body.step(1e-4);
    CHECK(allocations.count() == 0);
    return Matrix3X<double>(body.positions());
  };
  auto const check = [&](auto integrator, double tolerance) {
    Matrix3X<double> const whole = press(WholeBody{}, integrator), zone = press(ZoneOfInfluence{.rings = 3}, integrator);
    CHECK((whole - mesh.points).norm() > 1e-5);
    CHECK((whole - zone).norm() < tolerance * (whole - mesh.points).norm());
  };
  check(LeapfrogVerlet{}, 1e-10);
  check(BackwardEuler{.tolerance = 1e-10, .max_iterations = 1000}, 1e-6);
}

// Yardstick: alpha alone slows a body as a whole by exp(-alpha t); beta alone does not.
TEST_CASE("Rayleigh's alpha drags, beta damps what deforms", "[tissue][rayleigh][yardstick]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto const speed_after = [&](RayleighDamping<double> const& damping) {
    FiniteElements<double, Corotational<double>> tissue(mesh, {.density = 1000, .material = {3000, 0.4}, .damping = damping});
    SoftBody body(std::move(tissue), LeapfrogVerlet{});
    auto state = body.save();
    for (int i = 0; i < body.size(); ++i) state.particles.velocity[i] = Vector3<double>(0.1, 0, 0);
    body.restore(state);
    for (int k = 0; k < 1000; ++k) body.step(1e-4);
    return body.velocities()(0, 13);
  };
  check_yardstick({.what = "speed of a free body of 0.1 m/s after 0.1 s, α = 2 1/s [m/s]", .source = "exp(−α t)", .expected = 0.1 * std::exp(-0.2), .ours = speed_after({.alpha = 2, .beta = 0}), .within = 1e-5});
  CHECK(std::abs(speed_after({.alpha = 0, .beta = 1e-3}) - 0.1) < 1e-9);
  CHECK_THROWS_WITH((FiniteElements<double, Corotational<double>>(mesh, {.density = 1000, .material = {3000, 0.4}, .damping = {.alpha = 0, .beta = -1}})), says("beta", "-1"));
}

// Yardstick: a bar whose ends are held apart, pre-strained by e, is in the tension of the stretch 1/(1 - e).
TEST_CASE("pre-strain is the tension of a longer bar", "[tissue][prestrain][yardstick]") {
  auto const mesh = make_block<double>(2, 2, 2, 0.01, BlockPattern::alternating);
  double const strain = 0.1;
  FiniteElements<double, StVenantKirchhoff<double>> const tissue(mesh, {.density = 1000, .material = {3000, 0.0}, .prestrain = strain});
  double mass = 0;
  for (int i = 0; i < tissue.size(); ++i) mass += tissue.mass(i);
  CHECK(std::abs(mass - 1e-3) < 1e-12);
  testing::detail::WholeTissue<std::remove_cvref_t<decltype(tissue)>> whole(tissue);
  Matrix3X<double> const f = whole.forces(Matrix3X<double>(mesh.points), Matrix3X<double>::Zero(3, tissue.size()));
  double pull = 0;
  for (int i = 0; i < tissue.size(); ++i)
    if (mesh.points(0, i) > 0.005) pull -= f(0, i);
  double const stretch = 1 / (1 - strain), area = 0.01 * 0.01 * (1 - strain) * (1 - strain);
  double const expected = 3000.0 / 2 * (stretch * stretch * stretch - stretch) * area;   // nu = 0: each axis by itself
  check_yardstick({.what = "bar pre-strained by 0.1, ν = 0: its tension [N]", .source = "the stretch 1/(1 − ε)", .expected = expected, .ours = pull, .within = 1e-9});
  CHECK_THROWS_WITH((FiniteElements<double, StVenantKirchhoff<double>>(mesh, {.density = 1000, .material = {3000, 0.0}, .prestrain = 1})), says("pre-strain", "1"));
}
