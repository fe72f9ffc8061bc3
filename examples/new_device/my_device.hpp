// SPDX-License-Identifier: MIT
#pragma once

#include "driver.hpp"   // 1: your maker's header

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/device_registry.hpp>

#include <optional>
#include <utility>

/// 2: Your device: name it, fill in the numbered places, take out what it does not have. `capabilities`, `read` and `write` have to stay.
///    `read` and `write` are called once a tick, from one thread: nothing in them may throw, allocate, lock, print or wait.
class MyDevice {
 public:
  // 3: What it can do. SI. Say where each number comes from: reported by the device, from its data sheet, or guessed. What nobody knows stays out.
  palpate::Capabilities capabilities() const noexcept {
    using namespace palpate;
    return {.max_force = datasheet(3.3),
            .rate = 1000.0,
            .reports_velocity = true,       // false: `read` leaves `velocity` alone and the host differentiates
            .reports_orientation = false,   // likewise
            .buttons = 2,
            .moves_a_hand = true,           // somebody holds it: caps and buttons for their safety are on
            .continuous_force = datasheet(0.88),
            .resolution = datasheet(5.5e-5)};
  }

  // 4: May take its time and throws with advice. The host opens, arms, ticks, disarms and closes; closing twice must do no harm.
  void open() {
    if (int const error = maker_open(); error != 0)
      throw palpate::Error(palpate::detail::message("my device: maker_open gives ", error, "; is it plugged in, and may you use it?"));
  }
  void close() noexcept { maker_close(); }

  // 5: Motors on and off.
  void arm() {
    if (int const error = maker_enable_motors(1); error != 0)
      throw palpate::Error(palpate::detail::message("my device: its motors do not start, error ", error));
  }
  void disarm() noexcept { maker_enable_motors(0); }

  // 6: Where is the hand, in m and the device's frame: x to the right, y up, z to the user. A read that fails leaves `state` as it is.
  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    double position[3], velocity[3];
    int buttons = 0;
    int const error = maker_get(position, velocity, &buttons);
    if (error > 1) return failed(error);
    state.position = in_metres(position);
    state.velocity = in_metres(velocity);
    state.buttons = static_cast<std::uint32_t>(buttons) & 3u;
    return error == 1 ? palpate::DeviceStatus::stale : palpate::DeviceStatus::ok;
  }

  // 7: What it feels, until the next write. The host has limited it to `max_force` and made sure that it is finite.
  palpate::DeviceStatus write(palpate::Wrench<double> const& wrench) noexcept {
    double const force[3] = {wrench.force.x(), -wrench.force.z(), wrench.force.y()};   // the way back of 6
    int const error = maker_set_force(force);
    return error == 0 ? palpate::DeviceStatus::ok : failed(error);
  }

  // 8: Who it is; not in a tick, so it may allocate.
  palpate::DeviceDescription description() const { return {.vendor = "maker", .model = "mine", .serial = maker_serial(), .driver = "1.0"}; }

  // 9: What went wrong, in the maker's number and words that are not freed.
  std::optional<palpate::DeviceFault> pop_fault() noexcept { return std::exchange(fault_, std::nullopt); }

  // 10: If it has to be calibrated: `palpate::Calibration calibration() noexcept` and `void calibrate() noexcept`.
  //     If its driver has the clock: `void start(void (*tick)(void*) noexcept, void* context)` and `void stop() noexcept`.

 private:
  palpate::DeviceStatus failed(int error) noexcept {
    auto const status = error == 2 ? palpate::DeviceStatus::disconnected : palpate::DeviceStatus::fault;
    if (!fault_) fault_ = {.status = status, .native_code = error, .what = error == 2 ? "the cable is out" : "the driver is not open"};
    return status;
  }
  /// From the maker's axes, x right, y away from the user, z up, in mm.
  static palpate::Vector3<double> in_metres(double const (&mm)[3]) noexcept { return palpate::Vector3<double>(mm[0], mm[2], -mm[1]) / 1000.0; }

  std::optional<palpate::DeviceFault> fault_;
};

// 11: The compiler names what is missing.
static_assert(palpate::HapticDevice<MyDevice> && palpate::OpensAndCloses<MyDevice> && palpate::Armable<MyDevice> &&
              palpate::DescribesItself<MyDevice> && palpate::ReportsFaults<MyDevice>);

/// 12: Its name for users, if programs choose devices by name.
inline void add_my_device(palpate::DeviceRegistry<double>& devices) {
  devices.add({.name = "mine", .path = {}, .about = "the device of examples/new_device", .options = {}, .make = [](palpate::DeviceAddress const&) {
                 return palpate::AnyDevice<double>(MyDevice{});
               }});
}
