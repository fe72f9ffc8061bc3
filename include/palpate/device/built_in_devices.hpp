// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/device_registry.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/simulated_touch.hpp>

#include <limits>
#include <vector>

namespace palpate {

namespace detail {

/// light, normal or firm.
inline HandOptions hand_of(DeviceAddress const& address) {
  HandOptions hand;
  switch (address.choice("hand", {"normal", "light", "firm"})) {
    case 1: hand = light_hand(); break;
    case 2: hand = firm_hand(); break;
    default: hand = normal_hand();
  }
  hand.lets_go_at = address.number("lets_go_at", std::numeric_limits<double>::infinity());
  return hand;
}

template <RealScalar Scalar>
Trajectory<Scalar> path_of(DeviceAddress const& address) {
  if (address.has("path")) {
    Trajectory<Scalar> const path = Trajectory<Scalar>::from_csv(address.text("path", ""));
    return path.moved(address.point("at", Vector3<double>::Zero()).cast<Scalar>());
  }
  return Trajectory<Scalar>::start(address.point("at", Vector3<double>::Zero()).cast<Scalar>());
}

inline HandTremorOptions tremor_of(DeviceAddress const& address) {
  return {.amplitude = address.number("tremor", 0.0), .seed = address.count("seed", 0)};
}

template <RealScalar Scalar>
std::vector<typename DeviceScheme<Scalar>::Option> hand_options() {
  return {{"hand", "light, normal or firm"},
          {"path", "a CSV file with time_s,x_m,y_m,z_m that the hand means to follow; without one it rests"},
          {"at", "x,y,z in metres: where it rests, or by how much the path is moved"},
          {"tremor", "root mean square along each axis, m"},
          {"lets_go_at", "s"},
          {"rate", "Hz, 1000"},
          {"seed", "of the tremor"}};
}

}  // namespace detail

/// The devices of the library that need no driver: null:, script:FILE.csv, sim:hand, sim:touch. Adapters add theirs: a session's replay is
/// `add_replay` of the training folder.
template <RealScalar Scalar = double>
DeviceRegistry<Scalar> built_in_devices() {
  DeviceRegistry<Scalar> devices;
  devices.add({.name = "null",
               .path = {},
               .about = "a hand that stays where it is and feels nothing",
               .options = {{"at", "x,y,z in metres"}, {"rate", "Hz, 1000"}},
               .make = [](DeviceAddress const& address) {
                 Vector3<double> const at = address.point("at", Vector3<double>::Zero());
                 return AnyDevice<Scalar>(NullDevice<Scalar>(at.cast<Scalar>(), address.number("rate", 1000.0)));
               }});
  devices.add({.name = "script",
               .path = "FILE.csv",
               .about = "a hand that follows a file with time_s,x_m,y_m,z_m, whatever it feels",
               .options = {{"rate", "Hz, 1000"}, {"max_force", "N, 3.3"}, {"quantum", "m, resolution of the position"},
                           {"jitter", "s, of the sampling time"}, {"dropouts", "share of the ticks in which samples begin to be missing, 0 to 1"},
                           {"dropout_ticks", "how long they are missing, 1"}, {"seed", "of jitter and dropouts"}},
               .make = [](DeviceAddress const& address) {
                 ScriptedDeviceOptions options;
                 options.rate = address.number("rate", options.rate);
                 options.max_force = address.number("max_force", options.max_force);
                 options.quantum = address.number("quantum", options.quantum);
                 options.jitter = address.number("jitter", options.jitter);
                 options.dropouts = address.number("dropouts", options.dropouts);
                 options.dropout_ticks = static_cast<int>(address.count("dropout_ticks", 1, std::numeric_limits<int>::max()));
                 options.seed = address.count("seed", 0);
                 if (address.path.empty()) throw InvalidArgument("script: needs a file; write script:FILE.csv");
                 return AnyDevice<Scalar>(ScriptedDevice<Scalar>(Trajectory<Scalar>::from_csv(address.path), options));
               }});
  auto hand = detail::hand_options<Scalar>();
  auto touch = hand;
  hand.insert(hand.end(), {{"max_force", "N, 3.3"},
                           {"mass", "kg, of the device, 0.045"},
                           {"damping", "N s/m, of the device, 0.1"},
                           {"friction", "N, of the device, 0"},
                           {"quantum", "m, resolution of the position"},
                           {"force_delay", "ticks from a write to the motors, 0"}});
  devices.add({.name = "sim:hand",
               .path = {},
               .about = "a hand of mass, spring and damper that holds a device and gives way to the force",
               .options = hand,
               .make = [](DeviceAddress const& address) {
                 SimulatedHandOptions options{.hand = detail::hand_of(address), .tremor = detail::tremor_of(address)};
                 options.rate = address.number("rate", options.rate);
                 options.max_force = address.number("max_force", options.max_force);
                 options.mass = address.number("mass", options.mass);
                 options.damping = address.number("damping", options.damping);
                 options.friction = address.number("friction", options.friction);
                 options.quantum = address.number("quantum", options.quantum);
                 options.force_delay = static_cast<int>(address.count("force_delay", 0, 10000));
                 return AnyDevice<Scalar>(SimulatedHand<Scalar>(detail::path_of<Scalar>(address), options));
               }});
  touch.push_back({"calibrated", "yes, or no: the pen has to be taken to the inkwell first"});
  devices.add({.name = "sim:touch",
               .path = {},
               .about = "a Touch in such a hand: its arm, stops, inkwell, buttons, 3.3 N and warm motors",
               .options = touch,
               .make = [](DeviceAddress const& address) {
                 SimulatedTouchOptions options{.hand = detail::hand_of(address), .tremor = detail::tremor_of(address)};
                 options.rate = address.number("rate", options.rate);
                 options.calibrated = address.choice("calibrated", {"yes", "no"}) == 0;
                 return AnyDevice<Scalar>(SimulatedTouch<Scalar>(detail::path_of<Scalar>(address), options));
               }});
  return devices;
}

}  // namespace palpate
