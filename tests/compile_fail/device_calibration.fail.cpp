// SPDX-License-Identifier: MIT
// expect: palpate: the device's calibration() or calibrate() may throw, so that it would count as calibrated; declare: Calibration calibration() noexcept; void calibrate() noexcept.
// A device whose calibration() may throw would count as calibrated, behind an AnyDevice too.
#include <palpate/palpate.hpp>

/// A driver of its own.
struct Handle {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  palpate::DeviceStatus read(palpate::DeviceState<double>&) noexcept { return palpate::DeviceStatus::ok; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
  palpate::Calibration calibration() { return palpate::Calibration::needs_hand; }
  void calibrate() noexcept {}
};

void run() {
  palpate::AnyDevice<double> device(Handle{});
  device.open();
}
