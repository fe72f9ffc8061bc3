// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <cmath>

namespace palpate {

/// Where a number about a device comes from, the least trusted first.
enum class Provenance {
  unknown,     ///< nobody said
  guessed,     ///< an engineer's estimate: what a plain number counts as
  datasheet,   ///< the maker's papers
  reported     ///< the device itself, when it was opened
};

constexpr char const* to_string(Provenance provenance) noexcept {
  switch (provenance) {
    case Provenance::unknown: return "unknown";
    case Provenance::guessed: return "guessed";
    case Provenance::datasheet: return "datasheet";
    case Provenance::reported: return "reported";
  }
  return "unknown";
}

/// A number about a device with its provenance. Converts to the number.
///   Capabilities{.max_force = datasheet(3.3), .rate = 1000.0, .mass = guessed(0.045)}
struct DeviceValue {
  double value = 0.0;
  Provenance provenance = Provenance::unknown;

  constexpr DeviceValue() = default;
  constexpr DeviceValue(double number) noexcept : value(number), provenance(Provenance::guessed) {}
  constexpr DeviceValue(double number, Provenance from) noexcept : value(number), provenance(from) {}
  constexpr operator double() const noexcept { return value; }

  /// False where nobody stated it. If true, zero means zero.
  constexpr bool known() const noexcept { return provenance != Provenance::unknown; }
};

constexpr DeviceValue guessed(double value) noexcept { return {value, Provenance::guessed}; }
constexpr DeviceValue datasheet(double value) noexcept { return {value, Provenance::datasheet}; }
constexpr DeviceValue reported(double value) noexcept { return {value, Provenance::reported}; }

/// A box that the tip can reach, in the device's frame [m]; empty when nobody knows it.
struct DeviceWorkspace {
  Vector3<double> lower = Vector3<double>::Zero();
  Vector3<double> upper = Vector3<double>::Zero();
  Provenance provenance = Provenance::unknown;

  bool known() const noexcept { return provenance != Provenance::unknown; }
  Vector3<double> centre() const noexcept { return (lower + upper) / 2; }
  Vector3<double> size() const noexcept { return upper - lower; }
};

/// What a device can do. The first two have to be given; zero in the others means "does not have it", or, where a number may be
/// unknown, that nobody knows.
struct Capabilities {
  DeviceValue max_force{};        ///< N; no larger force is ever written. Infinity: not limited. 0: a tracker, the hand feels nothing
  DeviceValue rate{};             ///< Hz, servo ticks per second: one `read` and one `write` each
  DeviceValue max_torque{};       ///< N·m; 0: torques are ignored
  bool reports_velocity = false;  ///< `read` fills `velocity`; otherwise the host differentiates positions
  bool reports_orientation = false;
  bool reports_gripper = false;   ///< `read` fills `gripper`; otherwise a button closes a tool's jaws, see ServoOptions::grip
  int buttons = 0;                ///< how many bits of `DeviceState::buttons` mean something
  bool moves_a_hand = true;       ///< then at most 1 N is written by default, see SafetyOptions. False for a simulated device: nobody is hurt, so
                                  ///< force is not capped and no button has to be held

  DeviceValue continuous_force{};   ///< N, that the motors stand for ever
  DeviceValue max_stiffness{};      ///< N/m, that the maker says can be rendered
  DeviceValue max_damping{};        ///< N·s/m, likewise
  DeviceValue mass{};               ///< kg, apparent at the tip, where it is lightest
  DeviceValue damping{};            ///< N·s/m, of the mechanics
  DeviceValue friction{};           ///< N, to move it with motors off
  DeviceValue resolution{};         ///< m, of the position
  DeviceWorkspace workspace{};
};

/// Throws `InvalidArgument` for capabilities that no servo loop can run with.
inline void require_valid(Capabilities const& capabilities) {
  double const rate = capabilities.rate, force = capabilities.max_force, torque = capabilities.max_torque;
  if (!(rate > 0.0) || !std::isfinite(rate))
    throw InvalidArgument(detail::message("device rate is ", rate, " Hz; capabilities() must report a positive rate, for example .rate = 1000.0"));
  if (!(force >= 0.0))
    throw InvalidArgument(detail::message("device maximum force is ", force, " N; capabilities() must report zero or more, for example .max_force = 3.3"));
  if (!(torque >= 0.0))
    throw InvalidArgument(detail::message("device maximum torque is ", torque, " N m; capabilities() must report zero or more"));
  if (int const buttons = capabilities.buttons; buttons < 0 || buttons > 32)
    throw InvalidArgument(detail::message("device has ", buttons, " buttons; capabilities() must report 0 to 32"));
  auto const require = [](char const* what, DeviceValue const& known, char const* unit) {
    if (!(known.value >= 0.0)) throw InvalidArgument(detail::message("device ", what, " is ", known.value, unit, "; capabilities() must report zero or more"));
  };
  require("continuous force", capabilities.continuous_force, " N");
  require("maximum stiffness", capabilities.max_stiffness, " N/m");
  require("maximum damping", capabilities.max_damping, " N s/m");
  require("mass", capabilities.mass, " kg");
  require("damping", capabilities.damping, " N s/m");
  require("friction", capabilities.friction, " N");
  require("resolution", capabilities.resolution, " m");
  if (capabilities.workspace.known() && !((capabilities.workspace.size().array() > 0.0).all() && is_finite(capabilities.workspace.size())))
    throw InvalidArgument("device workspace is empty or not finite; capabilities() must report a box whose upper corner is above its lower one");
}

}  // namespace palpate
