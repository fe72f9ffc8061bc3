// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

/// What tests set and see of the stand-in for libHD. It shares no header with the adapter: numbers of the interface are written down twice.
namespace fake_libhd {

/// An error that the driver reports in the tick of this number, counted from the scheduler's start.
struct Mishap {
  std::uint64_t tick = 0;
  unsigned code = 0;      // 0x302, 0x303: the device is gone from then on
  unsigned device = 0;    // index
  std::uint64_t ticks = 1;   // it comes again in each of them
};

/// Settings; to be changed while the scheduler stands still, or between ticks of a virtual clock.
struct Plan {
  bool real_clock = false;          // else ticks come on request
  char const* names[4] = {"Default Device", nullptr, nullptr, nullptr};   // that the driver knows
  bool takes_no_name = true;        // a null name is the first of them
  unsigned init_error = 0;          // of the next `init_failures` calls
  int init_failures = 0;
  int init_milliseconds = 0;        // it takes so long
  char const* password = nullptr;   // of the licence; null: none is needed
  bool scheduler_is_silent = false; // starts, and never ticks
  unsigned start_error = 0;

  int styles = 2;                   // of calibration: 1 reset pose, 2 by itself, 4 inkwell
  unsigned calibration = 0x5000;    // what the check says at first
  bool calibration_helps = true;
  bool in_inkwell = false;          // the user has put it there
  double jump = 0.0;                // mm along x, by which positions are off until it is calibrated
  std::uint64_t drifts_at = 0;      // tick in which the calibration is lost, and the positions are off
  int output_degrees = 3;
  bool transform_by_rows = false;
  bool rate_is_double = false;
  bool turns = true;                // knows its angular velocity
  double turning = 0.0;             // rad/s about y, that it reports
  std::uint64_t misses_at = 0;      // tick in which it gives neither transform nor angular velocity: 0x402

  std::array<Mishap, 8> mishaps{};
  std::uint64_t not_a_number_from = 0, not_a_number_ticks = 0;   // positions
  std::uint64_t stall_at = 0;       // tick, in real time
  int stall_milliseconds = 0;
  bool hand_is_held = false;        // it stays where it is, whatever it feels
  double encoder = 2e-4;            // rad, of its joints
  double script_begins = 0.0;       // s, where in its path
  unsigned seed = 1;                // of the order of callbacks of one priority
  void (*around_callback)(bool before) = nullptr;   // in the servo's thread
};

/// What came of it, of one device.
struct Seen {
  std::atomic<double> force[3]{}, torque[3]{};   // N, N·m; that the motors gave in the last tick
  std::atomic<double> position[3]{};             // mm, of the tip, true
  std::atomic<bool> motors{false};
  std::atomic<std::uint64_t> frames{0}, calibrations{0}, calibrations_under_force{0};
};

struct Control {
  Plan plan;
  Seen seen[4];
  std::atomic<std::uint64_t> ticks{0};        // since the scheduler's start
  std::atomic<int> starts{0}, stops{0}, inits{0}, disables{0};
  std::atomic<long> calls{0};                 // of any function
  std::atomic<int> violations{0};             // of the rules of threads and frames, whether or not there is an error for them
  std::atomic<char const*> violation{""};     // the last one
  std::atomic<bool> init_in_plain_locale{false}, calibration_in_plain_locale{false};
};

}  // namespace fake_libhd

/// Exported by the stand-in. `reset` forgets everything; the scheduler must stand still.
extern "C" {
fake_libhd::Control* fake_libhd_control();
void fake_libhd_reset();
}
