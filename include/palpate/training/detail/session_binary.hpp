// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/training/session.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>

namespace palpate::detail {

/// CRC-32 as in Ethernet and PNG (polynomial 0x04C11DB7, reflected): finds every change of up to 32 neighbouring bits.
/// Source     \cite iso3309
inline std::uint32_t crc32(std::string_view bytes) noexcept {
  static constexpr auto table = [] {
    std::array<std::uint32_t, 256> entries{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t word = n;
      for (int bit = 0; bit < 8; ++bit) word = (word & 1u) != 0 ? 0xEDB88320u ^ (word >> 1) : word >> 1;
      entries[n] = word;
    }
    return entries;
  }();
  std::uint32_t sum = 0xFFFFFFFFu;
  for (char const c : bytes) sum = table[(sum ^ static_cast<unsigned char>(c)) & 0xFFu] ^ (sum >> 8);
  return sum ^ 0xFFFFFFFFu;
}

/// Numbers as bytes, the lowest first on every machine.
class ByteWriter {
 public:
  template <std::unsigned_integral Word>
  void put(Word word) {
    for (std::size_t i = 0; i < sizeof(Word); ++i) bytes_ += static_cast<char>(static_cast<unsigned char>((word >> (8 * i)) & 0xFFu));
  }
  /// One pattern of bits for every NaN, as in the text.
  void put(double value) { put(std::bit_cast<std::uint64_t>(std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value)); }
  void put(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
  }
  void raw(std::string_view bytes) { bytes_ += bytes; }

  std::string& bytes() noexcept { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes bytes apart. `fail(where, what)` throws; it is called before anything beyond the end is touched.
template <class Fail>
class ByteReader {
 public:
  ByteReader(std::string_view bytes, Fail fail) : bytes_(bytes), fail_(fail) {}

  template <std::unsigned_integral Word>
  Word word(std::string_view what) {
    need(sizeof(Word), what);
    Word word = 0;
    for (std::size_t i = 0; i < sizeof(Word); ++i)
      word = static_cast<Word>(word | static_cast<Word>(static_cast<Word>(static_cast<unsigned char>(bytes_[at_ + i])) << (8 * i)));
    at_ += sizeof(Word);
    return word;
  }
  double number(std::string_view what) { return std::bit_cast<double>(word<std::uint64_t>(what)); }
  std::string text(std::string_view what) {
    auto const length = word<std::uint32_t>(what);
    need(length, what);
    std::string const text(bytes_.substr(at_, length));
    at_ += length;
    return text;
  }
  /// How many things of at least `least` bytes follow; checked against the bytes that are left, before anybody makes room for them.
  std::size_t count(std::size_t least, std::string_view what) {
    std::size_t const at = at_;
    auto const count = word<std::uint64_t>(what);
    if (count > (bytes_.size() - at_) / least) fail_(at, what);
    return static_cast<std::size_t>(count);
  }

  std::size_t at() const noexcept { return at_; }
  std::size_t left() const noexcept { return bytes_.size() - at_; }

 private:
  void need(std::size_t size, std::string_view what) {
    if (size > left()) fail_(at_, what);
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  Fail fail_;
};

// A session as bytes, numbers with the lowest byte first:
//   8   magic: 0x89 "PLPS" CR LF 0x1A, so that a copy in text mode is noticed
//   4   format, 1
//   8   length of what follows, without the checksum
//       version; seed (8); device: force, rate (8 each), flags (1): reports velocity 1, has hand 2, moves a hand 4, reports orientation 8, gripper 16, has torque 32;
//         buttons (4);
//         continuous force, largest damping, mass (8 each; a NaN where it is not known); with torque its largest (8); with flag 64 largest stiffness, damping, friction and
//         resolution likewise, and where each of stated_values comes from (1 each)
//       configuration: count (8), key and value each; events: count (8), time (8) and name each; a text is its length (4) and its bytes
//       ticks: count (8), each two bytes of flags and then
//         flags     phase (bits 0-1), read (2-3), written (4-5), the hand is where the tip is (6), depth and force are +0 (7),
//                   the energy is the tick's before (8), so are the buttons (9); before the first tick both are +0; the orientation is not (10),
//                   nor is the gripper (11); there is a torque (12); the area cut is not the tick's before (13), +0 before the first tick
//         time, tip (4 · 8); without flag 7 depth, force (4 · 8); with flag 12 torque (3 · 8); without flag 8 the energy (8); with flag 13 the area (8); with a hand its velocity
//         (3 · 8), without flag 6 its position (3 · 8), without flag 9 its buttons (4), with flag 10 its orientation (x, y, z, w: 4 · 8), the identity before the first tick, with
//         flag 11 its gripper (8), 1 before the first tick
//   4   CRC-32 of all before
inline constexpr std::string_view session_magic = "\x89PLPS\r\n\x1A";
inline constexpr std::uint32_t session_format = 1;
inline constexpr std::size_t session_frame = 8 + 4 + 8;   // before the payload
inline constexpr unsigned velocity_flag = 1, hand_flag = 2, moves_flag = 4, orientation_flag = 8, gripper_flag = 16, torque_flag = 32, stated_flag = 64;
inline constexpr unsigned at_tip_flag = 1u << 6, silent_flag = 1u << 7, same_energy_flag = 1u << 8, same_buttons_flag = 1u << 9, turned_flag = 1u << 10,
                          gripped_flag = 1u << 11, twisted_flag = 1u << 12, cut_flag = 1u << 13;

inline bool same_bits(double a, double b) noexcept { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
inline bool same_bits(Vector3<double> const& a, Vector3<double> const& b) noexcept {
  return same_bits(a.x(), b.x()) && same_bits(a.y(), b.y()) && same_bits(a.z(), b.z());
}

inline bool same_bits(Eigen::Quaternion<double> const& a, Eigen::Quaternion<double> const& b) noexcept {
  return same_bits(Vector3<double>(a.vec()), Vector3<double>(b.vec())) && same_bits(a.w(), b.w());
}

inline void put(ByteWriter& out, Vector3<double> const& vector) {
  for (double const component : vector) out.put(component);
}

inline std::string session_bytes(Session const& session) {
  ByteWriter out;
  out.bytes().reserve(128 + session.recording.ticks().size() * (session.hand.empty() ? 74 : 102));
  out.raw(session_magic);
  out.put(session_format);
  out.put(std::uint64_t{0});   // the length, below
  out.put(std::string_view(session.version));
  out.put(session.seed.value);
  out.put(session.device.max_force.value);
  out.put(session.device.rate.value);
  bool const has_hand = !session.hand.empty();
  out.put(static_cast<std::uint8_t>((session.device.reports_velocity ? velocity_flag : 0u) | (has_hand ? hand_flag : 0u) | (session.device.moves_a_hand ? moves_flag : 0u) |
                                    (session.device.reports_orientation ? orientation_flag : 0u) | (session.device.reports_gripper ? gripper_flag : 0u) |
                                    (session.device.max_torque > 0 ? torque_flag : 0u) | (states_more(session.device) ? stated_flag : 0u)));
  out.put(static_cast<std::uint32_t>(session.device.buttons));
  for (DeviceValue const& value : {session.device.continuous_force, session.device.max_damping, session.device.mass})
    out.put(value.known() ? value.value : std::numeric_limits<double>::quiet_NaN());
  if (session.device.max_torque > 0) out.put(session.device.max_torque.value);
  if (states_more(session.device)) {
    for (std::size_t k = 0; k < extra_values; ++k) {
      DeviceValue const& value = session.device.*stated_values[k].value;
      out.put(value.known() ? value.value : std::numeric_limits<double>::quiet_NaN());
    }
    for (StatedValue const& stated : stated_values) out.put(static_cast<std::uint8_t>((session.device.*stated.value).provenance));
  }
  out.put(static_cast<std::uint64_t>(session.configuration.size()));
  for (auto const& [key, value] : session.configuration.values()) {
    out.put(std::string_view(key));
    out.put(std::string_view(value));
  }
  out.put(static_cast<std::uint64_t>(session.events.size()));
  for (SessionEvent const& event : session.events) {
    out.put(event.time);
    out.put(std::string_view(event.name));
  }
  auto const& ticks = session.recording.ticks();
  out.put(static_cast<std::uint64_t>(ticks.size()));
  double energy = 0.0, area = 0.0, gripper = 1.0;
  std::uint32_t buttons = 0;
  Eigen::Quaternion<double> orientation = Eigen::Quaternion<double>::Identity();
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    Tick const& tick = ticks[i];
    bool const silent = same_bits(tick.depth, 0.0) && same_bits(tick.force, Vector3<double>::Zero());
    unsigned flags = static_cast<unsigned>(tick.phase) | (silent ? silent_flag : 0u) | (same_bits(tick.energy, energy) ? same_energy_flag : 0u) |
                     (session.device.max_torque > 0 && !same_bits(tick.torque, Vector3<double>::Zero()) ? twisted_flag : 0u) |
                     (same_bits(tick.cut_area, area) ? 0u : cut_flag);
    energy = tick.energy, area = tick.cut_area;
    bool at_tip = false;
    if (has_hand) {
      HandSample const& hand = session.hand[i];
      at_tip = same_bits(hand.position, tick.tip);
      flags |= static_cast<unsigned>(hand.read) << 2 | static_cast<unsigned>(hand.written) << 4 | (at_tip ? at_tip_flag : 0u) |
               (hand.buttons == buttons ? same_buttons_flag : 0u) | (same_bits(hand.orientation, orientation) ? 0u : turned_flag) |
               (same_bits(hand.gripper, gripper) ? 0u : gripped_flag);
      buttons = hand.buttons;
      orientation = hand.orientation, gripper = hand.gripper;
    }
    out.put(static_cast<std::uint16_t>(flags));
    out.put(tick.time);
    put(out, tick.tip);
    if (!silent) {
      out.put(tick.depth);
      put(out, tick.force);
    }
    if ((flags & twisted_flag) != 0) put(out, tick.torque);
    if ((flags & same_energy_flag) == 0) out.put(tick.energy);
    if ((flags & cut_flag) != 0) out.put(area);
    if (has_hand) {
      put(out, session.hand[i].velocity);
      if (!at_tip) put(out, session.hand[i].position);
      if ((flags & same_buttons_flag) == 0) out.put(session.hand[i].buttons);
      if ((flags & turned_flag) != 0)
        for (double const component : session.hand[i].orientation.coeffs()) out.put(component);
      if ((flags & gripped_flag) != 0) out.put(gripper);
    }
  }
  std::string& bytes = out.bytes();
  std::uint64_t const length = bytes.size() - session_frame;
  for (std::size_t i = 0; i < 8; ++i) bytes[12 + i] = static_cast<char>(static_cast<unsigned char>((length >> (8 * i)) & 0xFFu));
  out.put(crc32(bytes));
  return std::move(bytes);
}

/// `path` is for the errors alone.
inline Session session_from_bytes(std::string_view bytes, std::filesystem::path const& path) {
  auto const refuse = [&](std::size_t at, std::string_view what) -> void { throw FileError(message(path.string(), ", byte ", at, ": ", what)); };
  if (bytes.size() < session_magic.size() || bytes.substr(0, session_magic.size()) != session_magic)
    refuse(0, "not a session in binary form; give a file that was recorded, or one of text with a name that ends in .csv");
  auto const cut = [&](std::size_t at, std::string_view what) { refuse(at, message(what, " is cut short or damaged; copy the file again")); };
  ByteReader frame(bytes.substr(session_magic.size()), [&](std::size_t at, std::string_view what) { cut(at + session_magic.size(), what); });
  if (auto const format = frame.word<std::uint32_t>("the number of the format"); format != session_format)
    refuse(8, message("the format is ", format, "; this version reads ", session_format));
  auto const length = frame.word<std::uint64_t>("the length");
  std::size_t const all = bytes.size();
  if (length > all || all - static_cast<std::size_t>(length) != session_frame + 4)
    refuse(12, message("the length is ", length, " bytes where ", all - std::min(all, session_frame + 4),
                       " are there; the file is cut short or damaged: copy it again"));
  ByteReader sum(bytes.substr(all - 4), cut);
  if (sum.word<std::uint32_t>("the checksum") != crc32(bytes.substr(0, all - 4)))
    refuse(all - 4, "the checksum is another one; the file is damaged: copy it again");

  std::string_view const payload = bytes.substr(session_frame, static_cast<std::size_t>(length));
  ByteReader in(payload, [&](std::size_t at, std::string_view what) { cut(at + session_frame, what); });
  auto const vector = [&](std::string_view what) {
    Vector3<double> v;
    for (double& component : v) component = in.number(what);
    return v;
  };
  auto const here = [&](std::string_view what) { refuse(in.at() + session_frame, what); };
  Session session;
  session.version = in.text("the version");
  session.seed.value = in.word<std::uint64_t>("the seed");
  session.device = {.max_force = in.number("the device's force"), .rate = in.number("the device's rate")};
  auto const flags = in.word<std::uint8_t>("the device's flags");
  if (flags > (velocity_flag | hand_flag | moves_flag | orientation_flag | gripper_flag | torque_flag | stated_flag)) here("the device's flags are unknown; copy the file again");
  session.device.reports_velocity = (flags & velocity_flag) != 0;
  session.device.moves_a_hand = (flags & moves_flag) != 0;
  session.device.reports_orientation = (flags & orientation_flag) != 0;
  session.device.reports_gripper = (flags & gripper_flag) != 0;
  auto const buttons_of_device = in.word<std::uint32_t>("the number of buttons");
  if (buttons_of_device > 32) here(message("there are ", buttons_of_device, " buttons; copy the file again"));
  session.device.buttons = static_cast<int>(buttons_of_device);
  for (DeviceValue* const value : {&session.device.continuous_force, &session.device.max_damping, &session.device.mass})
    if (double const number = in.number("what is known of the device"); !std::isnan(number)) *value = number;
  bool const has_torque = (flags & torque_flag) != 0;
  if (has_torque) session.device.max_torque = in.number("the device's torque");
  if ((flags & stated_flag) != 0) {
    for (std::size_t k = 0; k < extra_values; ++k)
      if (double const number = in.number("what is known of the device"); !std::isnan(number)) session.device.*stated_values[k].value = number;
    for (StatedValue const& stated : stated_values) {
      auto const from = in.word<std::uint8_t>("where what is known of the device comes from");
      if (from > static_cast<unsigned>(Provenance::reported)) here("where what is known of the device comes from is unknown; copy the file again");
      (session.device.*stated.value).provenance = static_cast<Provenance>(from);
    }
  }
  bool const has_hand = (flags & hand_flag) != 0;
  try {
    std::string last;
    for (std::size_t k = 0, n = in.count(8, "the configuration"); k < n; ++k) {
      std::string const key = in.text("a key of the configuration");
      if (k > 0 && !(last < key)) here(message("the key \"", legible(key), "\" of the configuration is not in order; copy the file again"));
      session.configuration.set(key, in.text("a value of the configuration"));
      last = key;
    }
    std::size_t const events = in.count(12, "the events");
    session.events.reserve(events);
    for (std::size_t k = 0; k < events; ++k) {
      double const time = in.number("the time of an event");
      session.events.push_back({time, in.text("the name of an event")});
    }
    std::size_t const ticks = in.count(has_hand ? 58 : 34, "the number of ticks");
    session.recording.reserve(ticks);
    if (has_hand) session.hand.reserve(ticks);
    double energy = 0.0, area = 0.0, gripper = 1.0;
    std::uint32_t buttons = 0;
    Eigen::Quaternion<double> orientation = Eigen::Quaternion<double>::Identity();
    for (std::size_t i = 0; i < ticks; ++i) {
      auto const bits = in.word<std::uint16_t>("a tick");
      if ((bits & 3u) > static_cast<unsigned>(CuttingPhase::moving)) here(message("tick ", i, " has an unknown phase; copy the file again"));
      constexpr unsigned of_hand = 0x7Cu | same_buttons_flag | turned_flag | gripped_flag;
      if (bits > (same_energy_flag | of_hand | twisted_flag | cut_flag | 0xFFu) || (!has_hand && (bits & of_hand) != 0) || (!has_torque && (bits & twisted_flag) != 0))
        here(message("tick ", i, " has unknown flags; copy the file again"));
      Tick tick;
      tick.phase = static_cast<CuttingPhase>(bits & 3u);
      tick.time = in.number("a tick");
      tick.tip = vector("a tick");
      if ((bits & silent_flag) == 0) {
        tick.depth = in.number("a tick");
        tick.force = vector("a tick");
      }
      if ((bits & twisted_flag) != 0) tick.torque = vector("a tick");
      if ((bits & same_energy_flag) == 0) energy = in.number("a tick");
      if ((bits & cut_flag) != 0) area = in.number("a tick");
      tick.energy = energy, tick.cut_area = area;
      session.recording.append(tick);
      if (!has_hand) continue;
      HandSample hand{.read = static_cast<DeviceStatus>(bits >> 2 & 3u), .written = static_cast<DeviceStatus>(bits >> 4 & 3u)};
      hand.velocity = vector("a sample of the hand");
      hand.position = (bits & at_tip_flag) != 0 ? tick.tip : vector("a sample of the hand");
      if ((bits & same_buttons_flag) == 0) buttons = in.word<std::uint32_t>("a sample of the hand");
      hand.buttons = buttons;
      if ((bits & turned_flag) != 0)
        for (double& component : orientation.coeffs()) component = in.number("a sample of the hand");
      hand.orientation = orientation;
      if ((bits & gripped_flag) != 0) gripper = in.number("a sample of the hand");
      hand.gripper = gripper;
      session.hand.push_back(hand);
    }
    if (in.left() != 0) here(message(in.left(), " bytes are left over; copy the file again"));
    session.validate();
  } catch (InvalidArgument const& problem) {
    here(problem.what());
  }
  return session;
}

}  // namespace palpate::detail
