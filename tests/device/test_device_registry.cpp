// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "device/temporary_folder.hpp"

#include <palpate/device/built_in_devices.hpp>
#include <palpate/testing/device_laws.hpp>

#include <cmath>
#include <string>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::TemporaryFolder;
using palpate_test::unsaid;

namespace {

std::string refusal_by(DeviceRegistry<double> const& devices, std::string const& name) {
  return message_of([&] { devices.make(name); });
}

}  // namespace

TEMPLATE_TEST_CASE("every built-in name makes a device that keeps the laws", "[device]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  TemporaryFolder const folder;
  auto const file = folder.file("stroke.csv", "time_s,x_m,y_m,z_m\n0,0,0,0\n1,0.01,0,0\n2,0.01,0.01,0\n").string();
  auto const devices = built_in_devices<Scalar>();
  for (std::string const& name :
       {std::string("null:"), std::string("null:?at=0.1,0.2,0.3&rate=500"), "script:" + file,
        "script:" + file + "?quantum=5.5e-5&jitter=1e-4&dropouts=0.01&seed=3",
        std::string("sim:hand"), "sim:hand?hand=firm&path=" + file + "&at=0,0,0.01&tremor=5e-5&friction=0.1", std::string("sim:touch?hand=light"),
        "sim:touch?path=" + file + "&lets_go_at=0.5"}) {
    INFO(name);
    AnyDevice<Scalar> device = devices.make(name);
    CHECK(testing::to_text(testing::check_device<Scalar>(device, {.force = 0.5})) == "");
  }
}

TEST_CASE("options reach the device that is named", "[device]") {
  TemporaryFolder const folder;
  auto const file = folder.file("stroke.csv", "time_s,x_m,y_m,z_m\n0,0,0,0\n1,0.01,0,0\n").string();
  auto const devices = built_in_devices();
  auto null = devices.make("null:?at=0.1,0.2,0.3&rate=500");
  DeviceState<double> state;
  null.read(state);
  CHECK(state.position == Vector3<double>(0.1, 0.2, 0.3));
  CHECK(null.capabilities().rate == 500.0);
  auto script = devices.make("script:" + file + "?max_force=7.9&quantum=1e-5&jitter=2e-4&dropouts=0.5&dropout_ticks=4&seed=9&rate=2000");
  ScriptedDeviceOptions const read = script.get_if<ScriptedDevice<double>>()->options();
  CHECK((read.max_force == 7.9 && read.quantum == 1e-5 && read.jitter == 2e-4 && read.dropouts == 0.5 &&
         read.dropout_ticks == 4 && read.seed == 9 && read.rate == 2000));
  auto hand = devices.make(
      "sim:hand?hand=firm&mass=0.1&damping=0.3&friction=0.2&quantum=1e-5&force_delay=2&max_force=8&tremor=1e-4&seed=5&lets_go_at=3&at=1,2,3");
  SimulatedHandOptions const held = hand.get_if<SimulatedHand<double>>()->options();
  CHECK((held.hand.stiffness == 500.0 && held.hand.lets_go_at == 3.0 && held.mass == 0.1 && held.damping == 0.3 &&
         held.friction == 0.2 && held.quantum == 1e-5 && held.force_delay == 2 && held.max_force == 8.0 &&
         held.tremor.amplitude == 1e-4 && held.tremor.seed == 5));
  CHECK(hand.get_if<SimulatedHand<double>>()->path().begin() == Vector3<double>(1, 2, 3));
  auto touch = devices.make("sim:touch?hand=light&calibrated=no&path=" + file + "&at=0,0,0.02");
  CHECK(touch.calibration() == Calibration::needs_hand);
  CHECK(touch.get_if<SimulatedTouch<double>>()->hand().options().hand.stiffness == 50.0);
  CHECK(touch.get_if<SimulatedTouch<double>>()->hand().path().begin() == Vector3<double>(0, 0, 0.02));
  CHECK(touch.description().model == "simulated Touch");
}

TEST_CASE("numbers too large or too small are refused, not changed", "[device]") {
  TemporaryFolder const folder;
  auto const script = "script:" + folder.file("stroke.csv", "time_s,x_m,y_m,z_m\n0,0,0,0\n1,0.01,0,0\n").string();
  auto const devices = built_in_devices();
  auto kept = devices.make(script + "?dropout_ticks=5000000");
  CHECK(kept.get_if<ScriptedDevice<double>>()->options().dropout_ticks == 5000000);
  CHECK(unsaid(refusal_by(devices, script + "?dropout_ticks=3000000000"), "dropout_ticks=3000000000", "at most 2147483647") == "");
  CHECK(unsaid(refusal_by(devices, script + "?dropout_ticks=0"), ".dropout_ticks is 0") == "");
  CHECK(unsaid(refusal_by(devices, "sim:hand?force_delay=99999999999"), "force_delay=99999999999", "at most 10000") == "");
  CHECK(unsaid(refusal_by(devices, script + "?quantum=1e-320"), ".quantum is", "1e-12 and more") == "");
  CHECK(unsaid(refusal_by(devices, "sim:hand?quantum=1e-320"), ".quantum is", "1e-12 and more") == "");
  DeviceState<double> state;
  auto finest = devices.make("sim:hand?quantum=1e-12&at=1,2,3");
  finest.read(state);
  CHECK((state.position - Vector3<double>(1, 2, 3)).norm() <= 1e-12);
}

TEST_CASE("a slow device needs no room for a tremor that nobody asked for", "[device]") {
  auto const devices = built_in_devices();
  for (char const* const name : {"sim:hand?rate=20", "sim:touch?rate=20"}) {
    INFO(name);
    AnyDevice<double> device = devices.make(name);
    CHECK(device.capabilities().rate == 20.0);
    device.open();
    DeviceState<double> state;
    CHECK(device.read(state) == DeviceStatus::ok);
    CHECK(state.position.allFinite());
  }
  CHECK(unsaid(refusal_by(devices, "sim:hand?rate=20&tremor=1e-4"), "HandTremor: .frequency is 10 Hz", "half the rate") == "");
  CHECK(unsaid(refusal_by(devices, "sim:hand?tremor=-1"), "HandTremor: .amplitude is -1 m") == "");
}

TEST_CASE("what nobody knows is refused with the names there are", "[device]") {
  auto const devices = built_in_devices();
  CHECK(unsaid(refusal_by(devices, "haply://localhost:10001"), "nothing is called haply", "null:, script:FILE.csv, sim:hand, sim:touch") == "");
  CHECK(unsaid(refusal_by(devices, "sim:tuch?hand=light"), "sim knows no \"tuch\"", "sim:hand, sim:touch") == "");
  CHECK(unsaid(refusal_by(devices, "sim:touch?hnad=light"), "sim:touch has no option hnad", "hand, path, at") == "");
  CHECK(unsaid(refusal_by(devices, "sim:touch?hand=heavy"), "sim:touch?hand=heavy", "light") == "");
  CHECK(unsaid(refusal_by(devices, "null:something"), "nothing follows null:") == "");
  CHECK(unsaid(refusal_by(devices, "script:"), "script:FILE.csv") == "");
  CHECK(unsaid(refusal_by(devices, "script:nowhere.csv"), "nowhere.csv") == "");
  CHECK(unsaid(refusal_by(devices, "sim:hand?mass=0"), "sim:hand?mass=0", ".mass is 0") == "");
  CHECK(unsaid(refusal_by(devices, "touch"), "no colon") == "");
  CHECK(unsaid(refusal_by(DeviceRegistry<double>{}, "null:"), "there are none") == "");
}

TEST_CASE("hosts add names of their own, once each", "[device]") {
  auto devices = built_in_devices();
  std::string asked;
  auto const make = [&asked](DeviceAddress const& address) {
    asked = address.path + " " + address.text("port", "7");
    return AnyDevice<double>(NullDevice<double>());
  };
  devices.add({.name = "robot", .path = "HOST", .about = "our robot", .options = {{"port", "of the host"}}, .make = make});
  devices.add({.name = "robot:mirror", .path = {}, .about = "its mirror image", .options = {}, .make = make});
  CHECK(devices.knows("robot"));
  devices.make("robot:lab 3?port=8");
  CHECK(asked == "lab 3 8");
  devices.make("robot:mirror");
  CHECK(asked == "mirror 7");
  CHECK(unsaid(refusal_by(devices, "robot:mirror?port=8"), "robot:mirror has no option port; it has none") == "");
  CHECK(unsaid(devices.help(), "robot:HOST\n    our robot\n    port=    of the host", "sim:touch\n", "hand=    light, normal or firm") == "");
  auto const refusal = [&](std::string const& name, auto const& maker) {
    return message_of([&] { devices.add({.name = name, .path = {}, .about = {}, .options = {}, .make = maker}); });
  };
  CHECK(unsaid(refusal("robot", make), "robot is there already") == "");
  CHECK(unsaid(refusal("Robot", make), "\"Robot\" is no name") == "");
  CHECK(unsaid(refusal("arm", nullptr), "arm has no .make") == "");
}
