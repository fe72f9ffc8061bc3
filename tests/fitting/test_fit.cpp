// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/fitting/contact_models.hpp>
#include <palpate/fitting/fit.hpp>
#include <palpate/fitting/fitted_force.hpp>
#include <palpate/fitting/needle_model.hpp>
#include <palpate/force/cutting_force.hpp>

#include "catch.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using namespace palpate;

namespace {

/// Measurements of a formula at even depths, with normal errors.
std::vector<Measurement> measured(std::function<double(Measurement const&)> const& formula, double sigma, std::uint64_t seed, MeasuredPhase phase = MeasuredPhase::indenting,
                                  std::vector<double> const& speeds = {0.001}, int count = 60, double deepest = 0.012) {
  Random random(Seed{seed});
  std::vector<Measurement> all;
  for (double const speed : speeds)
    for (int k = 1; k <= count; ++k) {
      Measurement m{.depth = deepest * k / count, .speed = speed, .phase = phase};
      m.force = formula(m) + sigma * random.normal();
      all.push_back(m);
    }
  return all;
}

template <class Model>
double value_of(Fit<Model> const& found, std::string const& name) {
  for (FittedCoefficient const& c : found.coefficients)
    if (c.name == name) return c.value;
  return std::numeric_limits<double>::quiet_NaN();
}

void append(std::vector<Measurement>& all, std::vector<Measurement> const& more) { all.insert(all.end(), more.begin(), more.end()); }

}  // namespace

// Yardstick: regression through the origin by hand: k = Σ d F/Σ d², its standard error √(Σ r²/(n − 1)/Σ d²), t(0.95, 3) = 3.182.
TEST_CASE("a line fitted to four measurements is the regression through the origin, its interval Student's") {
  std::vector<Measurement> const data{{0.001, 0.01, MeasuredPhase::indenting, 0.12}, {0.002, 0.01, MeasuredPhase::indenting, 0.19},
                                      {0.003, 0.02, MeasuredPhase::indenting, 0.31}, {0.004, 0.02, MeasuredPhase::indenting, 0.39},
                                      {0.004, 0.02, MeasuredPhase::loading, 99.0}};   // after the puncture: not of this model
  double const k = (0.001 * 0.12 + 0.002 * 0.19 + 0.003 * 0.31 + 0.004 * 0.39) / 30e-6;
  double squares = 0, spread = 0;
  for (int i = 0; i < 4; ++i) {
    double const d = data[static_cast<std::size_t>(i)].depth, f = data[static_cast<std::size_t>(i)].force;
    squares += (f - k * d) * (f - k * d), spread += (f - 0.2525) * (f - 0.2525);
  }
  auto const found = fit(data, LinearModel{});
  CHECK(found.used.size() == 4);
  CHECK(found.law.stiffness == Approx(k));
  double const half = 3.1824 * std::sqrt(squares / 3 / 30e-6);
  CHECK(found.coefficients[0].low == Approx(k - half).epsilon(1e-4));
  CHECK(found.coefficients[0].high == Approx(k + half).epsilon(1e-4));
  CHECK(found.rms == Approx(std::sqrt(squares / 4)));
  CHECK(found.r_squared == Approx(1 - squares / spread));
  CHECK(found.depths.high == 0.004);
  CHECK(found.speeds.low == 0.01);
  CHECK(found.residuals[1] == Approx(0.19 - k * 0.002));
  CHECK(found.at({.depth = 0.0025, .speed = 0.015}) == Approx(k * 0.0025));
  CHECK_THROWS_WITH(found.at({.depth = 0.0025, .speed = 0.03}), says("0.03 m/s", "0.01 to 0.02 m/s"));
  CHECK_THROWS_AS(found.at({.depth = 0.005, .speed = 0.015}), OutOfRange);
}

// Yardstick: F = k d + e (1, 1, −1, 0) at 1 … 4 mm. The errors are at right angles to d, so regression finds k, and its interval is k ± t(0.95, 3) e/√30e-6.
TEST_CASE("a coefficient whose interval is wider than its value is not determined") {
  constexpr double k = 100.0;
  auto const with_error = [](double e) {
    std::vector<Measurement> data;
    double const pattern[] = {1, 1, -1, 0};
    for (int i = 0; i < 4; ++i) data.push_back({1e-3 * (i + 1), 0.01, MeasuredPhase::indenting, k * 1e-3 * (i + 1) + e * pattern[i]});
    return fit(data, LinearModel{});
  };
  double const error_of_one = k * std::sqrt(30e-6) / 3.18245;   // N, with which the interval is [0, 2 k]
  for (double const share : {0.1, 0.99, 1.01, 10.0}) {
    auto const found = with_error(share * error_of_one);
    FittedCoefficient const& c = found.coefficients[0];
    CAPTURE(share, c.low, c.high);
    CHECK(c.value == Approx(k));
    CHECK(c.high == Approx(k * (1 + share)).epsilon(1e-4));
    CHECK(c.determined == (share < 1));
    std::ostringstream text;
    text << found;
    CHECK((text.str().find(": not determined by these measurements\n") != std::string::npos) == (share > 1));
    CHECK((force_preset(found, "by hand").source.find("not determined by the measurements: k") != std::string::npos) == (share > 1));
  }
}

// Yardstick: the coefficients that the measurements were made with.
TEST_CASE("known coefficients are found again, exactly without errors") {
  auto const cubic = [](Measurement const& m) { return 60 * m.depth + 2e3 * m.depth * m.depth + 1e6 * std::pow(m.depth, 3); };
  auto const polynomial = fit(measured(cubic, 0.0, 1), PolynomialModel{});
  CHECK(polynomial.law.linear == Approx(60.0).epsilon(1e-6));
  CHECK(polynomial.law.quadratic == Approx(2e3).epsilon(1e-6));
  CHECK(polynomial.law.cubic == Approx(1e6).epsilon(1e-6));
  CHECK(polynomial.r_squared == Approx(1.0));

  auto const fung = fit(measured([](Measurement const& m) { return 0.05 * std::expm1(250 * m.depth); }, 0.0, 1), ExponentialModel{});
  CHECK(fung.law.scale == Approx(0.05).epsilon(1e-6));
  CHECK(fung.law.rate == Approx(250.0).epsilon(1e-6));
  CHECK(fung.law.largest_depth == 0.012);

  auto const hunt = [](Measurement const& m) { return 900 * std::pow(m.depth, 1.5) * (1 + 2 * m.inward_speed()); };
  auto both = measured(hunt, 0.0, 1, MeasuredPhase::loading, {0.01, 0.05, 0.1});
  append(both, measured(hunt, 0.0, 1, MeasuredPhase::unloading, {0.01, 0.05, 0.1}));
  auto const crossley = fit(both, HuntCrossleyModel{});
  CHECK(crossley.used.size() == 360);   // no puncture: the way back counts
  CHECK(crossley.law.stiffness == Approx(900.0).epsilon(1e-6));
  CHECK(crossley.law.exponent == Approx(1.5).epsilon(1e-6));
  CHECK(crossley.law.damping == Approx(2.0).epsilon(1e-6));
}

// A tool that leaves fast is not held: the force is 0 there, not below. Yardstick: the law that the measurements are of.
TEST_CASE("a law of Hunt and Crossley is found again where its damping ends the force on the way back") {
  HuntCrossleyContact<double> const law{.stiffness = 900, .exponent = 1.5, .damping = 20};
  auto const felt = [](HuntCrossleyContact<double> const& by, Measurement const& m) {
    return by({.phase = CuttingPhase::indenting, .depth = m.depth, .normal = {0, 0, 1}, .velocity = {0, 0, -m.inward_speed()}}).z();
  };
  auto const formula = [&](Measurement const& m) { return felt(law, m); };
  auto both = measured(formula, 0.0, 1, MeasuredPhase::loading, {0.02, 0.04, 0.1});
  append(both, measured(formula, 0.0, 1, MeasuredPhase::unloading, {0.02, 0.04, 0.1}));   // 1 − 20 s/m · 0.1 m/s is below 0
  auto const found = fit(both, HuntCrossleyModel{});
  CHECK(found.law.stiffness == Approx(900.0).epsilon(1e-6));
  CHECK(found.law.exponent == Approx(1.5).epsilon(1e-6));
  CHECK(found.law.damping == Approx(20.0).epsilon(1e-6));
  for (Measurement const& m : both) REQUIRE(found.at(m) == Approx(felt(found.law, m)).margin(1e-12));
}

// Yardstick: the three parts by hand, with errors of 20 mN.
TEST_CASE("a needle's parts are told apart") {
  auto data = measured([](Measurement const& m) { return 80 * m.depth + 9e3 * m.depth * m.depth; }, 0.02, 1, MeasuredPhase::indenting, {0.003}, 100);
  append(data, measured([](Measurement const& m) { return 0.8 + (11 + 120 * m.speed) * m.depth; }, 0.02, 2, MeasuredPhase::loading, {0.003, 0.02, 0.05}, 200, 0.05));
  append(data, measured([](Measurement const& m) { return -(11 + 120 * m.speed) * m.depth; }, 0.02, 3, MeasuredPhase::unloading, {0.003, 0.02, 0.05}, 200, 0.05));
  auto const found = fit(data, NeedleModel{});
  CHECK(value_of(found, "cutting") == Approx(0.8).epsilon(0.02));
  CHECK(value_of(found, "dynamic") == Approx(11.0).epsilon(0.02));
  CHECK(value_of(found, "viscous") == Approx(120.0).epsilon(0.1));
  CHECK(value_of(found, "a1") == Approx(80.0).epsilon(0.15));
  CHECK(value_of(found, "a2") == Approx(9e3).epsilon(0.15));
  for (FittedCoefficient const& c : found.coefficients) CHECK((c.low < c.value && c.value < c.high));
  CHECK(found.rms == Approx(0.02).epsilon(0.1));
  CHECK(found.cross_validated_rms == Approx(0.02).epsilon(0.1));
  CuttingForce force(found.law);   // ready to be felt
  CHECK(force(ToolContact<double>{.phase = CuttingPhase::indenting, .depth = 0.01, .previous_depth = 0.01}).z() == Approx(0.8 + 0.9).epsilon(0.05));
}

// Yardstick: the meaning of 95 %: of 600 experiments some 570 have the true coefficient within their interval, 16 is three standard deviations.
TEST_CASE("intervals hold the true coefficient as often as they say") {
  int line = 0, rate = 0;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    FitOptions const quick{.folds = 0};
    auto const a = fit(measured([](Measurement const& m) { return 167 * m.depth; }, 0.05, seed, MeasuredPhase::indenting, {0.001}, 12), LinearModel{}, quick);
    line += a.coefficients[0].low <= 167 && 167 <= a.coefficients[0].high ? 1 : 0;
    auto const b = fit(measured([](Measurement const& m) { return 0.05 * std::expm1(250 * m.depth); }, 0.01, seed, MeasuredPhase::indenting, {0.001}, 30), ExponentialModel{}, quick);
    rate += b.coefficients[1].low <= 250 && 250 <= b.coefficients[1].high ? 1 : 0;
  }
  CHECK(std::abs(line - 570) <= 16);
  CHECK(std::abs(rate - 570) <= 16);
}

// Yardstick: for a right model the error on what was left out is σ √(1 + p/n) or so; a line through a bent curve errs there as much as on its own data.
TEST_CASE("what was left out tells a model that bends with the noise from one that does not") {
  auto const line = [](Measurement const& m) { return 100 * m.depth; };
  double plain = 0, bent = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    auto const data = measured(line, 0.05, seed, MeasuredPhase::indenting, {0.001}, 20);
    plain += fit(data, LinearModel{}).cross_validated_rms / 40;
    bent += fit(data, HuntCrossleyModel{}).cross_validated_rms / 40;
  }
  CHECK(plain == Approx(0.05 * std::sqrt(1 + 1.0 / 20)).epsilon(0.06));
  CHECK(bent > plain);
  auto const data = measured(line, 0.05, 3);
  CHECK(fit(data, LinearModel{}, {.seed = 1}).cross_validated_rms == fit(data, LinearModel{}, {.seed = 1}).cross_validated_rms);
  CHECK(std::isnan(fit(data, LinearModel{}, {.folds = 0}).cross_validated_rms));
}

TEST_CASE("what the measurements do not say is said, and malformed ones are refused") {
  // One speed: damping and stiffness of Hunt and Crossley's law can not be told apart. A negative curvature rests at its bound.
  auto const one_speed = fit(measured([](Measurement const& m) { return 900 * std::pow(m.depth, 1.5); }, 1e-3, 1), HuntCrossleyModel{});
  CHECK_FALSE(one_speed.coefficients[0].determined);
  CHECK(one_speed.coefficients[1].determined);   // the exponent
  CHECK_FALSE(one_speed.coefficients[2].determined);
  CHECK(std::isinf(one_speed.coefficients[0].high));
  CHECK(one_speed.coefficients[1].high < 1.51);
  auto const bent = fit(measured([](Measurement const& m) { return 100 * m.depth - 2e3 * m.depth * m.depth; }, 0.0, 1), PolynomialModel{});
  CHECK(bent.coefficients[1].at_bound);
  CHECK(bent.law.quadratic == 0.0);
  std::ostringstream text;
  text << one_speed << bent;
  for (char const* part : {"not determined by these measurements", "at its bound", "N/m^n", "R^2", "60 measurements", "No force of this library is validated"})
    CHECK(text.str().find(part) != std::string::npos);

  std::vector<Measurement> const two{{0.001, 0, MeasuredPhase::loading, 0.1}, {0.002, 0, MeasuredPhase::loading, 0.2}};
  CHECK_THROWS_WITH(fit(two, ExponentialModel{}), says("2 of the 2 measurements", "at least 3"));
  std::vector<Measurement> broken = two;
  broken[1].force = std::nan("");
  CHECK_THROWS_WITH(fit(broken, LinearModel{}), says("measurement 1 holds nan", "finite"));
  CHECK_THROWS_AS(fit(two, LinearModel{}, {.confidence = 1.0}), InvalidArgument);
  CHECK_THROWS_AS(fit(two, LinearModel{}, {.folds = 1}), InvalidArgument);
  CHECK_THROWS_AS(fit(std::vector<Measurement>{}, LinearModel{}), InvalidArgument);
}
