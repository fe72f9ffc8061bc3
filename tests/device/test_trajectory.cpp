// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"

#include <palpate/device/scripted_device.hpp>
#include <palpate/device/trajectory.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

static_assert(noexcept(std::declval<Trajectory<double> const&>().at(0.0)));
static_assert(noexcept(std::declval<Trajectory<float> const&>().at(0.0)));

namespace {

constexpr double pi = std::numbers::pi;

template <class Scalar>
Trajectory<Scalar> stroke() {   // of every kind of piece; 4.5 s
  return Trajectory<Scalar>::start({Scalar(0.03), Scalar(0), Scalar(0.01)})
      .line({Scalar(0.03), Scalar(0), Scalar(-0.01)}, 1.0)
      .hold(0.5)
      .arc({0, 0, 0}, {0, 0, Scalar(2)}, Scalar(pi / 2), 1.0)
      .tap({0, 0, Scalar(-0.005)}, 1.0, 2)
      .line({0, 0, 0}, 1.0, Pace::minimum_jerk);
}

template <class Scalar>
Scalar distance(Vector3<Scalar> const& a, Vector3<Scalar> const& b) { return (a - b).norm(); }

}  // namespace

TEMPLATE_TEST_CASE("a line covers its length at constant speed, a hold nothing", "[trajectory]", PALPATE_TEST_SCALARS) {
  // Yardstick: x(t) = x0 + (x1 - x0) t / T, by hand.
  using Scalar = TestType;
  using Point = Vector3<Scalar>;
  Scalar const tolerance = 8 * std::numeric_limits<Scalar>::epsilon();
  auto const path = Trajectory<Scalar>::start({1, 2, 3}).line({3, 2, -1}, 4.0).hold(2.0);
  CHECK(path.duration() == 6.0);
  CHECK(distance<Scalar>(path.at(1.0).position, Point(1.5, 2, 2)) <= tolerance);
  CHECK(distance<Scalar>(path.at(1.0).velocity, Point(0.5, 0, -1)) <= tolerance);
  CHECK(distance<Scalar>(path.at(5.0).position, Point(3, 2, -1)) <= tolerance);
  CHECK(path.at(5.0).velocity.isZero(Scalar(0)));
  CHECK(path.begin() == Point(1, 2, 3));
  CHECK(path.end() == Point(3, 2, -1));
}

TEMPLATE_TEST_CASE("an arc keeps its radius, its height and its speed", "[trajectory]", PALPATE_TEST_SCALARS) {
  // Yardstick: circle of radius 0.03 about the z axis at height -0.01, quarter turn in 1 s: |v| = r π/2.
  using Scalar = TestType;
  Scalar const epsilon = std::numeric_limits<Scalar>::epsilon();
  auto const path = Trajectory<Scalar>::start({Scalar(0.03), 0, Scalar(-0.01)})
                        .arc({0, 0, Scalar(7)}, {0, 0, Scalar(0.2)}, Scalar(pi / 2), 1.0);   // centre anywhere on the axis
  for (int i = 0; i < 100; ++i) {
    double const t = i / 100.0;
    auto const [position, velocity] = path.at(t);
    REQUIRE(std::abs(position.template head<2>().norm() - Scalar(0.03)) <= Scalar(0.03) * 8 * epsilon);
    REQUIRE(std::abs(position.z() + Scalar(0.01)) <= 16 * epsilon);   // the centre is 7 m away
    REQUIRE(std::abs(velocity.norm() - Scalar(0.03 * pi / 2)) <= Scalar(0.05) * 8 * epsilon);
    REQUIRE(std::abs(velocity.dot(position)) <= Scalar(0.0015) * 64 * epsilon);
    REQUIRE(std::abs(std::atan2(position.y(), position.x()) - Scalar(t * pi / 2)) <= 16 * epsilon);
  }
  CHECK(distance<Scalar>(path.end(), Vector3<Scalar>(0, Scalar(0.03), Scalar(-0.01))) <= 16 * epsilon);
}

TEST_CASE("an arc turns counter-clockwise seen against its axis", "[trajectory]") {
  auto const about = [](Vector3<double> const& axis) {
    return Trajectory<double>::start({1, 0, 0}).arc({0, 0, 0}, axis, pi / 2, 1.0).end();
  };
  CHECK(distance<double>(about({0, 0, 1}), {0, 1, 0}) <= 1e-15);
  CHECK(distance<double>(about({0, 0, -1}), {0, -1, 0}) <= 1e-15);
  CHECK(distance<double>(about({0, 1, 0}), {0, 0, -1}) <= 1e-15);
  CHECK(distance<double>(about({1, 0, 0}), {1, 0, 0}) <= 1e-15);   // on the axis nothing moves
}

TEMPLATE_TEST_CASE("a tap goes out and comes back to rest", "[trajectory]", PALPATE_TEST_SCALARS) {
  // Yardstick: p + reach (1 - cos 2πt)/2; largest speed π reach / T at a quarter.
  using Scalar = TestType;
  using Point = Vector3<Scalar>;
  Scalar const tolerance = 16 * std::numeric_limits<Scalar>::epsilon();
  auto const path = Trajectory<Scalar>::start({0, 0, Scalar(0.5)}).tap({0, 0, Scalar(-0.25)}, 2.0, 2);
  CHECK(distance<Scalar>(path.at(0.0).position, Point(0, 0, 0.5)) <= tolerance);
  CHECK(path.at(0.0).velocity.norm() <= tolerance);
  CHECK(distance<Scalar>(path.at(0.5).position, Point(0, 0, 0.25)) <= tolerance);   // bottom of the first
  CHECK(distance<Scalar>(path.at(1.0).position, Point(0, 0, 0.5)) <= tolerance);    // between the two
  CHECK(distance<Scalar>(path.at(1.5).position, Point(0, 0, 0.25)) <= tolerance);   // bottom of the second
  CHECK(distance<Scalar>(path.at(0.25).velocity, Point(0, 0, Scalar(-0.25 * pi))) <= tolerance);
  CHECK(path.end() == Point(0, 0, 0.5));
}

TEST_CASE("a minimum-jerk line starts and ends at rest and is fastest in the middle", "[trajectory]") {
  // Yardstick: Flash and Hogan's polynomial; s(1/2) = 1/2, s'(1/2) = 15/8, s(1/4) = 106/1024.
  auto const path = Trajectory<double>::start({0, 0, 0}).line({1, 0, 0}, 2.0, Pace::minimum_jerk);
  CHECK(path.at(0.0).velocity.norm() == 0.0);
  CHECK(path.at(2.0 - 1e-9).velocity.norm() < 1e-15);
  CHECK(std::abs(path.at(1.0).position.x() - 0.5) <= 1e-15);
  CHECK(std::abs(path.at(1.0).velocity.x() - 15.0 / 8.0 / 2.0) <= 1e-15);
  CHECK(std::abs(path.at(0.5).position.x() - 106.0 / 1024.0) <= 1e-15);
}

TEMPLATE_TEST_CASE("the velocity is the derivative of the position, and the path never jumps", "[trajectory]", PALPATE_TEST_SCALARS) {
  // Yardstick: central differences. Their error is h²/6 |x'''| + ε |x| / h; |x'''| stays below 5 m/s³ here
  // (tap: (4π)³ 0.0025; minimum jerk: 60 · 0.03).
  using Scalar = TestType;
  double const epsilon = std::numeric_limits<Scalar>::epsilon();
  double const h = std::cbrt(epsilon * 0.03);
  double const tolerance = h * h / 6.0 * 5.0 + 4.0 * epsilon * 0.04 / h;
  auto const path = stroke<Scalar>();
  CHECK(path.duration() == 4.5);
  double worst = 0.0;
  for (int i = 0; i < 900; ++i) {
    double const t = 0.0025 + i * 0.005;   // never on a joint
    if (std::abs(t * 2.0 - std::round(t * 2.0)) < 4.0 * h) continue;
    Vector3<double> const ahead = path.at(t + h).position.template cast<double>();
    Vector3<double> const behind = path.at(t - h).position.template cast<double>();
    worst = std::max(worst, ((ahead - behind) / (2.0 * h) - path.at(t).velocity.template cast<double>()).norm());
  }
  INFO("tolerance " << tolerance);
  CHECK(worst <= tolerance);

  double largest_step = 0.0;
  for (int i = 0; i < 5000; ++i)
    largest_step = std::max(largest_step, double((path.at((i + 1) * 1e-3).position - path.at(i * 1e-3).position).norm()));
  CHECK(largest_step <= 5.93e-5);   // the fastest piece is the minimum-jerk line: 15/8 · √(0.03² + 0.01²) m/s over 1 ms
}

TEST_CASE("before the start and from the end on the path rests; at a joint the later speed counts", "[trajectory]") {
  auto const path = Trajectory<double>::start({0, 0, 0}).line({1, 0, 0}, 1.0).line({1, 2, 0}, 1.0);
  for (double const t : {-1.0, -1e-300, -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(path.at(t).position.isZero(0.0));
    CHECK(path.at(t).velocity.isZero(0.0));
  }
  for (double const t : {2.0, 1e300, std::numeric_limits<double>::infinity()}) {
    CHECK(path.at(t).position == Vector3<double>(1, 2, 0));
    CHECK(path.at(t).velocity.isZero(0.0));
  }
  CHECK(path.at(0.0).velocity == Vector3<double>(1, 0, 0));
  CHECK(path.at(1.0).velocity == Vector3<double>(0, 2, 0));

  auto const point = Trajectory<double>::start({4, 5, 6});
  CHECK(point.duration() == 0.0);
  CHECK(point.at(0.0).position == Vector3<double>(4, 5, 6));
}

TEMPLATE_TEST_CASE("paths are joined end to end, also a path with itself", "[trajectory]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  using Point = Vector3<Scalar>;
  auto loop = Trajectory<Scalar>::start({0, 0, 0}).line({1, 0, 0}, 1.0).line({0, 0, 0}, 3.0);
  loop.then(loop);
  CHECK(loop.duration() == 8.0);
  CHECK(distance<Scalar>(loop.at(4.5).position, Point(0.5, 0, 0)) <= 4 * std::numeric_limits<Scalar>::epsilon());

  auto const far = Trajectory<Scalar>::start({0, 1, 0}).hold(1.0);
  CHECK_THROWS_AS(loop.then(far), InvalidArgument);
  CHECK(unsaid(message_of([&] { loop.then(far); }), "begins 1 m from the end") == "");
  CHECK(loop.duration() == 8.0);
  CHECK(loop.then(far.moved(Point(0, -1, 0))).duration() == 9.0);
}

TEMPLATE_TEST_CASE("a moved path moves every sample, velocities only by the rotation", "[trajectory]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  Scalar const tolerance = 32 * std::numeric_limits<Scalar>::epsilon();
  auto const path = stroke<Scalar>();
  Matrix<Scalar, 3, 3> const rotation =
      Eigen::AngleAxis<Scalar>(Scalar(0.7), Vector3<Scalar>(1, -2, 3).normalized()).toRotationMatrix();
  Vector3<Scalar> const shift(Scalar(0.1), Scalar(-0.2), Scalar(0.3));
  auto const moved = path.moved(rotation, shift);
  for (int i = -5; i < 500; ++i) {
    auto const here = path.at(i * 0.01);
    auto const there = moved.at(i * 0.01);
    REQUIRE(distance<Scalar>(there.position, rotation * here.position + shift) <= tolerance);
    REQUIRE(distance<Scalar>(there.velocity, rotation * here.velocity) <= tolerance);
  }
}

TEST_CASE("pieces that make no sense are refused and leave the path as it was", "[trajectory]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  double const infinity = std::numeric_limits<double>::infinity();
  auto path = Trajectory<double>::start({0, 0, 0}).line({1, 0, 0}, 1.0);
  for (double const seconds : {0.0, -1.0, nan, infinity}) {
    CHECK_THROWS_AS(path.hold(seconds), InvalidArgument);
    CHECK_THROWS_AS(path.line({2, 0, 0}, seconds), InvalidArgument);
    CHECK_THROWS_AS(path.arc({0, 0, 0}, {0, 0, 1}, 1.0, seconds), InvalidArgument);
    CHECK_THROWS_AS(path.tap({0, 0, 1}, seconds), InvalidArgument);
  }
  CHECK_THROWS_AS(Trajectory<double>::start({nan, 0, 0}), InvalidArgument);
  CHECK_THROWS_AS(path.line({0, infinity, 0}, 1.0), InvalidArgument);
  CHECK_THROWS_AS(path.arc({0, 0, nan}, {0, 0, 1}, 1.0, 1.0), InvalidArgument);
  CHECK_THROWS_AS(path.arc({0, 0, 0}, {0, 0, 0}, 1.0, 1.0), InvalidArgument);
  CHECK_THROWS_AS(path.arc({0, 0, 0}, {0, 0, 1}, nan, 1.0), InvalidArgument);
  CHECK_THROWS_AS(path.tap({0, 0, nan}, 1.0), InvalidArgument);
  CHECK_THROWS_AS(path.tap({0, 0, 1}, 1.0, 0), InvalidArgument);
  CHECK(unsaid(message_of([&] { path.hold(-1.0); }), "hold: it takes -1 s") == "");
  CHECK_THROWS_AS(path.hold(1e-20), InvalidArgument);   // vanishes beside the second before
  CHECK(path.duration() == 1.0);
  CHECK(path.end() == Vector3<double>(1, 0, 0));
}

TEST_CASE("sampling a path does not allocate", "[trajectory][realtime]") {
  auto const path = stroke<double>();
  REQUIRE(palpate_test::trap_works());
  double sum = 0.0;
  palpate_test::AllocationCount const allocations;
  for (int i = 0; i < 10000; ++i) sum += path.at(i * 1e-3).position.x();
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(std::isfinite(sum));
}

// By hand: 5 cm/s, then 2 cm/s.
TEST_CASE("a path through points in time is where they say, when they say", "[trajectory]") {
  TimedPoint<double> const points[] = {{0.5, {0, 0, 0.02}}, {0.9, {0, 0, 0}}, {1.9, {0.02, 0, 0}}};
  auto const path = Trajectory<double>::through(points);
  CHECK(path.at(0.2).position.isApprox(Vector3<double>(0, 0, 0.02)));
  CHECK(path.at(0.7).position.isApprox(Vector3<double>(0, 0, 0.01)));
  CHECK(path.at(0.7).velocity.isApprox(Vector3<double>(0, 0, -0.05)));
  CHECK(path.at(1.4).position.isApprox(Vector3<double>(0.01, 0, 0)));
  CHECK(path.at(5.0).position.isApprox(Vector3<double>(0.02, 0, 0)));
  ScriptedDevice<double> device({{0.0, {0, 0, 0.02}}, {0.4, {0, 0, 0}}});
  DeviceState<double> state;
  for (int k = 0; k <= 200; ++k) device.read(state);
  CHECK(state.position.z() == Approx(0.01));
  CHECK_THROWS_AS(Trajectory<double>::through({}), InvalidArgument);
  TimedPoint<double> const back[] = {{0.5, {0, 0, 0.02}}, {0.5, {0, 0, 0}}};
  CHECK(message_of([&] { Trajectory<double>::through(back); }).find("point 1 has the time 0.5 s") != std::string::npos);
}
