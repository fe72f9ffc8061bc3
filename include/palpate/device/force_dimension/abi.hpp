// SPDX-License-Identifier: MIT
#pragma once

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

}  // namespace palpate::detail::force_dimension
