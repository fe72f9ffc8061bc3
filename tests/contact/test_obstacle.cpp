// SPDX-License-Identifier: MIT
// An obstacle on its way. Yardsticks: distances between its vertices; where a body that turns evenly about an axis is, by hand; differences of positions.
#include "catch.hpp"
#include "contact/blocks.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/box.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;
using namespace palpate_test;

namespace {

template <class S>
Eigen::Quaternion<S> any_turn(Random& random) {
  auto const one = [&] { return random.uniform(S(-1), S(1)); };
  S const w = one(), x = one(), y = one(), z = one();
  return Eigen::Quaternion<S>(w, x, y, z).normalized();
}

}  // namespace

TEMPLATE_TEST_CASE("an obstacle that turns stays as large as it is, and turns evenly", "[contact]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  using V = Vector3<S>;
  S const eps = std::numeric_limits<S>::epsilon();
  auto body = table<S>(S(0.02));
  Matrix3X<S> const rest = body.positions();
  V const to(S(0.03), S(-0.02), S(0.05));
  S const angle = S(3), h = S(1e-3);
  Eigen::AngleAxis<S> const whole(angle, V(1, 2, -2).normalized());
  body.move_to({.position = to, .orientation = Eigen::Quaternion<S>(whole)}, S(0.1));
  S worst = 0, worst_speed = 0;
  for (int k = 1; k < 100; ++k) {
    Matrix3X<S> const before = body.positions();
    body.step(h);
    S const share = S(k) / 100;
    Eigen::AngleAxis<S> const part(share * angle, whole.axis());
    for (int i = 0; i < body.size(); ++i) {
      V const arm = part * V(rest.col(i)), expected = share * to + arm;
      worst = std::max(worst, (V(body.positions().col(i)) - expected).norm());
      V const speed = to / S(0.1) + (angle / S(0.1) * whole.axis()).cross(arm);
      worst_speed = std::max(worst_speed, (V(body.velocities().col(i)) - speed).norm());
    }
  }
  CHECK(worst < 100 * eps);          // m; of a table 0.3 m wide
  CHECK(worst_speed < 5000 * eps);   // m/s, of 9
  body.step(h);
  CHECK((body.positions() - ((whole.toRotationMatrix() * rest).colwise() + to)).cwiseAbs().maxCoeff() < 4 * eps);
  CHECK(body.velocities().cwiseAbs().maxCoeff() == 0);
  body.step(h);
  CHECK(body.velocities().cwiseAbs().maxCoeff() == 0);
}

TEST_CASE("a moving obstacle goes on as it did after it is restored, to the byte, and from where it is told to go elsewhere", "[contact]") {
  Random random(Seed{1});
  int differ = 0;
  double stretched = 0, jumped = 0;
  for (int trial = 0; trial < 10; ++trial) {
    auto const any = [&](double most) { return Vector3<double>(random.uniform(-most, most), random.uniform(-most, most), random.uniform(-most, most)); };
    Vector3<double> const low = any(0.3);
    Obstacle<double> body(make_box<double>(low, low + Vector3<double>(0.1, 0.2, 0.15)));
    double const across = (body.positions().col(0) - body.positions().col(body.size() - 1)).norm();
    for (int way = 0; way < 3; ++way) {
      Matrix3X<double> const from = body.positions();
      body.move_to({.position = any(2), .orientation = any_turn<double>(random)}, 0.1);
      jumped = std::max(jumped, (body.positions() - from).cwiseAbs().maxCoeff());
      for (int k = 0; k < 60; ++k) {   // not all of the way
        body.step(1e-3);
        stretched = std::max(stretched, std::abs((body.positions().col(0) - body.positions().col(body.size() - 1)).norm() - across));
        auto goes_on = body, restored = body;
        auto const state = body.save();
        restored.step(1e-3), restored.restore(state);
        differ += restored.positions() != body.positions() || restored.velocities() != body.velocities();
        for (int j = 0; j < 5; ++j) goes_on.step(1e-3), restored.step(1e-3);
        differ += restored.positions() != goes_on.positions() || restored.velocities() != goes_on.velocities();
      }
    }
  }
  CHECK(differ == 0);
  CHECK(stretched < 1e-14);
  CHECK(jumped < 1e-14);
}
