// SPDX-License-Identifier: MIT
// Bodies of several blocks, walked one after the other and at once. Yardsticks: accelerations summed spring by spring here, and bytes that do
// not depend on the order in which blocks are walked.
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <cmath>
#include <cstddef>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

/// Every block in a thread of its own.
struct AtOnce {
  template <class Work>
  void operator()(int n, Work const& work) const {
    std::vector<std::thread> threads;
    for (int k = 0; k < n; ++k) threads.emplace_back([&work, k] { work(k); });
    for (auto& thread : threads) thread.join();
  }
};

/// The last block first.
struct Backwards {
  template <class Work>
  void operator()(int n, Work const& work) const {
    for (int k = n - 1; k >= 0; --k) work(k);
  }
};

constexpr int side = 110;   // 12,100 particles, three blocks

template <RealScalar S>
MassSpring<S> sheet(bool nailed, double damping = 1) {
  auto grid = make_grid<S>(side, side, S(0.005));
  MassSpring<S> tissue(grid, {.mass = {.total = S(3)}, .link = {.stiffness = S(100), .damping = S(0.02 * damping)},
                              .home = {.stiffness = S(10), .damping = S(0.05 * damping)}});
  if (nailed) tissue.nail(boundary_vertices(grid));
  return tissue;
}

/// The same history for every kind of body: pushes all over, gravity, 40 steps.
template <class Body>
void live(Body& body) {
  using S = typename Body::Scalar;
  body.set_gravity({0, 0, S(-9.81)});
  for (int step = 0; step < 40; ++step) {
    for (int i = 7; i < body.size(); i += 97)
      body.apply_force(i, Vector3<S>(S(0.03) * static_cast<S>(std::sin(0.3 * step + i)), S(0.02), S(0.05) * static_cast<S>(std::cos(i))));
    REQUIRE(body.step(S(1e-4)));
  }
}

template <class A, class B>
bool same_bytes(A const& a, B const& b) {
  return a.positions() == b.positions() && a.velocities() == b.velocities();
}

template <class Integrator, RealScalar S>
void check_all_executions(bool nailed) {
  SoftBody body(sheet<S>(nailed), Integrator{}, WholeBody{});
  SoftBody at_once(sheet<S>(nailed), Integrator{}, WholeBody{}, AtOnce{});
  SoftBody backwards(sheet<S>(nailed), Integrator{}, WholeBody{}, Backwards{});
  live(body), live(at_once), live(backwards);
  CHECK((body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() > S(1e-5));
  CHECK(same_bytes(body, at_once));
  CHECK(same_bytes(body, backwards));
}

}  // namespace

TEMPLATE_TEST_CASE("a step of three blocks gives every particle the sum of its springs", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const nailed = GENERATE(false, true);
  SoftBody body(sheet<S>(nailed, 0), LeapfrogVerlet{}, WholeBody{});
  live(body);
  Matrix3X<S> const x = body.positions(), v = body.velocities();
  S const h = S(1e-5);

  // A step from rest without damping: v⁺ = h a(x).
  body.reset();
  body.set_gravity(Vector3<S>::Zero());
  for (int i = 0; i < body.size(); ++i)
    if (!body.tissue().nailed(i)) body.drag(i, x.col(i)), body.release(i);
  auto const& links = body.tissue().links();
  Matrix3X<double> force = Matrix3X<double>::Zero(3, body.size());
  for (int l = 0; l < links.size(); ++l) {
    Vector3<double> const d = (body.positions().col(links[l].a) - body.positions().col(links[l].b)).template cast<double>();
    double const pull = links[l].weight * links[l].law.stiffness * (d.norm() - links[l].rest_length);
    force.col(links[l].a) -= pull * d.normalized();
    force.col(links[l].b) += pull * d.normalized();
  }
  REQUIRE(body.step(h));
  double largest = 0, worst = 0;
  for (int i = 0; i < body.size(); ++i) {
    if (body.tissue().nailed(i)) continue;
    Vector3<double> const home = body.tissue().home(i).stiffness * (body.tissue().rest_position(i) - x.col(i)).template cast<double>();
    Vector3<double> const a = (force.col(i) + home) / body.tissue().mass(i);
    largest = std::max(largest, a.norm());
    worst = std::max(worst, (body.velocities().col(i).template cast<double>() / h - a).norm());
  }
  CHECK(largest > 1.0);
  CHECK(worst < (std::same_as<S, float> ? 2e-2 : 1e-10) * largest);
}

TEMPLATE_TEST_CASE("blocks walked at once or backwards give the same bytes", "", PALPATE_TEST_SCALARS) {
  check_all_executions<LeapfrogVerlet, TestType>(false);
  check_all_executions<LeapfrogVerlet, TestType>(true);
  check_all_executions<RungeKutta4, TestType>(false);
}

TEST_CASE("so do they after a cut, whose new particles have links across the body") {
  auto const cut = [](auto& body) {
    ProgressiveCutter<double> cutter({.puncture_depth = 1e-4});
    // New particles are numbered last; their links go to rows 30 to 45 of 110, far from them in that order.
    cutter.advance(body, {0.2, 0.151, 0.01});
    for (int k = 0; k <= 18; ++k) {
      cutter.advance(body, {0.2 + 0.005 * k, 0.151 + 0.004 * k, -1e-3});
      REQUIRE(body.step(1e-5));
    }
    cutter.advance(body, {0.3, 0.223, 0.1});
    REQUIRE(body.size() > side * side + 15);
    live(body);
  };
  SoftBody body(sheet<double>(false), LeapfrogVerlet{}, WholeBody{});
  SoftBody at_once(sheet<double>(false), LeapfrogVerlet{}, WholeBody{}, AtOnce{});
  cut(body), cut(at_once);
  CHECK(same_bytes(body, at_once));
}

TEST_CASE("a step that diverges is reported alike and leaves the state before it, to rounding") {
  auto const fail = [](auto& body, Matrix3X<double>& x, Matrix3X<double>& v) {
    live(body);
    x = body.positions(), v = body.velocities();
    body.apply_force(9000, {1e12, 0, 0}), body.apply_force(300, {0, 1e13, 0});
    return body.step(1e-4);
  };
  Matrix3X<double> x, v, x_again, v_again;
  SoftBody body(sheet<double>(false), LeapfrogVerlet{}, WholeBody{});
  SoftBody at_once(sheet<double>(false), LeapfrogVerlet{}, WholeBody{}, AtOnce{});
  auto const report = fail(body, x, v);
  auto const again = fail(at_once, x_again, v_again);
  CHECK(report.status == StepStatus::diverged);
  CHECK(report.particle == 300);
  CHECK(report.value == Approx(1e13 * 1e-4 * 0.5e-4 / body.tissue().mass(300)).epsilon(1e-6));
  CHECK((again.particle == report.particle && again.value == report.value));
  CHECK((body.positions() - x).cwiseAbs().maxCoeff() < 1e-15);
  CHECK((body.velocities() - v).cwiseAbs().maxCoeff() < 1e-13 * (1 + v.cwiseAbs().maxCoeff()));
  CHECK(same_bytes(body, at_once));
  CHECK(body.step(1e-4));   // without the forces it goes on
}
