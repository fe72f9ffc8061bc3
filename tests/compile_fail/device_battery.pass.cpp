// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/extend/device.hpp>

/// A driver of its own.
struct Handle {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  palpate::DeviceStatus read(palpate::DeviceState<double>&) noexcept { return palpate::DeviceStatus::ok; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
  void open() {}
  void close() noexcept {}
};

bool check() {
  Handle device;
  return palpate::testing::check_device(device).empty();
}
