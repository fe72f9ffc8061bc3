// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>

namespace palpate {

/// Keeps a device open and armed for as long as it lives, whatever way the scope is left.
/// Begin      capabilities checked, `open`, then `arm`, where the device has them. If `arm` throws, the device is closed again.
/// End        a zero wrench is written first, then `disarm`, then `close`: the hand is let go before the motors are.
template <class Device, RealScalar Scalar = double>
  requires HapticDevice<Device, Scalar>
class DeviceSession {
  static_assert(sizeof(detail::DeviceRefinements<Device>) > 0);

 public:
  explicit DeviceSession(Device& device) : device_(device) {
    if constexpr (OpensAndCloses<Device>) device_.open();
    try {
      require_valid(device_.capabilities());   // some devices know what they are only once they are open
      if constexpr (Armable<Device>) device_.arm();
    } catch (...) {
      close();
      throw;
    }
  }
  ~DeviceSession() {
    device_.write(Wrench<Scalar>{});
    if constexpr (Armable<Device>) device_.disarm();
    close();
  }
  DeviceSession(DeviceSession const&) = delete;
  DeviceSession& operator=(DeviceSession const&) = delete;

 private:
  void close() noexcept {
    if constexpr (OpensAndCloses<Device>) device_.close();
  }

  Device& device_;
};

}  // namespace palpate
