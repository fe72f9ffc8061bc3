// SPDX-License-Identifier: MIT
#include <palpate/force/noise.hpp>

#include "catch.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>

using namespace palpate;

static_assert(ForceNoise<WhiteGaussianNoise<float>, float> && !ForceNoise<WhiteGaussianNoise<float>, double>);

// Yardstick: the definition of the ratio, 10 log10(mean F² / mean ΔF²), measured over 1e5 samples.
TEMPLATE_TEST_CASE("the noise has the asked signal-to-noise ratio, along the force", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (double snr : {0.0, 20.0, 30.0}) {
    WhiteGaussianNoise<S> noise({.snr_db = snr, .seed = 7});
    double signal = 0, disturbance = 0, mean = 0, lag = 0, last = 0;
    constexpr int n = 100000;
    for (int i = 0; i < n; ++i) {
      S const strength = S(1) + S(0.9) * std::sin(S(i) * S(0.01));   // the ratio holds although the force changes
      Vector3<S> const force = strength * Vector3<S>(S(0.6), S(0), S(-0.8));
      Vector3<S> const error = noise.draw(force);
      REQUIRE(error.cross(force).norm() <= S(1e-6) * force.squaredNorm());
      double const along = double(error.dot(force) / force.squaredNorm());
      signal += double(force.squaredNorm());
      disturbance += double(error.squaredNorm());
      mean += along / n;
      lag += along * last / n;
      last = along;
    }
    CAPTURE(snr);
    double const sigma = std::pow(10.0, -snr / 20.0);
    CHECK(10 * std::log10(signal / disturbance) == Approx(snr).margin(0.2));
    CHECK(std::abs(mean) < 5 * sigma / std::sqrt(double(n)));
    CHECK(std::abs(lag) < 5 * sigma * sigma / std::sqrt(double(n)));   // white
  }
}

TEST_CASE("the same seed gives the same noise, also after a reset") {
  Vector3<double> const force(0, 0, 2);
  WhiteGaussianNoise<double> a({.snr_db = 30.0, .seed = 7});
  WhiteGaussianNoise<double> b({.snr_db = 30.0, .seed = 7});
  WhiteGaussianNoise<double> c({.snr_db = 30.0, .seed = 8});
  double const first = a.draw(force).z();
  CHECK(first == b.draw(force).z());
  CHECK(first != c.draw(force).z());
  CHECK(a.draw(force).z() == b.draw(force).z());
  a.reset();
  CHECK(a.draw(force).z() == first);
  CHECK(a.draw(Vector3<double>::Zero()).norm() == 0.0);
  CHECK(a.options().seed == 7);
}

TEST_CASE("a ratio that is not finite is refused") {
  CHECK_THROWS_WITH(WhiteGaussianNoise<double>({.snr_db = std::numeric_limits<double>::quiet_NaN()}), says(".snr_db is nan", "decibels"));
  CHECK_THROWS_AS(WhiteGaussianNoise<float>({.snr_db = -1e6}), InvalidArgument);
}
