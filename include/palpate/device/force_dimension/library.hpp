// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/detail/driver.hpp>
#include <palpate/device/force_dimension/options.hpp>

#include <string>
#include <vector>

/// The binary interface of DHD, the device library of Force Dimension, as far as the adapter uses it: own names for the numbers and functions that
/// the library exports. Nothing of the vendor's headers is here or needed.
namespace palpate::detail::force_dimension {

using Id = char;   // of an open device; not its index

namespace result {   // below zero: an error, ask last_error
constexpr int done = 0;
constexpr int repeated = 1;    // the library was asked too soon and gave the last sample again
constexpr int saturated = 2;   // sent, but a motor gives less than it was asked for
}  // namespace result

namespace error {
constexpr int communication = 2, busy = 3, no_driver = 4, no_device = 5, timeout = 7, not_ready = 12, bad_index = 15, in_use = 20;
}  // namespace error

namespace status {   // index into what `status` fills
constexpr int connected = 1, needs_reset = 3, force = 5, error = 9, force_off_cause = 14;
constexpr int room = 32;   // 15 to 17 are filled, by version
}  // namespace status

namespace force_off {
constexpr int none = 0, button = 1, velocity = 2, watchdog = 3, software = 4, unplugged = 5, dead_man = 6;
}  // namespace force_off

struct Functions {
  int (*open)(Id index) = nullptr;   // gives the id
  int (*close)(Id) = nullptr;
  int (*enable_force)(unsigned char on, Id) = nullptr;
  int (*status)(int*, Id) = nullptr;
  int (*pose)(double* x, double* y, double* z, double (*rows)[3], Id) = nullptr;
  int (*velocity)(double* x, double* y, double* z, Id) = nullptr;
  unsigned (*buttons)(Id) = nullptr;
  int (*set_forces)(double fx, double fy, double fz, double tx, double ty, double tz, double grip, Id) = nullptr;
  double (*max_force)(Id) = nullptr;   // below zero: no limit was set
  int (*set_max_force)(double, Id) = nullptr;
  int (*last_error)() = nullptr;   // of this thread
  char const* (*error_text)(int) = nullptr;

  // What older libraries may lack.
  int (*angular_velocity)(double* x, double* y, double* z, Id) = nullptr;
  bool (*has_wrist)(Id) = nullptr;
  bool (*has_active_wrist)(Id) = nullptr;
  char const* (*model)(Id) = nullptr;
  int (*serial)(unsigned short*, Id) = nullptr;
  void (*version)(int*, int*, int*, int*) = nullptr;
};

/// Calls visit(name, pointer, mandatory) for each of them.
template <class Visit>
void for_each_function(Functions& functions, Visit visit) {
  visit("dhdOpenID", functions.open, true);
  visit("dhdClose", functions.close, true);
  visit("dhdEnableForce", functions.enable_force, true);
  visit("dhdGetStatus", functions.status, true);
  visit("dhdGetPositionAndOrientationFrame", functions.pose, true);
  visit("dhdGetLinearVelocity", functions.velocity, true);
  visit("dhdGetButtonMask", functions.buttons, true);
  visit("dhdSetForceAndTorqueAndGripperForce", functions.set_forces, true);
  visit("dhdGetMaxForce", functions.max_force, true);
  visit("dhdSetMaxForce", functions.set_max_force, true);
  visit("dhdErrorGetLast", functions.last_error, true);
  visit("dhdErrorGetStr", functions.error_text, true);
  visit("dhdGetAngularVelocityRad", functions.angular_velocity, false);
  visit("dhdHasWrist", functions.has_wrist, false);
  visit("dhdHasActiveWrist", functions.has_active_wrist, false);
  visit("dhdGetSystemName", functions.model, false);
  visit("dhdGetSerialNumber", functions.serial, false);
  visit("dhdGetSDKVersion", functions.version, false);
}

constexpr DeviceStatus severity_of(int code) noexcept {
  return code == error::communication || code == error::no_device ? DeviceStatus::disconnected : DeviceStatus::fault;
}

/// What to look at, by the library's number.
constexpr char const* advice(int code) noexcept {
  switch (code) {
    case error::no_driver: return "the library found no USB driver: on Linux it needs libusb-1.0";
    case error::communication:
    case error::timeout: return "check the USB cable, and switch the device off and on";
    case error::busy:
    case error::in_use: return "another program holds the device: end it";
    case error::not_ready: return "switch the device on, and calibrate it as its manual says";
    default:
      return "check power and USB cable, that this user may read and write the device (a udev rule), and the index: 0 is the first device";
  }
}

constexpr char const* force_off_words(int cause) noexcept {
  switch (cause) {
    case force_off::button: return "the device's force is off: its force button was pressed; press it again";
    case force_off::velocity: return "the device's force is off: it was moved too fast; press its force button, or arm it again";
    case force_off::watchdog: return "the device's force is off: its watchdog saw no force come; arm it again";
    case force_off::software: return "the device's force is off: a program has switched it off; arm it again";
    case force_off::dead_man: return "the device's force is off: the hand has let it go";
    default: return "the device's force is off; press its force button, or arm it again";
  }
}

/// error 2 "its words".
inline std::string said(Functions const& dhd, int code) {
  char const* const words = dhd.error_text(code);
  return message("error ", code, " \"", words != nullptr ? words : "", "\"");
}

using Library = DriverLibrary<Functions>;

/// In order, unless another was asked for. libdrd holds all that libdhd does.
inline std::vector<std::string> library_candidates(std::string const& asked) {
  return detail::library_candidates(asked, "PALPATE_LIBDHD", {"libdrd.so", "libdhd.so", "libdrd.so.3", "libdhd.so.3"});
}

/// Fills the table with what `find(name)` gives; throws for the first mandatory function that it does not know.
template <class Find>
Functions bind_functions(Find find, std::string const& path) {
  return bound_functions<Functions>(find, [&](char const* name) {
    throw ForceDimensionError(ForceDimensionProblem::library_incompatible,
                              message(path, " has no function ", name,
                                      ": it is neither libdhd nor libdrd, or of a version that this adapter does not know (3.17 is meant)"));
  });
}

/// Loads the first library that can be loaded. Throws with the loader's messages as they came.
inline Library load_library(std::string const& asked) {
  if constexpr (!can_load_libraries) throw ForceDimensionError(ForceDimensionProblem::library_not_found, "libdhd is loaded on Unix alone so far");
  SharedLibrary const library = load_first(library_candidates(asked));
  if (library.handle == nullptr)
    throw ForceDimensionError(ForceDimensionProblem::library_not_found,
                              message("libdhd could not be loaded: ", library.reason(),
                                      ". Install the vendor's SDK, or say with ForceDimensionOptions::library or the variable PALPATE_LIBDHD where "
                                      "libdrd or libdhd is"));
  return {bind_functions([&](char const* name) { return function_of(library, name); }, library.path), library.path};
}

}  // namespace palpate::detail::force_dimension
