// SPDX-License-Identifier: MIT
#include <palpate/force/network.hpp>

#include "catch.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

using namespace palpate;

namespace {

/// An evaluation with plain loops over flat parameters, as `parameters()` documents their order.
template <class Net, class Activation>
std::vector<double> plain(Net const& network, std::vector<int> const& sizes, std::vector<double> x, Activation activation) {
  auto const parameters = network.parameters();
  std::size_t k = 0;
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l) {
    std::vector<double> y(std::size_t(sizes[l + 1]), 0.0);
    for (double& value : y)
      for (double const input : x) value += double(parameters[k++]) * input;
    for (double& value : y) value += double(parameters[k++]);
    if (l + 2 < sizes.size())
      for (double& value : y) value = activation(value);
    x = y;
  }
  REQUIRE(k == parameters.size());
  return x;
}

double tan_sigmoid(double x) { return (1.0 - std::exp(-2.0 * x)) / (1.0 + std::exp(-2.0 * x)); }
double printed_sigmoid(double x) { return (1.0 - std::exp(-x)) / (1.0 + std::exp(-x)); }

}  // namespace

static_assert(Network<double, 1, 5, 1>::parameter_count == 16);
static_assert(Network<double, 2, 5, 3, 1>::parameter_count == 15 + 18 + 4);
static_assert(Network<float, 4, 3>::parameter_count == 15);
static_assert(std::is_same_v<Network<double, 1, 5, 1>, BasicNetwork<Tanh, double, 1, 5, 1>>);
static_assert(noexcept(Network<double, 1, 5, 1>(Seed{1})(0.5)));
static_assert(noexcept(Network<float, 2, 5, 3, 1>(Seed{1})(std::array<float, 2>{})));

// Yardstick: plain loops, with the sigmoid written with the exponential function.
TEMPLATE_TEST_CASE("a network evaluates W f(W f(...) + b) + b", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const tolerance = 200 * double(std::numeric_limits<S>::epsilon());
  Random random(Seed{9});
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    S const a = random.uniform(S(-2), S(2));
    S const b = random.uniform(S(-2), S(2));
    Network<S, 1, 5, 1> const small{Seed{seed}};
    CHECK(double(small(a)) == Approx(plain(small, {1, 5, 1}, {double(a)}, tan_sigmoid)[0]).margin(tolerance));
    Network<S, 2, 5, 3, 1> const deep{Seed{seed}};
    CHECK(double(deep(a, b)) == Approx(plain(deep, {2, 5, 3, 1}, {double(a), double(b)}, tan_sigmoid)[0]).margin(tolerance));
    BasicNetwork<HalfSigmoid, S, 2, 4, 3, 2, 2> const wide{Seed{seed}};
    auto const y = wide({a, b});
    auto const expected = plain(wide, {2, 4, 3, 2, 2}, {double(a), double(b)}, printed_sigmoid);
    CHECK(double(y[0]) == Approx(expected[0]).margin(tolerance));
    CHECK(double(y[1]) == Approx(expected[1]).margin(tolerance));
    Network<S, 1, 1> const line{Seed{seed}};   // no hidden layer: a straight line
    CHECK(double(line(a)) == Approx(plain(line, {1, 1}, {double(a)}, tan_sigmoid)[0]).margin(tolerance));
  }
}

// Yardstick: central differences.
TEST_CASE("back-propagation gives the derivatives", "[gradient]") {
  auto const check = [](auto network) {
    using Net = decltype(network);
    typename Net::Scaling scaling = network.scaling();
    for (std::size_t i = 0; i < scaling.input_gain.size(); ++i) {
      scaling.input_gain[i] = 1.5 + double(i);
      scaling.input_offset[i] = 0.1;
    }
    for (std::size_t o = 0; o < scaling.output_gain.size(); ++o) scaling.output_gain[o] = 0.7 - 2.0 * double(o);
    network.set_scaling(scaling);
    typename Net::Input x{};
    typename Net::Output weight{};
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = 0.3 - 0.4 * double(i);
    for (std::size_t o = 0; o < weight.size(); ++o) weight[o] = 1.0 + 0.5 * double(o);
    auto const sum = [&](Net const& n, typename Net::Input const& at) {
      double result = 0;
      auto const y = n(at);
      for (std::size_t o = 0; o < y.size(); ++o) result += weight[o] * y[o];
      return result;
    };
    double const h = 1e-5;

    typename Net::Parameters gradient{};
    gradient.fill(1.0);   // it is added to
    network.add_parameter_gradient(x, weight, gradient);
    for (std::size_t k = 0; k < gradient.size(); ++k) {
      auto up = network.parameters();
      auto down = up;
      up[k] += h;
      down[k] -= h;
      Net above = network, below = network;
      above.set_parameters(up);
      below.set_parameters(down);
      CHECK(gradient[k] - 1.0 == Approx((sum(above, x) - sum(below, x)) / (2 * h)).margin(1e-8));
    }
    auto const slope = network.input_gradient(x, weight);
    for (std::size_t i = 0; i < slope.size(); ++i) {
      auto up = x;
      auto down = x;
      up[i] += h;
      down[i] -= h;
      CHECK(slope[i] == Approx((sum(network, up) - sum(network, down)) / (2 * h)).margin(1e-7));
    }
  };
  check(Network<double, 1, 5, 1>(Seed{1}));
  check(Network<double, 2, 5, 3, 1>(Seed{2}));
  check(Network<double, 3, 4, 2>(Seed{3}));
  check(BasicNetwork<HalfSigmoid, double, 2, 6, 4, 3, 3>(Seed{4}));
  check(Network<double, 2, 1>(Seed{5}));
}

// Yardstick: one neuron, computed by hand: inside = (3 - 1) * 0.5 = 1, y = 10 + 2 (4 tanh(0.5 * 1 + 0.25) - 1).
TEST_CASE("weights and scaling given by hand") {
  using Net = Network<double, 1, 1, 1>;
  Net::Layers layers;
  std::get<0>(layers) = {.weights = {{{0.5}}}, .bias = {0.25}};
  std::get<1>(layers) = {.weights = {{{4.0}}}, .bias = {-1.0}};
  Net const network(layers, {.input_offset = {1.0}, .input_gain = {0.5}, .output_offset = {10.0}, .output_gain = {2.0}});
  CHECK(network(3.0) == Approx(10.0 + 2.0 * (4.0 * std::tanh(0.75) - 1.0)).epsilon(1e-15));
  CHECK(network.has_scaling());
  CHECK_FALSE(Net(Seed{1}).has_scaling());
}

// Yardstick: the two forms of the sigmoid are the same function of x and x/2.
TEST_CASE("the thesis's printed sigmoid is tanh of half the argument") {
  for (double x : {-3.0, -0.5, 0.0, 0.1, 2.0}) {
    CHECK(HalfSigmoid::value(x) == Approx(printed_sigmoid(x)).margin(1e-15));
    CHECK(Tanh::value(x) == Approx(printed_sigmoid(2 * x)).margin(1e-15));
    double const h = 1e-6;
    CHECK(HalfSigmoid::slope(HalfSigmoid::value(x)) ==
          Approx((HalfSigmoid::value(x + h) - HalfSigmoid::value(x - h)) / (2 * h)).margin(1e-9));
    CHECK(Tanh::slope(Tanh::value(x)) == Approx((Tanh::value(x + h) - Tanh::value(x - h)) / (2 * h)).margin(1e-9));
  }
}

TEST_CASE("the same seed gives the same network, another seed another one") {
  using Net = Network<double, 2, 5, 1>;
  CHECK(Net(Seed{4}).parameters() == Net(Seed{4}).parameters());
  CHECK(Net(Seed{4}).parameters() != Net(Seed{5}).parameters());
  for (std::uint64_t seed = 0; seed < 50; ++seed)
    for (double const value : Net(Seed{seed}).parameters()) CHECK(std::isfinite(value));
}

TEST_CASE("a network goes through float and back with its scaling") {
  Network<double, 2, 3, 1> network(Seed{6});
  network.set_scaling({.input_offset = {0.5, 0.25}, .input_gain = {2.0, 4.0}, .output_offset = {1.0}, .output_gain = {0.125}});
  auto const single = network.cast<float>();
  CHECK(double(single(0.7f, 0.1f)) == Approx(network(double(0.7f), double(0.1f))).epsilon(1e-5));
  auto const back = single.cast<double>();
  CHECK(back.scaling().input_gain == network.scaling().input_gain);
  CHECK(back.has_scaling());
  CHECK_FALSE((Network<double, 2, 3, 1>(Seed{6}).cast<float>().has_scaling()));
}

TEST_CASE("a network refuses weights and scalings that are not finite") {
  using Net = Network<double, 1, 2, 1>;
  double const nan = std::numeric_limits<double>::quiet_NaN();
  Net network(Seed{1});
  auto parameters = network.parameters();
  parameters[3] = nan;
  CHECK_THROWS_WITH(network.set_parameters(parameters), says("nan", "finite"));
  CHECK(network.parameters() == Net(Seed{1}).parameters());
  Net::Layers layers = network.layers();
  std::get<1>(layers).bias[0] = -std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(Net(layers), says("-inf", "finite"));
  Net::Scaling scaling;
  scaling.output_gain[0] = 0.0;
  CHECK_THROWS_WITH(network.set_scaling(scaling), says("an output gain is 0", "other than zero"));
  scaling.output_gain[0] = 1.0;
  scaling.input_offset[0] = nan;
  CHECK_THROWS_AS(network.set_scaling(scaling), InvalidArgument);
  CHECK_FALSE(network.has_scaling());
}
