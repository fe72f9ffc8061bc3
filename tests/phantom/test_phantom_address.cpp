// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "phantom/fake.hpp"

#include <palpate/device/phantom/address.hpp>
#include <palpate/device/session.hpp>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

TEST_CASE("a PHANToM is named as hd:NAME among a program's devices", "[phantom]") {
  auto& fake = palpate_test::fresh_fake();
  fake.plan.names[0] = "Left Device";
  DeviceRegistry<double> devices;
  add_phantom(devices);
  AnyDevice<double> device = devices.make("hd:Left Device?max_force=0.5&ramp=0");
  {
    DeviceSession const session(device);
    REQUIRE(device.get_if<PhantomDevice>() != nullptr);
    CHECK(device.get_if<PhantomDevice>()->name() == "Left Device");
    CHECK(device.capabilities().max_force == 0.5);
    CHECK(device.description().model == "Touch, not a real one");
    CHECK(device.clock() != nullptr);
    DeviceState<double> state;
    CHECK(device.read(state) == DeviceStatus::ok);
  }
  AnyDevice<double> other = devices.make("hd:Right Device");   // the driver does not know it, and has another
  CHECK(unsaid(message_of([&] { DeviceSession const session(other); }), "tried \"Right Device\": 0x303", "is replaced by no other") == "");
  CHECK(unsaid(message_of([&] { static_cast<void>(devices.make("hd:?ramp=-1")); }), "hd:?ramp=-1", ".ramp is -1 s") == "");
  CHECK(unsaid(message_of([&] { static_cast<void>(devices.make("hd:?speed=1")); }), "no option speed", "library, rate, max_force") == "");
}
