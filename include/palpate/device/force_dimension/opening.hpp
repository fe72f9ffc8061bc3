// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/capabilities.hpp>
#include <palpate/device/force_dimension/library.hpp>
#include <palpate/device/force_dimension/options.hpp>
#include <palpate/device/force_dimension/servo.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace palpate::detail::force_dimension {

/// A device that this program holds; given back when it goes.
/// Invariant  one for each device: the library gives a second opening the id of the first, and closing that would close both.
class Connection {
 public:
  Connection(Library library, int index) : library_(std::move(library)) {
    Functions const& dhd = library_.functions;
    std::lock_guard const lock(held().mutex);
    int const opened = dhd.open(static_cast<Id>(index));
    if (opened < 0) {
      int const code = dhd.last_error();
      throw ForceDimensionError(ForceDimensionProblem::device_not_found,
                                message("device ", index, " was not opened: ", said(dhd, code), "; ", advice(code)), code);
    }
    id_ = static_cast<Id>(opened);
    if (!held().devices.insert({dhd.close, id_}).second)
      throw ForceDimensionError(ForceDimensionProblem::in_use, message("device ", index, " is open in this program already; close it there first"));
  }
  Connection(Connection const&) = delete;
  Connection& operator=(Connection const&) = delete;
  ~Connection() {
    Functions const& dhd = library_.functions;
    static_cast<void>(dhd.enable_force(0, id_));   // also after a fault, in which it may not have come through
    if (limited_) static_cast<void>(dhd.set_max_force(limit_before_, id_));
    std::lock_guard const lock(held().mutex);
    static_cast<void>(dhd.close(id_));
    held().devices.erase({dhd.close, id_});
  }

  Functions const& functions() const noexcept { return library_.functions; }
  std::string const& path() const noexcept { return library_.path; }
  Id id() const noexcept { return id_; }

  /// N, that the library lets through; below zero: all.
  double limit() const { return library_.functions.max_force(id_); }
  /// The library's own limit, as a second belt beside ours; as it was again at the end. Not all devices take one.
  void limit_force(double most) {
    limit_before_ = limit();
    limited_ = std::isfinite(most) && library_.functions.set_max_force(most, id_) >= 0;
  }

 private:
  struct Held {
    std::mutex mutex;
    std::set<std::pair<int (*)(Id), Id>> devices;
  };
  static Held& held() {
    static Held& all = *new Held;   // for ever: a device that is static may go after it
    return all;
  }

  Library library_;
  Id id_ = 0;
  double limit_before_ = -1.0;   // N
  bool limited_ = false;
};

/// What nobody reports, by the model's name.
struct Guess {
  double force;    // N
  double radius;   // m, of the workspace
};
/// Source     \cite conti2003, the devices of its library CHAI3D; for others the weakest and smallest of them, the Falcon's
inline Guess guess_of(std::string_view model) noexcept {
  auto const is = [&](std::string_view family) {
    return std::search(model.begin(), model.end(), family.begin(), family.end(),
                       [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; }) != model.end();
  };
  if (is("delta")) return {.force = 20.0, .radius = 0.15};
  if (is("omega")) return {.force = 12.0, .radius = 0.075};
  if (is("sigma")) return {.force = 12.0, .radius = 0.09};
  return {.force = 8.0, .radius = 0.04};
}
constexpr double guessed_torque = 0.2;   // N·m, of a wrist with motors; the same source

inline DeviceDescription describe(Functions const& dhd, Id id) {
  DeviceDescription all{.vendor = "Force Dimension"};
  if (dhd.model != nullptr)
    if (char const* const name = dhd.model(id)) all.model = name;
  unsigned short serial = 0;
  if (dhd.serial != nullptr && dhd.serial(&serial, id) >= 0) all.serial = std::to_string(serial);
  if (dhd.version != nullptr) {
    int version[4] = {};
    dhd.version(&version[0], &version[1], &version[2], &version[3]);
    all.driver = message("DHD ", version[0], ".", version[1], ".", version[2]);
  }
  return all;
}

inline Capabilities capabilities_of(Connection const& device, std::string_view model, ForceDimensionOptions const& options) {
  Functions const& dhd = device.functions();
  Guess const guess = guess_of(model);
  double const limit = device.limit(), half = guess.radius / std::sqrt(3.0);   // of the cube within that ball
  bool const wrist = dhd.has_wrist != nullptr && dhd.has_wrist(device.id());
  bool const turns = wrist && dhd.has_active_wrist != nullptr && dhd.has_active_wrist(device.id());
  Capabilities all{.max_force = limit >= 0.0 && std::isfinite(limit) ? reported(limit) : guessed(guess.force),
                   .rate = guessed(options.rate),
                   .reports_velocity = true,
                   .reports_orientation = wrist,
                   .buttons = button_bits,
                   .workspace = {
                       .lower = Vector3<double>::Constant(-half), .upper = Vector3<double>::Constant(half), .provenance = Provenance::guessed}};
  all.max_force.value = std::min(all.max_force.value, options.max_force);
  if (turns) all.max_torque = guessed(std::min(guessed_torque, options.max_torque));
  return all;
}

}  // namespace palpate::detail::force_dimension
