// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/force_dimension/library.hpp>
#include <palpate/device/force_dimension/opening.hpp>
#include <palpate/device/force_dimension/options.hpp>
#include <palpate/device/force_dimension/servo.hpp>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace palpate {

/// A delta, omega, sigma or lambda of Force Dimension, or a Falcon through their driver. The vendor's library is loaded when the device is opened;
/// nothing of it is needed to build.
///
///   ForceDimensionDevice device({.device = 0});
///   DeviceSession const session(device);   // opens and arms
///
/// The host keeps the time: `read` asks the library for the newest sample, `write` sends the force. A sample that the library gives again because it
/// was asked too soon is `stale`; the force goes on, for options.silence.
/// Units      SI, as the library's. Frame: x to the right, y up, z towards the user; the library has (z, x, y). The origin is where the device has it.
/// Buttons    bit 0 is the tool's; 16 bits, by model.
/// Errors     ForceDimensionError from open and arm, in one line; faults later: the status of read and write, and pop_fault. After an error of the
///            library, or ten reads without a sound state, the motors are off until it is opened again.
/// Threads    one at a time for all calls of a device. Other devices may be used at the same time.
/// Cost       read and write are noexcept and neither allocate nor lock here; the library waits for the USB in them, up to 4 kHz. A cable
///            that hangs makes the tick hang.
/// Limits     written to published facts and tested against a stand-in for the library; it has met no real device yet. No force of the gripper. The
///            last force stays with the motors when the host no longer ticks.
class ForceDimensionDevice {
  using Connection = detail::force_dimension::Connection;
  using Servo = detail::force_dimension::Servo;

 public:
  explicit ForceDimensionDevice(ForceDimensionOptions options = {}) : options_(std::move(options)) {
    options_.validate();
    capabilities_ = {.max_force = guessed(std::min(options_.max_force, detail::force_dimension::guess_of("").force)),
                     .rate = guessed(options_.rate),
                     .reports_velocity = true,
                     .buttons = detail::force_dimension::button_bits};
  }

  ForceDimensionDevice(ForceDimensionDevice&&) = default;
  ForceDimensionDevice& operator=(ForceDimensionDevice&&) = delete;
  ~ForceDimensionDevice() { close(); }

  /// Loads the library if need be, opens the device and waits for a first sample. The motors are off.
  void open() {
    if (connection_) throw InvalidArgument("ForceDimensionDevice: it is open already; close it first");
    auto connection = std::make_unique<Connection>(detail::force_dimension::load_library(options_.library), options_.device);
    auto const& dhd = connection->functions();
    if (dhd.enable_force(0, connection->id()) < 0) throw refused(dhd, dhd.last_error(), "the motors could not be switched off");
    auto description = detail::force_dimension::describe(dhd, connection->id());
    Capabilities const found = capabilities_of(*connection, description.model, options_);
    auto servo = std::make_unique<Servo>(dhd, connection->id(), options_, found);
    connection->limit_force(found.max_force);
    servo->check();
    auto const until = std::chrono::steady_clock::now() + std::chrono::duration<double>(options_.timeout);
    while (is_usable(servo->status()) && !servo->sample()) {   // the velocity's window may have to fill
      if (std::chrono::steady_clock::now() > until)
        throw ForceDimensionError(
            ForceDimensionProblem::driver,
            detail::message("the device was opened, but has given no sample within ", options_.timeout, " s; switch it off and on"));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!is_usable(servo->status())) throw refused(dhd, servo->last_code(), ended(*servo));
    servo_ = std::move(servo);
    connection_ = std::move(connection);
    capabilities_ = found;
    description_ = std::move(description);
    library_ = connection_->path();
  }
  void close() noexcept {
    if (!connection_) return;
    servo_->disarm();
    connection_.reset();
  }

  /// Switches the motors on, at zero; from then on the force rises to what is written within options.ramp.
  void arm() {
    if (!connection_) throw InvalidArgument("ForceDimensionDevice: arm() needs an open device; call open() first, or use a DeviceSession");
    auto const& dhd = connection_->functions();
    if (is_usable(servo_->status())) servo_->check();
    if (!is_usable(servo_->status()))
      throw refused(dhd, servo_->last_code(),
                    detail::message("the motors stay off: the device is at fault (", to_string(servo_->status()), "); close it and open it again"));
    if (options_.calibrated_only && calibration() != Calibration::good)
      throw ForceDimensionError(ForceDimensionProblem::not_calibrated,
                                detail::message("the motors stay off, the device is not calibrated: ", calibration_advice()));
    if (!servo_->arm()) throw refused(dhd, servo_->last_code(), "the motors were not switched on");
  }
  void disarm() noexcept {
    if (connection_) servo_->disarm();
  }

  DeviceStatus read(DeviceState<double>& state) noexcept { return connection_ ? servo_->read(state) : DeviceStatus::disconnected; }
  DeviceStatus write(Wrench<double> const& wrench) noexcept { return connection_ ? servo_->write(wrench) : DeviceStatus::disconnected; }

  /// As the device said when it was last asked, ten times a second.
  Calibration calibration() noexcept { return connection_ ? servo_->calibration() : Calibration::needs_hand; }
  /// Without effect: these devices are calibrated by the user, or by the vendor's program, which moves the arm by itself.
  void calibrate() noexcept {}
  /// What the user has to do.
  char const* calibration_advice() const noexcept {
    return "take the tool to its calibration pose as the device's manual says, or run the vendor's initialisation, which moves the arm by itself";
  }

  std::optional<DeviceFault> pop_fault() noexcept { return servo_ ? servo_->pop_fault() : std::nullopt; }

  Capabilities capabilities() const { return capabilities_; }
  DeviceDescription description() const { return description_; }
  /// The file that the library came from; empty before the device was open.
  std::string const& library() const noexcept { return library_; }
  ForceDimensionCounts counts() const noexcept { return servo_ ? servo_->counts() : ForceDimensionCounts{}; }

 private:
  static ForceDimensionError refused(detail::force_dimension::Functions const& dhd, int code, std::string const& what) {
    if (code == 0) return {ForceDimensionProblem::driver, what};
    return {ForceDimensionProblem::driver, detail::message(what, ": ", said(dhd, code), "; ", detail::force_dimension::advice(code)), code};
  }
  static std::string ended(Servo& servo) {
    auto const fault = servo.pop_fault();
    return detail::message("the device was opened, but failed at once", fault && servo.last_code() == 0 ? std::string(": ") + fault->what : "");
  }

  ForceDimensionOptions options_;
  Capabilities capabilities_;
  DeviceDescription description_;
  std::string library_;
  std::unique_ptr<Connection> connection_;   // while it is open
  std::unique_ptr<Servo> servo_;             // of the last opening: its counts and faults can be asked for afterwards
};

}  // namespace palpate
