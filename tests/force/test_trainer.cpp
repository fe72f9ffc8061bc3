// SPDX-License-Identifier: MIT
#include <palpate/force/trainer.hpp>

#include <palpate/force/detail/network_problem.hpp>
#include <palpate/force/network.hpp>

#include "catch.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

using namespace palpate;

namespace {

/// Linear least squares: residuals r = A p − b, whose minimum is known; it counts which samples were asked for.
struct LeastSquares {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  std::function<bool(int, Eigen::VectorXd const&)> after = [](int, Eigen::VectorXd const&) { return true; };
  std::vector<int>* uses = nullptr;

  int sample_count() const { return static_cast<int>(b.size()); }
  double mean_square(Eigen::VectorXd const& p) const { return (a * p - b).squaredNorm() / double(b.size()); }
  double gradient(Eigen::VectorXd const& p, Eigen::VectorXd& g) const {
    g = 2.0 / double(b.size()) * a.transpose() * (a * p - b);
    return mean_square(p);
  }
  double gradient(Eigen::VectorXd const& p, Eigen::VectorXd& g, std::span<std::size_t const> samples) const {
    g.setZero();
    double sum = 0;
    for (std::size_t const s : samples) {
      Eigen::Index const k = static_cast<Eigen::Index>(s);
      double const r = a.row(k).dot(p) - b[k];
      g += 2.0 / double(samples.size()) * r * a.row(k).transpose();
      sum += r * r;
      if (uses != nullptr) ++(*uses)[s];
    }
    return sum / double(samples.size());
  }
  double normal_equations(Eigen::VectorXd const& p, Eigen::MatrixXd& normal, Eigen::VectorXd& slope) const {
    normal = a.transpose() * a / double(b.size());
    slope = a.transpose() * (a * p - b) / double(b.size());
    return mean_square(p);
  }
  bool goes_on(int epoch, Eigen::VectorXd const& p) const { return after(epoch, p); }
};

/// One residual r = √(λ/2) x: E = λ x²/2, dE/dx = λ x.
LeastSquares parabola(double curvature) {
  return {Eigen::MatrixXd::Constant(1, 1, std::sqrt(curvature / 2)), Eigen::VectorXd::Zero(1)};
}

/// Twelve equations with three unknowns that some p fulfils exactly.
LeastSquares consistent() {
  Random random(Seed{4});
  Eigen::MatrixXd a(12, 3);
  for (double& value : a.reshaped()) value = random.uniform(-1.0, 1.0);
  return {a, a * Eigen::Vector3d(1, -2, 3)};
}

}  // namespace

// Yardstick: on λx²/2 gradient descent is x_k = (1 − rate λ)^k x_0.
TEST_CASE("gradient descent on a parabola is a geometric series") {
  for (double const rate : {0.001, 0.1, 0.45, 0.9}) {
    LeastSquares problem = parabola(2.0);
    std::vector<double> seen;
    problem.after = [&](int epoch, Eigen::VectorXd const& p) {
      CHECK(epoch == static_cast<int>(seen.size()) + 1);
      seen.push_back(p[0]);
      return true;
    };
    Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 3.0);
    TrainingResult const result = GradientDescent{.rate = rate, .epochs = 30}.minimise(problem, x);
    CHECK(result.epochs == 30);
    CHECK(result.stop == TrainingStop::epochs);
    REQUIRE(seen.size() == 30);
    for (int k = 1; k <= 30; ++k) CHECK(seen[std::size_t(k - 1)] == Approx(3.0 * std::pow(1 - 2 * rate, k)).margin(1e-13));
    CHECK(x[0] == seen.back());
  }
}

// Yardstick: with momentum m, x_{k+1} = (1 + m − rate λ) x_k − m x_{k−1}, x_{−1} = x_0: x_k = A s^k + B t^k, s and t the roots of
// z² − (1 + m − rate λ) z + m = 0, real or conjugate.
TEST_CASE("momentum on a parabola is the damped oscillation of its characteristic roots") {
  using Complex = std::complex<double>;
  double const curvature = 2.0, start = 3.0;
  for (double const momentum : {0.0, 0.3, 0.9, 0.99})
    for (double const rate : {0.001, 0.1, 0.4}) {
      CAPTURE(momentum, rate);
      double const trace = 1 + momentum - rate * curvature;
      Complex const root = std::sqrt(Complex(trace * trace - 4 * momentum));
      Complex const s = (trace + root) / 2.0, t = (trace - root) / 2.0;
      // x_0 = 3 and x_1 = (1 − rate λ) 3.
      Complex const b = (start * s - (1 - rate * curvature) * start) / (s - t), a = start - b;
      LeastSquares problem = parabola(curvature);
      problem.after = [&](int epoch, Eigen::VectorXd const& p) {
        CHECK(p[0] == Approx((a * std::pow(s, epoch) + b * std::pow(t, epoch)).real()).margin(1e-11));
        return true;
      };
      Eigen::VectorXd x = Eigen::VectorXd::Constant(1, start);
      CHECK(MomentumDescent{.rate = rate, .momentum = momentum, .epochs = 60}.minimise(problem, x).epochs == 60);
      CHECK(std::abs(x[0]) < start);
    }
}

// Yardstick: heavy-ball steps on a parabola of curvature λ are stable for rate · λ < 2 (1 + m), plain ones for rate · λ < 2.
TEST_CASE("momentum takes larger rates than plain descent") {
  auto const grows = [](auto const& trainer) {
    LeastSquares problem = parabola(1.0);
    double last = 0;
    problem.after = [&](int, Eigen::VectorXd const& p) {
      last = std::abs(p[0]);
      return true;
    };
    Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 1.0);
    trainer.minimise(problem, x);
    return last > 1;
  };
  CHECK_FALSE(grows(GradientDescent{.rate = 1.98, .epochs = 400}));
  CHECK(grows(GradientDescent{.rate = 2.02, .epochs = 400}));
  CHECK_FALSE(grows(MomentumDescent{.rate = 2.95, .momentum = 0.5, .epochs = 400}));
  CHECK(grows(MomentumDescent{.rate = 3.05, .momentum = 0.5, .epochs = 400}));
}

// Yardstick: equations that can all be fulfilled leave stochastic steps no noise: they converge to the known solution, whatever the batch.
TEST_CASE("stochastic descent solves consistent equations") {
  for (int const batch : {1, 5, 12, 100}) {
    CAPTURE(batch);
    LeastSquares const problem = consistent();
    Eigen::VectorXd p = Eigen::VectorXd::Zero(3);
    StochasticDescent{.rate = 0.2, .batch = batch, .epochs = 2000, .seed = Seed{1}}.minimise(problem, p);
    CHECK((p - Eigen::Vector3d(1, -2, 3)).norm() < 1e-9);
  }
}

// Yardstick: the mean of x = 1 … 8 is 4.5; steps at a constant rate wander round it, and the best epoch is kept.
TEST_CASE("stochastic descent over samples that disagree stays near their mean") {
  LeastSquares problem{Eigen::MatrixXd::Ones(8, 1), Eigen::VectorXd::LinSpaced(8, 1.0, 8.0)};
  double widest = 0;
  problem.after = [&](int epoch, Eigen::VectorXd const& p) {
    if (epoch > 100) widest = std::max(widest, std::abs(p[0] - 4.5));
    return true;
  };
  Eigen::VectorXd p = Eigen::VectorXd::Zero(1);
  StochasticDescent{.rate = 0.01, .epochs = 1000}.minimise(problem, p);
  CHECK(std::abs(p[0] - 4.5) < 0.001);
  CHECK(widest > 0.01);
  CHECK(widest < 0.5);
}

// Yardstick: a count of what the problem was asked for.
TEST_CASE("an epoch of stochastic descent takes every sample once, in an order that the seed decides") {
  std::vector<int> uses(12, 0);
  LeastSquares problem = consistent();
  problem.uses = &uses;
  problem.after = [&](int epoch, Eigen::VectorXd const&) {
    CHECK(uses == std::vector<int>(12, epoch));
    return true;
  };
  auto const trained = [&](std::uint64_t seed) {
    std::fill(uses.begin(), uses.end(), 0);
    Eigen::VectorXd p = Eigen::VectorXd::Zero(3);
    StochasticDescent{.rate = 0.05, .batch = 5, .epochs = 7, .seed = Seed{seed}}.minimise(problem, p);
    return p;
  };
  CHECK(trained(1) == trained(1));
  CHECK(trained(1) != trained(2));
}

// Yardstick: all samples in one step are plain gradient descent, up to the order of a sum.
TEST_CASE("stochastic descent with all samples in a batch is gradient descent") {
  LeastSquares const problem = consistent();
  Eigen::VectorXd p = Eigen::VectorXd::Zero(3), q = p;
  StochasticDescent{.rate = 0.1, .batch = 12, .epochs = 20}.minimise(problem, p);
  GradientDescent{.rate = 0.1, .epochs = 20}.minimise(problem, q);
  CHECK((p - q).norm() < 1e-14);
}

// Yardstick: on linear equations one step is (AᵀA/n + μ)⁻¹ Aᵀ(b − A p)/n, and the minimum is that of a QR factorisation.
TEST_CASE("Levenberg–Marquardt's step on linear equations is the damped solution") {
  LeastSquares problem = consistent();
  problem.b[0] += 0.5;   // not all can be fulfilled
  Eigen::VectorXd p = Eigen::VectorXd::Zero(3);
  CHECK(LevenbergMarquardt{.epochs = 1, .damping = 0.25}.minimise(problem, p).epochs == 1);
  Eigen::MatrixXd const normal = problem.a.transpose() * problem.a / 12.0 + 0.25 * Eigen::MatrixXd::Identity(3, 3);
  CHECK((p - normal.inverse() * problem.a.transpose() * problem.b / 12.0).norm() < 1e-13);
  LevenbergMarquardt{}.minimise(problem, p);
  CHECK((p - problem.a.colPivHouseholderQr().solve(problem.b)).norm() < 1e-7);
}

TEST_CASE("whoever watches ends a training after the epoch that he saw") {
  auto const check = [](auto const& trainer) {
    LeastSquares problem = consistent();
    int last = 0;
    problem.after = [&](int epoch, Eigen::VectorXd const&) {
      last = epoch;
      return epoch < 3;
    };
    Eigen::VectorXd p = Eigen::VectorXd::Zero(3);
    TrainingResult const result = trainer.minimise(problem, p);
    CHECK(result.stop == TrainingStop::stopped);
    CHECK(result.epochs == 3);
    CHECK(last == 3);
  };
  check(GradientDescent{.rate = 0.01});
  check(MomentumDescent{.rate = 0.01});
  check(StochasticDescent{.rate = 0.01});
  check(LevenbergMarquardt{.damping = 1e4});
}

// Yardstick: central differences of the mean square, and the gradients of single samples added up.
TEST_CASE("the derivatives that a network gives its trainer are those of its error") {
  using Net = Network<double, 2, 4, 2>;
  Net net(Seed{8});
  Net::Scaling scaling;
  scaling.input_gain = {0.5, 2.0};
  scaling.output_gain = {3.0, 0.25};
  net.set_scaling(scaling);
  std::vector<Sample<double, 2, 2>> samples;
  Random random(Seed{2});
  for (int k = 0; k < 9; ++k)
    samples.push_back({{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)}, {random.uniform(-3.0, 3.0), random.uniform(-1.0, 1.0)}});
  detail::NetworkProblem<Net> const problem(net, samples, [](int, Net const&) { return true; });
  auto const first = net.parameters();
  Eigen::VectorXd const p = Eigen::Map<Eigen::VectorXd const>(first.data(), Net::parameter_count);

  Eigen::VectorXd gradient(p.size());
  CHECK(problem.gradient(p, gradient) == Approx(problem.mean_square(p)).epsilon(1e-14));
  double const step = 1e-5;
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    Eigen::VectorXd up = p, down = p;
    up[i] += step;
    down[i] -= step;
    CHECK(gradient[i] == Approx((problem.mean_square(up) - problem.mean_square(down)) / (2 * step)).margin(1e-8));
  }

  Eigen::VectorXd sum = Eigen::VectorXd::Zero(p.size()), one(p.size());
  double errors = 0;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    std::vector<std::size_t> const alone{s};
    errors += problem.gradient(p, one, alone);
    sum += one;
  }
  CHECK(errors / 9 == Approx(problem.mean_square(p)).epsilon(1e-13));
  CHECK((sum / 9 - gradient).norm() < 1e-13);

  // The slope of the normal equations is half the gradient: E = Σ r²/n, slope = Σ r ∂r/n.
  Eigen::MatrixXd normal(p.size(), p.size());
  Eigen::VectorXd slope(p.size());
  problem.normal_equations(p, normal, slope);
  CHECK((2 * slope - gradient).norm() < 1e-13);
}

TEST_CASE("options of trainers that mean nothing are refused") {
  CHECK_THROWS_WITH((MomentumDescent{.momentum = 1.0}.validate()), says(".momentum is 1", "below one"));
  CHECK_THROWS_WITH((MomentumDescent{.momentum = -0.5}.validate()), says(".momentum is -0.5", "below one"));
  CHECK_THROWS_WITH((MomentumDescent{.rate = -1.0}.validate()), says(".rate is -1", "above zero"));
  CHECK_THROWS_AS((MomentumDescent{.momentum = std::nan("")}.validate()), InvalidArgument);
  CHECK_THROWS_WITH((StochasticDescent{.batch = 0}.validate()), says(".batch is 0", "one sample or more"));
  CHECK_THROWS_WITH((StochasticDescent{.epochs = 0}.validate()), says(".epochs is 0", "one or more"));
  CHECK_THROWS_AS((StochasticDescent{.rate = std::numeric_limits<double>::infinity()}.validate()), InvalidArgument);
  CHECK_THROWS_AS((StochasticDescent{.goal = -1.0}.validate()), InvalidArgument);
}
