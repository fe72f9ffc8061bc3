// SPDX-License-Identifier: MIT
#pragma once

/// The binary interface of libHD, the device library of OpenHaptics, as far as the adapter uses it: own names for the types, numbers and functions
/// that the library exports. Nothing of the vendor's headers is here or needed.
/// Limits     64-bit only: a `long` is what the platform makes it, eight bytes on Linux and four on Windows, as in the library.
namespace palpate::detail::phantom {

using Handle = unsigned int;    // of a device
using Number = unsigned int;    // of an error, parameter, capability or style
using Truth = unsigned char;
using Task = unsigned long;     // of the scheduler: wider than a Number on Linux

constexpr Handle no_device = 0xFFFFFFFFu;

/// An entry of the library's error stack, returned by value.
struct NativeError {
  Number code = 0;
  int internal_code = 0;
  Handle device = no_device;
};
static_assert(sizeof(NativeError) == 12);

using Callback = Number (*)(void*);
constexpr Number callback_done = 0, callback_continues = 1;

constexpr unsigned short highest_priority = 65535;

namespace error {
constexpr Number none = 0;
constexpr Number unknown_name = 0x100, bad_value = 0x101, bad_operation = 0x102, bad_type = 0x103, bad_handle = 0x104;
constexpr Number warm_motors = 0x200, too_much_force = 0x201, too_quick_force = 0x202, too_fast = 0x203, no_force = 0x204;
constexpr Number device_fault = 0x300, already_open = 0x301, connection = 0x302, connection_setup = 0x303, timer = 0x304;
constexpr Number bad_begin = 0x400, bad_end = 0x401, bad_frame = 0x402;
constexpr Number bad_priority = 0x500, scheduler_full = 0x501;
constexpr Number no_licence = 0x600;
}  // namespace error

namespace parameter {
constexpr Number buttons = 0x2000, position = 0x2050, velocity = 0x2051, transform = 0x2052, angular_velocity = 0x2053;
constexpr Number version = 0x2500, model = 0x2501, driver = 0x2502, vendor = 0x2503, serial = 0x2504, firmware = 0x2505;
constexpr Number usable_workspace = 0x2551, output_degrees = 0x2554, calibration_style = 0x2555;
constexpr Number rate = 0x2600, rate_now = 0x2601, max_stiffness = 0x2602, max_force = 0x2603, continuous_force = 0x2604, max_damping = 0x2609;
constexpr Number max_torque = 0x2622;
constexpr Number force = 0x2700, gimbal_torque = 0x2704;
}  // namespace parameter

namespace capability {
constexpr Number force = 0x4000, clamping = 0x4001, ramping = 0x4002, software_limit = 0x4003;
}  // namespace capability

namespace calibration {
constexpr Number good = 0x5000, needs_update = 0x5001, needs_hand = 0x5002;
constexpr Number reset_pose = 1, automatic = 2, inkwell = 4;   // styles, one bit each
}  // namespace calibration

/// What the adapter calls of the library. Device calls outside the scheduler's callback are legal only while the scheduler is stopped.
struct Functions {
  Handle (*init_device)(char const* name) = nullptr;
  void (*disable_device)(Handle) = nullptr;
  void (*make_current)(Handle) = nullptr;
  void (*begin_frame)(Handle) = nullptr;   // latches the state, makes the device current, zeroes its force
  void (*end_frame)(Handle) = nullptr;     // sends
  NativeError (*next_error)() = nullptr;   // the newest; one stack for all threads and devices
  char const* (*error_text)(Number) = nullptr;
  void (*enable)(Number) = nullptr;
  void (*disable)(Number) = nullptr;
  void (*get_integers)(Number, int*) = nullptr;
  void (*get_doubles)(Number, double*) = nullptr;
  char const* (*get_text)(Number) = nullptr;
  void (*set_doubles)(Number, double const*) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
  Task (*schedule)(Callback, void*, unsigned short priority) = nullptr;
  void (*unschedule)(Task) = nullptr;
  Number (*check_calibration)() = nullptr;
  void (*update_calibration)(Number style) = nullptr;

  // What older or newer libraries may lack.
  void (*set_rate)(unsigned long hertz) = nullptr;
  Truth (*show_licence)(char const* vendor, char const* application, char const* password) = nullptr;

  // Not the vendor's: a stand-in for the library that keeps a virtual clock exports these two.
  int (*advance_clock)(int ticks) = nullptr;    // runs so many ticks and returns how many; below zero when there is no virtual clock
  void (*release_clock)(int free) = nullptr;    // 1: ticks come by the wall clock; 0: only when asked for
};

/// Calls visit(name, pointer, mandatory) for each of them.
template <class Visit>
void for_each_function(Functions& functions, Visit visit) {
  visit("hdInitDevice", functions.init_device, true);
  visit("hdDisableDevice", functions.disable_device, true);
  visit("hdMakeCurrentDevice", functions.make_current, true);
  visit("hdBeginFrame", functions.begin_frame, true);
  visit("hdEndFrame", functions.end_frame, true);
  visit("hdGetError", functions.next_error, true);
  visit("hdGetErrorString", functions.error_text, true);
  visit("hdEnable", functions.enable, true);
  visit("hdDisable", functions.disable, true);
  visit("hdGetIntegerv", functions.get_integers, true);
  visit("hdGetDoublev", functions.get_doubles, true);
  visit("hdGetString", functions.get_text, true);
  visit("hdSetDoublev", functions.set_doubles, true);
  visit("hdStartScheduler", functions.start_scheduler, true);
  visit("hdStopScheduler", functions.stop_scheduler, true);
  visit("hdScheduleAsynchronous", functions.schedule, true);
  visit("hdUnschedule", functions.unschedule, true);
  visit("hdCheckCalibration", functions.check_calibration, true);
  visit("hdUpdateCalibration", functions.update_calibration, true);
  visit("hdSetSchedulerRate", functions.set_rate, false);
  visit("hdDeploymentLicense", functions.show_licence, false);
  visit("palpate_advance_clock", functions.advance_clock, false);
  visit("palpate_release_clock", functions.release_clock, false);
}

}  // namespace palpate::detail::phantom
