// SPDX-License-Identifier: MIT
#pragma once

/// A device of one's own: all that it takes. The page to this header is docs/new_device.md.
///
/// Required, together the concept HapticDevice<Device, Scalar>; double, unless a body in float is to have one in float
///   Capabilities capabilities() const                                at least .max_force [N] and .rate [Hz]
///   DeviceStatus read(DeviceState<double>& state) noexcept           m, m/s, rad/s, device frame: x right, y up, z to the user
///   DeviceStatus write(Wrench<double> const& wrench) noexcept        N, N·m, until the next write
///   neither may allocate, lock, print or wait
///   DeviceState: position, velocity, orientation (unit quaternion), angular_velocity, buttons (bit i); Wrench: force, torque
///   Capabilities besides: .max_torque, .reports_velocity, .reports_orientation, .reports_gripper, .moves_a_hand, …; zero: does not have it
/// Optional; static_assert(OpensAndCloses<MyDevice>) finds a misspelt one; one that lacks its noexcept is refused
///   void open(); void close() noexcept                               open throws; close twice does no harm       OpensAndCloses
///   void arm(); void disarm() noexcept                               motors on and off                           Armable
///   DeviceDescription description() const                            vendor, model, serial, driver               DescribesItself
///   Calibration calibration() noexcept; void calibrate() noexcept                                                Calibratable
///   char const* calibration_advice() const noexcept                  what the user has to do                     AdvisesCalibration
///   std::optional<DeviceFault> pop_fault() noexcept                  oldest first                                ReportsFaults
///   void start(void (*tick)(void*) noexcept, void* context); void stop() noexcept     the driver has the clock   SelfClocked
///   DeviceClock* clock() noexcept                                    null where it has none                      HasOptionalClock
/// Battery
///   testing::to_text(testing::check_device(device)) == ""            no force; {.force = 0.3} writes up to 0.3 N, {.paced = true} for a real one
/// In use
///   Simulator simulator(MyDevice{}, body, cutter, force);            palpate/simulator/simulator.hpp

#include <palpate/device/capabilities.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/testing/device_laws.hpp>

namespace palpate::testing {

/// The least device: it stays where the state was, and nobody holds it.
template <RealScalar Scalar>
struct DeviceArchetype {
  Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .moves_a_hand = false}; }
  DeviceStatus read(DeviceState<Scalar>&) noexcept { return DeviceStatus::ok; }
  DeviceStatus write(Wrench<Scalar> const&) noexcept { return DeviceStatus::ok; }
};

}  // namespace palpate::testing
