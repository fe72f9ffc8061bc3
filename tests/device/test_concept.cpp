// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"

#include <palpate/device/concept.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/session.hpp>
#include <palpate/extend/device.hpp>

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

using namespace palpate;

namespace {

// The least a device can be; each of the others lacks one thing of it.
using Archetype = testing::DeviceArchetype<double>;
struct WithoutCapabilities {
  DeviceStatus read(DeviceState<double>&) noexcept { return DeviceStatus::ok; }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};
struct ReadsNothing {
  Capabilities capabilities() const { return {}; }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};
struct WritesWithoutStatus : Archetype {
  void write(Wrench<double> const&) noexcept {}
};
struct MayThrow : Archetype {
  DeviceStatus read(DeviceState<double>&) { return DeviceStatus::ok; }
};

static_assert(!HapticDevice<Archetype, float>, "a device of doubles does not pass for one of floats");
static_assert(!ReportsCapabilities<WithoutCapabilities> && !HapticDevice<WithoutCapabilities>);
static_assert(!ReadsState<ReadsNothing, double> && !HapticDevice<ReadsNothing>);
static_assert(!WritesWrench<WritesWithoutStatus, double> && !HapticDevice<WritesWithoutStatus>);
static_assert(ReadsState<MayThrow, double> && !ServesWithoutThrowing<MayThrow, double> && !HapticDevice<MayThrow>);
static_assert(!OpensAndCloses<Archetype> && !Armable<Archetype>);

// Writes down what happens to it.
class Diary {
 public:
  Diary(std::vector<std::string>& log, std::string fails, double rate = 1000.0)
      : log_(log), fails_(std::move(fails)), rate_(rate) {}

  Capabilities capabilities() const { return {.max_force = 3.3, .rate = rate_}; }
  DeviceStatus read(DeviceState<double>&) noexcept { return DeviceStatus::ok; }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    log_.push_back(wrench.force.isZero(0.0) && wrench.torque.isZero(0.0) ? "zero" : "force");
    return DeviceStatus::ok;
  }
  void open() { enter("open"); }
  void close() noexcept { log_.push_back("close"); }
  void arm() { enter("arm"); }
  void disarm() noexcept { log_.push_back("disarm"); }

 private:
  void enter(std::string const& name) {
    log_.push_back(name);
    if (name == fails_) throw std::runtime_error(name);
  }
  std::vector<std::string>& log_;
  std::string fails_;
  double rate_;
};
static_assert(HapticDevice<Diary> && OpensAndCloses<Diary> && Armable<Diary>);

using Log = std::vector<std::string>;

}  // namespace

TEST_CASE("a fresh state and a fresh wrench are zero", "[device]") {
  DeviceState<double> const state;
  CHECK(state.position.isZero(0.0));
  CHECK(state.velocity.isZero(0.0));
  CHECK(state.angular_velocity.isZero(0.0));
  CHECK(state.orientation.toRotationMatrix().isIdentity(0.0));
  CHECK(state.buttons == 0);
  Wrench<float> const wrench;
  CHECK(wrench.force.isZero(0.0f));
  CHECK(wrench.torque.isZero(0.0f));
}

TEST_CASE("every status has a word, and only two of them let the tick go on", "[device]") {
  CHECK(std::string(to_string(DeviceStatus::ok)) == "ok");
  CHECK(std::string(to_string(DeviceStatus::stale)) == "stale");
  CHECK(std::string(to_string(DeviceStatus::disconnected)) == "disconnected");
  CHECK(std::string(to_string(DeviceStatus::fault)) == "fault");
  CHECK(is_usable(DeviceStatus::ok));
  CHECK(is_usable(DeviceStatus::stale));
  CHECK_FALSE(is_usable(DeviceStatus::disconnected));
  CHECK_FALSE(is_usable(DeviceStatus::fault));
}

TEST_CASE("capabilities that no servo loop can run with are refused", "[device]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  double const infinity = std::numeric_limits<double>::infinity();
  CHECK_NOTHROW(require_valid({.max_force = 3.3, .rate = 1000.0}));
  CHECK_NOTHROW(require_valid({.max_force = 0.0, .rate = 60.0}));        // a tracker
  CHECK_NOTHROW(require_valid({.max_force = infinity, .rate = 1000.0})); // no limit
  for (double const rate : {0.0, -1.0, nan, infinity})
    CHECK_THROWS_AS(require_valid({.max_force = 1.0, .rate = rate}), InvalidArgument);
  for (double const force : {-1.0, nan}) {
    CHECK_THROWS_AS(require_valid({.max_force = force, .rate = 1000.0}), InvalidArgument);
    CHECK_THROWS_AS(require_valid({.max_force = 1.0, .rate = 1000.0, .max_torque = force}), InvalidArgument);
  }
  CHECK(palpate_test::unsaid(palpate_test::message_of([] { require_valid({}); }), "device rate is 0 Hz", ".rate = 1000.0") == "");
}

TEST_CASE("a session opens, arms, lets go, disarms and closes, in that order", "[device]") {
  Log log;
  Diary device(log, "");
  {
    DeviceSession session(device);
    CHECK(log == Log{"open", "arm"});
  }
  CHECK(log == Log{"open", "arm", "zero", "disarm", "close"});
}

TEST_CASE("a session that can not begin leaves the device closed", "[device]") {
  Log log;
  SECTION("open fails: there is nothing to close") {
    Diary device(log, "open");
    CHECK_THROWS_AS(DeviceSession(device), std::runtime_error);
    CHECK(log == Log{"open"});
  }
  SECTION("arm fails") {
    Diary device(log, "arm");
    CHECK_THROWS_AS(DeviceSession(device), std::runtime_error);
    CHECK(log == Log{"open", "arm", "close"});
  }
  SECTION("the device turns out to have no rate") {
    Diary device(log, "", 0.0);
    CHECK_THROWS_AS(DeviceSession(device), InvalidArgument);
    CHECK(log == Log{"open", "close"});
  }
}

TEST_CASE("a session of the smallest device only writes the last zero", "[device]") {
  Archetype device;
  DeviceSession session(device);
  static_assert(std::is_same_v<decltype(session), DeviceSession<Archetype, double>>);
}

TEMPLATE_TEST_CASE("the null device stays where it is", "[device]", PALPATE_TEST_SCALARS) {
  NullDevice<TestType> device({TestType(1), TestType(2), TestType(3)});
  DeviceState<TestType> state;
  state.velocity.setOnes();
  CHECK(device.read(state) == DeviceStatus::ok);
  CHECK(state.position == Vector3<TestType>(1, 2, 3));
  CHECK(state.velocity.isZero(TestType(0)));
  CHECK(device.write({.force = {TestType(1e30), 0, 0}}) == DeviceStatus::ok);
  CHECK(device.capabilities().rate == 1000.0);
  CHECK_THROWS_AS(NullDevice<TestType>({0, 0, 0}, 0.0), InvalidArgument);
}
