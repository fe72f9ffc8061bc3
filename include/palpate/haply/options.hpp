// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/haply/frame.hpp>

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
  protocol,           ///< an answer that is no WebSocket message, too long or no JSON, or lacks what it must have
  gone,               ///< the connection ended
  silent,             ///< no answer within `Inverse3Options::stall`, or `timeout` while the device was opened
  vanished,           ///< the device is no longer among the service's
  frame_changed,      ///< the workspace was moved or scaled while the device was in use
  in_use              ///< this program has it open already
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

/// How the service wants a force to be written.
enum class HaplyDialect {
  by_version,   ///< `vector` from service 3.5 on and where the version is not told, `values` before
  vector,       ///< {"vector": {"x", "y", "z"}}
  values        ///< {"values": {"x", "y", "z"}}
};

struct Inverse3Options {
  std::string host = "localhost";   ///< where Haply's service runs; another machine's network is hardly fast enough for forces
  int port = 10001;
  std::string device = {};   ///< device_id; empty: the only one
  std::string grip = {};     ///< device_id of the verse grip; empty: the only one, if there is one; "none": no grip
  HaplyDialect dialect = HaplyDialect::by_version;
  std::string axes = "XZ-Y";    ///< of the frame here, in Haply's (x right, y forward, z up): x right, y up, z towards the user
  bool accepts_scale = false;   ///< a service that is set to scale lengths is taken as it is; forces are then not what the hand's motion says

  DeviceValue max_force = guessed(3.0);   ///< N; the service publishes none
  DeviceWorkspace workspace = {};         ///< m, in the frame here; unknown: a guess, as long as the service neither mounts nor moves the device
  double rate = 1000.0;                   ///< Hz, of the host's servo
  double exchange_rate = 2000.0;          ///< Hz, messages a second at most; each brings one state

  double ramp = 0.5;       ///< s, in which the force rises from zero after arming, a jump or a gap
  double held = 0.02;      ///< s, how long a force is held that is not written anew; an exchange that takes longer is a gap
  double stall = 0.1;      ///< s: a state that is older, or an answer that takes longer, ends the session
  double jump = 0.005;     ///< m from one state to the next, beyond what a hand of 2 m/s can do: the force begins at zero again
  double timeout = 5.0;    ///< s, for each step of opening

  void validate() const {
    detail::OptionCheck const require{"Inverse3Options"};
    if (host.empty()) throw InvalidArgument("Inverse3Options: .host is empty; give the machine of the service, as localhost");
    require(port >= 1 && port <= 65535, ".port", port, "", "the service's usual one is 10001");
    auto const matrix = signed_axes(axes);
    if (!matrix || matrix->determinant() < 0.0)
      throw InvalidArgument(detail::message("Inverse3Options: .axes is \"", axes,
                                            "\"; give each of X, Y and Z once, with signs, without a mirror, as XZ-Y (y up) or XYZ (z up)"));
    require.not_negative(".max_force", max_force, " N");
    require(rate >= 1.0 && rate <= 1e5, ".rate", rate, " Hz", "a servo's usual one is 1000");
    require(exchange_rate >= 1.0 && exchange_rate <= 1e5, ".exchange_rate", exchange_rate, " Hz", "give 1 to 100000");
    require.not_negative(".ramp", ramp, " s");
    require.positive(".held", held, " s");
    require.positive(".stall", stall, " s");
    require(exchange_rate * held >= 2.0 && exchange_rate * stall >= 2.0, ".exchange_rate", exchange_rate, " Hz",
            "at least two exchanges fit into .held and into .stall");
    require.positive(".jump", jump, " m");
    require.positive(".timeout", timeout, " s");
  }
};

}  // namespace palpate
