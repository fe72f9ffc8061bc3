// SPDX-License-Identifier: MIT
// Both sides of the stable step. Yardstick: the largest eigenvalue of M^-1/2 K M^-1/2, K by differences of the forces of a plain loop over
// the springs, and what each method's textbook limit makes of it.
#include <palpate/body/soft_body.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include "body/naive_twin.hpp"
#include "catch.hpp"
#include "integrators.hpp"

#include <Eigen/Eigenvalues>

#include <array>
#include <concepts>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

using namespace palpate;
using palpate_test::GridScene;
using palpate_test::NaiveBody;
using palpate_test::Points;

namespace {

/// A grid of 16 particles of unequal mass, two of them nailed.
struct Scene {
  GridScene grid{.nx = 4, .ny = 4, .link_damping = 0.0, .home_damping = 0.0, .nails = {0, 14}};

  double mass(int i) const { return grid.mass / 16 * (0.6 + 0.05 * ((7 * i) % 16)); }
  template <class S = double>
  MassSpring<S> tissue(double mass_damping = 0.0) const {
    auto tissue = grid.tissue<S>();
    for (int i = 0; i < tissue.size(); ++i) {
      tissue.set_mass(i, S(mass(i)));
      tissue.set_home(i, {.stiffness = S(grid.home), .damping = S(mass_damping * mass(i))});
    }
    return tissue;
  }
  NaiveBody plain() const {
    NaiveBody body = grid.plain();
    for (int i = 0; i < body.size(); ++i) body.mass[static_cast<std::size_t>(i)] = mass(i);
    return body;
  }
};

/// The largest eigenvalue of M^-1/2 K M^-1/2 at x, nailed particles left out; `forces(x)` is 3 × n.
template <class Forces>
double largest_eigenvalue(NaiveBody const& body, Points const& x, Forces forces) {
  Eigen::Index const n = 3 * body.size();
  Eigen::MatrixXd k(n, n);
  for (Eigen::Index c = 0; c < n; ++c) {
    Points d = Points::Zero(3, body.size());
    d.data()[c] = 1e-7;
    Points const change = (forces(Points(x - d)) - forces(Points(x + d))) / 2e-7;
    k.col(c) = Eigen::Map<Eigen::VectorXd const>(change.data(), n);
  }
  Eigen::VectorXd scale(n);
  for (Eigen::Index c = 0; c < n; ++c) {
    auto const i = static_cast<std::size_t>(c / 3);
    scale[c] = body.fixed[i] ? 0.0 : 1 / std::sqrt(body.mass[i]);
  }
  Eigen::MatrixXd const a = scale.asDiagonal() * ((k + k.transpose()) / 2) * scale.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

double largest_eigenvalue(NaiveBody const& body) {
  return largest_eigenvalue(body, body.home, [&](Points const& x) { return body.forces(x, Points::Zero(3, body.size())); });
}

/// The largest displacement, in edges, of a body moved by 1e-6 of an edge, over so many steps; infinite once it is above 1e-3.
template <class Body>
double reach(Body body, double edge, double h, int steps) {
  for (int i = 0; i < body.size(); ++i)
    if (!body.tissue().nailed(i)) {
      double const kick = 1e-6 * edge * (i % 2 == 0 ? 1 : -1);
      body.drag(i, body.reference_position(i) + kick * Vector3<double>(1.0, 0.3 + 0.1 * (i % 5), 0.7));
    }
  for (int i = 0; i < body.size(); ++i) body.release(i);
  Points const rest = body.rest_mesh().points;
  double most = 0;
  for (int k = 0; k < steps && most < 1e-3; ++k) {
    if (!body.step(h)) return std::numeric_limits<double>::infinity();
    if (k % 16 == 0) most = std::max(most, (body.positions() - rest).cwiseAbs().maxCoeff() / edge);
  }
  return most < 1e-3 ? most : std::numeric_limits<double>::infinity();
}

template <class I, class... Others>
constexpr bool is_one_of = (std::same_as<I, Others> || ...);

/// hω up to which an undamped mode stays bounded: 0 for at no step, infinite for at any.
template <class I>
constexpr double undamped_limit = [] {
  if constexpr (is_one_of<I, ExplicitEuler, ExplicitMidpoint>) return 0.0;
  if constexpr (is_one_of<I, SymplecticEuler, StoermerVerlet, LeapfrogVerlet, VelocityVerlet>) return 2.0;
  if constexpr (is_one_of<I, RungeKutta4>) return 2 * std::numbers::sqrt2;
  if constexpr (is_one_of<I, BackwardEuler, CrankNicolson, ThetaScheme, NodeSteps, DormandPrince>) return std::numeric_limits<double>::infinity();
}();

constexpr double far_beyond = 20.0;   // hω, ten times leapfrog's limit: where there is none

}  // namespace

TEMPLATE_LIST_TEST_CASE("an undamped body is bounded for 100,000 steps at 0.98 of the true limit and blows up at 1.02", "", AllIntegrators) {
  Scene const scene;
  double const edge = scene.grid.spacing;
  double const omega = std::sqrt(largest_eigenvalue(scene.plain()));
  double const limit = undamped_limit<TestType> / omega;
  SoftBody body(scene.tissue(), TestType{}, WholeBody{});
  if (limit == 0) {
    CHECK(body.stable_step() == 0);
    CHECK(body.guaranteed_stable_step() == 0);
    CHECK(body.step(1e-6).status == StepStatus::above_stable_step);
    // A fifth of leapfrog's limit: growth a step of √(1 + (hω)²) or (1 + (hω)⁴/4)^½.
    CHECK(reach(body, edge, 0.4 / omega, 10000) == std::numeric_limits<double>::infinity());
  } else if (std::isinf(limit)) {
    CHECK(body.stable_step() == limit);
    CHECK(body.guaranteed_stable_step() == limit);
    CHECK(reach(body, edge, far_beyond / omega, 1000) < 1e-4);
  } else {
    CHECK(body.stable_step() < limit);
    CHECK(body.stable_step() > limit * (std::same_as<TestType, RungeKutta4> ? 0.89 : 0.97));   // 2.6 of 2√2; κ is raised by 5 %
    CHECK(body.guaranteed_stable_step() < body.stable_step());
    CHECK(body.guaranteed_stable_step() > 0.5 * limit);
    CHECK(reach(body, edge, 0.98 * limit, 100000) < 1e-4);
    CHECK(reach(body, edge, 1.02 * limit, 4000) == std::numeric_limits<double>::infinity());
  }
}

TEMPLATE_LIST_TEST_CASE("a body damped in proportion to its masses is bounded at 0.98 of the stated step and blows up beyond it", "", AllIntegrators) {
  // All modes have the same γ then, so that most limits are sharp. The others' margins: Runge and Kutta's region reaches up to 16 %
  // beyond its narrowest place; velocity Verlet's limit holds for every smaller γ as well and is up to 65 % short for one.
  double const beyond = std::same_as<TestType, RungeKutta4> ? 1.16 : std::same_as<TestType, VelocityVerlet> ? 1.65 : 1.0;
  Scene const scene;
  double const edge = scene.grid.spacing;
  double const stiffness = largest_eigenvalue(scene.plain());
  for (double const ratio : {0.15, 0.5, 1.5}) {   // of the fastest mode
    double const gamma = 2 * ratio * std::sqrt(stiffness);
    SoftBody body(scene.tissue(gamma), TestType{}, WholeBody{});
    double const limit = TestType{}.stable_step(ModalBounds<double>{stiffness, gamma, gamma});
    CAPTURE(ratio, limit);
    if (std::isinf(undamped_limit<TestType>)) {
      CHECK(limit == std::numeric_limits<double>::infinity());
      CHECK(reach(body, edge, far_beyond / std::sqrt(stiffness), 500) < 1e-4);
      continue;
    }
    CHECK(limit > 0);
    CHECK(body.stable_step() < limit);
    CHECK(body.stable_step() > 0.94 * limit);   // κ and γ are raised by 5 %
    CHECK(reach(body, edge, 0.98 * limit, 20000) < 1e-4);
    CHECK(reach(body, edge, 1.02 * beyond * limit, 20000) == std::numeric_limits<double>::infinity());
  }
}

TEST_CASE("with θ below one half an undamped body blows up at the step at which implicit ones stay bounded") {
  Scene const scene;
  double const h = far_beyond / std::sqrt(largest_eigenvalue(scene.plain()));
  CHECK(reach(SoftBody(scene.tissue(), ThetaScheme{.theta = 0.4}, WholeBody{}), scene.grid.spacing, h, 1000) == std::numeric_limits<double>::infinity());
  CHECK(reach(SoftBody(scene.tissue(), ThetaScheme{.theta = 0.6}, WholeBody{}), scene.grid.spacing, h, 1000) < 1e-4);
}

TEST_CASE("the guaranteed bound is above the fastest mode of a body deformed at random, and holds elsewhere with Hooke's law") {
  Scene const scene;
  NaiveBody const plain = scene.plain();
  MassSpring<double> const tissue = scene.tissue();
  auto const moves = [&](int i) { return !tissue.nailed(i); };
  double const at_rest = row_bounds(tissue, plain.home, moves).squared_frequency;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (double const much : {0.0, 0.01, 0.1, 0.3, 0.6, 1.0})
    for (double const stretch : {0.6, 1.0, 1.8}) {
      Points x = stretch * plain.home;
      for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] += much * scene.grid.spacing * uniform(random);
      double const largest = largest_eigenvalue(plain, x, [&](Points const& at) { return plain.forces(at, Points::Zero(3, 16)); });
      CAPTURE(much, stretch);
      CHECK(row_bounds(tissue, x, moves).squared_frequency > largest);
      CHECK(at_rest > largest);
      CHECK(at_rest < 4 * largest_eigenvalue(plain));
    }
}

namespace {

struct ToeSpring {   // hardens: T = k δ (1 + (δ/toe)²)
  double stiffness, toe, damping;
  double tension(double elongation, double) const { return stiffness * elongation * (1 + elongation * elongation / (toe * toe)); }
};

}  // namespace

TEST_CASE("with a hardening law the bound at rest does not hold for a stretched body, the bound there does") {
  Scene const scene;
  NaiveBody const plain = scene.plain();
  ToeSpring const law{scene.grid.link, 0.002, 0.0};
  MassSpring<double, ToeSpring> tissue(make_grid<double>(4, 4, scene.grid.spacing),
                                       {.mass = {.total = scene.grid.mass}, .link = law, .home = {.stiffness = scene.grid.home}});
  for (int i = 0; i < 16; ++i) tissue.set_mass(i, scene.mass(i));
  tissue.nail(scene.grid.nails);
  auto const forces = [&](Points const& x) {   // a plain loop of its own
    Points f = -scene.grid.home * (x - plain.home);
    for (auto const& e : plain.edges) {
      Eigen::Vector3d const d = x.col(e.a) - x.col(e.b);
      double const stretch = d.norm() - e.rest_length;
      Eigen::Vector3d const pull = law.stiffness * stretch * (1 + std::pow(stretch / law.toe, 2)) * d.normalized();
      f.col(e.a) -= pull;
      f.col(e.b) += pull;
    }
    return f;
  };
  Points const stretched = 1.5 * plain.home;
  double const largest = largest_eigenvalue(plain, stretched, forces);
  SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
  double const at_rest = body.guaranteed_stable_step();
  for (int i = 0; i < 16; ++i)
    if (!tissue.nailed(i)) body.drag(i, stretched.col(i));
  for (int i = 0; i < 16; ++i) body.release(i);
  CHECK(at_rest > 2 / std::sqrt(largest));
  auto const moves = [&](int i) { return !tissue.nailed(i); };
  CHECK(row_bounds(tissue, stretched, moves).squared_frequency > largest);
  CHECK(body.guaranteed_stable_step() < 2 / std::sqrt(largest));
  CHECK(body.stable_step() < 2 / std::sqrt(largest));
}

/// A block that is drawn out by a corner, settled there.
template <class Material>
void check_damping_bound_of_drawn(Material const& material, double force) {
  FiniteElements<double, Material> tissue(make_block<double>(5, 4, 4, 0.01, BlockPattern::alternating), {.density = 1000, .material = material, .damping = {.alpha = 1, .beta = 2e-3}});
  for (int i = 0; i < 20; ++i) tissue.nail(i);
  SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
  int const corner = body.size() - 1;
  Vector3<double> const pull = force * Vector3<double>(1, 0.7, 1).normalized();
  body.apply_force(corner, pull);
  REQUIRE(body.relax(NewtonRaphson<>{.load_steps = 10}).converged);
  Eigen::MatrixXd damping = Eigen::MatrixXd::Zero(3 * body.size(), 3 * body.size());
  for (int k = 0; k < 3 * body.size(); ++k) {   // M^-1/2 C M^-1/2, column by column: forces are linear in velocities
    Matrix3X<double> v = Matrix3X<double>::Zero(3, body.size());
    v(k % 3, k / 3) = 1;
    Matrix3X<double> const still = Matrix3X<double>::Zero(3, body.size());
    for (int i = 0; i < body.size(); ++i)
      if (!tissue.nailed(i) && !tissue.nailed(k / 3))
        damping.block<3, 1>(3 * i, k) = (tissue.internal_force(i, body.positions(), still) - tissue.internal_force(i, body.positions(), v)) / std::sqrt(tissue.mass(i) * tissue.mass(k / 3));
  }
  double const largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(damping, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  auto const modes = row_bounds(tissue, body.positions(), [&](int i) { return !tissue.nailed(i); });
  CHECK(modes.decay_rate >= largest);
  CHECK(modes.decay_rate < 4 * largest);
  double const guaranteed = body.guaranteed_stable_step();
  Matrix3X<double> const settled = body.positions();
  body.apply_force(corner - 1, {1e-4, 0, 0});
  for (int k = 0; k < 2000; ++k) {
    body.apply_force(corner, pull);
    REQUIRE(body.step(guaranteed));
  }
  CHECK((body.positions() - settled).cwiseAbs().maxCoeff() < 1e-4 * 0.01);
}

TEST_CASE("where damping follows a stiffness that grows, the guaranteed step is one of a body that is drawn out, too") {
  // Yardstick: the largest eigenvalue of M^-1/2 C M^-1/2, dense, by Eigen; and 2,000 steps from the balance.
  check_damping_bound_of_drawn(StableNeoHookean<double>{.young = 5e3, .poisson = 0.45}, 0.8);
  check_damping_bound_of_drawn(StVenantKirchhoff<double>{.young = 5e3, .poisson = 0.3}, 2.0);
  check_damping_bound_of_drawn(StableNeoHookean<double>{.young = 5e3, .poisson = 0.45}, -0.3);   // pressed in: the semidefinite part of a tangent that is not
}

TEMPLATE_TEST_CASE("a body that was solved far from its last stable step stays at rest there, by explicit steps", "", DynamicRelaxation, NewtonRaphson<>) {
  // Yardstick: the balance itself. A soft cantilever of 10 cm that hangs down under its weight: its elements are stretched and stiffer there.
  auto const mesh = make_block<double>(21, 5, 5, 0.005, BlockPattern::alternating);
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {.young = 1000, .poisson = 0.45}, .damping = {.alpha = 5}});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-6; }));
  SoftBody start(std::move(tissue), LeapfrogVerlet{});
  for (bool const settles : {true, false}) {
    SoftBody body = start;
    REQUIRE(body.step(1e-5));
    double const before = body.stable_step();
    body.set_gravity({0, 0, -9.81});
    if (settles)
      body.settle(TestType{});
    else
      body.solve_statics(TestType{});
    Matrix3X<double> const rest = body.positions();
    for (int k = 0; k < 40; ++k) {
      auto const report = body.advance(1e-3);
      REQUIRE(report);
      CHECK(report.stable_step < 0.6 * before);
    }
    CHECK((body.positions() - rest).cwiseAbs().maxCoeff() < 1e-4);
    CHECK(rest.row(2).minCoeff() < -0.02);
  }
}

TEST_CASE("after a change of the tissue the estimate starts from its last answer") {
  auto tissue = GridScene{.nx = 20, .ny = 20}.tissue();
  Matrix3X<double> x(3, tissue.size());
  for (int i = 0; i < tissue.size(); ++i) x.col(i) = tissue.rest_position(i);
  auto const moves = [](int) { return true; };
  ModalEstimate<MassSpring<double>> estimate;
  estimate(tissue, x, moves);
  int const first = estimate.products();
  tissue.set_mass(150, 0.9 * tissue.mass(150));
  double const again = estimate(tissue, x, moves).squared_frequency;
  CHECK(estimate.products() < 0.7 * first);
  ModalEstimate<MassSpring<double>> fresh;
  CHECK(again == Approx(fresh(tissue, x, moves).squared_frequency).epsilon(0.01));
}
