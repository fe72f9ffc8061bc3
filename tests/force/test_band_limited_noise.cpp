// SPDX-License-Identifier: MIT
#include <palpate/force/band_limited_noise.hpp>
#include <palpate/force/noise.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"
#include "fused.hpp"
#include "spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

using namespace palpate;

static_assert(ForceNoise<BandLimitedNoise<float>, float> && !ForceNoise<BandLimitedNoise<float>, double>);

namespace {

template <class Noise>
std::vector<double> drawn(Noise noise, double strength, std::size_t count) {
  std::vector<double> values(count);
  for (double& value : values) value = noise.draw({0.0, 0.0, strength}).z();
  return values;
}

double variance(std::vector<double> const& values) {
  double sum = 0;
  for (double const value : values) sum += value * value;
  return sum / static_cast<double>(values.size());
}

/// The filter's response by its closed form.
double response(double frequency, double bandwidth, double rate) {
  return 1.0 / (1.0 + std::pow(std::tan(std::numbers::pi * frequency / rate) / std::tan(std::numbers::pi * bandwidth / rate), 4));
}

}  // namespace

// Yardstick: the definition of the ratio, over 1e5 samples at a fixed force; over 1e6 for the narrowest band, whose samples depend on each other.
TEMPLATE_TEST_CASE("band-limited noise has the asked signal-to-noise ratio", "[force]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (double const bandwidth : {20.0, 100.0, 400.0}) {
    BandLimitedNoise<S> noise({.snr_db = 20.0, .seed = 11, .bandwidth = bandwidth});
    double disturbance = 0;
    int const count = bandwidth < 100 ? 1000000 : 100000;
    for (int k = 0; k < count; ++k) disturbance += double(noise.draw({S(1.2), S(0), S(-1.6)}).squaredNorm()) / count;
    CAPTURE(bandwidth);
    CHECK(10 * std::log10(4.0 / disturbance) == Approx(20.0).margin(0.2));
  }
}

// Yardstick: the closed form of the response. In each of the bands of the spectrum the mean of a few hundred periodogram values.
TEST_CASE("its spectrum is the Butterworth filter's, flat for white noise") {
  constexpr std::size_t count = std::size_t{1} << 17;
  auto const check = [&](std::vector<double> const& values, auto const& wanted) {
    std::vector<double> const power = band_powers(values, 20);   // bands of 25 Hz at 1 kHz, mean 1 for white noise of variance 1
    double whole = 0;
    for (int band = 0; band < 2000; ++band) whole += wanted((band + 0.5) * 0.25) / 2000;
    for (std::size_t band = 0; band < power.size(); ++band) {
      double expected = 0;
      for (int k = 0; k < 100; ++k) expected += wanted((static_cast<double>(band) + (k + 0.5) / 100) * 25.0) / 100 / whole;
      CAPTURE(band);
      CHECK(power[band] == Approx(expected).epsilon(0.1).margin(1e-7));   // 3,277 values: 1.7 % standard deviation
    }
  };
  check(drawn(BandLimitedNoise<double>({.snr_db = 0.0, .seed = 5, .bandwidth = 100.0}), 1.0, count), [](double f) { return response(f, 100.0, 1000.0); });
  check(drawn(BandLimitedNoise<double>({.snr_db = 0.0, .seed = 6, .bandwidth = 30.0}), 1.0, count), [](double f) { return response(f, 30.0, 1000.0); });
  check(drawn(WhiteGaussianNoise<double>({.snr_db = 0.0, .seed = 5}), 1.0, count), [](double) { return 1.0; });
}

// Yardstick: the mean over many seeds of the square of the first sample is the variance: there is no start-up.
TEST_CASE("it is as strong in its first tick as later") {
  double first = 0, third = 0;
  constexpr int seeds = 20000;
  for (int seed = 0; seed < seeds; ++seed) {
    auto const values = drawn(BandLimitedNoise<double>({.snr_db = 0.0, .seed = static_cast<std::uint64_t>(seed), .bandwidth = 50.0}), 1.0, 3);
    first += values[0] * values[0] / seeds, third += values[2] * values[2] / seeds;
  }
  CHECK(first == Approx(1.0).margin(0.05));   // five standard deviations
  CHECK(third == Approx(1.0).margin(0.05));
}

TEST_CASE("a reference level makes the noise independent of the force's size") {
  for (double const strength : {0.01, 1.0, 3.0}) {
    CAPTURE(strength);
    CHECK(variance(drawn(WhiteGaussianNoise<double>({.snr_db = 20.0, .seed = 1, .reference = 2.0}), strength, 100000)) == Approx(0.04).epsilon(0.04));
    CHECK(variance(drawn(BandLimitedNoise<double>({.snr_db = 20.0, .seed = 1, .reference = 2.0}), strength, 100000)) == Approx(0.04).epsilon(0.04));
  }
  CHECK(variance(drawn(WhiteGaussianNoise<double>({.reference = 2.0}), 0.0, 10)) == 0.0);
  CHECK(variance(drawn(BandLimitedNoise<double>({.reference = 2.0}), 0.0, 10)) == 0.0);
}

TEST_CASE("the same seed gives the same band-limited noise, also after a reset") {
  BandLimitedNoise<double> a({.seed = 7}), b({.seed = 7}), c({.seed = 8});
  Vector3<double> const force(0, 0, 2);
  double const first = a.draw(force).z();
  CHECK(first == b.draw(force).z());
  CHECK(first != c.draw(force).z());
  for (int k = 0; k < 100; ++k) a.draw(force);
  a.reset();
  CHECK(a.draw(force).z() == first);
  CHECK(a.options().bandwidth == 100.0);
}

// Yardstick: the 1005th value of seed 7 from the textbook's filter in another language, its variance by its impulse response; the same bits wherever
// the compiler fuses no products and sums.
TEST_CASE("the sequence is the same with every compiler") {
  BandLimitedNoise<double> noise({.snr_db = 20.0, .seed = 7, .bandwidth = 100.0});
  for (int k = 0; k < 1004; ++k) noise.draw({0, 0, 2});
  double const value = noise.draw({0, 0, 2}).z();
  CHECK(value == Approx(-0.2095693870211548).epsilon(1e-12));
  CHECK((may_fuse || value == -0.20956938702115491));
}

TEST_CASE("malformed options of noises are refused with a reason") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  using Band = BandLimitedNoise<double>;
  CHECK_THROWS_WITH(Band({.bandwidth = 500.0}), says(".bandwidth is 500 Hz", "below half the rate"));
  CHECK_THROWS_AS(Band({.bandwidth = nan}), InvalidArgument);
  CHECK_THROWS_AS(Band({.bandwidth = 0.0}), InvalidArgument);
  CHECK_THROWS_WITH(Band({.rate = 0.0}), says(".rate is 0 Hz", "1000"));
  CHECK_THROWS_WITH(Band({.snr_db = nan}), says(".snr_db is nan", "decibels"));
  CHECK_THROWS_WITH(WhiteGaussianNoise<double>({.reference = -1.0}), says(".reference is -1 N", "above zero"));
  CHECK_THROWS_AS(WhiteGaussianNoise<double>({.reference = nan}), InvalidArgument);
}

TEST_CASE("a tick of band-limited noise allocates nothing") {
  BandLimitedNoise<double> noise;
  double sum = 0;
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 1000; ++k) sum += noise.draw({0, 0, 1}).z();
  noise.reset();
  long const counted = allocations.count();
  CHECK(counted == 0);
  CHECK(std::isfinite(sum));
}
