// SPDX-License-Identifier: MIT
#include <palpate/fitting/least_squares.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

/// Residuals of one's own, with the Jacobian by central differences.
struct Differenced {
  Eigen::Index rows;
  std::function<Eigen::VectorXd(Eigen::VectorXd const&)> residuals;

  Eigen::Index residual_count() const { return rows; }
  void evaluate(Eigen::VectorXd const& p, Eigen::VectorXd& r, Eigen::MatrixXd& j) const {
    r = residuals(p);
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      double const h = 1e-6 * std::max(1.0, std::abs(p[k]));
      Eigen::VectorXd above = p, below = p;
      above[k] += h, below[k] -= h;
      j.col(k) = (residuals(above) - residuals(below)) / (2 * h);
    }
  }
};

Eigen::VectorXd vector(std::initializer_list<double> values) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}
Eigen::VectorXd nowhere(Eigen::Index count) { return Eigen::VectorXd::Constant(count, -std::numeric_limits<double>::infinity()); }

}  // namespace

// r = p − 2 and 0.1, computable below a wall alone. Yardstick: the least is at 2; behind a wall at 1 it can not be reached, in front of one at 3 it can.
TEST_CASE("what lies behind parameters that the model is not finite at is not said to be found") {
  for (double const wall : {1.0, 3.0}) {
    Differenced const problem{2, [&](auto const& p) { return vector({p[0] < wall ? p[0] - 2 : std::nan(""), 0.1}); }};
    auto const found = minimise_least_squares(problem, vector({-1e6}), nowhere(1));
    CHECK(found.parameters[0] == Approx(std::min(wall, 2.0)).epsilon(1e-5));
    CHECK(found.converged == (wall > 2));
  }
}

// Yardstick: the normal equations of a regression line by hand. y = 1, 3, 2, 5 at x = 0 … 3: slope 1.1, intercept 1.1, Σ r² = 2.7, (JᵀJ)⁻¹ = (4 −6; −6 14)⁻¹.
TEST_CASE("a line through four points is the regression line") {
  Eigen::VectorXd const x = vector({0, 1, 2, 3}), y = vector({1, 3, 2, 5});
  auto const found = minimise_least_squares(Differenced{4, [&](auto const& p) { return Eigen::VectorXd(p[0] * Eigen::VectorXd::Ones(4) + p[1] * x - y); }},
                                            vector({0, 0}), nowhere(2));
  CHECK(found.converged);
  CHECK(found.determined == std::vector<bool>(found.determined.size(), true));
  CHECK(found.parameters[0] == Approx(1.1));
  CHECK(found.parameters[1] == Approx(1.1));
  CHECK(found.sum_of_squares == Approx(2.7));
  CHECK(found.inverse_normal(0, 0) == Approx(14.0 / 20));
  CHECK(found.inverse_normal(1, 1) == Approx(4.0 / 20));
  CHECK(found.inverse_normal(0, 1) == Approx(-6.0 / 20));
  CHECK(found.free_count() == 2);
}

// Yardstick: Rosenbrock's valley, whose minimum is (1, 1); with the first parameter kept at 1.5 or more its minimum is (1.5, 2.25) by hand.
TEST_CASE("a bent valley is followed to its minimum, and along a bound to the one there") {
  Differenced const valley{2, [](auto const& p) { return vector({10 * (p[1] - p[0] * p[0]), 1 - p[0]}); }};
  auto const free = minimise_least_squares(valley, vector({-1.2, 1}), nowhere(2));
  CHECK(free.parameters[0] == Approx(1.0));
  CHECK(free.parameters[1] == Approx(1.0));
  CHECK(free.sum_of_squares < 1e-20);
  auto const bounded = minimise_least_squares(valley, vector({2, 0}), vector({1.5, 0}));
  CHECK(bounded.parameters[0] == 1.5);
  CHECK(bounded.parameters[1] == Approx(2.25));
  CHECK(bounded.at_bound == std::vector<bool>{true, false});
  CHECK(bounded.inverse_normal(0, 0) == 0.0);
  CHECK(bounded.inverse_normal(1, 1) == Approx(0.01));
}

// Yardstick: the data y = 2 x with a parabola's coefficient that may not be negative: it is 0 and the slope is that of the regression through 0.
TEST_CASE("a parameter that leaves its bound again is free") {
  Eigen::VectorXd const x = vector({1, 2, 3, 4}), bent = vector({2, 3.8, 5.5, 7}), rising = vector({1, 4, 9, 16});
  auto const parabola = [&](Eigen::VectorXd const& y) {
    return minimise_least_squares(Differenced{4, [&](auto const& p) { return Eigen::VectorXd(p[0] * x + p[1] * x.cwiseAbs2() - y); }}, vector({0, 0}), vector({0, 0}));
  };
  auto const flat = parabola(bent);
  CHECK(flat.parameters[0] == Approx(x.dot(bent) / x.squaredNorm()));
  CHECK(flat.parameters[1] == 0.0);
  auto const square = parabola(rising);
  CHECK(square.parameters[0] == Approx(0.0).margin(1e-9));
  CHECK(square.parameters[1] == Approx(1.0));
}

TEST_CASE("what can not be told apart, and what is malformed, is said") {
  auto const twins = minimise_least_squares(Differenced{3, [](auto const& p) { return vector({p[0] + p[1] - 1, p[0] + p[1] - 1, 2 * p[2] - 4}); }}, vector({0, 0, 0, 0}), nowhere(4));
  CHECK(twins.determined == std::vector<bool>{false, false, true, false});   // the last: nothing depends on it
  CHECK(twins.parameters[2] == Approx(2.0));
  CHECK(twins.inverse_normal(2, 2) == Approx(0.25));
  CHECK(twins.sum_of_squares < 1e-20);
  Differenced const fine{1, [](auto const& p) { return vector({p[0]}); }};
  CHECK_THROWS_WITH(minimise_least_squares(fine, vector({1}), vector({2})), says("parameter 0", "at 1", "below 2"));
  CHECK_THROWS_AS(minimise_least_squares(fine, vector({std::nan("")}), vector({2})), InvalidArgument);
  CHECK_THROWS_AS(minimise_least_squares(fine, vector({1}), vector({0, 0})), InvalidArgument);
  CHECK_THROWS_WITH(minimise_least_squares(fine, vector({1}), vector({0}), {.iterations = 0}), says(".iterations is 0", "one or more"));
  for (double const tolerance : {std::nan(""), -1e-12, 1.0})
    CHECK_THROWS_WITH(minimise_least_squares(fine, vector({1}), vector({0}), {.tolerance = tolerance}), says("LeastSquaresOptions: .tolerance", "0 to below 1"));
  CHECK_THROWS_AS(minimise_least_squares(Differenced{1, [](auto const& p) { return vector({std::log(p[0])}); }}, vector({-1}), vector({-2})), InvalidArgument);
}

// Yardstick: the printed table of Student's distribution, two-sided.
TEST_CASE("Student's quantiles are those of the table") {
  struct Row {
    double confidence;
    int freedom;
    double t;
  };
  for (Row const row : {Row{0.95, 1, 12.706}, Row{0.95, 2, 4.303}, Row{0.95, 5, 2.571}, Row{0.95, 10, 2.228}, Row{0.95, 30, 2.042}, Row{0.95, 100000, 1.960},
                        Row{0.99, 1, 63.657}, Row{0.99, 7, 3.499}, Row{0.99, 120, 2.617}, Row{0.5, 3, 0.765}, Row{0.9, 4, 2.132}}) {
    CAPTURE(row.confidence, row.freedom);
    CHECK(student_quantile(row.confidence, row.freedom) == Approx(row.t).margin(0.002));
  }
  CHECK_THROWS_AS(student_quantile(1.0, 5), InvalidArgument);
  CHECK_THROWS_AS(student_quantile(0.95, 0), InvalidArgument);
}
