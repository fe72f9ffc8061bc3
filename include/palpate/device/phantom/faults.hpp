// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/phantom/abi.hpp>

#include <string>

namespace palpate {

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
class PhantomError : public Error {
 public:
  PhantomError(PhantomProblem problem, std::string const& text, int native_code = 0)
      : Error("PHANToM: " + text), problem_(problem), native_code_(native_code) {}

  PhantomProblem problem() const noexcept { return problem_; }
  /// The driver's own number; 0: it gave none.
  int native_code() const noexcept { return native_code_; }

 private:
  PhantomProblem problem_;
  int native_code_;
};

namespace detail::phantom {

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

}  // namespace detail::phantom

}  // namespace palpate
