// SPDX-License-Identifier: MIT
// A time step per node. Yardsticks: the closed form of a step of one oscillator; the exact modes of a chain; ThetaScheme, where all steps are the same; linear
// finite elements, which compute all columns each time; the numbers of solves, counted by hand.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "device/message.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/models.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/integrator.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <thread>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// n unit masses in a row between two walls, on springs of stiffness k, each moving along x: x″_i = k (x_{i−1} − 2 x_i + x_{i+1}) − γ x′_i.
class Chain {
 public:
  using Scalar = double;
  using Matrix = Matrix3X<double>;

  explicit Chain(int n, double stiffness = 1, double decay = 0) : stiffness_(stiffness), decay_(decay) {
    for (auto* columns : {&x_, &v_, &memory_}) columns->setZero(3, n);
    for (auto& columns : scratch_) columns.setConstant(3, n, std::numeric_limits<double>::quiet_NaN());
  }
  Matrix& positions() { return x_; }
  Matrix& velocities() { return v_; }
  Matrix& previous_acceleration() { return memory_; }
  Matrix& scratch(int k) { return scratch_[k]; }
  bool remembers() const { return false; }
  template <class X, class V>
  Matrix acceleration(X const& x, V const& v) const {
    return -stiffness_ * laplace(x) - decay_ * v;
  }
  template <class X, class V, class Out>
  void acceleration(X const& x, V const& v, Out&& out) const {
    out = acceleration(x, v);
  }
  void linearise() {}
  template <class D, class Out>
  void multiply_tangent(double m, double c, double k, D const& d, Out&& out) const {
    out = (m + c * decay_) * d + k * stiffness_ * laplace(d);
  }
  template <class Out>
  void tangent_diagonal(double m, double c, double k, Out&& out) const {
    out.setConstant(m + c * decay_ + 2 * k * stiffness_);
  }
  void take(SolveReport<double> const& report) { report_ = report; }
  SolveReport<double> const& report() const { return report_; }

  /// Where x = 0 with these velocities goes in time t, without damping.
  Eigen::VectorXd exact(Eigen::VectorXd const& v, double t) const {
    auto const n = v.size();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
    for (Eigen::Index mode = 1; mode <= n; ++mode) {
      double const angle = std::numbers::pi * static_cast<double>(mode) / static_cast<double>(n + 1), omega = 2 * std::sqrt(stiffness_) * std::sin(angle / 2);
      Eigen::VectorXd shape(n);
      for (Eigen::Index i = 0; i < n; ++i) shape[i] = std::sin(angle * static_cast<double>(i + 1));
      x += shape * (shape.dot(v) / shape.squaredNorm() * std::sin(omega * t) / omega);
    }
    return x;
  }

 private:
  template <class D>
  static Matrix laplace(D const& d) {
    Matrix out = 2 * d;
    auto const n = d.cols();
    if (n > 1) out.leftCols(n - 1) -= d.rightCols(n - 1), out.rightCols(n - 1) -= d.leftCols(n - 1);
    return out;
  }
  double stiffness_, decay_;
  Matrix x_, v_, memory_;
  Matrix scratch_[12];
  SolveReport<double> report_;
};

/// Shares work among threads, which come and go.
struct Threads {
  int count = 1;
  template <class Work>
  void operator()(int n, Work const& work) const {
    std::vector<std::thread> all;
    for (int t = 0; t < count; ++t)
      all.emplace_back([&work, n, t, count = count] {
        for (int k = t; k < n; k += count) work(k);
      });
    for (auto& one : all) one.join();
  }
};

template <class S>
TensorMass<S> bar(int length, int side, S beta = S(0)) {
  TensorMass<S> tissue(make_block<S>(length, side, side, S(0.005), BlockPattern::alternating),
                       {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.3)}, .damping = {.beta = beta}});
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i)[0] < 1e-6) tissue.nail(i);
  return tissue;
}
/// A push on one corner of the far end.
template <class Body>
void push(Body& body, double force) {
  using S = typename Body::Scalar;
  body.apply_force(body.size() - 1, {S(0), S(0), S(force)});
}
template <class Body>
auto bytes(Body const& body) {
  return std::pair(Matrix3X<typename Body::Scalar>(body.positions()), Matrix3X<typename Body::Scalar>(body.velocities()));
}

constexpr NodeSteps halved{.theta = 1, .speed_bound = 0.05, .max_halvings = 4, .tolerance = 1e-10};

}  // namespace

// Yardstick: x⁺ and v⁺ solved for by hand: (1 + hθγ + h²θ²κ) Δv = −h (κ x + γ v) − h²θ κ v.
TEST_CASE("one oscillator, its step halved as its speed says, is the θ-scheme's closed form", "[integrator][node_steps]") {
  double const kappa = 2 * 9.0, gamma = 0.4, h = 0.2;
  for (double const theta : {0.0, 0.5, 0.7, 1.0})
    for (int const halvings : {0, 1, 3}) {
      Chain one(1, 9.0, gamma);
      double x = 0.3, v = -0.8;
      one.positions()(0, 0) = x, one.velocities()(0, 0) = v;
      NodeSteps{.theta = theta, .speed_bound = 1e-9, .max_halvings = halvings, .tolerance = 1e-14}.step(one, h);
      double const part = std::ldexp(h, -halvings);
      for (int k = 0; k < 1 << halvings; ++k) {
        double const inertia = 1 + part * theta * gamma + part * part * theta * theta * kappa;
        double const change = (-part * (kappa * x + gamma * v) - part * part * theta * kappa * v) / inertia;
        x += part * (v + theta * change), v += change;
      }
      CHECK(one.positions()(0, 0) == Approx(x).epsilon(1e-13));
      CHECK(one.velocities()(0, 0) == Approx(v).epsilon(1e-13));
      CHECK(one.report().node_steps == (2 << halvings) - 1);
      CHECK(one.previous_acceleration()(0, 0) == halvings);
    }
}

TEST_CASE("a step is halved while its node is too fast, doubled again when it has become slow, and not in between", "[integrator][node_steps]") {
  Chain free(1, 0.0, 0.0);   // moves on as it does
  auto const level_at = [&](double speed) {
    free.velocities()(1, 0) = speed;
    NodeSteps{.speed_bound = 1, .max_halvings = 3}.step(free, 0.1);
    return static_cast<int>(free.previous_acceleration()(0, 0));
  };
  CHECK(level_at(0.9) == 0);
  CHECK(level_at(1.5) == 1);
  CHECK(level_at(3.9) == 2);
  CHECK(level_at(70.0) == 3);   // no more halvings
  CHECK(level_at(3.9) == 3);    // above half of 4
  CHECK(level_at(1.9) == 2);
  CHECK(level_at(0.6) == 1);
  CHECK(level_at(0.4) == 0);
  CHECK(level_at(0.9) == 0);
}

TEST_CASE("with steps of their own the nodes keep the order of the scheme", "[integrator][node_steps]") {
  int const n = 24;
  auto const run = [](double theta, double bound, int steps, long long& solves) {
    Chain chain(n, 100.0);
    for (int i = 0; i < n; ++i) chain.velocities()(0, i) = std::exp(-0.5 * (i - 12) * (i - 12));
    Eigen::VectorXd const exact = chain.exact(chain.velocities().row(0), 0.4);
    NodeSteps const rule{.theta = theta, .speed_bound = bound, .max_halvings = 3, .tolerance = 1e-13};
    solves = 0;
    for (int k = 0; k < steps; ++k) rule.step(chain, 0.4 / steps), solves += chain.report().node_steps;
    return (chain.positions().row(0).transpose() - exact).norm() / exact.norm();
  };
  for (double const theta : {1.0, 0.5}) {
    double last = 0;
    for (int const steps : {16, 32, 64}) {
      CAPTURE(theta, steps);
      long long mixed = 0, whole = 0, smallest = 0;
      double const error = run(theta, 0.03, steps, mixed), coarse = run(theta, 100, steps, whole);
      run(theta, 1e-200, steps, smallest);
      CHECK(whole == n * steps);
      CHECK(smallest == 15 * n * steps);   // 1 + 2 + 4 + 8
      CHECK(10 * mixed < 4 * smallest);
      CHECK(error < 0.4 * coarse);
      if (last > 0) CHECK(std::log2(last / error) == Approx(theta < 1 ? 2 : 1).margin(0.1));
      last = error;
    }
  }
  for (double const bound : {0.2, 0.5}) {   // not linear, and damped
    CHECK(testing::measured_order(NodeSteps{.theta = 0.5, .speed_bound = bound, .tolerance = 1e-12, .newton_iterations = 2}) == Approx(2).margin(0.15));
    CHECK(testing::measured_order(NodeSteps{.theta = 1, .speed_bound = bound, .tolerance = 1e-12, .newton_iterations = 2}) == Approx(1).margin(0.15));
  }
  CHECK(testing::to_text(testing::check_integrator(NodeSteps{.theta = 0.5, .speed_bound = 0.3})) == "");
}

TEMPLATE_TEST_CASE("where no node is too fast it is ThetaScheme", "[integrator][node_steps]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (double const theta : {1.0, 0.5}) {
    SoftBody body(bar<S>(9, 3, S(1e-3)), NodeSteps{.theta = theta, .tolerance = 1e-12});
    SoftBody other(bar<S>(9, 3, S(1e-3)), ThetaScheme{.theta = theta, .tolerance = 1e-12});
    for (int k = 0; k < 50; ++k) push(body, 0.02), push(other, 0.02), body.step(S(1e-3)), other.step(S(1e-3));
    S const moved = other.displacement(body.size() - 1).norm();
    CHECK(moved > S(1e-4));
    CHECK((body.positions() - other.positions()).cwiseAbs().maxCoeff() < moved * (std::is_same_v<S, double> ? 1e-9 : 1e-3));
    CHECK(body.solve_statistics().node_steps == 50 * (body.size() - 9));
  }
}

TEST_CASE("what computes some nodes alone does as what computes all, in a zone and as a whole", "[integrator][node_steps]") {
  auto const check = [](auto region) {
    NodeSteps const rule{.theta = 0.5, .speed_bound = 0.05, .tolerance = 1e-12};
    TensorMass<double> const tissue = bar<double>(9, 3, 1e-3);
    SoftBody some(tissue, rule, region);
    SoftBody all(static_cast<FiniteElements<double, LinearElastic<double>> const&>(tissue), rule, region);
    for (int k = 0; k < 50; ++k) push(some, 0.02), push(all, 0.02), some.step(2e-3), all.step(2e-3);
    double const moved = all.displacement(all.size() - 1).norm();
    CHECK(moved > 1e-4);
    CHECK((some.positions() - all.positions()).cwiseAbs().maxCoeff() < 1e-8 * moved);
    CHECK(some.solve_statistics().node_steps == all.solve_statistics().node_steps);
    CHECK(some.solve_statistics().node_steps > some.solve_statistics().steps * 30);
  };
  check(WholeBody{});
  check(ZoneOfInfluence{.rings = 3});
}

TEST_CASE("a few fast nodes: the work is theirs", "[integrator][node_steps]") {
  SoftBody body(bar<double>(41, 5), halved);
  int const free = body.size() - 25, h_steps = 20;
  for (int k = 0; k < h_steps; ++k) {
    push(body, 0.3);
    REQUIRE(body.step(1e-3));
  }
  long long const done = body.solve_statistics().node_steps, everywhere = 16LL * free * h_steps;
  CHECK(10 * done < 3 * everywhere);   // a quarter; the wave has run through a third of the bar
  CHECK(done > free * h_steps);
}

TEMPLATE_TEST_CASE("a step per node: the same bytes on one, two and four threads, without memory", "[integrator][node_steps]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const moved = [](auto execution) {
    SoftBody body(bar<S>(33, 7, S(1e-4)), halved, WholeBody{}, execution);
    for (int k = 0; k < 3; ++k) {
      push(body, 0.5);
      REQUIRE(body.step(S(2e-3)));
    }
    return bytes(body);
  };
  auto const alone = moved(Serial{});
  for (int const count : {1, 2, 4}) CHECK(moved(Threads{count}) == alone);

  SoftBody body(bar<S>(17, 3), halved);
  push(body, 0.3), body.step(S(1e-3));
  REQUIRE(trap_works());
  AllocationCount const allocations;
  for (int k = 0; k < 10; ++k) push(body, 0.3), body.step(S(1e-3));
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(body.solve_statistics().node_steps > 11 * (body.size() - 9));
}

TEST_CASE("a step per node: saved and restored to the byte, and carried through a cut", "[integrator][node_steps]") {
  SoftBody body(bar<double>(9, 5, 1e-4), halved);
  for (int k = 0; k < 10; ++k) push(body, 0.3), body.step(2e-3);
  auto const saved = body.save();
  auto const go_on = [&] {
    VolumeCutter<double> knife;
    for (int k = 0; k < 20; ++k) {
      knife.advance(body, {{0.0313, 0.001 * k, 0.01}, {0.0313, 0.001 * k, 0.03}});
      push(body, 0.3);
      REQUIRE(body.step(2e-3));
    }
    return bytes(body);
  };
  auto const first = go_on();
  body.restore(saved);
  CHECK(go_on() == first);
  CHECK(first.first.cols() > 200);
}

// Yardstick: the impulse of a force is the momentum.
TEST_CASE("momentum is lost where steps of nodes differ alone, and less with shorter ones", "[integrator][node_steps]") {
  auto const lost = [](double h, NodeSteps const& rule) {
    TensorMass<double> tissue(make_block<double>(7, 3, 3, 0.005, BlockPattern::alternating), {.density = 1000, .material = {.young = 1e4, .poisson = 0.3}});
    SoftBody body(std::move(tissue), rule);
    Vector3<double> const force(0.1, 0.3, 0.2);
    int const steps = static_cast<int>(std::lround(0.016 / h));
    for (int k = 0; k < steps; ++k) body.apply_force(body.size() - 1, force), body.step(h);
    return (body.momentum() - steps * h * force).norm() / (steps * h * force.norm());
  };
  for (double const theta : {1.0, 0.5}) {
    NodeSteps rule{.theta = theta, .speed_bound = 0.05, .max_halvings = 3, .tolerance = 1e-12};
    double const coarse = lost(1e-3, rule), fine = lost(2.5e-4, rule);
    CHECK(coarse < 0.02);
    CHECK(coarse > 1e-4);
    CHECK(fine < (theta < 1 ? 0.2 : 0.6) * coarse);
    rule.speed_bound = 1e9;
    CHECK(lost(1e-3, rule) < 1e-9);
    rule.speed_bound = 1e-9;   // all at the smallest step
    CHECK(lost(1e-3, rule) < 1e-9);
  }
}

// Measured: there is no proof for steps that differ.
TEST_CASE("a step per node: bounded far above the explicit limit, and what θ = ½ gains", "[integrator][node_steps]") {
  double const limit = SoftBody(bar<double>(9, 3), LeapfrogVerlet{}).stable_step();
  for (double const theta : {1.0, 0.6, 0.5})
    for (double const times : {10.0, 100.0}) {
      CAPTURE(theta, times);
      SoftBody body(bar<double>(9, 3), NodeSteps{.theta = theta, .speed_bound = 0.02, .max_halvings = 3});
      double first = 0, last = 0;
      for (int k = 0; k < 200; ++k) {
        if (k < 5) push(body, 0.05);
        REQUIRE(body.step(times * limit));
        last = body.kinetic_energy() + body.potential_energy();
        if (k == 4) first = last;
      }
      CHECK(body.solve_statistics().node_steps > 300 * (body.size() - 9));
      CHECK(last < (theta > 0.5 ? 1.0 : 1.1) * first);
    }
}

TEST_CASE("a step per node says what is wrong with what it is given", "[integrator][node_steps]") {
  auto const said = [](NodeSteps const& rule) {
    return message_of([&] { SoftBody(bar<double>(3, 2), rule); });
  };
  CHECK(said({.theta = 1.5}).find("theta is 1.5; give 0 to 1") != std::string::npos);
  CHECK(said({.speed_bound = 0}).find("the speed bound is 0 m/s") != std::string::npos);
  CHECK(said({.max_halvings = 21}).find("halved up to 21 times; give 0 to 20") != std::string::npos);
  CHECK(said({.tolerance = -1.0}).find("NodeSteps: .tolerance is -1") != std::string::npos);
  CHECK(said({.max_iterations = -1}).find("NodeSteps: .max_iterations is -1; give zero or more") != std::string::npos);
  CHECK(said({.newton_iterations = 0}).find("NodeSteps: .newton_iterations is 0; give 1 or more") != std::string::npos);
}

TEST_CASE("implicit rules whose numbers make no sense are refused by their own names", "[integrator]") {
  auto const said = [](auto const& rule) {
    return message_of([&] { SoftBody(bar<double>(3, 2), rule); });
  };
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(said(BackwardEuler{.max_iterations = -2}).find("BackwardEuler: .max_iterations is -2; give zero or more") != std::string::npos);
  CHECK(said(BackwardEuler{.newton_iterations = 0}).find("BackwardEuler: .newton_iterations is 0") != std::string::npos);
  CHECK(said(BackwardEuler{.halvings = -1}).find("BackwardEuler: .halvings is -1") != std::string::npos);
  CHECK(said(BackwardEuler{.tolerance = nan}).find("BackwardEuler: .tolerance is nan") != std::string::npos);
  CHECK(said(CrankNicolson{.max_iterations = -1}).find("CrankNicolson: .max_iterations is -1") != std::string::npos);
  CHECK(said(ThetaScheme{.tolerance = -1.0}).find("ThetaScheme: .tolerance is -1") != std::string::npos);
  CHECK_NOTHROW(SoftBody(bar<double>(3, 2), BackwardEuler{.tolerance = 0, .max_iterations = 25}));
}
