// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "phantom/fake.hpp"

#include <palpate/device/phantom.hpp>
#include <palpate/device/session.hpp>

#include <limits>
#include <string>
#include <utility>

using namespace palpate;
using palpate_test::fresh_fake;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

/// The error of open().
std::string phantom_refusal(PhantomOptions const& options, PhantomProblem problem, int native_code = 0) {
  PhantomDevice device(options);
  try {
    device.open();
  } catch (PhantomError const& error) {
    CHECK(to_string(device.calibration()) == std::string("needs the user's hand"));   // nothing is open
    CHECK(static_cast<int>(error.problem()) == static_cast<int>(problem));
    CHECK(error.native_code() == native_code);
    CHECK(std::string(error.what()).find('\n') == std::string::npos);
    return error.what();
  }
  return "(it opened)";
}

}  // namespace

TEST_CASE("a PHANToM says what it is and can do", "[phantom]") {
  // Yardstick: the published numbers of a Touch, in SI units.
  auto& fake = fresh_fake();
  PhantomDevice device;
  CHECK(device.capabilities().rate == 1000.0);
  device.open();
  Capabilities const all = device.capabilities();
  CHECK(all.max_force == 3.3);
  CHECK(all.max_force.provenance == Provenance::reported);
  CHECK(all.continuous_force == 0.88);
  CHECK(all.max_stiffness == Approx(500.0));
  CHECK(all.max_stiffness.provenance == Provenance::guessed);   // its unit is
  CHECK(all.max_damping == Approx(3.0));
  CHECK(all.rate == 1000.0);
  CHECK(all.max_torque == 0.0);
  CHECK((all.workspace.size() - Vector3<double>(0.16, 0.12, 0.07)).norm() <= 1e-15);
  CHECK(all.reports_velocity);
  CHECK_FALSE(all.moves_a_hand);   // a virtual clock: nobody is there
  CHECK_NOTHROW(require_valid(all));
  CHECK(device.description().model == "Touch, not a real one");
  CHECK(device.description().vendor == "palpate");
  CHECK(device.name() == "");
  CHECK(device.library() == std::getenv("PALPATE_LIBHD"));
  CHECK(device.calibration() == Calibration::good);
  CHECK(fake.init_in_plain_locale.load());
  CHECK_FALSE(device.pop_fault().has_value());
  device.close();
  device.close();
  CHECK(fake.disables == 1);
  CHECK(fake.violations == 0);

  fake.plan.output_degrees = 6;
  fake.plan.rate_is_double = true;
  device.open();
  CHECK(device.capabilities().max_torque == Approx(0.188));
  CHECK(device.capabilities().rate == 1000.0);
  CHECK(device.capabilities().rate.provenance == Provenance::reported);
}

TEST_CASE("without a name it is the driver's default, under any of its usual names", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.takes_no_name = false;
  fake.plan.names[0] = "Default PHANToM";
  PhantomDevice device;
  device.open();
  CHECK(device.name() == "Default PHANToM");
  CHECK(fake.inits == 3);   // no name, the newer default, the older one
  PhantomDevice second;     // not for the second device: these could be the first one's
  CHECK(unsaid(message_of([&] { second.open(); }), "tried the default (no name): 0x303") == "");
  CHECK(fake.inits == 4);
  DeviceState<double> state;
  CHECK(device.read(state) == DeviceStatus::ok);   // the first goes on
  CHECK(fake.violations == 0);
}

TEST_CASE("a device that is named is that one or none", "[phantom]") {
  auto& fake = fresh_fake();
  unsigned const code = GENERATE(0x300u, 0x301u, 0x302u, 0x303u, 0x600u);
  fake.plan.names[1] = "Left Device";
  fake.plan.init_error = code;
  fake.plan.init_failures = code == 0x301 ? 2 : 1;   // the next one would open
  std::string const text = phantom_refusal({.device = "Left Device"}, code == 0x600 ? PhantomProblem::licence : PhantomProblem::device_not_found,
                                           static_cast<int>(code));
  CHECK(unsaid(text, "tried \"Left Device\": 0x", "is replaced by no other", "none for the driver's default") == "");
  CHECK(text.find("Default") == std::string::npos);
  CHECK(fake.inits == (code == 0x301 ? 2 : 1));
  PhantomDevice device({.device = "Left Device"});
  CHECK_NOTHROW(device.open());
  CHECK(device.name() == "Left Device");
  CHECK(fake.violations == 0);
}

TEST_CASE("when no device answers, the error says what was tried, what the driver said and what to check", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.init_failures = -1;
  fake.plan.init_error = 0x303;
  CHECK(unsaid(phantom_refusal({}, PhantomProblem::device_not_found, 0x303),
               "tried the default (no name): 0x303 \"the connection is not set up\" (internal 7)", "\"Default Device\": 0x303",
               "\"Default PHANToM\": 0x303", "check power and cable", "PALPATE_LIBHD is ", "/dev/") == "");
  fake.plan.init_error = 0x300;
  CHECK(unsaid(phantom_refusal({}, PhantomProblem::device_not_found, 0x300), "GTDD_HOME") == "");
  CHECK(fake.violations == 0);
}

TEST_CASE("a device that another has just let go is tried twice", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.init_failures = 1;
  fake.plan.init_error = 0x301;
  {
    PhantomDevice device;
    CHECK_NOTHROW(device.open());
    CHECK(fake.inits == 2);
    CHECK(unsaid(phantom_refusal({.device = "Default Device"}, PhantomProblem::device_not_found, 0x301),
                 "another program, or this one, holds the device") == "");
  }
  CHECK(fake.violations == 0);
}

TEST_CASE("a licence is shown before the device is opened", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.password = "sesame";
  CHECK(unsaid(phantom_refusal({}, PhantomProblem::licence, 0x600), "0x600", "PhantomOptions::licence") == "");
  CHECK(unsaid(phantom_refusal({.licence = PhantomLicence{"us", "palpation", "guess"}}, PhantomProblem::licence), "vendor \"us\"", "\"palpation\"",
               "refused") == "");
  PhantomDevice device({.licence = PhantomLicence{"us", "palpation", "sesame"}});
  CHECK_NOTHROW(device.open());
}

TEST_CASE("a scheduler that does not start, or does not call, is an error and leaves nothing open", "[phantom]") {
  auto& fake = fresh_fake();
  SECTION("it refuses") {
    fake.plan.start_error = 0x304;
    CHECK(unsaid(phantom_refusal({}, PhantomProblem::driver, 0x304), "the scheduler did not start: 0x304", "other programs") == "");
    fake.plan.start_error = 0;
  }
  SECTION("it is silent") {
    fake.plan.scheduler_is_silent = true;
    CHECK(unsaid(phantom_refusal({.timeout = 0.02}, PhantomProblem::timeout), "has not called within 0.02 s") == "");
    fake.plan.scheduler_is_silent = false;
  }
  SECTION("it does not take the rate") {
    CHECK(unsaid(phantom_refusal({.rate = 1234.0}, PhantomProblem::driver, 0x101), "a rate of 1234 Hz was refused", "500, 1000") == "");
  }
  CHECK(fake.inits == 1);
  CHECK(fake.disables == 1);
  PhantomDevice device({.rate = 500.0});
  CHECK_NOTHROW(device.open());
  CHECK(device.capabilities().rate == 500.0);
  PhantomDevice other({.device = "Right Device", .rate = 1000.0});
  CHECK(unsaid(message_of([&] { other.open(); }), ".rate is 1000 Hz", "one clock, of 500 Hz") == "");
  CHECK(fake.violations == 0);
}

TEST_CASE("a driver that hangs does not take the program with it, and is closed when it comes back", "[phantom]") {
  auto& fake = fresh_fake();
  fake.plan.init_milliseconds = 600;
  CHECK(unsaid(phantom_refusal({.timeout = 0.05}, PhantomProblem::timeout), "opening the default PHANToM took longer than 0.05 s",
               "PhantomOptions::timeout") == "");
  CHECK(unsaid(phantom_refusal({.device = "x", .timeout = 0.05}, PhantomProblem::timeout), "opening the PHANToM \"x\"") ==
        "");   // the first still hangs
  REQUIRE(palpate_test::soon([&] { return fake.disables == 1; }));
  CHECK(fake.inits == 1);
  fake.plan.init_milliseconds = 0;
  PhantomDevice device;
  CHECK_NOTHROW(device.open());
  CHECK(fake.violations == 0);
}

TEST_CASE("calls in the wrong order, and options without sense, are refused", "[phantom]") {
  fresh_fake();
  PhantomDevice device;
  DeviceState<double> state;
  CHECK(device.read(state) == DeviceStatus::disconnected);
  CHECK(device.write({}) == DeviceStatus::disconnected);
  CHECK(unsaid(message_of([&] { device.arm(); }), "arm() needs an open device") == "");
  CHECK(unsaid(message_of([&] { device.start([](void*) noexcept {}, nullptr); }), "start() needs an open device") == "");
  CHECK_NOTHROW(device.disarm());
  CHECK_NOTHROW(device.stop());
  device.open();
  CHECK(unsaid(message_of([&] { device.open(); }), "open already") == "");
  CHECK(unsaid(message_of([&] { device.start(nullptr, nullptr); }), "no function") == "");
  PhantomDevice other({.library = "/another/libHD.so"});
  CHECK(unsaid(message_of([&] { other.open(); }), "/another/libHD.so", "can have one") == "");

  double const nan = std::numeric_limits<double>::quiet_NaN();
  for (PhantomOptions const& options :
       {PhantomOptions{.rate = 0.0}, PhantomOptions{.max_force = -1.0}, PhantomOptions{.ramp = nan}, PhantomOptions{.silence = 0.0},
        PhantomOptions{.held = 0.0}, PhantomOptions{.jump = -1.0}, PhantomOptions{.timeout = nan}, PhantomOptions{.calibration_patience = -1.0}})
    CHECK_THROWS_AS(PhantomDevice(options), InvalidArgument);
}

TEST_CASE("a device that is moved stays open, and is closed once", "[phantom]") {
  auto& fake = fresh_fake();
  {
    PhantomDevice first;
    first.open();
    PhantomDevice second(std::move(first));
    DeviceState<double> state;
    CHECK(second.read(state) == DeviceStatus::ok);
    CHECK(first.read(state) == DeviceStatus::disconnected);   // NOLINT(bugprone-use-after-move)
  }
  CHECK(fake.disables == 1);
  CHECK(fake.violations == 0);
}
