// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"

#include <palpate/core/random.hpp>
#include <palpate/device/session.hpp>
#include <palpate/device/simulated_touch.hpp>
#include <palpate/testing/device_laws.hpp>

#include <cmath>
#include <limits>
#include <string>

using namespace palpate;

namespace {

Vector3<double> millimetres(double x, double y, double z) { return Vector3<double>(x, y, z) / 1000.0; }

/// Joints within all limits.
template <class Scalar>
Vector3<Scalar> some_joints(TouchKinematics<Scalar> const& arm, Random& random) {
  for (;;) {
    Vector3<Scalar> joints;
    for (int joint = 0; joint < 3; ++joint) joints[joint] = random.uniform(arm.lower[joint], arm.upper[joint]);
    if (arm.within_limits(joints)) return joints;
  }
}

}  // namespace

TEST_CASE("the arm's poses are those that a device reports", "[device]") {
  // Yardstick: poses recorded from a device: (0, −65.5107, −88.1142) mm in the inkwell; the driver's own offsets at zero.
  TouchKinematics<double> const arm;
  CHECK((arm.forward({0, 0, 0}) - millimetres(0, -110, -35)).norm() <= 1e-15);
  CHECK((arm.forward(arm.inkwell()) - millimetres(0, -65.5106, -88.1142)).norm() <= 1e-7);
  CHECK((arm.forward(arm.inkwell()) - millimetres(0, -65.5107, -88.1142)).norm() <= 1e-7);
  CHECK((arm.inverse(millimetres(0, -65.5106, -88.1142)).value() - arm.inkwell()).norm() <= 1e-6);
  // By hand: a quarter turn of the waist puts the tip of (0, 0, 0), 133.35 mm in front of the axis, to its side.
  CHECK((arm.forward({std::acos(-1.0) / 2, 0, 0}) - millimetres(-133.35, -110, -35 - 133.35)).norm() <= 1e-15);
  CHECK(arm.within_limits(arm.inkwell()));
}

TEMPLATE_TEST_CASE("inverse kinematics take the tip back to its joints", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  TouchKinematics<Scalar> const arm;
  Random random(Seed{5});
  Scalar const epsilon = std::numeric_limits<Scalar>::epsilon();
  for (int k = 0; k < 2000; ++k) {
    Vector3<Scalar> const joints = some_joints(arm, random), tip = arm.forward(joints);
    auto const found = arm.inverse(tip);
    REQUIRE(found.has_value());
    REQUIRE((*found - joints).norm() <= 100 * epsilon);
    REQUIRE((arm.forward(arm.nearest(tip)) - tip).norm() <= 20 * epsilon);
  }
}

TEST_CASE("the Jacobian is the derivative, and presses with what the motors turn", "[device]") {
  // Yardsticks: central differences, error h²/6 · 0.27; virtual work τ·dθ = F·dx.
  TouchKinematics<double> const arm;
  Random random(Seed{6});
  for (int k = 0; k < 200; ++k) {
    Vector3<double> const joints = some_joints(arm, random);
    Matrix<double, 3, 3> numeric;
    double const h = 1e-5;
    for (int joint = 0; joint < 3; ++joint) {
      Vector3<double> const step = h * Vector3<double>::Unit(joint);
      numeric.col(joint) = (arm.forward(joints + step) - arm.forward(joints - step)) / (2 * h);
    }
    REQUIRE((arm.jacobian(joints) - numeric).norm() <= 1e-10);
    REQUIRE(std::abs(numeric.determinant()) >= 1e-5);   // nowhere singular within the limits
    Vector3<double> const force(random.normal(), random.normal(), random.normal()), turn(random.normal(), random.normal(), random.normal());
    REQUIRE(std::abs(arm.torques(joints, force).dot(turn) - force.dot(numeric * turn)) <= 1e-8);
  }
}

TEST_CASE("the whole workspace is within reach, what is not has no joints", "[device]") {
  TouchKinematics<double> const arm;
  auto const box = SimulatedTouch<double>().capabilities().workspace;
  CHECK((box.size() - millimetres(160, 120, 70)).norm() <= 1e-15);
  for (double a = 0; a <= 1.0; a += 0.25)
    for (double b = 0; b <= 1.0; b += 0.25)
      for (double c = 0; c <= 1.0; c += 0.25) {
        auto const joints = arm.inverse(box.lower + Vector3<double>(a, b, c).cwiseProduct(box.size()));
        REQUIRE(joints.has_value());
        REQUIRE(arm.within_limits(*joints));
      }
  CHECK_FALSE(arm.inverse({0, 0, 0.5}).has_value());                                  // longer than both links
  CHECK_FALSE(arm.inverse(millimetres(0, 0, -35 - 133.35)).has_value());              // on the waist's axis
  CHECK_FALSE(arm.inverse({std::numeric_limits<double>::quiet_NaN(), 0, 0}).has_value());
  CHECK(arm.nearest({std::numeric_limits<double>::quiet_NaN(), 0, 0}) == arm.inkwell());
  Random random(Seed{8});
  for (int k = 0; k < 2000; ++k)
    REQUIRE(arm.within_limits(arm.nearest(Vector3<double>(random.normal(), random.normal(), random.normal()) * 0.2), 1e-12));
}

TEST_CASE("the tip of a simulated Touch stays where its joints can go, and slides along the end", "[device]") {
  // A hand that pulls out of reach, up and to the side: the arm is stretched to its joint limits.
  TouchKinematics<double> const arm;
  SimulatedTouch<double> touch(Trajectory<double>::start({0, 0, 0}).line({-0.3, 0.2, 0.3}, 1.0).hold(1.0), {.hand = firm_hand()});
  DeviceSession session(touch);
  DeviceState<double> state, before;
  touch.read(before);
  double worst = 0.0;
  for (int tick = 1; tick < 2000; ++tick) {
    touch.write({});
    touch.read(state);
    auto const joints = arm.inverse(touch.hand().position());
    REQUIRE(joints.has_value());
    for (int joint = 0; joint < 3; ++joint) REQUIRE(((*joints)[joint] >= arm.lower[joint] - 1e-6 && (*joints)[joint] <= arm.upper[joint] + 1e-6));
    worst = std::max(worst, (state.position - before.position).norm());
    before = state;
  }
  CHECK(worst <= 0.003);   // no leap
  CHECK(state.velocity.norm() <= 0.02);
  CHECK(touch.joints()[2] == Approx(1.25).epsilon(1e-6));   // one of them at its end
}

TEST_CASE("velocities fit positions, and buttons are two", "[device]") {
  SimulatedTouch<double> touch(Trajectory<double>::start({0, 0, 0}).sine({0.03, 0.01, 0}, 1.0, 5.0));
  CHECK(testing::to_text(testing::check_device(touch, {.ticks = 4000, .force = 0.5})) == "");
  DeviceSession session(touch);
  DeviceState<double> state;
  touch.set_buttons(0xffu);
  touch.read(state);
  CHECK(state.buttons == 3u);
  CHECK(touch.description().model == "simulated Touch");
}

TEST_CASE("the motors warm up with the square of the force and trip where the first order says", "[device]") {
  // Yardstick: Θ(t) = (F/0.88)² (1 − e^(−t/τ)); 3.3 N pass 1.2 after −τ ln(1 − 1.2/14.0625) = 0.892 s, 0.88 N never do.
  SimulatedTouch<double> touch;
  DeviceState<double> state;
  {
    DeviceSession session(touch);
    int tripped = 0;
    for (int tick = 0; tick < 2000 && tripped == 0; ++tick) {
      if (touch.read(state) == DeviceStatus::fault) tripped = tick;
      touch.write({.force = {0, 0, 30.0}});   // limited to 3.3 N
      if (tick == 500) CHECK(touch.temperature() == Approx(14.0625 * (1 - std::exp(-0.05))).epsilon(1e-12));
    }
    CHECK(std::abs(tripped - 892) <= 2);
    CHECK(touch.hand().last_wrench().force.isZero(0.0));
    CHECK(touch.write({.force = {0, 0, 1}}) == DeviceStatus::fault);
    auto const fault = touch.pop_fault();
    REQUIRE(fault.has_value());
    CHECK(std::string(fault->what) == "the motors are too warm");
    CHECK_FALSE(touch.pop_fault().has_value());
  }
  CHECK(touch.read(state) == DeviceStatus::disconnected);
  double const hot = touch.temperature();
  for (int tick = 0; tick < 10000; ++tick) touch.read(state);
  CHECK(touch.temperature() == Approx(hot * std::exp(-1.0)).epsilon(1e-9));
  DeviceSession session(touch);
  CHECK(touch.read(state) == DeviceStatus::ok);

  SimulatedTouch<double> steady;
  DeviceSession other(steady);
  bool usable = true;
  for (int tick = 0; tick < 100000; ++tick) {
    usable = usable && is_usable(steady.read(state));
    steady.write({.force = {0.88, 0, 0}});
  }
  CHECK(usable);
  CHECK(steady.temperature() == Approx(1.0).epsilon(1e-4));
}

TEST_CASE("without motors or without calibration nothing is felt", "[device]") {
  SimulatedTouch<double> touch({.calibrated = false});
  DeviceState<double> state;
  CHECK(touch.write({.force = {1, 0, 0}}) == DeviceStatus::disconnected);
  touch.open();
  touch.arm();
  touch.read(state);
  CHECK(touch.write({.force = {1, 0, 0}}) == DeviceStatus::ok);
  CHECK(touch.hand().last_wrench().force.isZero(0.0));
  CHECK(touch.calibration() == Calibration::needs_hand);
  touch.calibrate();
  CHECK(touch.calibration() == Calibration::needs_hand);
  // Yardstick: joints that are 0.1 rad off, through the forward kinematics.
  TouchKinematics<double> const arm;
  CHECK((state.position - arm.forward(arm.inverse({0, 0, 0}).value() + Vector3<double>::Constant(0.1))).norm() <= 1e-4);
  CHECK(state.position.norm() > 0.01);
  touch.hand().place(arm.forward(arm.inkwell()), {0, 0, 0});
  CHECK(touch.calibration() == Calibration::needs_update);
  touch.calibrate();
  CHECK(touch.calibration() == Calibration::good);
  touch.write({.force = {1, 0, 0}});
  CHECK(touch.hand().last_wrench().force.x() == 1.0);
  touch.disarm();
  touch.write({.force = {1, 0, 0}});
  CHECK(touch.hand().last_wrench().force.isZero(0.0));
}

TEMPLATE_TEST_CASE("a simulated Touch keeps the laws of a device and does not allocate", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  SimulatedTouch<Scalar> touch(Trajectory<Scalar>::start({0, 0, 0}).line({Scalar(0.4), 0, 0}, 1.0),
                               {.hand = firm_hand(), .tremor = {.amplitude = 1e-4}});
  CHECK(testing::to_text(testing::check_device<Scalar>(touch, {.force = 1.0})) == "");
  touch.open();
  DeviceState<Scalar> state;
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  testing::serve(touch, state, 500);
  long const count = allocations.count();
  CHECK(count == 0);
}

TEST_CASE("options of a Touch outside their range are refused", "[device]") {
  using palpate_test::message_of;
  using palpate_test::unsaid;
  auto const refusal = [](SimulatedTouchOptions const& options) { return message_of([&] { SimulatedTouch<double> touch(options); }); };
  CHECK(unsaid(refusal({.motor_time = 0.0}), "SimulatedTouch", ".motor_time is 0") == "");
  CHECK(unsaid(refusal({.motor_trip = 1.0}), ".motor_trip is 1", "more than 1") == "");
  CHECK(unsaid(refusal({.encoder_error = 2.0}), ".encoder_error is 2") == "");
  CHECK(unsaid(refusal({.rate = 0.0}), ".rate is 0") == "");
}
