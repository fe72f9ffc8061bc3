// SPDX-License-Identifier: MIT
// Implicit integrators on bodies. Yardsticks: differences of the forces, dense eigenvalues, a dense solution of K u = f, Newton-Raphson's
// equilibrium, Dormand and Prince's path, sums of momentum and the count of the allocation trap.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/node_steps.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

template <class S>
MassSpring<S> sheet(S stiffness = S(100), S home = S(5), S damping = S(0.02)) {
  return {make_grid<S>(7, 6, S(0.01)), {.mass = {.total = S(0.05)}, .link = {.stiffness = stiffness, .damping = damping}, .home = {.stiffness = home, .damping = damping}}};
}

/// An assembly of the first `moving` particles, and its matrices, read off product by product; positions are the rest ones, stretched and shaken.
template <class Tissue>
struct LinkTangent {
  using S = typename Tissue::Scalar;
  using Dense = Eigen::Matrix<double, Dynamic, Dynamic>;

  LinkTangent(Tissue const& tissue, int moving, S stretch, S shake, Vector3<S> const& about = Vector3<S>::Zero()) : count(moving) {
    std::vector<int> chosen(static_cast<std::size_t>(moving));
    std::iota(chosen.begin(), chosen.end(), 0);
    tissue.assemble(chosen, assembly);
    auto const particles = assembly.particles();
    x.setZero(4, static_cast<Eigen::Index>(particles.size()));
    Random random(Seed{11});
    for (std::size_t k = 0; k < particles.size(); ++k)
      for (int axis = 0; axis < 3; ++axis)
        x(axis, static_cast<Eigen::Index>(k)) = about[axis] + stretch * (tissue.rest_position(particles[k]) - about)[axis] + static_cast<S>(random.uniform(-1.0, 1.0)) * shake;
    std::vector<S> inverse_mass;
    for (int const i : chosen) inverse_mass.push_back(1 / tissue.mass(i));
    assembly.linearise(x, inverse_mass.data());
  }

  Dense matrix(S m, S c, S k) const {
    Dense dense(3 * count, 3 * count);
    Matrix<S, 4, Dynamic> d = Matrix<S, 4, Dynamic>::Zero(4, x.cols()), out = d;
    for (int j = 0; j < 3 * count; ++j) {
      d(j % 3, j / 3) = 1;
      out.setConstant(7);
      assembly.multiply_tangent(m, c, k, d.data(), out.data());
      d(j % 3, j / 3) = 0;
      for (int i = 0; i < 3 * count; ++i) dense(i, j) = double(out(i % 3, i / 3));
      CHECK(out.row(3).leftCols(count).isZero(0));
    }
    return dense;
  }
  Eigen::VectorXd diagonal(S m, S c, S k) {
    Matrix<S, 4, Dynamic> out = Matrix<S, 4, Dynamic>::Constant(4, x.cols(), 7);
    assembly.tangent_diagonal(m, c, k, out.data());
    CHECK(out.row(3).leftCols(count).isZero(0));
    Eigen::VectorXd flat(3 * count);
    for (int i = 0; i < 3 * count; ++i) flat[i] = double(out(i % 3, i / 3));
    return flat;
  }
  /// −∂f/∂x or, of velocities, −∂f/∂v by central differences, at rest.
  Dense differences(bool of_velocities, S step) {
    Dense dense(3 * count, 3 * count);
    Matrix3X<S> at = x.template topRows<3>(), v = Matrix3X<S>::Zero(3, x.cols());
    Matrix3X<S>& moved = of_velocities ? v : at;
    for (int j = 0; j < 3 * count; ++j) {
      Matrix3X<S> change = Matrix3X<S>::Zero(3, x.cols());
      for (S const sign : {S(1), S(-1)}) {
        S const before = moved(j % 3, j / 3);
        moved(j % 3, j / 3) += sign * step;
        Matrix3X<S> f = Matrix3X<S>::Zero(3, x.cols());
        assembly.add_forces(at, v, f);
        change += sign * f;
        moved(j % 3, j / 3) = before;
      }
      for (int i = 0; i < 3 * count; ++i) dense(i, j) = -double(change(i % 3, i / 3)) / (2 * double(step));
    }
    return dense;
  }

  typename Tissue::Assembly assembly;
  int count;
  Matrix<S, 4, Dynamic> x;
};

template <class Tissue>
void check_in_tension(Tissue const& tissue, int moving, double tolerance, Vector3<double> const& about = Vector3<double>::Zero()) {
  LinkTangent<Tissue> tangent(tissue, moving, 1.3, 2e-4, about);
  auto const k = tangent.matrix(0, 0, 1), c = tangent.matrix(0, 1, 0), m = tangent.matrix(1, 0, 0);
  CHECK((k - tangent.differences(false, 1e-7)).norm() < tolerance * k.norm());
  CHECK((c - tangent.differences(true, 1e-3)).norm() < 1e-9 * c.norm());
  for (int i = 0; i < 3 * moving; ++i) CHECK(m(i, i) == Approx(tissue.mass(i / 3)));
  CHECK((tangent.matrix(2.0, 3.0, 5.0) - 2 * m - 3 * c - 5 * k).norm() < 1e-13 * k.norm());
  CHECK((tangent.diagonal(2.0, 3.0, 5.0) - (2 * m + 3 * c + 5 * k).diagonal()).norm() < 1e-13 * k.norm());
}

template <class Tissue>
void check_in_compression(Tissue const& tissue, int moving) {
  using S = typename Tissue::Scalar;
  double const digits = 30 * double(std::numeric_limits<S>::epsilon());
  for (double const stretch : {0.3, 0.9, 1.0}) {
    LinkTangent<Tissue> tangent(tissue, moving, S(stretch), S(3e-3));
    for (auto const& a : {tangent.matrix(0, 0, 1), tangent.matrix(0, 1, 0)}) {
      CHECK((a - a.transpose()).norm() <= digits * a.norm());
      Eigen::SelfAdjointEigenSolver<typename LinkTangent<Tissue>::Dense> const modes((a + a.transpose()) / 2);
      CHECK(modes.eigenvalues().minCoeff() > -digits * a.norm());
    }
  }
}

template <class Body>
double distance(Body const& body, Matrix3X<double> const& x) {
  return (body.positions().template cast<double>() - x).norm();
}

}  // namespace

TEST_CASE("in tension the tangent is the derivative of the forces, whatever the law") {
  auto const grid = make_grid<double>(5, 4, 0.01);
  check_in_tension(sheet<double>(), 42, 1e-7);
  check_in_tension(sheet<double>(), 17, 1e-7);   // a border beside it
  check_in_tension(MassSpring<double, SaturatingSpring<double>>(grid, {.link = {.stiffness = 80, .largest_tension = 0.2, .damping = 0.1}, .home = {.stiffness = 1, .damping = 0.2}}), 13, 1e-6);
  check_in_tension(MassSpring<double, LockingSpring<double>>(grid, {.link = {.stiffness = 80, .largest_tension = 0.5, .damping = 0.1}}), 20, 1e-6);
  check_in_tension(MassSpring<double, CubicSpring<double>>(grid, {.link = {.stiffness = 80, .cubic = 1e6, .damping = 0.1}}), 20, 1e-6);
  Vector3<double> const centre(0.03, 0.02, -0.01);
  check_in_tension(Supported(sheet<double>(), LinearSpring<double>{.stiffness = 20, .damping = 0.3}, centre), 30, 1e-6, centre);
}

TEMPLATE_TEST_CASE("in compression the tangent stays symmetric and positive semidefinite", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  check_in_compression(sheet<S>(), 42);
  check_in_compression(sheet<S>(S(100), S(0)), 20);
  check_in_compression(MassSpring<S, SaturatingSpring<S>>(make_grid<S>(5, 4, S(0.01)), {.link = {.stiffness = S(80), .largest_tension = S(0.2), .damping = S(0.1)}}), 20);
  check_in_compression(Supported(sheet<S>(), LinearSpring<S>{.stiffness = S(20)}, {S(0.03), S(0.02), S(-0.01)}), 30);
}

TEST_CASE("a body's path converges with the order stated, with damped and compressed links, nailed and held particles") {
  auto const path = [](auto integrator, int steps) {
    auto tissue = sheet<double>(100.0, 5.0, 0.05);
    tissue.nail(0);
    SoftBody body(tissue, integrator, WholeBody{});
    body.hold(41);
    for (int k = 0; k < steps; ++k) {
      body.apply_force(17, {0.1, -0.05, -0.2});
      REQUIRE(body.step(0.02 / steps));
    }
    return Matrix3X<double>(body.positions());
  };
  Matrix3X<double> const exact = path(DormandPrince{.relative = 1e-10}, 1);
  auto const order = [&](auto integrator) { return std::log2((path(integrator, 160) - exact).norm() / (path(integrator, 320) - exact).norm()); };
  CHECK((path(DormandPrince{.relative = 1e-10}, 7) - exact).norm() < 1e-9);
  CHECK(order(BackwardEuler{}) == Approx(1.0).margin(0.1));
  CHECK(order(CrankNicolson{}) == Approx(2.0).margin(0.1));
  CHECK((path(BackwardEuler{}, 40) - exact).norm() > 5 * (path(CrankNicolson{}, 40) - exact).norm());
}

// Yardstick: Dormand and Prince's steps to 1e-10. The damping of a solid is that of where it is; a step that weighs its ways by that of its start has to say so.
TEST_CASE("a damped solid's path converges with the order stated, however hard it is pushed") {
  auto const path = [](auto integrator, double push, int steps) {
    auto const mesh = make_block<double>(4, 3, 3, 0.01, BlockPattern::alternating);
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {.young = 5e3, .poisson = 0.45}, .damping = {.alpha = 1, .beta = 1e-3}});
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-6; }));
    SoftBody body(std::move(tissue), integrator, WholeBody{});
    for (int k = 0; k < steps; ++k) {
      body.apply_force(body.size() - 1, {push, push / 2, -push});
      REQUIRE(body.step(0.03 / steps));
    }
    return Matrix3X<double>(body.positions());
  };
  for (double const push : {0.02, 0.3, 1.0}) {
    CAPTURE(push);
    Matrix3X<double> const exact = path(DormandPrince{.relative = 1e-10}, push, 1);
    auto const order = [&](auto integrator) { return std::log2((path(integrator, push, 128) - exact).norm() / (path(integrator, push, 256) - exact).norm()); };
    CHECK(order(CrankNicolson{}) == Approx(2.0).margin(0.2));
    CHECK(order(BackwardEuler{}) == Approx(1.0).margin(0.15));
  }
}

TEST_CASE("far above the explicit limit a stiff body stays bounded and comes to rest where statics say") {
  auto tissue = sheet<double>(5000.0, 5.0, 0.05);
  for (int i = 0; i < 7; ++i) tissue.nail(i);
  Vector3<double> const force(0.1, 0.3, 0.05);
  SoftBody still(tissue, LeapfrogVerlet{}, WholeBody{});
  double const limit = still.stable_step();
  still.apply_force(38, force);
  still.solve_statics(NewtonRaphson<>{}, 1e-10);
  double const expected = (still.positions() - still.rest_mesh().points).norm();
  CHECK(expected > 1e-3);

  auto const check = [&](auto integrator, double times) {
    SoftBody body(tissue, integrator, WholeBody{});
    CHECK(std::isinf(body.stable_step()));
    double farthest = 0;
    for (int k = 0; k < 600; ++k) {
      body.apply_force(38, force);
      REQUIRE(body.step(times * limit).status == StepStatus::ok);
      farthest = std::max(farthest, (body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff());
    }
    CHECK(farthest < 0.01);   // an edge
    CHECK((body.positions() - still.positions()).norm() < 1e-3 * expected);
  };
  check(BackwardEuler{}, 10.0);
  check(BackwardEuler{}, 100.0);
  check(ThetaScheme{.theta = 0.6}, 100.0);
  check(CrankNicolson{}, 10.0);
}

TEST_CASE("small forces end at K u = f, solved densely") {
  auto const tissue = sheet<double>(200.0, 5.0, 0.5);
  LinkTangent<MassSpring<double>> const tangent(tissue, 42, 1.0, 0.0);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * 42);
  load.segment<3>(3 * 17) = Vector3<double>(1e-6, -2e-6, 1e-6);
  Eigen::VectorXd const u = tangent.matrix(0, 0, 1).ldlt().solve(load);
  SoftBody body(tissue, BackwardEuler{}, WholeBody{});
  for (int k = 0; k < 400; ++k) {
    body.apply_force(17, load.segment<3>(3 * 17));
    body.step(0.05);
  }
  Matrix3X<double> const moved = body.positions() - body.rest_mesh().points;
  CHECK((Eigen::Map<Eigen::VectorXd const>(moved.data(), moved.size()) - u).norm() < 1e-3 * u.norm());
}

TEMPLATE_PRODUCT_TEST_CASE("a step of zero changes nothing, two runs agree to the bit", "", std::pair, ((BackwardEuler, double), (CrankNicolson, double), (BackwardEuler, float))) {
  using I = typename TestType::first_type;
  using S = typename TestType::second_type;
  SoftBody a(sheet<S>(), I{}, WholeBody{}), b(sheet<S>(), I{}, WholeBody{});
  for (int k = 0; k < 20; ++k) {
    for (auto* body : {&a, &b}) {
      body->apply_force(17, {S(0.1), S(0), S(-0.2)});
      body->step(S(0.01));
    }
    Matrix3X<S> const x = a.positions(), v = a.velocities();
    a.apply_force(9, {S(0), S(0), S(1)});
    a.step(S(0));
    REQUIRE(a.positions() == x);
    REQUIRE(a.velocities() == v);
  }
  CHECK(a.positions() == b.positions());
  CHECK(a.velocities() == b.velocities());
}

TEMPLATE_TEST_CASE("a free body keeps its momentum to within the tolerance, and pushes add theirs", "", BackwardEuler, CrankNicolson) {
  TestType integrator;
  integrator.tolerance = 1e-12;
  integrator.max_iterations = 2000;
  auto tissue = sheet<double>(300.0, 0.0, 0.02);
  for (int i = 0; i < tissue.size(); ++i) tissue.set_home(i, {});
  SoftBody body(tissue, integrator, WholeBody{});
  Vector3<double> const force(0.02, -0.01, 0.03);
  for (int k = 0; k < 100; ++k) {
    if (k < 40) body.apply_force(17, force);
    body.step(1e-3);
  }
  CHECK((body.momentum() - 40 * 1e-3 * force).norm() < 1e-9 * 0.04 * force.norm());
}

TEST_CASE("a spent budget still gives a bounded step towards rest") {
  auto tissue = sheet<double>(5000.0, 5.0, 0.05);
  for (int i = 0; i < 7; ++i) tissue.nail(i);
  for (int const budget : {0, 1, 5, 10}) {
    SoftBody body(tissue, BackwardEuler{.max_iterations = budget}, WholeBody{});
    for (int k = 0; k < 300; ++k) {
      body.apply_force(38, {0.0, 0.2, 0.0});
      auto const report = body.step(5e-3);
      REQUIRE(report);
      if (budget == 0) CHECK((!report.solve.converged && report.solve.residual == 1));
    }
    CAPTURE(budget);
    CHECK((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() < 0.02);
    if (budget == 0) CHECK((body.positions() - body.rest_mesh().points).norm() == 0);
  }
}

TEST_CASE("integrators whose numbers make no sense are refused with the value, as a body is made") {
  auto const tissue = sheet<double>(50.0, 5.0, 0.05);
  double const nan = std::numeric_limits<double>::quiet_NaN();
  for (double const theta : {-1.0, 2.0, nan}) {
    CHECK_THROWS_WITH(SoftBody(tissue, ThetaScheme{.theta = theta}), says("ThetaScheme: theta is ", "give 0 to 1"));
    CHECK_THROWS_WITH(SoftBody(tissue, NodeSteps{.theta = theta}), says("NodeSteps: theta is ", "give 0 to 1"));
  }
  for (DormandPrince const& wrong : {DormandPrince{.relative = -1}, DormandPrince{.absolute = nan}, DormandPrince{.max_inner_steps = 0}})
    CHECK_THROWS_WITH(SoftBody(tissue, wrong), says("DormandPrince: the tolerances are ", "zero or more"));
}

TEMPLATE_TEST_CASE("a zone with its border moves as a body whose other particles are nailed", "", BackwardEuler, CrankNicolson) {
  TestType integrator;
  integrator.tolerance = 1e-12;
  SoftBody zone(sheet<double>(), integrator, ZoneOfInfluence{.rings = 2});
  zone.apply_force(17, {0.0, 0.05, -0.1});
  int const moving = zone.step(2e-3).moving;
  CHECK(moving < 42);
  CHECK(moving > 7);
  auto tissue = sheet<double>();
  for (int i = 0; i < 42; ++i)
    if (zone.displacement(i).isZero(0)) tissue.nail(i);
  SoftBody whole(tissue, integrator, WholeBody{});
  whole.apply_force(17, {0.0, 0.05, -0.1});
  CHECK(whole.step(2e-3).moving == moving);
  CHECK((whole.positions() - zone.positions()).norm() < 1e-12);
  for (int k = 0; k < 50; ++k) {
    zone.apply_force(17, {0.0, 0.05, -0.1});
    whole.apply_force(17, {0.0, 0.05, -0.1});
    CHECK(zone.step(2e-3).moving == moving);
    whole.step(2e-3);
  }
  CHECK((whole.positions() - zone.positions()).norm() < 1e-10);
  int left = moving;
  for (int k = 0; k < 20000 && left > 0; ++k) left = zone.step(2e-3).moving;
  CHECK(left == 0);
}

TEST_CASE("support springs move with the implicit step too") {
  auto const path = [](auto integrator, int steps) {
    SoftBody body(Supported(sheet<double>(), LinearSpring<double>{.stiffness = 20, .damping = 0.1}, {0.03, 0.02, -0.03}), integrator, WholeBody{});
    for (int k = 0; k < steps; ++k) {
      body.apply_force(17, {0.1, -0.05, -0.2});
      REQUIRE(body.step(0.02 / steps));
    }
    return Matrix3X<double>(body.positions());
  };
  Matrix3X<double> const exact = path(DormandPrince{.relative = 1e-9}, 1);
  CHECK(std::log2((path(CrankNicolson{}, 40) - exact).norm() / (path(CrankNicolson{}, 80) - exact).norm()) == Approx(2.0).margin(0.1));
}

TEMPLATE_PRODUCT_TEST_CASE("implicit steps allocate nothing after the first", "", std::pair, ((BackwardEuler, WholeBody), (CrankNicolson, ZoneOfInfluence))) {
  REQUIRE(palpate_test::trap_works());
  using I = typename TestType::first_type;
  using R = typename TestType::second_type;
  auto const allocations_of = [](auto&& body) {
    using S = typename std::remove_cvref_t<decltype(body)>::Scalar;
    body.apply_force(0, {S(0), S(0), S(1e-3)});
    body.step(S(1e-3));
    palpate_test::AllocationCount const allocations;
    for (int k = 0; k < 100; ++k) {
      body.apply_force((k * 37) % body.size(), {S(0), S(1e-3), S(-1e-2)});
      if (k % 50 == 10) body.hold(5);
      if (k % 50 == 40) body.release(5);
      if (k == 60) body.set_gravity({S(0), S(0), S(-1)});
      body.step(S(1e-3));
    }
    return allocations.count();
  };
  CHECK(allocations_of(SoftBody(sheet<double>(), I{}, R{})) == 0);
  CHECK(allocations_of(SoftBody(sheet<float>(), I{}, R{})) == 0);
  CHECK(allocations_of(SoftBody(MassSpring<double>(make_block<double>(4, 4, 5, 0.01), {.link = {.stiffness = 100, .damping = 0.1}, .home = {.stiffness = 1}}), I{}, R{})) == 0);
  CHECK(allocations_of(SoftBody(Supported(MassSpring<float>(make_sphere<float>(0.05F, 4), {.link = {.stiffness = 100}}), LinearSpring<float>{.stiffness = 20}), I{}, R{})) == 0);
}
