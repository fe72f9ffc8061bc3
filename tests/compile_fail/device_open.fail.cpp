// SPDX-License-Identifier: MIT
// expect: palpate: the device has open() and no close(), so that it would never be opened; declare: void open(); void close() noexcept.
// A device whose destructor closes it would never be opened, behind an AnyDevice too.
#include <palpate/palpate.hpp>

/// A driver of its own.
struct Handle {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  palpate::DeviceStatus read(palpate::DeviceState<double>&) noexcept { return palpate::DeviceStatus::ok; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
  void open() {}
};

void run() {
  palpate::AnyDevice<double> device(Handle{});
  device.open();
}
