// SPDX-License-Identifier: MIT
#pragma once

/// What tests set and see of the stand-in for libdhd. It shares no header with the adapter: numbers of the interface are written down twice.
namespace fake_libdhd {

/// A call that can go wrong.
enum class Call { none, open, enable, status, pose, velocity, forces };

/// Settings; samples are counted from 1 at the opening, repeated ones too.
struct Plan {
  int devices = 1;
  char const* model = "omega.7";
  bool wrist = true, active_wrist = false;
  double limit = -1.0;   // N, that the library has at first; below zero: none
  double saturates_at = 1e9;   // N

  Call fails = Call::none;    // with `code`, in the sample of that number or, before there is one, at once
  int code = 1;
  long fails_from = 0, fails_until = 1000000000;
  long vanishes_at = 0;       // the device is gone from that sample on
  long repeats_from = 0, repeats = 0;               // TIMEGUARD
  long not_a_number_from = 0, not_a_number = 0;     // positions
  long jumps_at = 0;          // by 20 mm, for ever
  bool uncalibrated = false, in_error = false;
  int off_by = 0;             // why the device has switched its force off; 0: it has not
};

/// What came of it, of the device that was opened last.
struct Control {
  Plan plan;
  double force[3] = {}, torque[3] = {};   // that the motors give, in the library's axes
  double position[3] = {}, velocity[3] = {};
  double limit = -1.0;
  bool motors = false, open = false;
  long samples = 0, calls = 0, sent = 0, opens = 0, closes = 0;
  double first_sent = -1.0;   // N, since the motors were switched on
  int violations = 0;         // of the rules, whether or not the vendor's library would mind
  char const* violation = "";
};

}  // namespace fake_libdhd

/// Exported by the stand-in. `reset` forgets everything; no device may be open.
extern "C" {
fake_libdhd::Control* fake_libdhd_control();
void fake_libdhd_reset();
}
