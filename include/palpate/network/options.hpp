// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/tissue_node.hpp>
#include <palpate/network/weber_deadband.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/realtime_options.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <cstdint>
#include <string>

namespace palpate {

/// A server that can not listen, or a client that reaches none. The text is one line: which address and port, what came back, what to do.
class NetworkError : public Error {
 public:
  using Error::Error;
};

/// Whatever goes for a client of a network if nothing else is said: a model that is 0.1 s old is too old for a simulated device too.
inline ServoOptions over_a_network(ServoOptions options) {
  if (!options.safety.stale_after) options.safety.stale_after = 0.1;
  return options;
}

struct TissueServerOptions {
  std::string address = "127.0.0.1";   ///< that it listens on. Nothing is encrypted and nobody is asked who they are: another one only in a network of friends
  std::uint16_t port = 0;              ///< 0: any that is free; see TissueServer::port
  double rate = 100.0;                 ///< Hz, of the body
  double surface_rate = 500.0;         ///< Hz, at which the hand is told the surface
  TissueNodeOptions node{};            ///< coupling, kind of surface, deadband
  int onlookers = 8;                   ///< at most
  double picture_rate = 30.0;          ///< Hz, of pictures for onlookers
  double silence = 2.0;                ///< s without a byte, or without one that could be sent: the connection ends
  double max_bytes_per_second = 4e6;   ///< that one connection may send, a quarter of a second of them at once; a hand sends 0.13e6

  void validate() const {
    detail::OptionCheck const require{"TissueServer", true};
    if (address.empty()) throw InvalidArgument("TissueServer: .address is empty; give 127.0.0.1 for this machine alone, 0.0.0.0 for all its networks");
    require(rate >= 1.0 && rate <= 1e4, ".rate", rate, " Hz", "give 1 to 10000, 30 to 100 for most");
    require(surface_rate >= rate && surface_rate >= 50.0 && surface_rate <= 1e4, ".surface_rate", surface_rate, " Hz",
            "give the body's rate or more, 50 to 10000");
    require(onlookers >= 0 && onlookers <= 1000, ".onlookers", onlookers, "give 0 to 1000");
    require(picture_rate >= 0.1 && picture_rate <= 1000.0, ".picture_rate", picture_rate, " Hz", "give 0.1 to 1000, 30 for most");
    require(silence >= 0.1 && silence <= 3600.0, ".silence", silence, " s", "give 0.1 to 3600; a client says something every 0.02 s");
    require(max_bytes_per_second >= 1e4 && max_bytes_per_second <= 1e12, ".max_bytes_per_second", max_bytes_per_second,
            "give 1e4 to 1e12; a hand at 1000 Hz sends 0.13e6");
  }
};

struct HapticClientOptions {
  std::string server = "localhost";   ///< name or address
  std::uint16_t port = 0;             ///< of the server; there is no usual one
  double connect_timeout = 2.0;       ///< s, for the first connection; each later one gets as long
  double retry = 0.25;                ///< s, between two attempts to connect again
  double silence = 2.0;               ///< s without a byte: the connection counts as lost. The force has faded long before: see `servo.safety.stale_after`
  double send_rate = 0.0;             ///< Hz, of samples of the hand at most; 0: the servo's, up to 1000
  WeberDeadbandOptions deadband{};    ///< of the samples; that of the answers is the server's
  RemoteTissueOptions remote{};
  ServoOptions servo{};               ///< a `stale_after` that is not given becomes 0.1 s, also for devices that move no hand
  RealtimeOptions realtime{};         ///< of the servo's thread

  void validate(char const* owner = "HapticClient") const {
    detail::OptionCheck const require{owner, true};
    if (server.empty()) throw InvalidArgument(detail::message(owner, ": .server is empty; give its name or address, as localhost"));
    require(port != 0, ".port", port, "give the one that the server says it listens on");
    require(connect_timeout >= 0.01 && connect_timeout <= 3600.0, ".connect_timeout", connect_timeout, " s", "give 0.01 to 3600");
    require(retry >= 0.01 && retry <= 3600.0, ".retry", retry, " s", "give 0.01 to 3600");
    require(silence >= 0.1 && silence <= 3600.0, ".silence", silence, " s", "give 0.1 to 3600; a server says something every 0.02 s");
    require(send_rate == 0.0 || (send_rate >= 50.0 && send_rate <= 1e4), ".send_rate", send_rate, " Hz", "give 50 to 10000, or 0 for the servo's");
    realtime.validate();
  }
};

struct OnlookerOptions {
  std::string server = "localhost";   ///< name or address
  std::uint16_t port = 0;             ///< of the server
  double connect_timeout = 2.0;       ///< s, for an attempt
  double retry = 0.25;                ///< s, between two attempts
  double silence = 2.0;               ///< s without a byte: the connection counts as lost

  void validate() const {
    HapticClientOptions{.server = server, .port = port, .connect_timeout = connect_timeout, .retry = retry, .silence = silence}.validate("Onlooker");
  }
};

}  // namespace palpate
