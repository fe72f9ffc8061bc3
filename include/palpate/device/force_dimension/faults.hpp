// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/force_dimension/abi.hpp>

#include <string>

namespace palpate {

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
class ForceDimensionError : public Error {
 public:
  ForceDimensionError(ForceDimensionProblem problem, std::string const& text, int native_code = 0)
      : Error("Force Dimension: " + text), problem_(problem), native_code_(native_code) {}

  ForceDimensionProblem problem() const noexcept { return problem_; }
  /// The library's own number; 0: it gave none.
  int native_code() const noexcept { return native_code_; }

 private:
  ForceDimensionProblem problem_;
  int native_code_;
};

namespace detail::force_dimension {

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

}  // namespace detail::force_dimension

}  // namespace palpate
