// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/haptics/filtered_wall.hpp>

#include "catch.hpp"
#include "haptics/spectral_radius.hpp"


#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

/// A linear filter u → y as (state, u) → (state, y), to be put into the loop's matrix.
struct StateSpace {
  Eigen::MatrixXd a;   // state of state
  Eigen::VectorXd b, c;   // state of u, y of state
  double d = 1.0;         // y of u
};

StateSpace delays(int count, std::vector<double> const& taps) {   // y = Σ taps[i] u[k − i]
  StateSpace f{Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count), taps[0]};
  if (count > 0) f.b(0) = 1;
  for (int i = 0; i + 1 < count; ++i) f.a(i + 1, i) = 1;
  for (int i = 0; i < count; ++i) f.c(i) = taps[static_cast<std::size_t>(i + 1)];
  return f;
}
StateSpace mean(int samples) { return delays(samples - 1, std::vector<double>(static_cast<std::size_t>(samples), 1.0 / samples)); }
StateSpace late(int ticks) {
  std::vector<double> taps(static_cast<std::size_t>(ticks + 1), 0.0);
  taps.back() = 1.0;
  return delays(ticks, taps);
}
StateSpace low_pass(double cutoff, double period) {
  double const a = std::exp(-2 * std::numbers::pi * cutoff * period);
  return {Eigen::MatrixXd::Constant(1, 1, a), Eigen::VectorXd::Constant(1, 1 - a), Eigen::VectorXd::Constant(1, a), 1 - a};
}

/// The largest modulus of an eigenvalue of the loop: mass under zero-order hold, wall K to both sides, filter.
double spectral_radius(double mass, double damping, double period, StateSpace const& filter, double wall) {
  double const a = damping / mass, e = std::exp(-a * period), phi = (1 - e) / a;
  Eigen::Matrix2d free;
  free << 1, phi, 0, e;
  Eigen::Vector2d const force((period - phi) / damping, phi / mass);
  Eigen::Index const n = filter.b.size();
  Eigen::MatrixXd loop = Eigen::MatrixXd::Zero(2 + n, 2 + n);
  loop.topLeftCorner(2, 2) = free;
  loop.topLeftCorner(2, 1) -= wall * filter.d * force;
  loop.topRightCorner(2, n) = force * filter.c.transpose();
  loop.bottomLeftCorner(n, 1) = -wall * filter.b;
  loop.bottomRightCorner(n, n) = filter.a;
  return palpate_test::spectral_radius(loop);
}

double stiffest(double mass, double damping, double period, StateSpace const& filter) {
  double low = 0, high = 1;
  while (spectral_radius(mass, damping, period, filter, high) <= 1 + 1e-12) high *= 2;
  for (int k = 0; k < 50; ++k) {
    double const middle = (low + high) / 2;
    (spectral_radius(mass, damping, period, filter, middle) <= 1 + 1e-12 ? low : high) = middle;
  }
  return low;
}

constexpr double mass = 0.075, damping = 0.5, period = 0.001;

}  // namespace

// Yardsticks: a printed table for 75 g, 0.5 N·s/m and 1 kHz; and, beside it, the eigenvalues of the loop's matrix.
TEST_CASE("C6-S1: smoothing a force costs the stiffness that its delay says") {
  for (auto const& [samples, wall] : {std::pair{1, 1001.0}, std::pair{2, 501.0}, std::pair{5, 201.0}, std::pair{10, 101.0}, std::pair{15, 68.0}}) {
    MovingAverage const filter{samples};
    double const found = stable_wall(mass, damping, period, filter);
    CAPTURE(samples, found);
    CHECK(found == Approx(wall).epsilon(0.02));
    CHECK(stiffest(mass, damping, period, mean(samples)) == Approx(found).epsilon(1e-5));
    CHECK(stable_wall_estimate(damping, period, filter.delay(period)) == Approx(wall).epsilon(0.02));
  }
  for (auto const& [cutoff, wall] : {std::pair{200.0, 560.0}, std::pair{100.0, 307.0}, std::pair{50.0, 159.0}, std::pair{30.0, 97.0}}) {
    OnePole const filter{cutoff};
    double const found = stable_wall(mass, damping, period, filter);
    CAPTURE(cutoff, found);
    CHECK(found == Approx(wall).epsilon(0.02));
    CHECK(stiffest(mass, damping, period, low_pass(cutoff, period)) == Approx(found).epsilon(1e-5));
    CHECK(stable_wall_estimate(damping, period, filter.delay(period)) == Approx(found).epsilon(0.045));
  }
}

// Yardstick: printed limits for masses of 45 to 100 g, of one and two ticks of delay.
TEST_CASE("a force that is a tick late leaves a third of the stiffness, two ticks a fifth") {
  struct Row {
    double mass, damping, period, one, two;
  };
  for (Row const row : {Row{0.045, 0.10, 0.001, 66.71, 40.04}, Row{0.045, 0.25, 0.001, 166.92, 100.24}, Row{0.075, 0.50, 0.001, 333.95, 200.58},
                        Row{0.075, 0.50, 0.0005, 667.28, 400.58}, Row{0.075, 0.50, 0.002, 167.28, 100.57}, Row{0.100, 5.0, 0.001, 3378.9, 2042.2}}) {
    CAPTURE(row.mass, row.damping, row.period);
    CHECK(stable_wall(row.mass, row.damping, row.period, TickDelay{1}) == Approx(row.one).epsilon(2e-4));
    CHECK(stable_wall(row.mass, row.damping, row.period, TickDelay{2}) == Approx(row.two).epsilon(2e-4));
    CHECK(stable_wall(row.mass, row.damping, row.period, TickDelay{1}, TickDelay{1}) == Approx(row.two).epsilon(2e-4));
  }
}

// Yardstick: eigenvalues, for devices drawn at random; without a filter the closed form, which is another derivation.
TEST_CASE("the limit with filters is the one of the eigenvalues, for any device") {
  Random random(Seed{8});
  for (int set = 0; set < 25; ++set) {
    double const m = random.uniform(0.02, 0.3), b = std::exp(random.uniform(std::log(0.02), std::log(40.0))), t = random.uniform(2e-4, 3e-3);
    int const samples = 1 + static_cast<int>(random.uniform(0.0, 12.0)), ticks = static_cast<int>(random.uniform(0.0, 5.0));
    double const cutoff = random.uniform(10.0, 300.0);
    CAPTURE(m, b, t, samples, ticks, cutoff);
    CHECK(stable_wall(m, b, t, TickDelay{0}) == Approx(stable_wall(m, b, t)).epsilon(1e-6));
    CHECK(stable_wall(m, b, t, MovingAverage{samples}) == Approx(stiffest(m, b, t, mean(samples))).epsilon(1e-5));
    CHECK(stable_wall(m, b, t, TickDelay{ticks}) == Approx(stiffest(m, b, t, late(ticks))).epsilon(1e-5));
    CHECK(stable_wall(m, b, t, OnePole{cutoff}) == Approx(stiffest(m, b, t, low_pass(cutoff, t))).epsilon(1e-5));
    CHECK(stable_wall(m, b, t, OnePole{cutoff}, TickDelay{1}) < stable_wall(m, b, t, OnePole{cutoff}));
  }
  CHECK(stable_wall(0.1, 1e-5, 0.001, TickDelay{1}) == Approx(1e-5 / 0.0015).epsilon(1e-4));   // hardly any damping
  CHECK(stable_wall(0.1, 0.0, 0.001, TickDelay{1}) == 0.0);
}

// Yardsticks: K = b/(T/2 + t), to which the limit tends with the damping; Routh's criterion of a slow low-pass, K = b (ω + b/m).
TEST_CASE("a wall is not stable because hardly anything is damped") {
  for (double const b : {1e-8, 1e-10, 1e-11, 1e-12, 1e-14, 1e-16, 1e-20, 1e-100, 1e-300})
    for (int const ticks : {0, 1, 1000}) {
      CAPTURE(b, ticks);
      CHECK(stable_wall(0.1, b, 0.001, TickDelay{ticks}) / (b / (0.0005 + ticks * 0.001)) == Approx(1.0).epsilon(1e-6));
    }
  for (double const b : {1e-3, 1e-6, 1e-9, 1e-12, 1e-18})
    for (double const cutoff : {1e-2, 1e-4, 1e-8}) {
      CAPTURE(b, cutoff);
      CHECK(stable_wall(0.1, b, 0.001, OnePole{cutoff}) / (b * (2 * std::numbers::pi * cutoff + b / 0.1)) == Approx(1.0).epsilon(1e-3));
    }
}

TEST_CASE("malformed filters are refused") {
  CHECK_THROWS_WITH(stable_wall(mass, damping, period, MovingAverage{0}), says(".samples is 0", "1 to 1000"));
  CHECK_THROWS_WITH(stable_wall(mass, damping, period, OnePole{-1.0}), says(".cutoff is -1 Hz", "above zero"));
  CHECK_THROWS_WITH(stable_wall(mass, damping, period, TickDelay{-1}), says(".ticks is -1", "0 to 1000"));
  CHECK_THROWS_AS(stable_wall(0.0, damping, period, TickDelay{1}), InvalidArgument);
  CHECK_THROWS_AS(stable_wall_estimate(damping, period, -0.001), InvalidArgument);
  CHECK_THROWS_AS(stable_wall_estimate(damping, period, std::numeric_limits<double>::quiet_NaN()), InvalidArgument);
}
