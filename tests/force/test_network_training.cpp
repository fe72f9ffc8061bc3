// SPDX-License-Identifier: MIT
#include <palpate/force/liver.hpp>
#include <palpate/force/network_training.hpp>

#include "catch.hpp"

#include <cmath>
#include <limits>
#include <vector>

using namespace palpate;

namespace {

/// The samples of the published loading curve, every half millimetre.
template <RealScalar S>
std::vector<Sample<S, 1, 1>> loading_samples() {
  auto const loading = liver_loading<S>();
  std::vector<Sample<S, 1, 1>> samples;
  for (int i = 0; i <= 45; ++i) {
    S const depth = S(i) * S(0.0005);
    samples.push_back({{depth}, {loading(depth)}});
  }
  return samples;
}

/// Computed here, not by the library.
template <class Net, class Samples>
double error_of(Net const& network, Samples const& samples) {
  double sum = 0;
  std::size_t count = 0;
  for (auto const& sample : samples) {
    auto const y = network(sample.input);
    for (std::size_t o = 0; o < y.size(); ++o, ++count) sum += std::pow(double(y[o]) - double(sample.output[o]), 2);
  }
  return sum / double(count);
}

}  // namespace

// Yardstick: the thesis's mean squared error for this network and number of epochs, 5.018e-5 N².
TEMPLATE_TEST_CASE("Levenberg–Marquardt learns the liver's loading curve from any start", "", PALPATE_TEST_SCALARS) {
  auto const samples = loading_samples<TestType>();
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    Network<TestType, 1, 5, 1> network(Seed{seed});
    TrainingReport const report = train(network, samples, LevenbergMarquardt{.epochs = 100});
    CHECK(report.mean_squared_error < 5e-5);
    CHECK(report.mean_squared_error == Approx(error_of(network, samples)).epsilon(1e-6).margin(1e-14));
    CHECK(report.epochs <= 100);
    CHECK(report.initial_mean_squared_error > report.mean_squared_error);
    CHECK(network.has_scaling());
  }
}

// Yardstick: the reported errors of the 2-5-1 network (1.232e-4 N²) and of two hidden layers (5e-4 N²).
TEST_CASE("networks with two inputs and with two hidden layers learn the hysteresis") {
  auto const curve = liver_hysteresis<double>();
  std::vector<Sample<double, 2, 1>> samples;
  for (int i = 0; i <= 57; ++i)
    for (int flag = 0; flag < 2; ++flag) {
      double const depth = i * 4e-4;
      samples.push_back({{depth, double(flag)}, {curve(depth, flag == 0 ? Phase::loading : Phase::unloading)}});
    }
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    CAPTURE(seed);
    Network<double, 2, 5, 1> one(Seed{seed});
    CHECK(train(one, samples, LevenbergMarquardt{}).mean_squared_error < 1.232e-4);
    Network<double, 2, 5, 3, 1> two(Seed{seed});
    CHECK(train(two, samples, LevenbergMarquardt{.epochs = 500}).mean_squared_error < 5e-4);
  }
}

// Yardstick: with no hidden layer, training is linear least squares; the solution of the normal equations is worked out by hand:
// x = 0, 1, 2, 3, y = 1, 3, 2, 5: slope 11/10, intercept 11/10, mean square 27/40.
TEST_CASE("training without a hidden layer is the regression line") {
  std::vector<Sample<double, 1, 1>> const samples{{{0}, {1}}, {{1}, {3}}, {{2}, {2}}, {{3}, {5}}};
  Network<double, 1, 1> fast(Seed{1});
  TrainingReport const report = train(fast, samples, LevenbergMarquardt{});
  CHECK(report.mean_squared_error == Approx(27.0 / 40.0).epsilon(1e-10));
  CHECK(fast(0.0) == Approx(1.1).epsilon(1e-6));
  CHECK(fast(10.0) == Approx(12.1).epsilon(1e-6));
  Network<double, 1, 1> slow(Seed{1});
  CHECK(train(slow, samples, GradientDescent{.rate = 0.1, .epochs = 2000}).mean_squared_error == Approx(27.0 / 40.0).epsilon(1e-10));
  CHECK(slow(10.0) == Approx(12.1).epsilon(1e-6));
}

TEST_CASE("several outputs are trained together") {
  std::vector<Sample<double, 1, 2>> samples;
  for (int i = 0; i <= 40; ++i) {
    double const x = i * 0.1;
    samples.push_back({{x}, {std::sin(x), 100.0 * std::cos(x)}});
  }
  Network<double, 1, 6, 2> network(Seed{2});
  TrainingReport const report = train(network, samples, LevenbergMarquardt{.epochs = 200});
  CHECK(report.mean_squared_error == Approx(error_of(network, samples)).epsilon(1e-9));
  CHECK(network({1.0})[0] == Approx(std::sin(1.0)).margin(0.01));
  CHECK(network({1.0})[1] == Approx(100 * std::cos(1.0)).margin(1.0));
}

// Yardstick: the thesis's rate 0.001 and 100 epochs do not reach the thesis's error; each epoch goes downhill.
TEST_CASE("plain gradient descent goes downhill, slowly") {
  auto const samples = loading_samples<double>();
  Network<double, 1, 5, 1> network(Seed{1});
  double last = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 5; ++round) {
    TrainingReport const report = train(network, samples, GradientDescent{.rate = 0.001, .epochs = 100});
    CHECK(report.epochs == 100);
    CHECK(report.stop == TrainingStop::epochs);
    CHECK(report.mean_squared_error < report.initial_mean_squared_error);
    CHECK(report.mean_squared_error < last);
    CHECK(report.mean_squared_error > 5e-4);
    last = report.mean_squared_error;
  }
}

TEST_CASE("gradient descent that is too fast never makes the network worse") {
  auto const samples = loading_samples<double>();
  for (double rate : {1.0, 1e3, 1e100, 1e308}) {
    Network<double, 1, 5, 1> network(Seed{1});
    TrainingReport const report = train(network, samples, GradientDescent{.rate = rate, .epochs = 500});
    CAPTURE(rate);
    CHECK(report.mean_squared_error <= report.initial_mean_squared_error);
    CHECK(std::isfinite(network(0.01)));
  }
}

TEST_CASE("the goal ends a training") {
  auto const samples = loading_samples<double>();
  Network<double, 1, 5, 1> network(Seed{1});
  TrainingReport const first = train(network, samples, LevenbergMarquardt{.epochs = 100, .goal = 1e-3});
  CHECK(first.stop == TrainingStop::goal);
  CHECK(first.epochs < 100);
  TrainingReport const again = train(network, samples, GradientDescent{.goal = 1e-3});
  CHECK(again.stop == TrainingStop::goal);
  CHECK(again.epochs == 0);
}

TEST_CASE("a second training goes on where the first stopped and keeps the scaling") {
  auto const samples = loading_samples<double>();
  Network<double, 1, 5, 1> network(Seed{3});
  TrainingReport const first = train(network, samples, LevenbergMarquardt{.epochs = 5});
  auto const scaling = network.scaling();
  std::vector<Sample<double, 1, 1>> const half(samples.begin(), samples.begin() + 20);
  CHECK(train(network, samples, LevenbergMarquardt{.epochs = 5}).initial_mean_squared_error == Approx(first.mean_squared_error));
  train(network, half, LevenbergMarquardt{.epochs = 5});
  CHECK(network.scaling().input_gain == scaling.input_gain);
  CHECK(network.scaling().output_offset == scaling.output_offset);
}

TEST_CASE("samples without spread train to a constant") {
  std::vector<Sample<double, 1, 1>> const samples(3, {{0.5}, {2.0}});
  Network<double, 1, 5, 1> network(Seed{1});
  CHECK(train(network, samples, LevenbergMarquardt{}).mean_squared_error < 1e-20);
  CHECK(network(0.5) == Approx(2.0));
}

TEST_CASE("the same training gives the same bits") {
  auto const samples = loading_samples<double>();
  Network<double, 1, 5, 1> a(Seed{9}), b(Seed{9});
  train(a, samples, LevenbergMarquardt{.epochs = 30});
  train(b, samples, LevenbergMarquardt{.epochs = 30});
  CHECK(a.parameters() == b.parameters());
}

TEST_CASE("a training with malformed input says so and leaves the network as it was") {
  auto const good = loading_samples<double>();
  Network<double, 1, 5, 1> network(Seed{1});
  auto const before = network.parameters();

  CHECK_THROWS_WITH(train(network, std::vector<Sample<double, 1, 1>>{}, LevenbergMarquardt{}),
                    "train: there are no samples; give at least one");
  auto bad = good;
  bad[3].output[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(train(network, bad, LevenbergMarquardt{}), "train: output 0 of sample 3 is nan; give finite numbers");
  bad = good;
  bad[7].input[0] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(train(network, bad, GradientDescent{}), "train: input 0 of sample 7 is inf; give finite numbers");
  CHECK_THROWS_WITH(train(network, good, LevenbergMarquardt{.epochs = 0}),
                    "LevenbergMarquardt: .epochs is 0; give one or more");
  CHECK_THROWS_AS(train(network, good, LevenbergMarquardt{.goal = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(train(network, good, LevenbergMarquardt{.damping = 0.0}), InvalidArgument);
  CHECK_THROWS_WITH(train(network, good, GradientDescent{.rate = 0.0}),
                    "GradientDescent: .rate is 0; give a finite number above zero");
  CHECK_THROWS_AS(train(network, good, GradientDescent{.epochs = -1}), InvalidArgument);
  CHECK_THROWS_AS(train(network, good, GradientDescent{.goal = std::nan("")}), InvalidArgument);

  CHECK(network.parameters() == before);
  CHECK_FALSE(network.has_scaling());
}
