// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/detail/driver.hpp>

#include <limits>
#include <optional>
#include <string>

namespace palpate {

/// What the vendor gives to those who deploy an application. The library ships none.
struct PhantomLicence {
  std::string vendor{}, application{}, password{};
};

struct PhantomOptions {
  std::string device = {};    ///< its name in the vendor's setup program, and no other device; empty: the driver's default, under any of its usual names
  std::string library = {};   ///< file of libHD; empty: the environment's PALPATE_LIBHD, then the usual names and places
  std::optional<PhantomLicence> licence = {};
  double rate = 1000.0;       ///< Hz, of the driver's clock; what it takes depends on the device
  double max_force = std::numeric_limits<double>::infinity();   ///< N; never above what the device reports

  double ramp = 0.5;          ///< s, in which the force rises from zero after arming, calibration, an error of force, a jump or a gap
  double silence = 0.1;       ///< s without a tick of the driver after which the device counts as gone
  double held = 0.02;         ///< s, how long a force is held that is not written anew
  double jump = 0.005;        ///< m in one tick, above which the force begins at zero again
  double timeout = 10.0;      ///< s, for each call of the driver outside the servo

  bool calibrated_only = true;      ///< without calibration there is no force, and arm() throws
  bool calibrates_itself = true;    ///< what the driver can correct by itself is corrected when it asks for it, with the force off
  bool in_reset_pose = false;       ///< for devices with encoders that are reset: the user holds the reset pose while open() runs
  double calibration_patience = 0;  ///< s that arm() waits for the user to calibrate

  void validate() const {
    detail::OptionCheck const require{"PhantomOptions"};
    require(rate >= 1.0 && rate <= 1e5, ".rate", rate, " Hz", "the driver's usual one is 1000");
    require(max_force >= 0.0, ".max_force", max_force, " N", "give zero or more");
    require.not_negative(".ramp", ramp, " s");
    require.positive(".silence", silence, " s");
    require.positive(".held", held, " s");
    require.positive(".jump", jump, " m");
    require.positive(".timeout", timeout, " s");
    require.not_negative(".calibration_patience", calibration_patience, " s");
  }
};

/// Why a PHANToM could not be opened, armed or started.
enum class PhantomProblem {
  library_not_found,      ///< no libHD could be loaded
  library_incompatible,   ///< what was loaded lacks a function
  licence,                ///< the licence of deployment was refused
  device_not_found,       ///< the driver opens no device of that name
  not_calibrated,
  timeout,                ///< the driver did not come back in time
  driver                  ///< the driver reported an error of its own: see the code
};

/// Thrown by `PhantomDevice` outside the servo tick. The text is one line: what was tried, what the driver said, what to check.
class PhantomError : public detail::DriverError<PhantomProblem> {
 public:
  PhantomError(PhantomProblem problem, std::string const& text, int native_code = 0) : DriverError(problem, "PHANToM: " + text, native_code) {}
};

}  // namespace palpate
