// SPDX-License-Identifier: MIT
// Yardstick: a puppet device whose strings the test holds; what it said is what must come back.
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "simulator/puppet.hpp"

#include <palpate/device/recorded_device.hpp>
#include <palpate/device/replay_device.hpp>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::Puppet;
using palpate_test::Strings;
using palpate_test::unsaid;

namespace {

struct Opened {
  int* state;
  Capabilities capabilities() const { return {.max_force = 1.0, .rate = 500.0}; }
  DeviceStatus read(DeviceState<double>&) noexcept { return DeviceStatus::ok; }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
  void open() { *state += 1; }
  void close() noexcept { *state += 10; }
  void arm() { *state += 100; }
  void disarm() noexcept { *state += 1000; }
};

static_assert(OpensAndCloses<RecordedDevice<Opened>> && Armable<RecordedDevice<Opened>>);
static_assert(!OpensAndCloses<RecordedDevice<Puppet<double>>> && !Armable<RecordedDevice<Puppet<double>>>);
static_assert(HapticDevice<RecordedDevice<Puppet<float>, float>, float>);

}  // namespace

TEST_CASE("a copied recorder goes on recording, and so does a moved one", "[device][replay]") {
  Strings<double> strings;
  strings.capabilities = {.max_force = 2.0, .rate = 500.0, .reports_velocity = true};
  RecordedDevice<Puppet<double>> first(Puppet<double>(strings), 3);
  auto const record = [&](RecordedDevice<Puppet<double>>& device, double x) {
    strings.next.position = {x, 0, 0};
    DeviceState<double> state;
    device.read(state);
    device.write({});
  };
  record(first, 1);
  RecordedDevice<Puppet<double>> copy(first), assigned(Puppet<double>(strings), 0);
  assigned = first;
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  for (auto* device : {&copy, &assigned})
    for (double const x : {2.0, 3.0, 4.0}) record(*device, x);
  long const count = allocations.count();
  CHECK(count == 0);
  for (auto* device : {&copy, &assigned}) {
    REQUIRE(device->samples().size() == 3);
    for (int i = 0; i < 3; ++i) CHECK(device->samples()[static_cast<std::size_t>(i)].position.x() == i + 1.0);
    CHECK(device->dropped() == 1);
  }
  CHECK(first.samples().size() == 1);
  RecordedDevice<Puppet<double>> moved(std::move(first));
  record(moved, 5);
  CHECK(moved.samples().size() == 2);
}

TEST_CASE("a velocity that the device does not report is not recorded", "[device][replay]") {
  Strings<double> strings;
  strings.next.velocity = {1, 2, 3};   // what a host, or whoever, left in the state
  for (bool const reports : {false, true}) {
    strings.capabilities = {.max_force = 2.0, .rate = 500.0, .reports_velocity = reports};
    RecordedDevice<Puppet<double>> recorded(Puppet<double>(strings), 1);
    DeviceState<double> state;
    state.velocity = {1, 2, 3};
    recorded.read(state);
    CHECK(state.velocity == Vector3<double>(1, 2, 3));
    CHECK(recorded.samples().at(0).velocity == (reports ? Vector3<double>(1, 2, 3) : Vector3<double>(0, 0, 0)));
  }
}

TEMPLATE_TEST_CASE("a device is replayed as it was, failed reads and writes included", "[device][replay]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Strings<S> strings;
  bool const turns = GENERATE(false, true);
  strings.capabilities = {.max_force = 2.0, .rate = 500.0, .reports_velocity = true, .reports_orientation = turns};
  RecordedDevice<Puppet<S>, S> recorded(Puppet<S>(strings), 5);
  DeviceStatus const reads[] = {DeviceStatus::ok, DeviceStatus::stale, DeviceStatus::ok, DeviceStatus::disconnected, DeviceStatus::ok};
  DeviceStatus const writes[] = {DeviceStatus::ok, DeviceStatus::ok, DeviceStatus::fault, DeviceStatus::ok, DeviceStatus::ok};
  auto const place = [](int i) {
    return Vector3<S>(S(1) / S(3 + i), std::nextafter(S(i), S(9)), i == 2 ? std::numeric_limits<S>::quiet_NaN() : S(-i));
  };
  auto const turn = [](int i) { return Eigen::Quaternion<S>(S(0.5), S(i) / 7, 0, S(-0.5)); };
  for (int i = 0; i < 5; ++i) {
    strings.next.position = place(i);
    strings.next.orientation = turn(i);
    strings.next.velocity = S(2) * Vector3<S>(S(1) / S(7), S(i), 0);
    strings.reads = reads[i];
    strings.writes = writes[i];
    DeviceState<S> state;
    CHECK(recorded.read(state) == reads[i]);
    CHECK(recorded.write({.force = Vector3<S>(0, 0, S(i))}) == writes[i]);
    CHECK(strings.felt.force.z() == S(i));
  }
  recorded.write({});   // as at the end of a session
  REQUIRE(recorded.samples().size() == 5);

  ReplayDevice<S> again(recorded.samples(), recorded.capabilities());
  CHECK(again.capabilities().max_force == 2.0);
  CHECK(again.capabilities().rate == 500.0);
  CHECK(again.capabilities().reports_velocity);
  CHECK(again.duration() == 0.01);
  for (int round = 0; round < 2; ++round) {
    DeviceState<S> state;
    for (int i = 0; i < 5; ++i) {
      CHECK(again.tick() == unsigned(i));
      Vector3<S> const before = state.position;
      CHECK(again.read(state) == reads[i]);
      if (reads[i] == DeviceStatus::disconnected) {
        CHECK((state.position - before).norm() == 0);   // a failed read leaves the state as it was
      } else {
        CHECK(state.position.template head<2>() == place(i).template head<2>());
        CHECK(std::isnan(state.position.z()) == (i == 2));
        CHECK(state.velocity == S(2) * Vector3<S>(S(1) / S(7), S(i), 0));
        CHECK(state.orientation.coeffs() == (turns ? turn(i) : Eigen::Quaternion<S>::Identity()).coeffs());
      }
      CHECK(again.write({.force = Vector3<S>(S(i), 0, 0)}) == writes[i]);
      CHECK(again.last_wrench().force.x() == S(i));
      if (i == 2) state.position.setZero();
    }
    CHECK(again.finished());
    CHECK(again.read(state) == DeviceStatus::stale);   // the hand rests where it was
    CHECK(state.position == place(4));
    CHECK(state.velocity.isZero(0));
    again.rewind();
    CHECK(!again.finished());
  }
}

TEST_CASE("recording and replaying allocate nothing in a tick, and ticks without room are counted", "[device][replay][realtime]") {
  REQUIRE(palpate_test::trap_works());
  Strings<double> strings;
  RecordedDevice<Puppet<double>> recorded(Puppet<double>(strings), 1000);
  std::size_t const room = recorded.samples().capacity();
  DeviceState<double> state;
  palpate_test::AllocationCount const recording;
  for (std::size_t i = 0; i < room + 7; ++i) {
    recorded.read(state);
    recorded.write({});
  }
  long const count = recording.count();
  CHECK(count == 0);
  CHECK(recorded.samples().size() == room);
  CHECK(recorded.dropped() == 7);

  ReplayDevice<double> again(recorded.samples(), recorded.capabilities());
  palpate_test::AllocationCount const replaying;
  for (std::size_t i = 0; i < room + 7; ++i) {
    again.read(state);
    again.write({});
  }
  long const replayed = replaying.count();
  CHECK(replayed == 0);
}

TEST_CASE("a recorded device is opened and armed like the one in it", "[device][replay]") {
  int state = 0;
  RecordedDevice<Opened> device(Opened{&state}, 1);
  device.open();
  device.arm();
  CHECK(state == 101);
  device.disarm();
  device.close();
  CHECK(state == 1111);
}

TEST_CASE("nothing to replay is refused", "[device][replay]") {
  CHECK(unsaid(message_of([] { ReplayDevice<double>({}, {.max_force = 1.0, .rate = 1000.0}); }), "ReplayDevice: there are 0 samples",
               "RecordedDevice") == "");
  CHECK(unsaid(message_of([] { ReplayDevice<double>(std::vector<HandSample>(3), {.max_force = 1.0}); }), "device rate is 0 Hz") == "");
}
