// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>

namespace palpate {

/// What a message is: the second byte after the magic number. Numbers are part of the protocol and never change their meaning.
enum class MessageType : std::uint8_t {
  hello = 1,        ///< client → server, first
  welcome = 2,      ///< server → client, its answer
  refusal = 3,      ///< server → client, the other answer; the last message
  hand = 4,         ///< client with the hand → server
  surface = 5,      ///< server → client with the hand, at the fast rate
  tissue = 6,       ///< server → client with the hand, at the body's rate
  keep_alive = 7,   ///< both ways, where nothing else goes
  goodbye = 8,      ///< both ways, the last message
  triangles = 9,    ///< server → onlooker, where they have changed
  points = 10,      ///< server → onlooker
  drawn = 11        ///< server → onlooker: what came since the last one is a picture
};

/// Which part a client plays: one has the hand, any number look on.
enum class ClientRole : std::uint8_t { hand = 1, onlooker = 2 };

/// Why a connection was not accepted, or why it ended.
enum class Farewell : std::uint8_t {
  ended = 1,            ///< the partner has ended
  version = 2,          ///< no version of the protocol that both know
  hand_taken = 3,       ///< another client has the hand
  too_many = 4,         ///< there are as many onlookers as the server takes
  protocol = 5,         ///< what was sent is no message, or not one of this partner
  silent = 6,           ///< nothing was heard for too long
  too_fast = 7          ///< more was sent than one who means well sends
};

constexpr char const* to_string(Farewell why) noexcept {
  switch (why) {
    case Farewell::ended: return "the partner has ended";
    case Farewell::version: return "no common version of the protocol";
    case Farewell::hand_taken: return "another client has the hand";
    case Farewell::too_many: return "there are too many onlookers";
    case Farewell::protocol: return "what was sent is no valid message";
    case Farewell::silent: return "nothing was heard for too long";
    case Farewell::too_fast: return "more was sent than allowed";
  }
  return "unknown";
}

namespace detail::network {

inline constexpr double farthest = 1e4;       // m, of any point
inline constexpr double largest = 1e7;        // of any other number: N, N/m, m/s, 1/m
inline constexpr double latest = 1e12;        // s

template <class V>
bool within(V const& vector, double most) noexcept {
  return (vector.array().abs() <= most).all();   // false for what is no number
}
inline bool within(double number, double most) noexcept { return std::abs(number) <= most; }
inline bool is_time(double seconds) noexcept { return seconds >= 0.0 && seconds <= latest; }
template <class V>
bool is_direction(V const& normal) noexcept {
  return within(normal, 2.0) && std::abs(normal.norm() - 1.0) < 1e-4;
}

}  // namespace detail::network

// Each message lays itself out: `layout(message, wire)` names its fields in the order in which they are sent, once for writing, reading and measuring.
// `valid()` says whether every number makes sense; one that is not valid is not a message.

/// The first message of a client.
struct Hello {
  static constexpr MessageType type = MessageType::hello;
  std::uint8_t oldest = 1, newest = 1;   ///< versions of the protocol that it knows
  ClientRole role = ClientRole::hand;
  double rate = 1000.0;                  ///< Hz, of its servo

  bool valid() const noexcept {
    return oldest >= 1 && oldest <= newest && (role == ClientRole::hand || role == ClientRole::onlooker) && rate >= 1.0 && rate <= 1e5;
  }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.oldest, m.newest, m.role, m.rate);
  }
};

/// The server takes the client.
struct Welcome {
  static constexpr MessageType type = MessageType::welcome;
  std::uint8_t version = 1;         ///< that both speak from now on
  std::uint64_t session = 0;        ///< of this run of the server, a number of its own
  double body_rate = 100.0;         ///< Hz, of tissue messages
  double surface_rate = 500.0;      ///< Hz, of surface messages
  double contact_stiffness = 0.0;   ///< N/m, of the contact between tool and tissue: what its surfaces have
  std::uint64_t revision = 0;       ///< of the body's topology

  bool valid() const noexcept {
    return version >= 1 && body_rate >= 1.0 && body_rate <= 1e5 && surface_rate >= 1.0 && surface_rate <= 1e5 && contact_stiffness >= 0.0 &&
           contact_stiffness <= detail::network::largest;
  }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.version, m.session, m.body_rate, m.surface_rate, m.contact_stiffness, m.revision);
  }
};

/// The server does not take the client; it closes the connection.
struct Refusal {
  static constexpr MessageType type = MessageType::refusal;
  Farewell why = Farewell::version;

  bool valid() const noexcept { return why >= Farewell::ended && why <= Farewell::too_fast; }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.why);
  }
};

/// Where the hand is.
struct HandReport {
  static constexpr MessageType type = MessageType::hand;
  std::uint64_t sequence = 0;   ///< from 1 on, of this connection
  double time = 0.0;            ///< s, on the client's clock
  std::uint64_t pose_discontinuities = 0; ///< how often the tool was placed anew, not moved: answers for an earlier place do not count
  Vector3<double> position = Vector3<double>::Zero(), velocity = Vector3<double>::Zero();   ///< m, m/s; world frame
  Eigen::Quaternion<double> orientation = Eigen::Quaternion<double>::Identity();
  double opening = 1.0;

  bool valid() const noexcept {
    using namespace detail::network;
    return sequence > 0 && is_time(time) && within(position, farthest) && within(velocity, largest) && within(orientation.coeffs(), 2.0) &&
           std::abs(orientation.norm() - 1.0) < 1e-3 && opening >= 0.0 && opening <= 1.0;
  }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.sequence, m.time, m.pose_discontinuities, m.position, m.velocity, m.orientation, m.opening);
  }
};

/// What an answer answers, and when it was made.
struct AnswerStamp {
  std::uint64_t sequence = 0;      ///< from 1 on, of this connection and kind
  std::uint64_t hand = 0;          ///< sequence of the newest sample that was known; 0: none
  double hand_time = 0.0;          ///< its time, on the client's clock
  std::uint64_t pose_discontinuities = 0;    ///< those of that report
  std::uint64_t revision = 0;      ///< of the body's topology
  double time = 0.0;               ///< s, on the server's clock

  bool valid() const noexcept { return sequence > 0 && detail::network::is_time(hand_time) && detail::network::is_time(time); }
};

/// The surface near the tool, a plane or a ball, already offset by the tool's radius; see SurfaceModel. A stiffness of 0 means none.
struct SurfaceAnswer {
  static constexpr MessageType type = MessageType::surface;
  AnswerStamp stamp{};
  SurfacePatch<double> patch{};

  bool valid() const noexcept {
    using namespace detail::network;
    return stamp.valid() && within(patch.point, farthest) && is_direction(patch.normal) && within(patch.curvature, largest) && patch.stiffness >= 0.0 &&
           patch.stiffness <= largest && within(patch.velocity, largest) && within(patch.angular_velocity, largest) && patch.reach >= 0.0;
  }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.stamp.sequence, m.stamp.hand, m.stamp.hand_time, m.stamp.pose_discontinuities, m.stamp.revision, m.stamp.time, m.patch.point, m.patch.normal, m.patch.curvature,
         m.patch.stiffness, m.patch.velocity, m.patch.angular_velocity, m.patch.reach);
  }
};

/// What the body answered to the tool in a tick; see LocalModel.
struct TissueAnswer {
  static constexpr MessageType type = MessageType::tissue;
  AnswerStamp stamp{};
  CuttingPhase phase = CuttingPhase::no_contact;
  bool diverged = false;
  std::uint64_t restorations = 0;
  Vector3<double> home_point = Vector3<double>::Zero(), normal = Vector3<double>::UnitZ();   ///< m; of the undisturbed surface
  double tip_radius = 0.0;                                                                    ///< m
  Vector3<double> force = Vector3<double>::Zero(), moment = Vector3<double>::Zero();          ///< N, N m; on the tool
  double cut_area = 0.0;                                                                      ///< m²

  bool valid() const noexcept {
    using namespace detail::network;
    return stamp.valid() && phase >= CuttingPhase::no_contact && phase <= CuttingPhase::moving && within(home_point, farthest) && is_direction(normal) &&
           tip_radius >= 0.0 && tip_radius <= farthest && within(force, largest) && within(moment, largest) && cut_area >= 0.0 && cut_area <= largest;
  }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.stamp.sequence, m.stamp.hand, m.stamp.hand_time, m.stamp.pose_discontinuities, m.stamp.revision, m.stamp.time, m.phase, m.diverged, m.restorations, m.home_point,
         m.normal, m.tip_radius, m.force, m.moment, m.cut_area);
  }
};

/// Says that one is there, and lets the partner measure the way there and back: rtt = now − echo − held.
struct KeepAlive {
  static constexpr MessageType type = MessageType::keep_alive;
  double time = 0.0;   ///< s, on the sender's clock
  double echo = 0.0;   ///< s, time of the partner's last keep-alive, on its clock; 0: none
  double held = 0.0;   ///< s, since that came

  bool valid() const noexcept { return detail::network::is_time(time) && detail::network::is_time(echo) && detail::network::is_time(held); }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.time, m.echo, m.held);
  }
};

/// The last message.
struct Goodbye {
  static constexpr MessageType type = MessageType::goodbye;
  Farewell why = Farewell::ended;

  bool valid() const noexcept { return why >= Farewell::ended && why <= Farewell::too_fast; }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.why);
  }
};

/// The tool as it is to be drawn, and that the picture of this revision is whole.
struct Drawn {
  static constexpr MessageType type = MessageType::drawn;
  double time = 0.0;                 ///< s, simulated
  std::uint64_t revision = 0;        ///< of the body's topology
  std::uint32_t points = 0, triangles = 0;   ///< so many make up the picture
  bool has_hand = false;             ///< there is a hand, and a tool
  Vector3<double> tip = Vector3<double>::Zero();   ///< m, never inside the tissue
  Eigen::Quaternion<double> orientation = Eigen::Quaternion<double>::Identity();
  CuttingPhase phase = CuttingPhase::no_contact;

  bool valid() const noexcept {
    using namespace detail::network;
    return is_time(time) && within(tip, farthest) && std::abs(orientation.norm() - 1.0) < 1e-3 && phase >= CuttingPhase::no_contact && phase <= CuttingPhase::moving;
  }
  template <class Self, class Wire>
  static void layout(Self& m, Wire& wire) {
    wire(m.time, m.revision, m.points, m.triangles, m.has_hand, m.tip, m.orientation, m.phase);
  }
};

}  // namespace palpate
