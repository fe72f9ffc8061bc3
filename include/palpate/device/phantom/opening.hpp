// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/phantom/runtime.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#if defined(__unix__)
#include <unistd.h>
#endif

namespace palpate {

/// What of this machine matters to a PHANToM's driver, in one line: its variables, and the ports that a device can be at. Errors of `open()` end with
/// it.
inline std::string phantom_environment() {
  std::string text;
  auto const add = [&](auto const&... parts) { text += (text.empty() ? "" : ", ") + detail::message(parts...); };
  for (char const* name : {"PALPATE_LIBHD", "GTDD_HOME", "OH_SDK_BASE"}) {
    std::string const value = detail::environment(name);
    add(name, value.empty() ? " is not set" : " is ", value);
  }
#if defined(__unix__)
  if (::geteuid() == 0) add("this user is root, whose home may lack the device's files");
  std::vector<std::string> ports;
  std::error_code problem;
  for (auto entry = std::filesystem::directory_iterator("/dev", problem); !problem && entry != std::filesystem::directory_iterator();
       entry.increment(problem)) {
    std::string const name = entry->path().filename().string();
    bool const firewire = name.starts_with("fw") && name.size() > 2 && name[2] >= '0' && name[2] <= '9';
    if (name.starts_with("ttyACM") || name.starts_with("hidraw") || firewire) ports.push_back(entry->path().string());
  }
  std::sort(ports.begin(), ports.end());
  if (ports.empty()) add("there is no /dev/ttyACM*, /dev/hidraw* or /dev/fw*");
  for (std::string const& port : ports)
    add(port, ::access(port.c_str(), R_OK | W_OK) == 0 ? " can be used" : " can not be read and written by this user");
#endif
  return text;
}

}  // namespace palpate

namespace palpate::detail::phantom {

/// What a device says about itself when it is opened.
struct Facts {
  std::string name;   // that the driver took; empty: its default
  Capabilities capabilities;
  DeviceDescription description;
  Number styles = 0;   // of calibration
};

/// Numbers of a parameter in double; nothing when the driver does not know it.
template <std::size_t Count>
std::optional<std::array<double, Count>> asked(Functions const& hd, Number what) {
  std::array<double, Count> values;
  values.fill(std::numeric_limits<double>::quiet_NaN());
  hd.get_doubles(what, values.data());
  static_cast<void>(drained(hd));
  for (double const value : values)
    if (!std::isfinite(value)) return std::nullopt;
  return values;
}
inline std::optional<int> asked_integer(Functions const& hd, Number what) {
  constexpr int never = std::numeric_limits<int>::min();
  int value = never;
  hd.get_integers(what, &value);
  bool const wrong_type = [&] {
    for (NativeError const& entry : drained(hd))
      if (entry.code == error::bad_type) return true;
    return false;
  }();
  if (wrong_type)   // the update rate is said to be an integer, and read as a double by the vendor
    if (auto const real = asked<1>(hd, what)) return static_cast<int>(std::lround((*real)[0]));
  return value != never ? std::optional<int>(value) : std::nullopt;
}
inline std::string asked_text(Functions const& hd, Number what) {
  char const* const text = hd.get_text(what);
  static_cast<void>(drained(hd));
  return text != nullptr ? text : "";
}

inline void query(Functions const& hd, PhantomOptions const& options, Facts& facts) {
  facts.description = {.vendor = asked_text(hd, parameter::vendor),
                       .model = asked_text(hd, parameter::model),
                       .serial = asked_text(hd, parameter::serial),
                       .driver = asked_text(hd, parameter::driver)};
  Capabilities& all = facts.capabilities;
  auto const limit = asked<1>(hd, parameter::max_force);
  double const most = limit && (*limit)[0] > 0.0 ? (*limit)[0] : 0.88;   // N; unsaid: what the weakest of the family stands for ever
  all.max_force = {std::min(options.max_force, most), limit ? Provenance::reported : Provenance::guessed};
  int const hertz = asked_integer(hd, parameter::rate).value_or(0);
  all.rate = hertz > 0 ? reported(hertz) : guessed(options.rate);
  if (auto const continuous = asked<1>(hd, parameter::continuous_force)) all.continuous_force = reported((*continuous)[0]);
  // Said to be "0 to 1", and used as N/mm and N/(mm/s) by the vendor, which fits the devices: the unit is a guess.
  if (auto const stiffness = asked<1>(hd, parameter::max_stiffness)) all.max_stiffness = guessed(1e3 * (*stiffness)[0]);
  if (auto const damping = asked<1>(hd, parameter::max_damping)) all.max_damping = guessed(1e3 * (*damping)[0]);
  if (auto const box = asked<6>(hd, parameter::usable_workspace)) {
    auto const& b = *box;
    all.workspace = {
        .lower = 1e-3 * Vector3<double>(b[0], b[1], b[2]), .upper = 1e-3 * Vector3<double>(b[3], b[4], b[5]), .provenance = Provenance::reported};
    if (!(all.workspace.size().array() > 0.0).all()) all.workspace = {};
  }
  if (asked_integer(hd, parameter::output_degrees).value_or(3) >= 6)
    if (auto const torque = asked<1>(hd, parameter::max_torque)) all.max_torque = reported(1e-3 * (*torque)[0]);
  all.reports_velocity = all.reports_orientation = true;
  all.buttons = 4;   // that the interface has; a Touch has two of them
  facts.styles = static_cast<Number>(asked_integer(hd, parameter::calibration_style).value_or(0));
}

/// The driver opens the name that was asked for, and no other: whoever names a device means that one. Without a name it is the driver's default,
/// which has had two names; where another device is open already these could be that one's.
inline Handle initialised(Functions const& hd, std::size_t others, PhantomOptions const& options, Facts& facts) {
  std::vector<std::string> names{options.device};
  if (options.device.empty() && others == 0) names.insert(names.end(), {"Default Device", "Default PHANToM"});
  std::string tried;
  NativeError last;
  for (std::string const& name : names) {
    for (int attempt = 0; attempt < 2; ++attempt) {
      Handle const handle = hd.init_device(name.empty() ? nullptr : name.c_str());
      auto const errors = drained(hd);
      if (errors.empty() && handle != no_device) {
        facts.name = name;
        return handle;
      }
      if (handle != no_device) {   // half open
        hd.disable_device(handle);
        static_cast<void>(drained(hd));
      }
      last = errors.empty() ? NativeError{} : errors.back();   // the first that came
      tried += (tried.empty() ? "" : ", ") + (name.empty() ? std::string("the default (no name)") : "\"" + name + "\"") + ": " +
               (errors.empty() ? std::string("an invalid handle without an error") : said(last, hd.error_text(last.code)));
      if (last.code != error::already_open) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));   // whoever had it may be going
    }
    if (last.code == error::no_licence) break;
  }
  throw PhantomError(last.code == error::no_licence ? PhantomProblem::licence : PhantomProblem::device_not_found,
                     message("no device was opened; tried ", tried, "; ", advice(last.code),
                             options.device.empty() ? "" : "; a device that has a name is replaced by no other: give the name as in the vendor's setup "
                                                           "program, or none for the driver's default",
                             ". Here ", phantom_environment()),
                     static_cast<int>(last.code));
}

/// Everything from the licence to a servo that can be attached. The scheduler stands still.
inline std::shared_ptr<Servo> open_device(Functions const& hd, std::size_t others, PhantomOptions const& options, Facts& facts) {
  static_cast<void>(drained(hd));
  if (options.licence) {
    if (hd.show_licence == nullptr)
      throw PhantomError(PhantomProblem::licence, "this libHD has no hdDeploymentLicense; leave PhantomOptions::licence empty");
    PhantomLicence const& l = *options.licence;
    bool const taken = hd.show_licence(l.vendor.c_str(), l.application.c_str(), l.password.c_str()) != 0;
    auto const errors = drained(hd);
    if (!taken || !errors.empty())
      throw PhantomError(PhantomProblem::licence,
                         message("the licence of vendor \"", l.vendor, "\" for application \"", l.application, "\" was refused",
                                 errors.empty() ? "" : ": " + said(errors.back(), hd.error_text(errors.back().code)),
                                 "; check the three texts, they are for one library version"));
  }
  Handle const handle = initialised(hd, others, options, facts);
  try {
    if (hd.set_rate != nullptr) hd.set_rate(static_cast<unsigned long>(options.rate));   // before it is asked for; a refusal is told at the start
    static_cast<void>(drained(hd));
    query(hd, options, facts);
    if (options.in_reset_pose && (facts.styles & calibration::reset_pose) != 0) {
      hd.update_calibration(calibration::reset_pose);
      if (auto const errors = drained(hd); !errors.empty())
        throw PhantomError(PhantomProblem::not_calibrated,
                           message("the encoders were not reset: ", said(errors.back(), hd.error_text(errors.back().code))),
                           static_cast<int>(errors.back().code));
    }
    Number const found = hd.check_calibration();
    Calibration const calibrated = found == calibration::good           ? Calibration::good
                                   : found == calibration::needs_update ? Calibration::needs_update
                                                                        : Calibration::needs_hand;
    hd.disable(capability::force);   // until it is armed
    for (Number const guard : {capability::ramping, capability::clamping, capability::software_limit}) hd.enable(guard);
    static_cast<void>(drained(hd));
    return std::make_shared<Servo>(options, handle, facts.capabilities, facts.styles, calibrated);
  } catch (...) {
    hd.disable_device(handle);
    static_cast<void>(drained(hd));
    throw;
  }
}

}  // namespace palpate::detail::phantom
