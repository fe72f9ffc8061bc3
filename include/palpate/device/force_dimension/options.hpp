// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/detail/driver.hpp>

#include <limits>
#include <string>

namespace palpate {

struct ForceDimensionOptions {
  int device = 0;             ///< index among the devices that the library finds
  std::string library = {};   ///< file of libdrd or libdhd; empty: the environment's PALPATE_LIBDHD, then the usual names
  double rate = 1000.0;       ///< Hz, of the host's servo; up to 4000 go through the USB
  double max_force = std::numeric_limits<double>::infinity();    ///< N; never above what the device reports
  double max_torque = std::numeric_limits<double>::infinity();   ///< N·m, of a wrist with motors; never above a guess of 0.2

  double ramp = 0.5;       ///< s, in which the force rises from zero after arming, a jump, a gap, or a time without force
  double silence = 0.1;    ///< s of one and the same sample, after which there is no force until a new one comes
  double jump = 0.005;     ///< m from one tick to the next, above which the force begins at zero again
  double gap = 0.05;       ///< s between two reads, above which it does too
  double timeout = 1.0;    ///< s, that open() waits for a first sample

  bool calibrated_only = true;   ///< without calibration there is no force, and arm() throws

  void validate() const {
    detail::OptionCheck const require{"ForceDimensionOptions"};
    require(device >= 0 && device < 127, ".device", device, "", "give the device's index, 0 for the first");
    require(rate >= 1.0 && rate <= 1e5, ".rate", rate, " Hz", "a servo's usual one is 1000");
    require(max_force >= 0.0, ".max_force", max_force, " N", "give zero or more");
    require(max_torque >= 0.0, ".max_torque", max_torque, " N m", "give zero or more");
    require.not_negative(".ramp", ramp, " s");
    require.positive(".silence", silence, " s");
    require.positive(".jump", jump, " m");
    require.positive(".gap", gap, " s");
    require.positive(".timeout", timeout, " s");
  }
};

/// Why a device of Force Dimension could not be opened or armed.
enum class ForceDimensionProblem {
  library_not_found,      ///< neither libdrd nor libdhd could be loaded
  library_incompatible,   ///< what was loaded lacks a function
  device_not_found,       ///< the library opens no device of that index
  in_use,                 ///< this program has it open already
  not_calibrated,
  driver                  ///< the library reported an error of its own: see the code
};

/// Thrown by `ForceDimensionDevice` outside the servo tick. The text is one line: what was tried, what the library said, what to check.
class ForceDimensionError : public detail::DriverError<ForceDimensionProblem> {
 public:
  ForceDimensionError(ForceDimensionProblem problem, std::string const& text, int native_code = 0)
      : DriverError(problem, "Force Dimension: " + text, native_code) {}
};

}  // namespace palpate
