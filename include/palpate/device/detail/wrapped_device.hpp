// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>

#include <optional>
#include <utility>

namespace palpate::detail {

/// Base of devices that wrap another: forwards capabilities and every refinement that the inner device has.
template <class Device, RealScalar S>
  requires HapticDevice<Device, S>
class WrappedDevice {
  static_assert(sizeof(DeviceRefinements<Device>) > 0);

 public:
  Capabilities capabilities() const noexcept(noexcept(std::declval<Device const&>().capabilities())) { return device_.capabilities(); }

  void open() requires OpensAndCloses<Device> { device_.open(); }
  void close() noexcept requires OpensAndCloses<Device> { device_.close(); }
  void arm() requires Armable<Device> { device_.arm(); }
  void disarm() noexcept requires Armable<Device> { device_.disarm(); }
  DeviceDescription description() const requires DescribesItself<Device> { return device_.description(); }
  Calibration calibration() noexcept requires Calibratable<Device> { return device_.calibration(); }
  void calibrate() noexcept requires Calibratable<Device> { device_.calibrate(); }
  char const* calibration_advice() const noexcept requires AdvisesCalibration<Device> { return device_.calibration_advice(); }
  std::optional<DeviceFault> pop_fault() noexcept requires ReportsFaults<Device> { return device_.pop_fault(); }
  void start(void (*tick)(void*) noexcept, void* context) requires SelfClocked<Device> { device_.start(tick, context); }
  void stop() noexcept requires SelfClocked<Device> { device_.stop(); }
  DeviceClock* clock() noexcept requires HasOptionalClock<Device> { return device_.clock(); }

  Device& device() noexcept { return device_; }
  Device const& device() const noexcept { return device_; }

 protected:
  explicit WrappedDevice(Device device) : device_(std::move(device)) {}

  Device device_;
};

}  // namespace palpate::detail
