// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"

#include <palpate/device/mouse_device.hpp>
#include <palpate/testing/device_laws.hpp>

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>
#include <utility>

using namespace palpate;

namespace {

template <class Device>
DeviceState<double> read_mouse(Device& device, int ticks) {
  DeviceState<double> state;
  for (int tick = 0; tick < ticks; ++tick) device.read(state);
  return state;
}

}  // namespace

TEST_CASE("pixels, wheel and keys go where the mapping says", "[device]") {
  // Yardstick: sums by hand; a camera that looks along +x, with y to its left.
  Mouse mouse({.mapping = {.right = {0, -2, 0}, .up = {0, 0, 3}, .depth = {1, 0, 0}, .per_pixel = 1e-4, .per_step = 1e-3}, .start = {0.1, 0.2, 0.3}});
  MouseDevice<double> device(mouse);
  CHECK((read_mouse(device, 1).position - Vector3<double>(0.1, 0.2, 0.3)).norm() <= 1e-16);
  mouse.move(50, 20);       // 5 mm to the right, 2 mm down
  mouse.turn_wheel(-3);     // 3 mm to the user
  CHECK((read_mouse(device, 3000).position - Vector3<double>(0.097, 0.195, 0.298)).norm() <= 1e-12);
  mouse.set_speed(0, 0.02, 0);
  read_mouse(device, 500);
  mouse.set_speed(0, 0, 0);
  CHECK((read_mouse(device, 3000).position - Vector3<double>(0.097, 0.195, 0.308)).norm() <= 1e-12);
  mouse.set_mapping({.per_pixel = 1e-3});   // the camera turns: what was moved stays
  mouse.move(1, 0);
  CHECK((read_mouse(device, 3000).position - Vector3<double>(0.098, 0.195, 0.308)).norm() <= 1e-12);
  mouse.set_buttons(0xffu);
  CHECK(read_mouse(device, 1).buttons == 7u);
}

TEMPLATE_TEST_CASE("a step of the mouse arrives as a critically damped filter says", "[device]", PALPATE_TEST_SCALARS) {
  // Yardstick: x = d (1 − (1 + ωt) e^(−ωt)), v = d ω² t e^(−ωt).
  using Scalar = TestType;
  Mouse mouse({.smoothing = 3.0});
  MouseDevice<Scalar> device(mouse);
  DeviceState<Scalar> state;
  device.read(state);
  mouse.move(1000, 0);   // 0.2 m
  double const omega = 2.0 * std::numbers::pi * 3.0, tolerance = 2000 * std::numeric_limits<Scalar>::epsilon();
  double fastest = 0.0, last = 0.0;
  for (int tick = 1; tick < 1500; ++tick) {
    device.read(state);
    double const t = tick / 1000.0, decay = std::exp(-omega * t);
    REQUIRE(std::abs(double(state.position.x()) - 0.2 * (1 - (1 + omega * t) * decay)) <= 0.2 * tolerance);
    REQUIRE(std::abs(double(state.velocity.x()) - 0.2 * omega * omega * t * decay) <= 4 * tolerance);
    fastest = std::max(fastest, std::abs(double(state.velocity.x()) - last));
    last = double(state.velocity.x());
  }
  CHECK(fastest <= 1.001 * 0.2 * omega * omega / 1000.0 + 4 * tolerance);   // the velocity has no step
}

TEST_CASE("at the edge of the workspace the way back begins at once", "[device]") {
  Mouse mouse({.workspace = {.lower = {-0.05, -0.05, -0.05}, .upper = {0.05, 0.05, 0.05}, .provenance = Provenance::guessed}});
  MouseDevice<double> device(mouse);
  mouse.move(10000, 0);   // 2 m
  CHECK(read_mouse(device, 3000).position.x() == Approx(0.05));
  mouse.move(-50, 0);     // 1 cm
  CHECK(read_mouse(device, 3000).position.x() == Approx(0.04));
  mouse.set_speed(0, 1.0, 0);
  CHECK(read_mouse(device, 3000).position.y() == Approx(0.05));
  mouse.set_speed(0, -0.01, 0);
  CHECK(read_mouse(device, 1000).position.y() < 0.0425);
  Mouse outside({.start = {1, 0, 0}, .workspace = mouse.options().workspace});
  MouseDevice<double> inside(outside);
  CHECK(read_mouse(inside, 1).position.x() == 0.05);
}

TEST_CASE("the arrow is the limited force at the tip", "[device]") {
  Mouse mouse({.start = {0.01, 0, 0}, .max_force = 2.0});
  MouseDevice<double> device(mouse);
  CHECK(mouse.arrow().force.isZero(0.0));
  read_mouse(device, 1);
  device.write({.force = {0, 0, 4.0}});
  CHECK(mouse.arrow().force == Vector3<double>(0, 0, 2.0));
  CHECK(mouse.arrow().position == Vector3<double>(0.01, 0, 0));
}

TEST_CASE("input that is no number changes nothing", "[device]") {
  Mouse mouse;
  MouseDevice<double> device(mouse);
  double const nan = std::numeric_limits<double>::quiet_NaN();
  mouse.move(nan, 0);
  mouse.turn_wheel(std::numeric_limits<double>::infinity());
  mouse.set_speed(0, nan, 0);
  CHECK(read_mouse(device, 100).position.isZero(0.0));
}

TEST_CASE("a window's thread and a servo's thread share a mouse", "[device][threads]") {
  // Yardstick: 20000 moves of one pixel add up to all of them, whenever they are seen; and the position never goes back.
  Mouse mouse({.mapping = {.per_pixel = 1e-5}, .smoothing = 20.0});
  MouseDevice<double> device(mouse);
  std::atomic<bool> done = false;
  bool forward = true, drawn_forward = true;
  std::thread servo([&] {
    DeviceState<double> state;
    double before = 0.0;
    for (int after = 0; after < 3000; after += done ? 1 : 0) {
      device.read(state);
      device.write({.force = state.position});
      forward = forward && state.position.x() >= before - 1e-12;
      before = state.position.x();
    }
  });
  double drawn = 0.0;
  for (int k = 0; k < 20000; ++k) {
    mouse.move(1, 0);
    auto const arrow = mouse.arrow();
    drawn_forward = drawn_forward && arrow.position == arrow.force && arrow.force.x() >= drawn - 1e-12;
    drawn = arrow.force.x();
  }
  done = true;
  servo.join();
  CHECK(forward);
  CHECK(drawn_forward);
  CHECK(mouse.arrow().position.x() == Approx(0.2).epsilon(1e-9));
}

TEMPLATE_TEST_CASE("a mouse keeps the laws of a device and does not allocate", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  Mouse mouse;
  MouseDevice<Scalar> device(mouse);
  mouse.set_speed(0.02, 0.01, 0);
  CHECK(testing::to_text(testing::check_device<Scalar>(device, {.force = 1.0})) == "");
  DeviceState<Scalar> state;
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  testing::serve(device, state, 100);
  mouse.move(3, 4);
  mouse.set_buttons(1);
  long const count = allocations.count();
  CHECK(count == 0);
}

TEST_CASE("a mouse that was moved away is heard by nobody, its device goes on with the other", "[device]") {
  Mouse mouse({.mapping = {.per_pixel = 1e-3}});
  MouseDevice<double> first(mouse);
  Mouse other = std::move(mouse);
  CHECK_FALSE(static_cast<bool>(mouse));   // NOLINT: what is left of it is what is tested
  mouse.move(1000, 1000);
  mouse.turn_wheel(5);
  mouse.set_speed(1, 1, 1);
  mouse.set_buttons(7);
  CHECK(mouse.arrow().force.isZero(0.0));
  CHECK_THROWS_AS(MouseDevice<double>(mouse), InvalidArgument);
  other.move(1, 0);
  MouseDevice<double> device = std::move(first);
  CHECK((read_mouse(device, 3000).position - Vector3<double>(0.001, 0, 0)).norm() <= 1e-12);
  DeviceState<double> state;
  state.buttons = 9;
  CHECK(first.read(state) == DeviceStatus::disconnected);
  CHECK(first.write({}) == DeviceStatus::disconnected);
  CHECK(state.buttons == 9);
}

TEST_CASE("mice that make no sense are refused", "[device]") {
  using palpate_test::message_of;
  using palpate_test::unsaid;
  auto const refusal = [](MouseOptions const& options) {
    return message_of([&] {
      Mouse mouse(options);
      MouseDevice<double> device(mouse);
    });
  };
  CHECK(unsaid(refusal({.mapping = {.right = {0, 1, 0}}}), "MouseMapping", "do not span") == "");
  CHECK(unsaid(refusal({.mapping = {.up = {0, 0, 0}}}), "do not span") == "");
  CHECK(unsaid(refusal({.mapping = {.per_pixel = std::numeric_limits<double>::infinity()}}), ".per_pixel is inf") == "");
  CHECK(unsaid(refusal({.smoothing = 0.0}), ".smoothing is 0 Hz") == "");
  CHECK(unsaid(refusal({.rate = -1.0}), "rate is -1 Hz") == "");
  CHECK(unsaid(refusal({.buttons = 40}), ".buttons is 40") == "");
  Mouse mouse;
  MouseDevice<double> first(mouse);
  CHECK(unsaid(message_of([&] { MouseDevice<double> second(mouse); }), "has a device already") == "");
}
