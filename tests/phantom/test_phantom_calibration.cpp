// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "phantom/fake.hpp"

#include <palpate/device/phantom.hpp>
#include <palpate/device/session.hpp>

#include <string>

using namespace palpate;
using palpate_test::force_on;
using palpate_test::fresh_fake;
using palpate_test::message_of;
using palpate_test::unsaid;

TEST_CASE("a device that can calibrate itself does so before it is armed, with the motors off", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.calibration = 0x5001;
  fake.plan.jump = 50.0;
  bool const by_itself = GENERATE(true, false);
  PhantomDevice device({.calibrates_itself = by_itself});
  device.open();
  CHECK(device.calibration() == Calibration::needs_update);
  CHECK_NOTHROW(device.arm());
  CHECK(device.calibration() == Calibration::good);
  CHECK(fake.seen[0].calibrations == 1);
  CHECK(fake.seen[0].calibrations_under_force == 0);
  CHECK(fake.calibration_in_plain_locale.load());
  DeviceState<double> state;
  REQUIRE(device.read(state) == DeviceStatus::ok);
  CHECK(state.position.x() == Approx(1e-3 * fake.seen[0].position[0]).margin(1e-4));   // not 50 mm off
  CHECK(fake.violations == 0);
}

TEST_CASE("when the calibration is lost on the way the force goes, the position jumps, and the force comes back by the ramp", "[phantom]") {
  // Yardstick: no force in the ticks around the jump; afterwards at most F/100 a tick.
  auto& fake = fresh_fake();
  fake.plan.hand_is_held = true;
  fake.plan.jump = 50.0;
  fake.plan.drifts_at = 1500;
  PhantomDevice device({.ramp = 0.1});
  DeviceSession const session(device);
  DeviceState<double> state;
  double x = 0.0, before = 0.0;
  bool drifted = false, mended = false, full_again = false;
  for (int k = 0; k < 4000; ++k) {
    REQUIRE(device.read(state) == DeviceStatus::ok);
    double const force = force_on(fake).norm();
    if (k > 200 && std::abs(state.position.x() - x) > 0.03) {
      CHECK(force <= 0.011);
      (drifted ? mended : drifted) = true;
    }
    if (k > 0) REQUIRE(force - before <= 0.5 / 100 + 1e-12);
    full_again = mended && force == 0.5;
    x = state.position.x();
    before = force;
    device.write({.force = {0.0, 0.5, 0.0}});
  }
  CHECK(drifted);
  CHECK(mended);
  CHECK(full_again);
  CHECK(device.counts().jumps == 2);
  CHECK(fake.seen[0].calibrations == 1);
  CHECK(fake.seen[0].calibrations_under_force == 0);
  CHECK(fake.violations == 0);
}

TEST_CASE("a calibration that does not help is tried five times, a tenth of a second apart, and then the user is asked", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.calibration = 0x5001;
  fake.plan.calibration_helps = false;
  PhantomDevice device;
  device.open();
  for (std::uint64_t before = fake.seen[0].calibrations, k = 0; k < 30; ++k) {
    palpate_test::advance_fake(100);
    CHECK(fake.seen[0].calibrations - before <= 1);
    before = fake.seen[0].calibrations;
  }
  CHECK(fake.seen[0].calibrations == 5);
  CHECK(device.calibration() == Calibration::needs_hand);
  CHECK(unsaid(message_of([&] { device.arm(); }), "needs the user's hand", "move the tool slowly") == "");
  fake.plan.calibration_helps = true;
  palpate_test::advance_fake(3000);
  CHECK(fake.seen[0].calibrations == 5);
  device.calibrate();
  palpate_test::advance_fake(10);
  CHECK(fake.seen[0].calibrations == 6);
  CHECK_NOTHROW(device.arm());
  CHECK(fake.violations == 0);
}

TEST_CASE("a stylus that belongs into the inkwell is asked for", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.styles = 4;
  fake.plan.calibration = 0x5002;
  PhantomDevice device;
  device.open();
  CHECK(device.calibration() == Calibration::needs_hand);
  std::string const text = message_of([&] { device.arm(); });
  CHECK(unsaid(text, "the motors of the default PHANToM stay off", "needs the user's hand", "into the inkwell", "calibration_patience") == "");
  CHECK_FALSE(fake.seen[0].motors);
  DeviceState<double> state;
  CHECK(device.read(state) == DeviceStatus::ok);   // it can be looked at
  fake.plan.in_inkwell = true;
  CHECK(palpate_test::advance_fake(1000) == 1000);
  CHECK_NOTHROW(device.arm());
  CHECK(device.calibration() == Calibration::good);
  CHECK(fake.violations == 0);
}

TEST_CASE("arm waits for the user's hand as long as it was told to", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.styles = 4;
  fake.plan.calibration = 0x5002;
  PhantomDevice device({.calibration_patience = 0.5});
  device.open();
  auto const ticks = fake.ticks.load();
  CHECK_THROWS_AS(device.arm(), PhantomError);
  CHECK(fake.ticks - ticks >= 500);
}

TEST_CASE("encoders are reset while the user holds the pose, before the clock runs", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.styles = 1;
  fake.plan.calibration = 0x5002;
  {
    PhantomDevice device;
    device.open();
    CHECK(unsaid(message_of([&] { device.arm(); }), "right angles", "PhantomOptions::in_reset_pose") == "");
    device.calibrate();
    palpate_test::advance_fake(10);
    CHECK(fake.seen[0].calibrations == 0);   // not while it runs
  }
  PhantomDevice device({.in_reset_pose = true});
  device.open();
  CHECK_NOTHROW(device.arm());
  CHECK(fake.seen[0].calibrations == 1);
  CHECK(fake.violations == 0);
}

TEST_CASE("who wants force without calibration has to say so", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.styles = 4;
  fake.plan.calibration = 0x5002;
  PhantomDevice device({.calibrated_only = false});
  device.open();
  CHECK_NOTHROW(device.arm());
  CHECK(fake.seen[0].motors);
}
