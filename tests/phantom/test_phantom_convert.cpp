// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "fake_libhd/device.hpp"

#include <palpate/device/phantom/servo.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

using namespace palpate;
using namespace palpate::detail::phantom;
using palpate::detail::nearest_rotation;

namespace {

NativeState resting_stylus() {
  NativeState native;
  native.transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  return native;
}

}  // namespace

TEST_CASE("C10-M3: units and axes of a PHANToM, written out", "[phantom]") {
  // Yardstick: millimetres, radians and the column-major layout by hand; a quarter turn about x sends y to z.
  NativeState native = resting_stylus();
  native.position = {12.0, -34.5, 7.25};
  native.velocity = {100.0, 0.0, -250.0};
  native.angular_velocity = {0.5, -1.0, 2.0};
  native.buttons = 2;
  native.transform = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 12.0, -34.5, 7.25, 1};
  DeviceState<double> state;
  REQUIRE(order_of(native) == TransformOrder::by_columns);
  REQUIRE(convert(native, TransformOrder::by_columns, state));
  CHECK((state.position - Vector3<double>(0.012, -0.0345, 0.00725)).norm() <= 1e-17);
  CHECK((state.velocity - Vector3<double>(0.1, 0.0, -0.25)).norm() <= 1e-16);
  CHECK(state.angular_velocity == Vector3<double>(0.5, -1.0, 2.0));
  CHECK(state.buttons == 2);
  double const half = std::sqrt(0.5);
  CHECK((state.orientation.coeffs() - Eigen::Vector4d(half, 0.0, 0.0, half)).norm() <= 1e-15);
  CHECK((state.orientation * Vector3<double>::UnitY() - Vector3<double>::UnitZ()).norm() <= 1e-15);

  CHECK(force_to_native({1.0, -2.0, 3.3}) == std::array<double, 3>{1.0, -2.0, 3.3});
  auto const torque = torque_to_native({0.188, 0.0, -0.001});
  CHECK(torque[0] == Approx(188.0).epsilon(1e-15));
  CHECK(torque[2] == Approx(-1.0).epsilon(1e-15));
}

TEST_CASE("a transform that lies by rows is noticed", "[phantom]") {
  NativeState native = resting_stylus();
  CHECK(order_of(native) == std::nullopt);   // at the origin there is nothing to tell them by
  native.position = {1.0, 2.0, 3.0};
  CHECK(order_of(native) == std::nullopt);   // neither
  native.transform = {1, 0, 0, 1.0, 0, 0, -1, 2.0, 0, 1, 0, 3.0, 0, 0, 0, 1};
  REQUIRE(order_of(native) == TransformOrder::by_rows);
  DeviceState<double> state;
  REQUIRE(convert(native, TransformOrder::by_rows, state));
  CHECK((state.orientation * Vector3<double>::UnitY() - Vector3<double>::UnitZ()).norm() <= 1e-15);
}

TEST_CASE("a matrix that is almost a rotation becomes the nearest one", "[phantom]") {
  // Yardstick: R S with S symmetric and positive has the polar factor R.
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int k = 0; k < 200; ++k) {
    Vector3<double> const axis(uniform(generator), uniform(generator), uniform(generator));
    Matrix<double, 3, 3> const rotation = Eigen::AngleAxisd(std::numbers::pi * uniform(generator), axis.normalized()).toRotationMatrix();
    Matrix<double, 3, 3> stretch = Matrix<double, 3, 3>::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) stretch(i, j) = stretch(j, i) = stretch(i, j) + 0.01 * uniform(generator);
    auto const found = nearest_rotation<double>(rotation * stretch);
    REQUIRE(found.has_value());
    REQUIRE((*found - rotation).norm() <= 1e-14);
  }
  CHECK_FALSE(nearest_rotation<double>(-Matrix<double, 3, 3>::Identity()).has_value());
  CHECK_FALSE(nearest_rotation<double>(Matrix<double, 3, 3>::Zero()).has_value());
  CHECK_FALSE(nearest_rotation<double>(2.0 * Matrix<double, 3, 3>::Identity()).has_value());
  CHECK_FALSE(nearest_rotation<double>(Matrix<double, 3, 3>::Constant(std::numeric_limits<double>::quiet_NaN())).has_value());
}

TEST_CASE("a state that is not finite changes nothing, an orientation that is none stays as it was", "[phantom]") {
  NativeState native = resting_stylus();
  DeviceState<double> state;
  state.position.setConstant(0.25);
  state.orientation = Eigen::Quaternion<double>(Eigen::AngleAxisd(1.0, Vector3<double>::UnitX()));
  auto const before = state;
  native.position[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(convert(native, TransformOrder::by_columns, state));
  CHECK(state.position == before.position);
  native = resting_stylus();
  native.velocity[2] = std::numeric_limits<double>::infinity();
  CHECK_FALSE(convert(native, TransformOrder::by_columns, state));
  native = resting_stylus();
  native.transform.fill(0.0);
  CHECK(convert(native, TransformOrder::by_columns, state));
  CHECK(state.position.isZero(0.0));
  CHECK(state.orientation.coeffs() == before.orientation.coeffs());
}

TEST_CASE("the hand behind the stand-in has the kinematics of a Touch", "[phantom]") {
  // Yardstick: the pose in the inkwell that is on record, and zero angles; the way back by the way there.
  using fake_libhd::Kinematics, fake_libhd::operator+, fake_libhd::operator*;
  auto const inkwell = Kinematics::tip({0.0, 0.26889, -0.370813});
  CHECK(std::abs(inkwell[0]) <= 1e-12);
  CHECK(inkwell[1] == Approx(-65.5107).margin(2e-4));
  CHECK(inkwell[2] == Approx(-88.1142).margin(2e-4));
  CHECK(Kinematics::tip({0.0, 0.0, 0.0})[1] == Approx(-110.0));
  for (double const x : {-70.0, 0.0, 60.0})
    for (double const y : {-50.0, 0.0, 50.0}) {
      auto const back = Kinematics::tip(Kinematics::joints({x, y, 20.0}));
      CHECK(fake_libhd::norm(back + -1.0 * fake_libhd::Triple{x, y, 20.0}) <= 1e-10);
    }
}
