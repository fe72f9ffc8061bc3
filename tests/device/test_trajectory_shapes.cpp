// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"

#include <palpate/device/trajectory.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;

namespace {

constexpr double full_turn = 2.0 * std::numbers::pi;

/// The largest difference between the velocity and the central difference of the position, of the whole path but `margin` about the times given.
template <class Path>
double velocity_error(Path const& path, std::initializer_list<double> kinks, double step = 1e-5) {
  double worst = 0.0;
  for (double t = 3e-4; t < path.duration() - 3e-4; t += 1.7e-3) {
    bool near = false;
    for (double const kink : kinks) near = near || std::abs(t - kink) <= 2 * step;
    if (near) continue;
    Vector3<double> const slope = (path.at(t + step).position - path.at(t - step).position) / (2 * step);
    worst = std::max(worst, (path.at(t).velocity - slope).norm());
  }
  return worst;
}

}  // namespace

TEMPLATE_TEST_CASE("a sine is p + a sin 2πft, and its velocity the derivative", "[trajectory]", PALPATE_TEST_SCALARS) {
  // Yardstick: the formula by hand.
  using Scalar = TestType;
  auto const path = Trajectory<Scalar>::start({0, 0, Scalar(0.01)}).sine({0, 0, Scalar(0.002)}, 3.0, 2.0);
  double const tolerance = 0.02 * 8 * std::numeric_limits<Scalar>::epsilon();
  for (double t = 0.0; t < 2.0; t += 0.0137) {
    CHECK(std::abs(path.at(t).position.z() - (0.01 + 0.002 * std::sin(full_turn * 3.0 * t))) <= tolerance);
    CHECK(std::abs(path.at(t).velocity.z() - 0.002 * full_turn * 3.0 * std::cos(full_turn * 3.0 * t)) <= 4 * tolerance + 1e-12);
  }
  CHECK(std::abs(path.end().z() - Scalar(0.01)) <= tolerance);   // six whole periods
}

TEMPLATE_TEST_CASE("a sine keeps its phase for an hour", "[trajectory]", PALPATE_TEST_SCALARS) {
  // Yardstick: after 3600.25 s at 97 Hz, 349224 turns and a quarter, it is at the top.
  using Scalar = TestType;
  auto const path = Trajectory<Scalar>::start({0, 0, 0}).sine({1, 0, 0}, 97.0, 4000.0);
  CHECK(std::abs(path.at(3600.25).position.x() - Scalar(1)) <= 1e-6);
}

TEST_CASE("a chirp passes its turns at the times of the quadratic", "[trajectory]") {
  // Yardstick: φ/2π = f t + (g − f) t²/(2T) is k/2 at t = (−f + √(f² + k (g − f)/T)) T/(g − f); there the path crosses its middle.
  double const from = 1.0, to = 41.0, seconds = 5.0;
  auto const path = Trajectory<double>::start({0.1, 0, 0}).chirp({0.003, 0, 0}, from, to, seconds);
  double const sweep = (to - from) / seconds;
  int crossings = 0;
  for (int k = 1;; ++k) {
    double const t = (-from + std::sqrt(from * from + k * sweep)) / sweep;
    if (t >= seconds) break;
    ++crossings;
    REQUIRE(std::abs(path.at(t).position.x() - 0.1) <= 1e-12);
    // and there its speed is that of the frequency of the moment
    REQUIRE(std::abs(std::abs(path.at(t).velocity.x()) - 0.003 * full_turn * (from + sweep * t)) <= 1e-10);
  }
  CHECK(crossings == 209);   // (f + g) T/2 = 105 turns, two crossings each, the last one at the end
  CHECK(path.at(seconds).velocity.isZero(0.0));
}

TEST_CASE("every shape's velocity is the derivative of its position", "[trajectory]") {
  // Yardstick: central differences, error (2π 20 Hz)³ 3 mm step²/6 ≈ 1e-7 m/s.
  auto const begin = Trajectory<double>::start({0.02, 0, 0.01});
  CHECK(velocity_error(Trajectory<double>(begin).chirp({0.003, 0, 0.001}, 0.0, 20.0, 2.0), {}) <= 3e-7);
  CHECK(velocity_error(Trajectory<double>(begin).chirp({0.003, 0, 0.001}, 20.0, 2.0, 2.0).sine({0, 0.002, 0}, 5.0, 1.0), {2.0}) <= 3e-7);
  CHECK(velocity_error(slide(begin, SlideShape<double>{}), {0.5, 2.5}) <= 3e-7);
  CHECK(velocity_error(circle<double>(begin, {0, 0, 0}, {0, 0, 1}, 3.0, -2), {}) <= 3e-7);
  CHECK(velocity_error(strokes<double>(begin, {0, 0, -0.01}, 0.3, 3), {}) <= 3e-7);
}

TEST_CASE("a slide presses, slides at depth and lifts", "[trajectory]") {
  auto const path = slide(Trajectory<double>::start({0.1, 0, 0}),
                          {.down = {0, 0, -0.003}, .along = {0, 0.05, 0}, .press_seconds = 0.4, .slide_seconds = 2.5});
  CHECK(path.duration() == Approx(3.3).epsilon(1e-15));
  CHECK((path.at(0.4).position - Vector3<double>(0.1, 0, -0.003)).norm() <= 1e-15);
  CHECK((path.at(1.65).position - Vector3<double>(0.1, 0.025, -0.003)).norm() <= 1e-15);
  CHECK((path.at(1.65).velocity - Vector3<double>(0, 0.02, 0)).norm() <= 1e-15);
  CHECK((path.end() - Vector3<double>(0.1, 0.05, 0)).norm() <= 1e-15);
  CHECK(path.at(0.2).velocity.z() == Approx(-0.003 / 0.4 * 1.875));   // the peak of a minimum-jerk reach, 15/8 of its mean
}

TEST_CASE("circles close, strokes return, swings that move go with a moved path", "[trajectory]") {
  auto const round = circle<double>(Trajectory<double>::start({0.03, 0, 0.01}), {0, 0, 0}, {0, 0, 1}, 4.0, 2);
  CHECK((round.end() - Vector3<double>(0.03, 0, 0.01)).norm() <= 1e-16);
  CHECK((round.at(0.5).position - Vector3<double>(0, 0.03, 0.01)).norm() <= 1e-16);
  auto const other_way = circle<double>(Trajectory<double>::start({0.03, 0, 0}), {0, 0, 0}, {0, 0, 1}, 4.0, -1);
  CHECK((other_way.at(1.0).position - Vector3<double>(0, -0.03, 0)).norm() <= 1e-16);
  auto const there = strokes<double>(Trajectory<double>::start({0, 0, 0.02}), {0, 0, -0.01}, 0.5, 2);
  CHECK(there.duration() == 2.0);
  CHECK(there.at(1.5).position.z() == Approx(0.01));
  CHECK(there.end().z() == 0.02);
  Matrix<double, 3, 3> quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  auto const swung = Trajectory<double>::start({1, 0, 0}).sine({0.5, 0, 0}, 1.0, 1.25).moved(quarter, {0, 0, 3});
  CHECK((swung.at(0.25).position - Vector3<double>(0, 1.5, 3)).norm() <= 1e-15);
  CHECK((swung.end() - Vector3<double>(0, 1.5, 3)).norm() <= 1e-15);
}

TEST_CASE("shapes that make no sense are refused with advice, and leave the path as it was", "[trajectory]") {
  using palpate_test::message_of;
  using palpate_test::unsaid;
  auto path = Trajectory<double>::start({0, 0, 0});
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(unsaid(message_of([&] { path.sine({0, 0, 1}, -1.0, 1.0); }), "sine", "-1", "Hz") == "");
  CHECK(unsaid(message_of([&] { path.sine({0, 0, 1}, 1.0, 0.0); }), "sine", "0 s", "positive") == "");
  CHECK(unsaid(message_of([&] { path.chirp({0, 0, 1}, 1.0, nan, 1.0); }), "chirp", "nan", "finite") == "");
  CHECK(unsaid(message_of([&] { path.chirp({0, nan, 1}, 1.0, 2.0, 1.0); }), "chirp", "not finite") == "");
  CHECK(unsaid(message_of([&] { circle<double>(path, {0, 0, 0}, {0, 0, 1}, 1.0, 0); }), "circle", "0 turns") == "");
  CHECK(unsaid(message_of([&] { strokes<double>(path, {0, 0, 1}, 1.0, 0); }), "strokes", "0 times") == "");
  CHECK(unsaid(message_of([&] { path.sine({0, 0, 1}, 1e300, 1e10); }), "sine", "no finite point", "lower frequencies") == "");
  CHECK(path.duration() == 0.0);
}
