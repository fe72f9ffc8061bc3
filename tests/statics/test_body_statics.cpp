// SPDX-License-Identifier: MIT
// A body asked for its equilibrium. Yardsticks: the same body stepped until it rests, closed forms, and what it was before.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/error.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include "catch.hpp"
#include "statics/solvers.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

using namespace palpate;
using palpate_test::for_each_solver;

namespace {

template <class S>
MassSpring<S> skin() {
  MassSpring<S> tissue(make_grid<S>(8, 7, S(0.01)), {.mass = {.total = S(0.05)}, .link = {.stiffness = S(50), .damping = S(0.05)},
                                                     .home = {.stiffness = S(4), .damping = S(0.05)}});
  tissue.nail(0);
  return tissue;
}

template <class Body>
void load(Body& body) {
  using S = typename Body::Scalar;
  body.apply_force(27, {S(0.02), S(0), S(-0.1)});
  body.apply_force(0, {S(1), S(0), S(0)});   // on the nail
}

/// Looks at what it is told.
struct Watched {
  template <TissueModel Tissue>
  auto solve(StaticProblem<Tissue> const& problem, Matrix3X<typename Tissue::Scalar>& x) const {
    for (int const i : problem.touched) REQUIRE(i < problem.tissue.size());
    return LocalRelaxation{}.solve(problem, x);
  }
};

}  // namespace

TEMPLATE_TEST_CASE("every solver finds where stepping comes to rest", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SoftBody stepped(skin<S>(), LeapfrogVerlet{}, WholeBody{});
  stepped.set_gravity({S(0), S(0), S(-2)});
  stepped.drag(40, stepped.positions().col(40) + Vector3<S>(S(0.001), S(0), S(0.003)));
  for (int k = 0; k < 12000; ++k) {
    load(stepped);
    REQUIRE(stepped.step(S(2e-4)));
  }
  REQUIRE(stepped.kinetic_energy() < S(1e-10));
  for_each_solver([&](char const* name, auto const& solver) {
    CAPTURE(name);
    SoftBody body(skin<S>(), LeapfrogVerlet{}, WholeBody{});
    body.set_gravity({S(0), S(0), S(-2)});
    body.drag(40, body.positions().col(40) + Vector3<S>(S(0.001), S(0), S(0.003)));
    load(body);
    auto const found = body.solve_statics(solver, std::same_as<S, float> ? S(2e-6) : S(1e-10));
    CHECK(found.converged);
    CHECK(double((body.positions() - stepped.positions()).cwiseAbs().maxCoeff()) < (std::same_as<S, float> ? 1e-5 : 3e-8));
    CHECK(body.velocities().isZero(0));
    CHECK(body.time() == 0);
    // The forces count as those of a step: they are felt at nail and hand, and are gone.
    for (int const i : {0, 40}) CHECK(double((body.reaction(i) - stepped.reaction(i)).norm()) < (std::same_as<S, float> ? 2e-3 : 1e-5));
    CHECK(body.reference_position(27) == body.tissue().rest_position(27));
  });
}

TEST_CASE("a body that was solved goes on in time, in a zone too") {
  SoftBody body(skin<double>(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  load(body);
  body.solve_statics(NewtonRaphson<>{}, 1e-9);
  auto const deformed = body.positions().eval();
  REQUIRE(body.displacement(27).z() < -1e-3);
  REQUIRE(std::abs(body.displacement(30).z()) > 1e-6);   // far outside the zone
  for (int k = 0; k < 200; ++k) {
    load(body);
    REQUIRE(body.step(2e-4));
  }
  CHECK((body.positions() - deformed).cwiseAbs().maxCoeff() < 1e-7);   // under the same force it stays
  for (int k = 0; k < 20000 && body.step(2e-4).moving > 0; ++k) {}
  CHECK(body.step(2e-4).moving == 0);
  CHECK((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() < 1e-5);   // without it, it comes home
}

// Lips that are held and joined again: a solver that begins where the body is touched reads past its particles, or writes there.
TEST_CASE("what a solver is told to be touched is there, right after a cut too") {
  SoftBody body(skin<double>(), LeapfrogVerlet{}, WholeBody{});
  std::array const part{body.tissue().surface().triangles_at(27).front()};
  int const copy = body.split_particle(27, part);
  body.hold(copy), body.hold(20);
  body.merge_last_particle(27);
  load(body);
  CHECK(body.solve_statics(Watched{}, 1e-9).converged);
}

TEST_CASE("settle takes any solver and makes the balance its home, without the applied forces") {
  for_each_solver([&](char const* name, auto const& solver) {
    CAPTURE(name);
    SoftBody body(skin<double>(), LeapfrogVerlet{}, WholeBody{}), plain(skin<double>(), LeapfrogVerlet{}, WholeBody{});
    for (auto* each : {&body, &plain}) each->set_gravity({0.0, 0.0, -9.81});
    load(body);
    plain.settle(1e-10);
    CHECK(body.settle(solver, 1e-10).converged);
    CHECK((body.positions() - plain.positions()).cwiseAbs().maxCoeff() < 1e-10);
    CHECK(body.reference_position(27) == body.positions().col(27));
  });
}

TEST_CASE("loads that act in parts all act in the end, or there is no balance") {
  // Yardstick: the balance with all of them at once.
  SoftBody whole(skin<double>(), LeapfrogVerlet{}, WholeBody{});
  load(whole);
  whole.solve_statics(NewtonRaphson<>{});
  int found = 0, refused = 0;
  for (int const parts : {4, 100})
    for (int const iterations : {1, 2, 3, 4, 5, 6, 8, 12, 20, 200}) {
      INFO(parts << " parts, " << iterations << " iterations");
      SoftBody body(skin<double>(), LeapfrogVerlet{}, WholeBody{});
      Matrix3X<double> const before = body.positions();
      load(body);
      try {
        body.solve_statics(NewtonRaphson<>{.iterations = iterations, .load_steps = parts});
        ++found;
        CHECK((body.positions() - whole.positions()).cwiseAbs().maxCoeff() < 1e-7);
      } catch (Error const&) {
        ++refused;
        CHECK(body.positions() == before);
      }
    }
  CHECK(found > 2);
  CHECK(refused > 2);
}

// Yardstick: the same body in double, at the origin.
TEST_CASE("far from the origin a body of float yields under a load, too") {
  auto const bent = [](auto scalar, double off) {
    using S = decltype(scalar);
    auto mesh = make_block<S>(5, 4, 4, S(0.01), BlockPattern::alternating);
    mesh.points.array() += S(off);
    FiniteElements<S, NeoHookean<S>> tissue(mesh, {.density = S(1000), .material = {.young = S(5e3), .poisson = S(0.45)}});
    for (int i = 0; i < tissue.size(); ++i)
      if (tissue.rest_position(i).x() < S(off + 0.005)) tissue.nail(i);
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
    body.apply_force(body.size() - 1, {S(0), S(0), S(-0.005)});
    body.solve_statics(NewtonRaphson{});
    return Matrix3X<double>(body.positions().template cast<double>() - body.tissue().rest_positions().template cast<double>());
  };
  auto const exact = bent(0.0, 0.0);
  double const most = exact.colwise().norm().maxCoeff();
  REQUIRE(most > 5e-4);
  CHECK((bent(0.0f, 0.0) - exact).colwise().norm().maxCoeff() < 0.001 * most);
  CHECK((bent(0.0f, 10.0) - exact).colwise().norm().maxCoeff() < 0.03 * most);   // 1e-6 m are a unit in the last place there
}

TEST_CASE("without a balance the body stays as it was and says so") {
  // Nothing holds it against gravity.
  for_each_solver([&](char const* name, auto solver) {
    CAPTURE(name);
    SoftBody body(MassSpring<double>(make_grid<double>(4, 4, 0.01), {.link = {.stiffness = 50.0}}), LeapfrogVerlet{}, WholeBody{});
    if constexpr (requires { solver.sweeps; }) solver.sweeps = 500;
    if constexpr (requires { solver.iterations; }) solver.iterations = 50;
    body.apply_force(7, {0.0, 0.0, -1.0});
    body.step(1e-4);
    auto const x = body.positions().eval(), v = body.velocities().eval();
    body.set_gravity({0.0, 0.0, -9.81});
    body.apply_force(7, {0.0, 0.0, -1.0});
    CHECK_THROWS_WITH(body.solve_statics(solver), says("imbalance is ", " iterations", "raise the home stiffness"));
    CHECK_THROWS_WITH(body.settle(solver), says("does not settle", "imbalance is "));
    CHECK(body.positions() == x);
    CHECK(body.velocities() == v);
  });
  SoftBody body(skin<double>(), LeapfrogVerlet{}, WholeBody{});
  CHECK_THROWS_WITH(body.settle(DynamicRelaxation{}, -1.0), says("the tolerance is -1 mean edges", "not negative"));
  CHECK_THROWS_WITH(body.settle(LocalRelaxation{.relaxation = 2.0}), says("the relaxation factor is 2", "below 2"));
  CHECK_THROWS_WITH(body.settle(LocalRelaxation{.sweeps = std::numeric_limits<double>::quiet_NaN()}), says("LocalRelaxation: .sweeps is nan"));   // it never ended
  CHECK_THROWS_WITH(body.settle(LocalRelaxation{.seconds = std::numeric_limits<double>::quiet_NaN()}), says("LocalRelaxation: .seconds is nan"));
  CHECK_THROWS_WITH(body.settle(NewtonRaphson<>{.damping = 0.0}), says("the damping of Newton's step is 0", "at most 1"));
  CHECK_THROWS_WITH(body.settle(LocalRelaxation{.seconds = 0.1, .clock = nullptr}), says("LocalRelaxation: .seconds is a limit", ".clock is null"));   // it was called
  CHECK_THROWS_WITH(body.settle(NewtonRaphson<>{.load_steps = std::numeric_limits<int>::max()}), says("the loads act in 2147483647 steps", "there are 200", "fewer steps"));   // it took minutes
  load(body);
  CHECK_THROWS_WITH(body.solve_statics(NewtonRaphson<>{.inner = {.tolerance = std::numeric_limits<double>::quiet_NaN()}}), says("TangentConjugateGradients: .tolerance is nan"));
  CHECK_THROWS_WITH(body.solve_statics(NewtonRaphson<>{.inner = {.tolerance = 10.0}}), says("TangentConjugateGradients: .tolerance is 10", "below 1"));
  CHECK_THROWS_WITH(body.solve_statics(NewtonRaphson<>{.inner = {.iterations = 0}}), says("TangentConjugateGradients: .iterations is 0", "one or more"));
  CHECK_THROWS_WITH(body.solve_statics(NewtonRaphson<TangentOverRelaxation>{.inner = {.sweeps = 0}}), says("TangentOverRelaxation: .sweeps is 0", "one or more"));
  CHECK_THROWS_WITH(body.solve_statics(NewtonRaphson<TangentOverRelaxation>{.inner = {.omega = 2.0}}, 1e-12), says("omega is 2", "0 < omega < 2"));
}

TEST_CASE("a push that the first step of a relaxation would turn elements over by has the balance that small load steps lead to") {
  // Yardstick: Newton's method in twenty load steps. A neo-Hookean solid has no energy where an element is turned over.
  auto const pushed = [](double force, auto const& solver) {
    FiniteElements<double, NeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating), {.density = 1000, .material = {.young = 5e3, .poisson = 0.3}});
    for (int i = 0; i < 9; ++i) tissue.nail(i);
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.apply_force(body.size() - 1, {0, 0, -force});
    auto const result = body.relax(solver, 1e-6);
    return std::pair(body, result);
  };
  for (double const force : {0.05, 0.2}) {
    auto const [body, result] = pushed(force, DynamicRelaxation{.iterations = 20000});
    auto const [expected, known] = pushed(force, NewtonRaphson<>{.load_steps = 20});
    CAPTURE(force, result.iterations, result.imbalance);
    REQUIRE(known.converged);
    CHECK(result.converged);
    CHECK((body.positions() - expected.positions()).cwiseAbs().maxCoeff() < 1e-6);
  }
  auto const [body, result] = pushed(50.0, DynamicRelaxation{.iterations = 20000});   // whatever becomes of it, it ends
  CAPTURE(result.iterations, result.imbalance);
  CHECK((result.converged || result.iterations < 20000));
}

TEST_CASE("relax takes what a budget gives, step by step towards the balance") {
  SoftBody body(skin<double>(), LeapfrogVerlet{}, WholeBody{}), solved(skin<double>(), LeapfrogVerlet{}, WholeBody{});
  load(solved);
  solved.solve_statics();
  double error = (body.positions() - solved.positions()).norm();
  int frames = 0;
  for (; frames < 400 && error > 1e-7; ++frames) {
    load(body);
    auto const found = body.relax(LocalRelaxation{.sweeps = 5});
    CHECK(found.iterations <= 5);
    double const now = (body.positions() - solved.positions()).norm();
    REQUIRE(now < error);
    error = now;
  }
  CHECK(frames > 3);
  CHECK(error <= 1e-7);
  load(body);
  auto const timed = body.relax(LocalRelaxation{.relaxation = 0.01, .seconds = 0.0});   // no time at all: one look
  CHECK(timed.iterations <= 1);
}

TEST_CASE("support springs lessen the loss of volume under equal forces") {
  auto const loss = [](auto tissue) {
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
    double const before = volume(body.mesh());
    for (int i = 0; i < body.size(); ++i)
      if (std::abs(body.positions()(2, i)) > 0.03) body.apply_force(i, {0.0, 0.0, body.positions()(2, i) > 0 ? -0.02 : 0.02});
    body.solve_statics(NewtonRaphson<>{});
    return (before - volume(body.mesh())) / before;
  };
  MassSpring<double> const ball(make_sphere<double>(0.05, 8), {.link = {.stiffness = 50.0}, .home = {.stiffness = 2.0}});
  double const plain = loss(ball), some = loss(Supported(ball, LinearSpring<double>{.stiffness = 4.0}));
  double const more = loss(Supported(ball, LinearSpring<double>{.stiffness = 20.0}));
  CAPTURE(plain, some, more);
  CHECK(plain > 0.02);
  CHECK(some < 0.7 * plain);
  CHECK(more < 0.5 * some);
  CHECK(more > 0);
}
