// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/detail/driver.hpp>
#include <palpate/device/phantom/options.hpp>

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

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
constexpr Number force = 0x2700, torque = 0x2701;   // both in the frame of positions; the joint and gimbal torques beside them are about the axes of the arm
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

/// What an error means for the servo.
enum class FaultKind {
  force,        ///< force is off for a moment, the amplifiers come back by themselves: go on, from zero
  device,       ///< the device is of no use until it is opened again
  connection,   ///< it is gone
  use           ///< a call was wrong: ours to mend, or a driver of another mind
};

constexpr FaultKind kind_of(Number code) noexcept {
  if (code >= error::warm_motors && code <= error::no_force) return FaultKind::force;
  if (code == error::connection || code == error::connection_setup) return FaultKind::connection;
  if ((code >= error::device_fault && code <= error::timer) || code == error::no_licence) return FaultKind::device;
  return FaultKind::use;
}

/// What to look at, by the driver's number.
constexpr char const* advice(Number code) noexcept {
  switch (code) {
    case error::connection:
    case error::connection_setup:
      return "check power and cable, that the device is set up and paired in the vendor's setup program, and that this user may read and write its "
             "port";
    case error::already_open: return "another program, or this one, holds the device: end it, or wait a second and open again";
    case error::timer: return "the driver's clock could not start: close other programs that use the device, and check the rate that was asked for";
    case error::no_licence: return "give PhantomOptions::licence, or install the developer's licence";
    case error::device_fault: return "switch the device off and on, run the vendor's diagnosis, check the pairing file and the folder in GTDD_HOME";
    default: return "check the device's name in the vendor's setup program, and run the vendor's diagnosis";
  }
}

/// "0x302 'the driver's words' (internal 7)".
inline std::string said(NativeError const& error, char const* words) {
  constexpr char const* digits = "0123456789abcdef";
  std::string text = "0x";
  for (int shift = 8; shift >= 0; shift -= 4) text += digits[(error.code >> shift) & 15u];
  text += message(" \"", words != nullptr ? words : "", "\"");
  if (error.internal_code != 0) text += message(" (internal ", error.internal_code, ")");
  return text;
}

/// libHD as it was found on this machine, at run time.
/// Invariant  Never unloaded: the driver behind it does not stand being loaded twice.
using Library = DriverLibrary<Functions>;

/// Where to look, in order: the usual names, alone and in the usual folders, unless another was asked for.
inline std::vector<std::string> library_candidates(std::string const& asked) {
  std::vector<std::string> const names{"libHD.so", "libHD.so.3.4", "libHD.so.3.4.0", "libHD.so.3.0"};
  std::vector<std::string> all = names, folders;
  if (std::string const base = environment("OH_SDK_BASE"); !base.empty()) folders = {base + "/lib64", base + "/lib"};
  folders.insert(folders.end(), {"/usr/lib", "/usr/lib64", "/opt/OpenHaptics/Developer/3.4-0/lib64"});
  for (std::string const& folder : folders)
    for (std::string const& name : names) {
      std::error_code problem;
      if (std::filesystem::exists(folder + "/" + name, problem)) all.push_back(folder + "/" + name);
    }
  return detail::library_candidates(asked, "PALPATE_LIBHD", all);
}

/// Fills the table with what `find(name)` gives; throws for the first mandatory function that it does not know.
template <class Find>
Functions bind_functions(Find find, std::string const& path) {
  return bound_functions<Functions>(find, [&](char const* name) {
    throw PhantomError(
        PhantomProblem::library_incompatible,
        message(path, " has no function ", name, ": it is not libHD, or of a version that this adapter does not know (3.0 to 3.5 are meant)"));
  });
}

/// Loads the first library that can be loaded. Throws with every loader's message as it came: it names a library that is missing further down.
inline Library load_library(std::string const& asked) {
  static_assert(sizeof(void*) == 8 || sizeof(void*) == 4);
  if constexpr (!can_load_libraries) throw PhantomError(PhantomProblem::library_not_found, "libHD is loaded on Unix alone so far");
  if constexpr (sizeof(void*) != 8) throw PhantomError(PhantomProblem::library_incompatible, "libHD is used on 64-bit systems only");
  auto const candidates = library_candidates(asked);
  SharedLibrary library = load_first(candidates);
#if defined(PALPATE_CAN_LOAD_LIBRARIES)
  if (library.handle == nullptr && !library.problems.empty()) {   // perhaps it wants the driver's names to be there already
    bool found = false;
    for (char const* const driver : {"libPhantomIOLib42.so", "libPHANToMIO.so.4"})
      found = ::dlopen(driver, RTLD_NOW | RTLD_GLOBAL) != nullptr || found;
    if (found) library = load_first(candidates);
  }
#endif
  if (library.handle == nullptr)
    throw PhantomError(
        PhantomProblem::library_not_found,
        message("libHD could not be loaded: ", library.reason(),
                ". Install OpenHaptics and the device's driver, or say with PhantomOptions::library or the variable PALPATE_LIBHD where libHD is"));
  return {bind_functions([&](char const* name) { return function_of(library, name); }, library.path), library.path};
}

}  // namespace palpate::detail::phantom
