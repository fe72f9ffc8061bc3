// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "fake_libdhd/control.hpp"

#include <palpate/device/force_dimension/address.hpp>
#include <palpate/device/session.hpp>
#include <palpate/testing/device_laws.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <dlfcn.h>

using namespace palpate;
using fake_libdhd::Call;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

constexpr double never = 1e9;   // s, between two reads: a machine under load may pause this program

void* dhd_function(char const* name) {
  char const* const path = std::getenv("PALPATE_LIBDHD");
  void* const library = path != nullptr ? ::dlopen(path, RTLD_NOW | RTLD_LOCAL) : nullptr;
  void* const found = library != nullptr ? ::dlsym(library, name) : nullptr;
  if (found == nullptr)
    throw std::runtime_error(std::string(name) + " is not there: PALPATE_LIBDHD has to name the libdhd.so of the target fake_libdhd; ctest sets it");
  return found;
}

/// The stand-in as new; no device may be open.
fake_libdhd::Control& fresh_dhd() {
  reinterpret_cast<void (*)()>(dhd_function("fake_libdhd_reset"))();
  return *reinterpret_cast<fake_libdhd::Control* (*)()>(dhd_function("fake_libdhd_control"))();
}

double felt(fake_libdhd::Control const& fake) { return std::hypot(fake.force[0], fake.force[1], fake.force[2]); }

/// `count` ticks that push with `force` along x; the status of the last read.
DeviceStatus push(ForceDimensionDevice& device, int count, double force = 1.0) {
  DeviceStatus last = DeviceStatus::ok;
  DeviceState<double> state;
  for (int k = 0; k < count; ++k) {
    last = device.read(state);
    static_cast<void>(device.write({.force = {force, 0.0, 0.0}}));
  }
  return last;
}

ForceDimensionOptions quick() {
  ForceDimensionOptions options;
  options.ramp = 0.01;
  options.gap = never;
  return options;
}

ForceDimensionProblem problem_of_opening(ForceDimensionDevice& device) {
  try {
    device.open();
    device.arm();
  } catch (ForceDimensionError const& error) {
    return error.problem();
  }
  throw std::runtime_error("it was opened");
}

}  // namespace

TEST_CASE("C10-M3: axes of Force Dimension's devices, written out", "[force_dimension]") {
  // Yardstick: x towards the user, y right, z up of the maker, by hand into right, up, towards the user.
  using namespace palpate::detail::force_dimension;
  struct Row {
    std::array<double, 3> native;
    Vector3<double> here;
  };
  for (Row const& row :
       {Row{{1, 0, 0}, {0, 0, 1}}, Row{{0, 1, 0}, {1, 0, 0}}, Row{{0, 0, 1}, {0, 1, 0}}, Row{{0.01, -0.02, 0.03}, {-0.02, 0.03, 0.01}}}) {
    CHECK(from_native(row.native) == row.here);
    CHECK(to_native(row.here) == row.native);
    NativeState native;
    native.position = native.angular_velocity = row.native;
    native.velocity = {10 * row.native[0], 10 * row.native[1], 10 * row.native[2]};
    native.buttons = 0x10005u;
    DeviceState<double> state;
    REQUIRE(convert(native, true, state));
    CHECK(state.position == row.here);
    CHECK((state.velocity - 10.0 * row.here).norm() < 1e-15);
    CHECK(state.angular_velocity == row.here);
    CHECK(state.buttons == 5u);   // sixteen of them
  }
  // A quarter turn about each of the maker's axes is one about the axis of the same place here; rows before columns.
  double const s = std::sqrt(0.5);
  NativeState native;
  DeviceState<double> state;
  auto const turned = [&](double const (&rows)[3][3]) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) native.rotation[i][j] = rows[i][j];
    REQUIRE(convert(native, true, state));
    return state.orientation;
  };
  CHECK(turned({{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}).isApprox(Eigen::Quaternion<double>(s, 0, 0, s), 1e-12));   // towards the user
  CHECK(turned({{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}).isApprox(Eigen::Quaternion<double>(s, s, 0, 0), 1e-12));   // right
  CHECK(turned({{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}).isApprox(Eigen::Quaternion<double>(s, 0, s, 0), 1e-12));   // up
  auto const before = state.orientation;
  CHECK(turned({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}).coeffs() == before.coeffs());   // no rotation
  native.position[2] = std::numeric_limits<double>::infinity();
  CHECK_FALSE(convert(native, true, state));
}

TEST_CASE("Force Dimension's library is looked for, and what it lacks is named", "[force_dimension]") {
  using namespace palpate::detail::force_dimension;
  std::string const ours = std::getenv("PALPATE_LIBDHD") != nullptr ? std::getenv("PALPATE_LIBDHD") : "";
  CHECK(library_candidates("mine.so") == std::vector<std::string>{"mine.so"});
  CHECK(library_candidates("") == std::vector<std::string>{ours});
  ::unsetenv("PALPATE_LIBDHD");
  auto const usual = library_candidates("");
  bool const installed = ::dlopen("libdrd.so", RTLD_LAZY | RTLD_LOCAL) != nullptr || ::dlopen("libdhd.so", RTLD_LAZY | RTLD_LOCAL) != nullptr;
  std::string const nowhere = installed ? "" : message_of([] { static_cast<void>(load_library("")); });
  ::setenv("PALPATE_LIBDHD", ours.c_str(), 1);
  REQUIRE(usual.size() >= 2);
  CHECK(usual[0] == "libdrd.so");
  CHECK(usual[1] == "libdhd.so");
  if (!installed) CHECK(unsaid(nowhere, "Force Dimension: libdhd could not be loaded", "not found: libdrd.so, libdhd.so", "PALPATE_LIBDHD") == "");

  auto const load = [](std::string const& path) { return message_of([&] { static_cast<void>(load_library(path)); }); };
  CHECK(unsaid(load("/nowhere/libdhd.so"), "/nowhere/libdhd.so: cannot open shared object file", "Install the vendor's SDK") == "");
  CHECK(unsaid(load("libm.so.6"), "libm.so.6 has no function dhdOpenID", "3.17") == "");
  // Yardstick: what a session from opening to closing can not do without, counted by hand.
  std::map<std::string, bool> names;
  Functions all;
  for_each_function(all, [&](char const* name, auto&, bool mandatory) { names[name] = mandatory; });
  int mandatory = 0;
  for (auto const& [hidden, needed] : names) {
    auto const find = [&](char const* name) { return name == hidden ? nullptr : dhd_function(name); };
    mandatory += needed ? 1 : 0;
    std::string const said = message_of([&] { static_cast<void>(bind_functions(find, "old/libdhd.so")); });
    CHECK(unsaid(said, needed ? "old/libdhd.so has no function " + hidden + ":" : std::string("(no exception)")) == "");
  }
  CHECK(mandatory == 12);
}

TEST_CASE("a device of Force Dimension is opened, described and closed as it was", "[force_dimension]") {
  auto& fake = fresh_dhd();
  fake.plan.limit = 2.5;
  fake.plan.devices = 2;
  {
    ForceDimensionDevice device({.device = 1});
    device.open();
    Capabilities const can = device.capabilities();
    CHECK(can.max_force == 2.5);
    CHECK(can.max_force.provenance == Provenance::reported);
    CHECK(can.workspace.provenance == Provenance::guessed);
    CHECK(can.workspace.upper.norm() == Approx(0.075));   // the corners lie on the ball that is guessed for an omega
    CHECK_FALSE(can.friction.known());
    CHECK(can.max_torque == 0.0);   // a wrist that only measures
    CHECK(can.reports_orientation);
    DeviceDescription const who = device.description();
    CHECK(who.model == "omega.7");
    CHECK(who.serial == "4711");
    CHECK(who.driver == "DHD 3.17.5");
    CHECK(device.library() == std::getenv("PALPATE_LIBDHD"));
    CHECK_FALSE(fake.motors);
    DeviceState<double> state;
    CHECK(device.read(state) == DeviceStatus::ok);
    CHECK(state.position == Vector3<double>(fake.position[1], fake.position[2], fake.position[0]));
    CHECK(state.velocity == Vector3<double>(fake.velocity[1], fake.velocity[2], fake.velocity[0]));
    CHECK(state.angular_velocity == Vector3<double>(0.2, 0.3, 0.1));
    CHECK(state.orientation.isApprox(Eigen::Quaternion<double>(std::sqrt(0.5), 0, std::sqrt(0.5), 0), 1e-12));
    CHECK(device.write({.force = {1, 0, 0}}) == DeviceStatus::ok);
    CHECK(fake.sent == 0);   // not armed

    ForceDimensionDevice second({.device = 1});
    CHECK(problem_of_opening(second) == ForceDimensionProblem::in_use);
    CHECK(device.read(state) == DeviceStatus::ok);   // the first has kept it
    CHECK(message_of([&] { device.open(); }).find("open already") != std::string::npos);

    ForceDimensionDevice moved = std::move(device);
    CHECK(moved.read(state) == DeviceStatus::ok);
  }
  CHECK(fake.closes == 1);
  CHECK(fake.limit == 2.5);
  CHECK(fake.violations == 0);

  fake = {};
  fake.plan.wrist = false;
  fake.plan.model = "delta.3";
  ForceDimensionDevice plain({.max_force = 4.0});
  plain.open();
  CHECK(plain.capabilities().max_force == 4.0);   // of 20 that are guessed
  CHECK(plain.capabilities().max_force.provenance == Provenance::guessed);
  CHECK(fake.limit == 4.0);   // the library keeps to it too
  DeviceState<double> state;
  state.orientation = Eigen::Quaternion<double>(0, 1, 0, 0);
  CHECK(plain.read(state) == DeviceStatus::ok);
  CHECK(state.orientation.x() == 1.0);   // not measured, not touched
  plain.close();
  CHECK(fake.limit == -1.0);
  long const calls = fake.calls;
  CHECK(plain.read(state) == DeviceStatus::disconnected);
  CHECK(plain.write({}) == DeviceStatus::disconnected);
  plain.disarm();
  plain.close();
  CHECK(fake.calls == calls);   // nothing after closing
  CHECK(unsaid(message_of([&] { plain.arm(); }), "arm() needs an open device") == "");
  CHECK(unsaid(message_of([] { ForceDimensionDevice wrong({.device = -1}); }), ".device is -1") == "");
}

TEST_CASE("what keeps a device of Force Dimension from being opened or armed is said, and nothing stays open", "[force_dimension]") {
  struct Row {
    Call fails;
    int code;
    ForceDimensionProblem problem;
    char const* words;
  };
  for (Row const& row : {Row{Call::open, 5, ForceDimensionProblem::device_not_found, "0 was not opened: error 5 \"no device found\"; check power"},
                         Row{Call::open, 20, ForceDimensionProblem::device_not_found, "\"device in use\"; another program holds"},
                         Row{Call::status, 2, ForceDimensionProblem::driver, "failed at once: error 2 \"communication error\"; check the USB cable"},
                         Row{Call::pose, 8, ForceDimensionProblem::driver, "failed at once: error 8 \"geometry error\""},
                         Row{Call::velocity, 1, ForceDimensionProblem::driver, "has given no sample within 0.2 s"},
                         Row{Call::enable, 12, ForceDimensionProblem::driver, "the motors were not switched on: error 12"},
                         Row{Call::forces, 2, ForceDimensionProblem::driver, "the motors were not switched on: error 2"}}) {
    auto& fake = fresh_dhd();
    fake.plan.fails = row.fails;
    fake.plan.code = row.code;
    ForceDimensionOptions options = quick();
    options.timeout = 0.2;
    ForceDimensionDevice device(options);
    CHECK(problem_of_opening(device) == row.problem);
    device.close();
    CHECK(unsaid(message_of([&] {
            device.open();
            device.arm();
          }),
          "Force Dimension: ", row.words) == "");
    device.close();
    CHECK_FALSE(fake.motors);
    CHECK(fake.opens == fake.closes);
    CHECK(fake.violations == 0);
  }
  auto& fake = fresh_dhd();
  fake.plan.repeats_from = 1, fake.plan.repeats = 1000000;
  ForceDimensionOptions options;
  options.timeout = 0.01;
  ForceDimensionDevice silent(options);
  CHECK(unsaid(message_of([&] { silent.open(); }), "has given no sample within 0.01 s") == "");
  CHECK(fake.opens == fake.closes);

  fake.plan = {};   // its velocity is a mean, and there is none before its window is full
  fake.plan.fails = Call::velocity, fake.plan.fails_until = fake.samples + 21;
  ForceDimensionDevice filling(quick());
  CHECK(message_of([&] { filling.open(); }) == "(no exception)");
  filling.close();

  fake.plan = {};
  fake.plan.uncalibrated = true;
  ForceDimensionDevice device(quick());
  CHECK(problem_of_opening(device) == ForceDimensionProblem::not_calibrated);
  CHECK(device.calibration() == Calibration::needs_hand);
  fake.plan.uncalibrated = false;   // the user has done it
  device.arm();
  CHECK(device.calibration() == Calibration::good);
  push(device, 100);
  CHECK(felt(fake) == 1.0);
  fake.plan.uncalibrated = true;    // lost: ten times a second it is asked for
  push(device, 101);
  CHECK(felt(fake) == 0.0);
  CHECK(device.calibration() == Calibration::needs_hand);
  fake.plan.uncalibrated = false;
  fake.plan.in_error = true;
  CHECK(push(device, 101) == DeviceStatus::fault);
  CHECK(fake.violations == 0);
}

TEST_CASE("the force of a device of Force Dimension begins at zero and ends at the cap", "[force_dimension]") {
  // Yardstick: a ramp of 100 ms at 1 kHz rises by a hundredth a tick; the caps by hand.
  struct Row {
    double limit, option, cap;
  };
  for (Row const& row : {Row{-1.0, 1e9, 12.0}, Row{2.5, 1e9, 2.5}, Row{2.5, 1.0, 1.0}, Row{-1.0, 3.0, 3.0}, Row{2.5, 0.0, 0.0}}) {
    auto& fake = fresh_dhd();
    fake.plan.limit = row.limit;
    ForceDimensionOptions options = quick();
    options.ramp = 0.1;
    options.max_force = row.option;
    ForceDimensionDevice device(options);
    device.open();
    push(device, 10, 100.0);
    CHECK(fake.sent == 0);
    device.arm();
    CHECK(fake.motors);
    CHECK(fake.first_sent == 0.0);
    CHECK(fake.sent == 1);
    for (int k = 1; k <= 120; ++k) {
      push(device, 1, 100.0);
      REQUIRE(felt(fake) == Approx(row.cap * std::min(1.0, 0.01 * k)).margin(1e-12));
    }
    DeviceState<double> state;
    CHECK(device.read(state) == DeviceStatus::ok);
    CHECK(device.write({.force = {0.0, 3e3, 4e3}, .torque = {1, 1, 1}}) == DeviceStatus::ok);
    CHECK(fake.force[2] == Approx(0.6 * row.cap));   // up; the direction is kept
    CHECK(fake.force[0] == Approx(0.8 * row.cap));   // towards the user
    CHECK(fake.torque[0] == 0.0);
    CHECK(device.write({.force = {std::numeric_limits<double>::quiet_NaN(), 0, 0}}) == DeviceStatus::ok);
    CHECK(felt(fake) == 0.0);
    device.write({.force = {1e3, 0, 0}});
    device.disarm();
    CHECK(felt(fake) == 0.0);
    CHECK_FALSE(fake.motors);
    CHECK(fake.violations == 0);
    CHECK(fake.violation == std::string());
  }
  auto& fake = fresh_dhd();
  fake.plan.active_wrist = true;
  fake.plan.saturates_at = 0.9;
  ForceDimensionOptions options = quick();
  options.max_torque = 0.05;
  ForceDimensionDevice device(options);
  DeviceSession const session(device);
  push(device, 20);
  CHECK(device.counts().saturated == 11);   // the tenth tick, of 1 N, and ten more: nothing but counted
  CHECK(device.capabilities().max_torque == 0.05);
  DeviceState<double> state;
  CHECK(device.read(state) == DeviceStatus::ok);
  CHECK(device.write({.torque = {0.0, 0.0, 1.0}}) == DeviceStatus::ok);
  CHECK(fake.torque[0] == Approx(0.05));
  CHECK(fake.violations == 0);
}

TEST_CASE("whatever goes wrong in a device of Force Dimension, there is no force within two ticks, and it stays so", "[force_dimension]") {
  struct Row {
    char const* name;
    void (*plan)(fake_libdhd::Plan&);
    DeviceStatus status;
    int code;
    char const* words;
  };
  constexpr int at = 200;   // sample
  for (Row const& row :
       {Row{"position", [](auto& p) { p.fails = Call::pose, p.code = 8, p.fails_from = at; }, DeviceStatus::fault, 8, "geometry error"},
        Row{"connection", [](auto& p) { p.fails = Call::pose, p.code = 2, p.fails_from = at; }, DeviceStatus::disconnected, 2, "communication error"},
        Row{"once", [](auto& p) { p.fails = Call::pose, p.code = 2, p.fails_from = at, p.fails_until = at + 1; }, DeviceStatus::disconnected, 2,
            "communication error"},
        Row{"forces", [](auto& p) { p.fails = Call::forces, p.code = 1, p.fails_from = at; }, DeviceStatus::fault, 1, "another error"},
        Row{"not a number", [](auto& p) { p.not_a_number_from = at, p.not_a_number = 1000; }, DeviceStatus::fault, 0, "ten reads without"},
        Row{"velocity", [](auto& p) { p.fails = Call::velocity, p.code = 1, p.fails_from = at; }, DeviceStatus::fault, 0, "ten reads without"},
        Row{"gone", [](auto& p) { p.vanishes_at = at; }, DeviceStatus::disconnected, 2, "communication error"}}) {
    CAPTURE(row.name);
    auto& fake = fresh_dhd();
    row.plan(fake.plan);
    {
      ForceDimensionDevice device(quick());
      DeviceSession const session(device);
      push(device, at - 2);   // open() took one sample
      REQUIRE(felt(fake) == 1.0);
      REQUIRE(fake.samples == at - 1);
      push(device, 2);
      if (std::string(row.name) != "gone") CHECK(felt(fake) == 0.0);   // what is unplugged can not be told
      CHECK(push(device, 10) == row.status);
      auto const fault = device.pop_fault();
      REQUIRE(fault.has_value());
      CHECK(fault->status == row.status);
      CHECK(fault->native_code == row.code);
      CHECK(unsaid(fault->what, row.words) == "");
      CHECK_FALSE(device.pop_fault().has_value());
      long const calls = fake.calls;
      fake.plan = {};   // it would be well again
      CHECK(push(device, 200) == row.status);
      CHECK(device.write({}) == row.status);
      CHECK(fake.calls == calls);   // it is left alone
      CHECK(unsaid(message_of([&] { device.arm(); }), "close it and open it again") == "");
      device.close();
      device.open();
      device.arm();
      push(device, 100);
      CHECK(felt(fake) == 1.0);
    }
    CHECK_FALSE(fake.motors);
    CHECK(fake.opens == 2);
    CHECK(fake.closes == 2);
    CHECK(fake.violation == std::string());
  }
}

TEST_CASE("a repeated sample of Force Dimension's library is stale, and many of them cost the force until one is new", "[force_dimension]") {
  auto& fake = fresh_dhd();
  fake.plan.repeats_from = 102;
  fake.plan.repeats = 150;
  ForceDimensionDevice device(quick());   // silence: 100 ticks
  DeviceSession const session(device);
  push(device, 100);
  DeviceState<double> before, state;
  before.position = {fake.position[1], fake.position[2], fake.position[0]};
  for (int k = 0; k < 150; ++k) {
    REQUIRE(device.read(state) == DeviceStatus::stale);
    REQUIRE(state.position == before.position);
    REQUIRE(device.write({.force = {1.0, 0.0, 0.0}}) == DeviceStatus::ok);
    REQUIRE(felt(fake) == (k < 99 ? 1.0 : 0.0));
  }
  CHECK(device.counts().repeated == 150);
  auto const told = device.pop_fault();
  REQUIRE(told.has_value());
  CHECK(told->status == DeviceStatus::ok);   // the session goes on
  CHECK(unsaid(told->what, "the same sample over and over") == "");
  CHECK(push(device, 1) == DeviceStatus::ok);
  CHECK(felt(fake) == Approx(0.1));   // the ramp of ten ticks
  CHECK(push(device, 20) == DeviceStatus::ok);
  CHECK(felt(fake) == 1.0);
  CHECK_FALSE(device.pop_fault().has_value());
  CHECK(device.counts().jumps == 0);   // the hand went on meanwhile, by 9 mm along one axis alone
  CHECK(fake.violations == 0);

  fake.plan.not_a_number_from = fake.samples + 1, fake.plan.not_a_number = 9;   // one less than what ends a session
  for (int k = 0; k < 9; ++k) {
    CHECK(push(device, 1) == DeviceStatus::stale);
    CHECK(felt(fake) == 0.0);
  }
  CHECK(push(device, 1) == DeviceStatus::ok);
  CHECK(felt(fake) == Approx(0.1));
  CHECK(device.counts().unreadable == 9);
}

TEST_CASE("after a jump, a pause or the device's own switch the force begins at zero again", "[force_dimension]") {
  auto& fake = fresh_dhd();
  fake.plan.jumps_at = 102;
  ForceDimensionDevice device(quick());
  DeviceSession const session(device);
  push(device, 100);
  CHECK(device.counts().jumps == 0);
  push(device, 1);
  CHECK(device.counts().jumps == 1);
  CHECK(felt(fake) == Approx(0.1));
  push(device, 20);
  CHECK(felt(fake) == 1.0);
  fake.plan.off_by = 2;   // too fast
  push(device, 101);
  CHECK(felt(fake) == 0.0);
  CHECK(device.counts().switched_off == 1);
  auto const told = device.pop_fault();
  REQUIRE(told.has_value());
  CHECK(told->native_code == 2);
  CHECK(unsaid(told->what, "too fast") == "");
  push(device, 300);
  CHECK_FALSE(device.pop_fault().has_value());   // once
  fake.plan.off_by = 0;
  double last = 0.0;
  for (int k = 0; k < 120; ++k) {
    push(device, 1);
    REQUIRE(felt(fake) <= last + 0.1 + 1e-12);
    last = felt(fake);
  }
  CHECK(last == 1.0);
  fake.plan.off_by = 5;   // the cable
  CHECK(push(device, 101) == DeviceStatus::disconnected);
  device.close();

  fake.plan = {};
  ForceDimensionOptions options = quick();
  options.gap = 0.02;
  ForceDimensionDevice paused(options);
  DeviceSession const again(paused);
  push(paused, 100);
  auto const gaps = paused.counts().gaps;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  push(paused, 1);
  CHECK(paused.counts().gaps > gaps);
  CHECK(felt(fake) == Approx(0.1));
  CHECK(fake.violations == 0);
}

TEST_CASE("a device of Force Dimension keeps the laws of devices, and its tick allocates nothing", "[force_dimension]") {
  for (bool const wrist : {true, false}) {
    auto& fake = fresh_dhd();
    fake.plan.wrist = wrist;
    ForceDimensionDevice device(quick());
    CHECK(testing::to_text(testing::check_device(device, {.force = 2.0})) == "");
    CHECK(fake.violation == std::string());
    CHECK(fake.opens == 2);
    CHECK(fake.closes == 2);
  }
  auto& fake = fresh_dhd();
  fake.plan.repeats_from = 500, fake.plan.repeats = 200;
  ForceDimensionDevice device(quick());
  DeviceSession const session(device);
  REQUIRE(palpate_test::trap_works());
  DeviceState<double> state;
  palpate_test::AllocationCount const allocations;
  testing::serve(device, state, 100000);
  long const allocated = allocations.count();
  CHECK(allocated == 0);
  CHECK(device.counts().ticks == 100000);
}

TEST_CASE("a device of Force Dimension is named as dhd:INDEX among a program's devices", "[force_dimension]") {
  auto& fake = fresh_dhd();
  fake.plan.devices = 2;
  DeviceRegistry<double> devices;
  add_force_dimension(devices);
  for (char const* const name : {"dhd:", "dhd:0", "dhd:1?max_force=0.5&ramp=0"}) {
    AnyDevice<double> device = devices.make(name);
    DeviceSession const session(device);
    REQUIRE(device.get_if<ForceDimensionDevice>() != nullptr);
    DeviceState<double> state;
    CHECK(device.read(state) == DeviceStatus::ok);
    CHECK(device.clock() == nullptr);   // the host keeps the time
  }
  AnyDevice<double> absent = devices.make("dhd:7");
  CHECK(unsaid(message_of([&] { DeviceSession const session(absent); }), "device 7 was not opened", "no device found") == "");
  CHECK(unsaid(message_of([&] { static_cast<void>(devices.make("dhd:left")); }), "\"left\" is no index", "dhd:0") == "");
  CHECK(unsaid(message_of([&] { static_cast<void>(devices.make("dhd:?ramp=-1")); }), "dhd:?ramp=-1", ".ramp is -1 s") == "");
  CHECK(fake.violations == 0);
}
