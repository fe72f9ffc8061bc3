// SPDX-License-Identifier: MIT
// 13: Run this on your device with the tool in nobody's hand and nothing in its way. It writes no force until you give one: new_device 0.3
#include "my_device.hpp"

#include <palpate/device/built_in_devices.hpp>
#include <palpate/testing/device_laws.hpp>

#include <cstdio>
#include <cstdlib>

int main(int count, char** arguments) try {
  using namespace palpate;
  double const force = count > 1 ? std::atof(arguments[1]) : 0.0;   // N, for a moment to each side; more than the device's largest is refused
  DeviceRegistry<double> devices = built_in_devices();
  add_my_device(devices);
  AnyDevice<double> device = devices.make("mine:");
  std::printf("%s %s, number %s\n", device.description().vendor.c_str(), device.description().model.c_str(), device.description().serial.c_str());

  // A device of metal needs its ticks at its rate.
  testing::Violations const broken = testing::check_device(device, {.ticks = 2000, .force = force, .paced = device.capabilities().moves_a_hand});
  if (broken.empty()) {
    std::printf("keeps the laws of a device\n");
    return EXIT_SUCCESS;
  }
  std::printf("%s", testing::to_text(broken).c_str());
  return EXIT_FAILURE;
} catch (palpate::Error const& error) {
  std::printf("new_device: %s\n", error.what());
  return EXIT_FAILURE;
}
