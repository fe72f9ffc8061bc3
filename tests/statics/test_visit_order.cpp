// SPDX-License-Identifier: MIT
// Which order of visiting gets there first after a touch. Yardstick: the balance that Newton's method finds.
#include <palpate/mesh/grid.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"
#include "statics/solvers.hpp"

#include <algorithm>
#include <vector>

using namespace palpate;

namespace {

/// A skin of 31 × 31 particles pushed, or dragged, at one of them.
struct Touched {
  MassSpring<double> tissue{make_grid<double>(31, 31, 0.01), {.link = {.stiffness = 50.0}, .home = {.stiffness = 50.0}}};
  std::vector<int> touched, free;
  Matrix3X<double> start = tissue.rest_positions(), balance = start;
  Matrix3X<double> applied = Matrix3X<double>::Zero(3, 961);

  Touched(int at, bool dragged) : touched{at} {
    for (int i = 0; i < 961; ++i)
      if (!dragged || i != at) free.push_back(i);
    if (dragged)
      start.col(at) += Vector3<double>(0.004, 0.003, -0.002);
    else
      applied.col(at) << 0.1, 0.06, -0.05;
    balance = start;
    REQUIRE(NewtonRaphson<>{}.solve(problem(), balance).converged);
  }
  StaticProblem<MassSpring<double>> problem() const { return {tissue, free, {0.0, 0.0, 0.0}, applied, 1e-12, touched}; }

  /// The largest distance from balance after a budget of sweeps, as a share of what it was.
  double error(LocalRelaxation const& solver) const {
    Matrix3X<double> x = start;
    solver.solve(problem(), x);
    return (x - balance).colwise().norm().maxCoeff() / (start - balance).colwise().norm().maxCoeff();
  }
  /// Sweeps until that is a hundredth.
  double sweeps(VisitOrder order) const {
    double n = 0.5;
    while (error({.order = order, .sweeps = n, .seed = Seed{3}}) > 0.01 && n < 200) n += 0.5;
    return n;
  }
};

/// A clock that goes on by a millisecond whenever it is asked.
double asked_seconds = 0;
double ticking() { return asked_seconds += 1e-3; }

}  // namespace

TEST_CASE("breadth first from the touched particle takes less than half the visits") {
  for (bool const dragged : {false, true})
    for (int const at : {480, 0, 960}) {   // in the middle, at the first and at the last index
      Touched const scene(at, dragged);
      double const breadth = scene.sweeps(VisitOrder::breadth_first), index = scene.sweeps(VisitOrder::index), random = scene.sweeps(VisitOrder::random);
      CAPTURE(dragged, at, breadth, index, random);
      CHECK(breadth < 0.5 * index);
      CHECK(breadth < 0.5 * random);
    }
}

TEST_CASE("a budget of a few visits is spent where the touch is") {
  Touched const scene(960, false);
  CHECK(scene.error({.sweeps = 0.1}) < 0.7);
  CHECK(scene.error({.order = VisitOrder::index, .sweeps = 0.1}) == 1.0);   // it has not come there
  CHECK(scene.error({.sweeps = 0}) == 1.0);
}

// Yardstick: a budget of visits, counted by hand. The clock is asked at the start, after every 64 visits and after each sweep of 961, 16 times a sweep.
TEST_CASE("a budget of time ends the relaxation within a sweep, with what it has reached") {
  struct Budget {
    double seconds;
    int visits;
  };
  Touched const scene(0, false);
  for (Budget const b : {Budget{0.0005, 64}, Budget{0.0095, 10 * 64}, Budget{0.0395, 2 * 961 + 8 * 64}, Budget{0.1595, 10 * 961}}) {
    CAPTURE(b.seconds);
    LocalRelaxation const timed{.order = VisitOrder::index, .seconds = b.seconds, .clock = ticking};
    LocalRelaxation const counted{.order = VisitOrder::index, .sweeps = (b.visits - 0.5) / 961};
    Matrix3X<double> x = scene.start, y = scene.start;
    asked_seconds = 1000.0;
    auto const found = timed.solve(scene.problem(), x);
    double const asked = asked_seconds - 1000.0;
    counted.solve(scene.problem(), y);
    CHECK_FALSE(found.converged);
    CHECK(found.imbalance > 0);
    CHECK(found.iterations == (b.visits + 960) / 961);
    CHECK(asked == Approx(b.seconds + 0.0015));   // the start, and up to the first answer that is not below the budget
    CHECK(x == y);
    CHECK(x != scene.start);
  }
  asked_seconds = 0;
  CHECK(scene.error({.order = VisitOrder::index, .sweeps = 300, .seconds = 1e9, .clock = ticking}) == scene.error({.order = VisitOrder::index, .sweeps = 300}));
  asked_seconds = 0;
  scene.error({.sweeps = 3, .clock = ticking});
  CHECK(asked_seconds == 0);   // no limit, no clock
  double const before = steady_seconds();
  CHECK(steady_seconds() >= before);
}

TEST_CASE("the same seed visits in the same order, another in another") {
  Touched const scene(480, true);
  LocalRelaxation const solver{.order = VisitOrder::random, .sweeps = 3, .seed = Seed{5}};
  Matrix3X<double> a = scene.start, b = scene.start, c = scene.start;
  solver.solve(scene.problem(), a);
  solver.solve(scene.problem(), b);
  LocalRelaxation{.order = VisitOrder::random, .sweeps = 3, .seed = Seed{6}}.solve(scene.problem(), c);
  CHECK(a == b);
  CHECK(a != c);
}

TEST_CASE("pieces that nothing touches come to balance too") {
  Touched scene(480, false);
  scene.applied.col(0) << 0.0, 0.0, 0.1;   // far from `touched`
  Matrix3X<double> x = scene.start, y = x;
  CHECK(LocalRelaxation{}.solve(scene.problem(), x).converged);
  CHECK(NewtonRaphson<>{}.solve(scene.problem(), y).converged);
  CHECK((x - y).cwiseAbs().maxCoeff() < 1e-8);
}

TEST_CASE("Newton's method converges quadratically where links are in tension") {
  MassSpring<double> sheet(make_grid<double>(7, 7, 0.01), {.link = {.stiffness = 50.0}, .home = {.stiffness = 5.0}, .link_prestrain = 0.3});
  auto const free = palpate_test::free_particles(sheet);
  Matrix3X<double> applied = Matrix3X<double>::Zero(3, 49), x = sheet.rest_positions();
  for (int i = 0; i < 7; ++i) applied.col(i) << 0.0, -1.0, 0.0, applied.col(42 + i) << 0.0, 1.0, 0.0;   // drawn out
  for (int i = 0; i < 7; ++i) applied.col(7 * i) += Vector3<double>(-1.0, 0.0, 0.0), applied.col(7 * i + 6) += Vector3<double>(1.0, 0.0, 0.2);
  auto const iterations = [&](NewtonRaphson<> const& solver) {
    Matrix3X<double> from = x;
    auto const found = solver.solve(StaticProblem<MassSpring<double>>{.tissue = sheet, .free = free, .applied = applied, .tolerance = 1e-14}, from);
    CHECK(found.converged);
    return found.iterations;
  };
  TangentConjugateGradients const exact{.tolerance = 1e-12};
  int const full = iterations({.inner = exact}), modified = iterations({.tangent = Tangent::modified, .inner = exact});
  int const damped = iterations({.damping = 0.5, .inner = exact});
  CAPTURE(full, modified, damped);
  CHECK(full <= 9);
  CHECK(modified > full);
  CHECK(damped > 30);   // half an error an iteration, ten digits and more
}
