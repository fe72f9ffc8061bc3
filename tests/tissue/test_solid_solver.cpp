// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "yardstick.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/simulator/step_control.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::check_yardstick, palpate_test::text, palpate_test::worse;

namespace {

using Stable = FiniteElements<double, StableNeoHookean<double>>;

static_assert(std::same_as<decltype(SoftBody(std::declval<Stable>())), SoftBody<Stable, BackwardEuler, WholeBody>>, "what moves a solid when nothing is said");

/// A beam of 5 x 1 x 1 cm that is held at one end and sags.
template <class Integrator>
auto sagging_beam(Integrator const& integrator, Pressure pressure) {
  auto const mesh = make_block<double>(21, 5, 5, 0.0025, BlockPattern::alternating);
  Stable tissue(mesh, {.density = 1060, .material = {.young = 2e5, .poisson = 0.45}, .pressure = pressure});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-9; }));
  SoftBody body(std::move(tissue), integrator);
  body.set_gravity({0, 0, -9.81});
  body.settle(NewtonRaphson{});
  body.set_gravity({0, 0, 0});
  return body;
}

template <class Body>
double distance_from_rest(Body const& body) {
  return (body.positions() - body.tissue().rest_positions()).cwiseAbs().maxCoeff();
}

int how_often(char const* name, int quick) {
  char const* const text = std::getenv(name);
  return text != nullptr ? std::stoi(text) : quick;
}

/// Backward Euler, and whether a step of it raised the incremental potential above its value at x+ = x.
struct Watched {
  static constexpr bool steps_of_any_size = true;
  BackwardEuler inner;
  double* worst;

  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return inner.stable_step(modes);
  }
  template <LinearisedSystem S>
  void step(S& system, typename S::Scalar h) const {
    inner.step(system, h);
  }
  template <HasPotential S>
  void step(S& system, typename S::Scalar h) const {
    using M = typename S::Matrix;
    M const v = system.velocities();
    M momentum(3, v.cols());
    system.linearise();
    system.multiply_tangent(1.0, 0.0, 0.0, v, momentum);
    double const start = system.potential(M(system.positions())) + 0.5 * v.cwiseProduct(momentum).sum();
    inner.step(system, h);
    M const change = system.velocities() - v;
    system.multiply_tangent(1.0, 0.0, 0.0, change, momentum);
    double const end = system.potential(M(system.positions())) + 0.5 * change.cwiseProduct(momentum).sum();
    *worst = std::max(*worst, end - start);
  }
};

}  // namespace

// Yardstick: a body that nothing drives does not go farther than where it was let go, whatever the budget of its solver.
TEST_CASE("a beam that is let go stays bounded for any budget of conjugate gradients and comes to rest", "[tissue][solid_solver][yardstick]") {
  int const steps = how_often("PALPATE_SOLID_BEAM_STEPS", 250);   // of 10 ms
  double farther = 0, left = 0;
  for (Pressure const pressure : {Pressure::element, Pressure::nodal})
    for (int const budget : {10, 25, 50, 100}) {
      auto body = sagging_beam(BackwardEuler{.max_iterations = budget}, pressure);
      double const start = distance_from_rest(body);
      CHECK(start > 4e-3);
      double worst = 0;
      for (int k = 0; k < steps; ++k) {
        auto const report = body.step(0.01);
        REQUIRE(report);
        CHECK(report.solve.iterations <= budget);
        CHECK(report.solve.converged == (report.solve.residual <= 1e-3));
        worst = std::max(worst, distance_from_rest(body));
      }
      farther = worse(farther, worst / start - 1), left = worse(left, distance_from_rest(body));
      CHECK(body.solve_statistics().steps == steps);
      CHECK(body.solve_statistics().iterations <= static_cast<long long>(budget) * steps);
      if (budget == 10) CHECK(body.solve_statistics().unconverged > steps / 2);   // at steps of 10 ms ten are too few
    }
  std::string const beam = "beam let go, at most 10, 25, 50, 100 iterations a step, " + text(steps / 100.0) + " s: ";
  check_yardstick({.what = beam + "how much farther than at the start", .source = "nothing drives it", .expected = 0, .ours = farther, .within = 0.05});
  check_yardstick({.what = beam + "distance from rest [m]", .source = "rest", .expected = 0, .ours = left, .within = steps >= 250 ? 1e-6 : 1e-3});
}

// Yardstick: the incremental potential, computed here from the system's masses and potential.
TEST_CASE("no implicit step raises the incremental potential, also where its budget ends", "[tissue][solid_solver][yardstick]") {
  double most = 0;
  for (int const budget : {1, 3, 10, 100}) {
    double worst = 0;
    auto body = sagging_beam(Watched{BackwardEuler{.max_iterations = budget}, &worst}, Pressure::element);
    auto state = body.save();
    std::srand(3);
    for (int i = 0; i < body.size(); ++i)
      if (!body.tissue().nailed(i)) state.particles.velocity[i] = Vector3<double>::Random();   // m/s: an edge in a quarter of a step
    body.restore(state);
    for (int k = 0; k < 30; ++k) {
      body.apply_force(body.nearest_vertex({0.05, 0.005, 0.005}), {0, 0, k % 2 == 0 ? 2.0 : -2.0});
      REQUIRE(body.step(0.01));
    }
    most = worse(most, worst);
  }
  check_yardstick({.what = "incremental potential, 4 × 30 steps with blows, at most 1 to 100 iterations: largest rise [J]", .source = "each step lowers it", .expected = 0, .ours = most, .within = 1e-10});   // the beam stored some 1e-4
}

// Yardstick: nothing drives it, so energy does not rise above what it is let go with; its shape at rest.
TEST_CASE("what is almost flat comes back in long steps, of one Newton iteration or of several", "[tissue][solid_solver]") {
  auto const mesh = make_block<double>(5, 5, 5, 0.01, BlockPattern::alternating);
  for (int const iterations : {1, 5})
    for (double const h : {0.005, 0.01, 0.03}) {
      CAPTURE(iterations, h);
      SoftBody body(Stable(mesh, {.density = 1000, .material = {.young = 5000, .poisson = 0.45}}), BackwardEuler{.newton_iterations = iterations});
      auto state = body.save();
      for (int i = 0; i < body.size(); ++i) state.particles.position[i].z() = 1e-5 * std::sin(1.7 * i);
      body.restore(state);
      double const start = body.potential_energy();
      double most = 0;
      for (int k = 0; k < 300; ++k) {
        REQUIRE(body.step(h));
        most = std::max(most, body.potential_energy() + body.kinetic_energy());
      }
      CHECK(most < start);
      CHECK(body.potential_energy() + body.kinetic_energy() < 1e-6 * start);
      CHECK(body.tissue().lowest_determinant(body.positions()).value > 0.99);
    }
}

// Yardstick: a law without energy for what is turned over; every J stays above 0.
TEST_CASE("a step that would turn over what can not be is cut back", "[tissue][solid_solver]") {
  auto const mesh = make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating);
  FiniteElements<double, NeoHookean<double>> tissue(mesh, {.density = 1000, .material = {3000, 0.3}});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 1e-9; }));
  SoftBody body(std::move(tissue));
  auto const top = vertices_where(mesh, [](auto const& p) { return p.z() > 0.029; });
  int halvings = 0;
  for (int k = 0; k < 40; ++k) {
    for (int const i : top) body.apply_force(i, {0, 0, -2.0});   // 32 N on 9 cm2 of 3 kPa
    auto const report = body.step(0.02);
    REQUIRE(report);
    halvings += report.solve.halvings;
    REQUIRE(body.tissue().lowest_determinant(body.positions()).value > 0);
  }
  CHECK(halvings > 0);
  CHECK(body.solve_statistics().halved > 0);
  CHECK(body.positions().row(2).maxCoeff() < 0.02);
}

// Yardstick: which tetrahedron was turned over by hand.
TEST_CASE("a tetrahedron that is turned over is reported with its determinant", "[tissue][solid_solver]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto const start = [&](auto integrator, double down) {
    Stable tissue(mesh, {.density = 1000, .material = {3000, 0.3}});
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 0.015; }));
    SoftBody body(std::move(tissue), integrator);
    auto state = body.save();
    state.particles.position[26].z() -= down;
    body.restore(state);
    return body;
  };
  auto turned = start(BackwardEuler{}, 0.03);
  auto const report = turned.step(1e-5);
  REQUIRE(report);
  REQUIRE(report.element >= 0);
  auto const& nodes = turned.tissue().list().nodes[static_cast<std::size_t>(report.element)];
  CHECK(std::find(nodes.begin(), nodes.end(), 26) != nodes.end());
  CHECK(report.determinant < -0.5);
  CHECK(std::abs(report.determinant - turned.tissue().lowest_determinant(turned.positions()).value) < 1e-12);
  CHECK(start(BackwardEuler{}, 0.0).step(1e-5).element == -1);

  // Explicit steps of any length take turns at it, and begin where a restored body did.
  auto const told = [](auto& body) {
    std::vector<StepReport<double>> reports;
    for (int k = 0; k < 70; ++k) {
      auto const before = body.tissue().lowest_determinant(body.positions());
      reports.push_back(body.step(k % 2 == 0 ? 1e-8 : 31e-8));
      if (auto const& last = reports.back(); last.element >= 0 && last.element == before.element) CHECK(last.determinant == Approx(before.value).epsilon(0.01));
    }
    return reports;
  };
  auto swinging = start(LeapfrogVerlet{}, 0.03);
  auto const worst = swinging.tissue().lowest_determinant(swinging.positions());
  auto const from = swinging.save();
  auto const first = told(swinging);
  CHECK(std::count_if(first.begin(), first.begin() + 32, [&](auto const& each) { return each.element == worst.element; }) == 1);
  CHECK(std::count_if(first.begin() + 32, first.begin() + 64, [&](auto const& each) { return each.element == worst.element; }) == 1);
  swinging.restore(from);
  auto const again = told(swinging);
  for (std::size_t k = 0; k < first.size(); ++k) CHECK(again[k].element == first[k].element);
  swinging.restore(from);
  StepControl<decltype(swinging)> control;   // what a simulator counts
  control.allow(100), control.reset(swinging);
  double const h = swinging.stable_step();
  int said = 0;
  for (int k = 0; k < 32; ++k) {
    auto later = from;
    later.looks = k;
    swinging.restore(later);
    auto const three = swinging.advance(3 * h);
    CHECK(three.steps == 3);
    said += three.element == worst.element;
    swinging.restore(later);
    CHECK(control.advance(swinging, 3 * h, [](auto&&...) {}));
  }
  CHECK(said >= 1);   // by the first of three steps, after which it goes back
  CHECK(control.counts(swinging).inverted >= 1);
  CHECK(control.counts(swinging).inverted_element >= 0);
  CHECK(control.counts(swinging).lowest_determinant < worst.value / 2);
  auto resting = start(LeapfrogVerlet{}, 0.0);
  for (auto const& each : told(resting)) CHECK(each.element == -1);

  auto exploding = start(LeapfrogVerlet{}, 1e-3);
  double const above = 40 * exploding.stable_step();
  auto last = exploding.step(above);
  for (int k = 0; k < 100 && last; ++k) last = exploding.step(above);
  REQUIRE(last.status == StepStatus::diverged);
  CHECK(last.element >= 0);
  CHECK(is_finite(exploding.positions()));   // the last good state
}

namespace {

/// Tissue whose assembly looks at all of its elements or at none.
struct LooksAtOnce : Stable {
  using Stable::Stable;
  struct Assembly : Stable::Assembly {
    auto lowest_determinant(double const* x) const noexcept { return Stable::Assembly::lowest_determinant(x); }
  };
};
static_assert(HasLowestDeterminant<LooksAtOnce> && HasLowestDeterminant<Stable>);
struct NamesNoElement : Stable {
  using Stable::Stable;
  struct Assembly : Stable::Assembly {
    double lowest_determinant(double const*) const noexcept { return 1; }
  };
};
static_assert(!HasLowestDeterminant<NamesNoElement>);

}  // namespace

// Yardstick: the tissue's own answer; the particle that was moved hardly moves on.
TEST_CASE("an assembly that looks at all of its tetrahedra at once is asked for them once in 32 explicit steps",
          "[tissue][solid_solver]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto const start = [&](auto integrator) {
    LooksAtOnce tissue(mesh, {.density = 1000, .material = {3000, 0.3}});
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 0.015; }));
    SoftBody body(std::move(tissue), integrator);
    auto state = body.save();
    state.particles.position[26].z() -= 0.03;
    body.restore(state);
    return body;
  };
  auto implicit = start(BackwardEuler{});
  int const turned = implicit.tissue().lowest_determinant(implicit.positions()).element;
  CHECK(implicit.step(1e-7).element == turned);
  auto swinging = start(LeapfrogVerlet{});
  std::vector<StepReport<double>> told;
  for (int k = 0; k < 64; ++k)
    if (auto const report = swinging.step(1e-8); report.element >= 0) told.push_back(report);
  REQUIRE(told.size() == 2);
  for (auto const& report : told) {
    CHECK(report.element == turned);
    CHECK(report.determinant == Approx(swinging.tissue().lowest_determinant(swinging.positions()).value).epsilon(0.01));
  }
}

// Yardstick: the harmonic oscillator's phase; the trapezoidal rule keeps the amplitude of a swing, backward Euler does not.
TEST_CASE("Crank-Nicolson swings a solid on, and takes its line search", "[tissue][solid_solver]") {
  auto const swing = [](auto integrator) {
    auto body = sagging_beam(integrator, Pressure::nodal);
    double const start = distance_from_rest(body), energy = body.potential_energy();
    double last = 0;
    for (int k = 0; k < 60; ++k) {
      REQUIRE(body.step(0.001));
      last = body.potential_energy() + body.kinetic_energy();
    }
    CHECK(distance_from_rest(body) < 1.05 * start);
    return last / energy;
  };
  CHECK(swing(CrankNicolson{}) > 0.95);
  CHECK(swing(CrankNicolson{}) < 1.01);
  CHECK(swing(BackwardEuler{}) < 0.9);
}

// Yardstick: (M + hC + h²K) Δv = h (f(x) − C v − h K v), C = αM + βK, with K by differences of the forces at rest, solved densely. The dragged particle is in C v alone.
TEST_CASE("a step of a damped solid solves the equation it states, beside a particle that is dragged", "[tissue][solid_solver]") {
  double const h = 3e-3, alpha = 4, beta = 5e-3;
  for (Pressure const pressure : {Pressure::element, Pressure::nodal}) {
    auto const mesh = make_block<double>(4, 3, 3, 0.01, BlockPattern::alternating);
    Stable tissue(mesh, {.density = 1000, .material = {.young = 1e4, .poisson = 0.35}, .damping = {.alpha = alpha, .beta = beta}, .pressure = pressure});
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-9; }));
    SoftBody body(std::move(tissue), BackwardEuler{.tolerance = 1e-12, .max_iterations = 1000, .halvings = 0});
    int const dragged = body.size() - 1;
    for (int i = 0; i < body.size(); ++i) {
      Vector3<double> const rest = body.tissue().rest_position(i);
      if (body.tissue().nailed(i)) continue;
      Vector3<double> const place(1.2 * rest[0], 1.15 * rest[1] + 0.05 * rest[0], 1.1 * rest[2]);   // in tension: its tangent is semidefinite as it is
      body.drag(i, place, Vector3<double>(0.1 * std::sin(3.0 * i), 0.2 * std::cos(2.0 * i), 0.05 * i));
      if (i != dragged) body.release(i);
    }
    Matrix3X<double> const x = body.positions(), v = body.velocities(), still = Matrix3X<double>::Zero(3, body.size());
    Eigen::Index const n = 3 * body.size();
    auto const forces = [&](Matrix3X<double> const& at) {
      Eigen::VectorXd f(n);
      for (int i = 0; i < body.size(); ++i) f.segment<3>(3 * i) = body.tissue().internal_force(i, at, still);
      return f;
    };
    Eigen::MatrixXd K(n, n), M = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      Matrix3X<double> high = x, low = x;
      high(k % 3, k / 3) += 1e-7, low(k % 3, k / 3) -= 1e-7;
      K.col(k) = (forces(low) - forces(high)) / 2e-7;
    }
    Eigen::VectorXd speeds(n), free_speeds = Eigen::VectorXd::Zero(n);
    std::vector<Eigen::Index> moves;
    for (int i = 0; i < body.size(); ++i) {
      bool const is_free = !body.tissue().nailed(i) && i != dragged;
      for (Eigen::Index k = 3 * i; k < 3 * i + 3; ++k) {
        M(k, k) = body.tissue().mass(i), speeds[k] = v(k % 3, i);
        if (is_free) free_speeds[k] = speeds[k], moves.push_back(k);
      }
    }
    Eigen::MatrixXd const C = alpha * M + beta * K, A = M + h * C + h * h * K;
    Eigen::VectorXd const right = h * (forces(x) - C * speeds - h * K * free_speeds);
    Eigen::VectorXd const change = Eigen::MatrixXd(A(moves, moves)).ldlt().solve(Eigen::VectorXd(right(moves)));
    REQUIRE(body.step(h));
    double worst = 0;
    for (std::size_t k = 0; k < moves.size(); ++k)
      worst = std::max(worst, std::abs(body.velocities()(moves[k] % 3, moves[k] / 3) - speeds[moves[k]] - change[static_cast<Eigen::Index>(k)]));
    CHECK(worst < 1e-6 * change.cwiseAbs().maxCoeff());
  }
}
