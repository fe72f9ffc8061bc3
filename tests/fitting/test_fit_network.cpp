// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/fitting/fit_network.hpp>
#include <palpate/force/liver.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

using namespace palpate;

namespace {

/// Samples of the published hysteresis with normal errors.
std::vector<Measurement> of_liver(double sigma, std::uint64_t seed) {
  Random random(Seed{seed});
  auto const curve = liver_hysteresis<double>();
  std::vector<Measurement> all;
  for (auto const phase : {MeasuredPhase::loading, MeasuredPhase::unloading})
    for (int k = 0; k <= 60; ++k) {
      double const depth = 0.02283 * k / 60;
      all.push_back({depth, 1e-4, phase, curve(depth, phase == MeasuredPhase::loading ? Phase::loading : Phase::unloading) + sigma * random.normal()});
    }
  return all;
}

}  // namespace

// Yardstick: the curve that the samples were taken from, between the samples too; the noise, for the error on what was left out.
TEST_CASE("a network learns the liver's loop from noisy measurements") {
  auto const found = fit_network<Network<double, 2, 5, 1>>(of_liver(0.005, 3), {.training = {.starts = 3}});
  CHECK(found.used.size() == 122);
  auto const curve = liver_hysteresis<double>();
  for (int k = 0; k < 200; ++k) {
    double const depth = 0.0002 + 0.0224 * k / 200;
    REQUIRE(std::abs(found.law(depth, Phase::loading) - curve(depth, Phase::loading)) < 0.012);
    REQUIRE(std::abs(found.law(depth, Phase::unloading) - curve(depth, Phase::unloading)) < 0.012);
  }
  CHECK(found.rms < 0.0055);
  CHECK(found.r_squared > 0.999);
  CHECK(found.cross_validated_rms > 0.005);
  CHECK(found.cross_validated_rms < 0.008);   // 21 weights on 98 measurements
  CHECK(found.cross_validated_rms > found.rms);
  CHECK(found.law.range().high == 0.02283);
  CHECK(found.law(1.0, Phase::loading) == Approx(2 * curve(0.02283, Phase::loading)).epsilon(0.02));   // the cap: twice the largest force
  std::ostringstream text;
  text << found;
  CHECK(text.str().find("21 weights") != std::string::npos);
  CHECK(text.str().find("No force of this library is validated") != std::string::npos);

  auto const loading = fit_network<Network<double, 1, 5, 1>>(of_liver(0.0, 1), {.training = {.starts = 2}, .folds = 0});
  CHECK(loading.used.size() == 61);
  CHECK(loading.rms * loading.rms < 5.0e-5);
  CHECK(std::isnan(loading.cross_validated_rms));
}

// Yardstick: the formula the samples were made with, F = (20 + 100 v) d.
TEST_CASE("a network of depth and speed follows both, and neither beyond what was measured") {
  std::vector<Measurement> data;
  for (double const speed : {0.001, 0.01, 0.02, 0.04})
    for (int k = 0; k <= 20; ++k) data.push_back({k * 0.001, speed, MeasuredPhase::loading, (20 + 100 * speed) * k * 0.001});
  data.push_back({0.001, 0.5, MeasuredPhase::unloading, -7});   // not looked at
  auto const found = fit_speed_network<Network<double, 2, 5, 1>>(data, {.training = {.starts = 2}, .folds = 0});
  auto const& law = found.law;
  for (double const speed : {0.001, 0.005, 0.03, 0.04})
    for (double const depth : {0.0005, 0.0055, 0.0105, 0.02}) {
      CAPTURE(speed, depth);
      CHECK(law(depth, speed) == Approx((20 + 100 * speed) * depth).margin(0.01));
      CHECK(law(depth, -speed) == law(depth, speed));
    }
  CHECK(law(0.01, 3.0) == law(0.01, 0.04));
  CHECK(law(0.01, 0.0) == law(0.01, 0.001));
  double const slope = (law(0.02, 0.02) - law(0.0199, 0.02)) / 1e-4;
  CHECK(law(0.022, 0.02) == Approx(law(0.02, 0.02) + slope * 0.002).epsilon(0.02));   // along the slope at the end
  CHECK(law(1.0, 0.04) == Approx(2 * 0.48));                                           // to the cap
  CHECK(law(-1.0, 0.04) == 0.0);
  ToolContact<double> contact{.phase = CuttingPhase::moving, .depth = 0.01, .velocity = {0, 0, -0.02}};
  CHECK(law(contact).z() == law(0.01, 0.02));
  contact.depth = 0.001;   // half of the default fade depth: s(1/2) = 1/2
  CHECK(law(contact).z() == Approx(law(0.001, 0.02) / 2));
  contact.phase = CuttingPhase::indenting;
  CHECK(law(contact).norm() == 0.0);
}

TEST_CASE("too few measurements and malformed options are refused with a reason") {
  using Net = Network<double, 1, 5, 1>;
  std::vector<Measurement> const few(5, Measurement{.depth = 0.001, .force = 1.0});
  CHECK_THROWS_WITH(fit_network<Net>(few), says("16 weights", "5 of the 5 measurements", "as many"));
  CHECK_THROWS_WITH(fit_network<Net>(std::vector<Measurement>(40, Measurement{.depth = 0.01, .force = 1.0})), says("all 40 measurements are at a depth of 0.01 m"));
  CHECK_THROWS_AS(fit_network<Net>(of_liver(0.0, 1), {.folds = 1}), InvalidArgument);
  CHECK_THROWS_AS(fit_network<Net>(of_liver(0.0, 1), {.cap = 0.5}), InvalidArgument);
  auto loading = of_liver(0.0, 1);
  loading.resize(61);
  auto broken = loading;
  broken[0].phase = MeasuredPhase::indenting, broken[7].depth = std::nan("");
  CHECK_THROWS_WITH(fit_network<Net>(broken), says("fit_network: measurement 7 holds nan", "finite"));   // as it was given, not as it is counted inside
  broken[7].depth = 0.001, broken[9].speed = std::nan("");
  CHECK_THROWS_WITH(fit_network<Net>(broken), says("measurement 9 holds nan"));
  broken[9] = {-0.001, 1e-4, MeasuredPhase::loading, 0.0};
  CHECK_THROWS_WITH(fit_network<Net>(broken), says("measurement 9 is at -0.001 m", "zero or more"));   // no force file may hold such a depth
  using OfPhase = Network<double, 2, 5, 1>;
  CHECK_THROWS_WITH(fit_network<OfPhase>(loading), says("an input for the phase", "none of the 61 measurements is of unloading", "depth alone"));
  for (Measurement& m : loading) m.phase = MeasuredPhase::unloading;
  CHECK_THROWS_WITH(fit_network<OfPhase>(loading), says("is of loading"));
  Network<double, 2, 5, 1> const network(Seed{1});
  using Curve = SpeedCurve<Network<double, 2, 5, 1>>;
  CHECK_THROWS_WITH(Curve(network, {0.01, 0.0}, {0.0, 1.0}), says("the depth range is 0.01 … 0 m", "the lower one first"));
  CHECK_THROWS_AS(Curve(network, {0.0, 0.01}, {-1.0, 1.0}), InvalidArgument);
  CHECK_THROWS_AS(Curve(network, {0.0, 0.01}, {0.0, 1.0}, {.largest_force = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(Curve(network, {0.0, 0.01}, {0.0, 1.0}, {}, -1.0), InvalidArgument);
}

// Noise makes a network's end lie above all that was measured; the guard gives way to it. Yardstick: the curve goes on without a jump there.
TEST_CASE("a cap of the largest force measured never refuses the network that was fitted") {
  int above = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(Seed{seed});
    std::vector<Measurement> all;
    for (int k = 0; k < 30; ++k) all.push_back({0.02 * k / 29, 1e-3, MeasuredPhase::loading, 1e5 * std::pow(0.02 * k / 29, 3) + 0.05 * random.normal()});
    auto const found = fit_network<Network<double, 1, 5, 1>>(all, {.training = {.starts = 1, .seed = {seed}}, .epochs = 60, .folds = 0, .cap = 1.0});
    double largest = 0.0;
    for (Measurement const& m : all) largest = std::max(largest, m.force);
    double const end = found.law(0.02);
    above += end > largest ? 1 : 0;
    CHECK(found.law(0.0200001) == Approx(end).margin(1e-3));
    CHECK(found.law(0.5) <= std::max(end, largest));
  }
  CHECK(above > 0);
}
