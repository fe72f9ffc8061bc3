// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>

#include <string>
#include <string_view>

namespace palpate {

/// Why an Inverse3 could not be opened or armed, or what ended its session.
enum class HaplyProblem {
  none,
  not_reachable,      ///< nothing answers where the service should be
  handshake_refused,  ///< something answers, but takes no WebSocket
  no_device,          ///< no Inverse3 there, not the one that was asked for, or several and none was named
  frame,              ///< the service scales lengths, or names axes that are none
  no_power,           ///< the motors have no supply
  protocol,           ///< an answer that is no JSON, or lacks what it must have
  gone,               ///< the connection ended
  silent,             ///< no answer within `Inverse3Options::stall`, or `timeout` while the device was opened
  vanished,           ///< the device is no longer among the service's
  frame_changed       ///< the workspace was moved or scaled while the device was in use
};

/// Thrown by `Inverse3Device` outside the servo tick. The text is one line: what was tried, what came back, what to check.
class HaplyError : public Error {
 public:
  HaplyError(HaplyProblem problem, std::string const& text) : Error(std::string(name) + text), problem_(problem) {}

  HaplyProblem problem() const noexcept { return problem_; }
  /// The text without the device's name before it.
  char const* reason() const noexcept { return what() + name.size(); }

 private:
  static constexpr std::string_view name = "Inverse3: ";
  HaplyProblem problem_;
};

namespace detail::haply {

constexpr DeviceStatus status_of(HaplyProblem ending) noexcept {
  if (ending == HaplyProblem::none) return DeviceStatus::ok;
  return ending == HaplyProblem::gone || ending == HaplyProblem::vanished ? DeviceStatus::disconnected : DeviceStatus::fault;
}

}  // namespace detail::haply

}  // namespace palpate
