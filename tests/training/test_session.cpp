// SPDX-License-Identifier: MIT
// Yardsticks: the text by hand; the published check value of the checksum; the bits that were written.
#include "catch.hpp"

#include "device/message.hpp"
#include "device/temporary_folder.hpp"
#include "training/sessions.hpp"

#include <palpate/device/trajectory.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/session_io.hpp>

#include <algorithm>
#include <cstring>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

using namespace palpate;
using palpate_test::content_of;
using palpate_test::message_of;
using palpate_test::random_session;
using palpate_test::small_session;
using palpate_test::TemporaryFolder;
using palpate_test::unsaid;

namespace {

constexpr char const* small_head =
    "# palpate session 1\n"
    "# note No force of this library is validated for a patient or for the outcome of a training.\n"
    "# version " PALPATE_VERSION_STRING
    "\n"
    "# seed 18446744073709551615\n"
    "# device 3.3 N 1000 Hz, reports velocity\n"
    "# motors hand 2 buttons 0.88 N unknown N·s/m 0.045 kg\n"
    "# configuration cutter progressive\n"
    "# configuration guided no\n"
    "# configuration note a line of words, with a comma\n"
    "# configuration tissue.mass_kg 0.1\n"
    "# event 0.001 touch\n"
    "# event 0.002 puncture\n"
    "# event 0.0015 the teacher spoke\n"
    "# ticks 3\n";
constexpr char const* small_table =
    "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J,"
    "hand_x_m,hand_y_m,hand_z_m,hand_vx_m_s,hand_vy_m_s,hand_vz_m_s,buttons,read,written\n"
    "0,0.0312,0.0533,0.002,0,no contact,0,0,0,0,0.0312,0.0533,0.002,0,0,-3.5,0,ok,ok\n"
    "0.001,0.0312,0.0533,-0.0015,0.0015,indenting,0,0,0.25,1e-05,0.0312,0.0533,-0.0015,1,2,3,3,stale,ok\n"
    "0.002,0.3333333333333333,-1e-07,1e+22,0.01,moving,-3,0,4,-2.5e-05,nan,0,0,0,0,0,0,disconnected,fault\n";

/// With its length and checksum as they must be: what the parser itself sees.
std::string sealed(std::string bytes) {
  std::string out = bytes.substr(0, bytes.size() - 4);
  std::uint64_t const length = out.size() - detail::session_frame;
  for (std::size_t i = 0; i < 8; ++i) out[12 + i] = static_cast<char>(static_cast<unsigned char>(length >> (8 * i) & 0xFFu));
  detail::ByteWriter sum;
  sum.put(detail::crc32(out));
  return out + sum.bytes();
}

}  // namespace

TEST_CASE("a session is written as the agreed text", "[training][session]") {
  CHECK(to_csv(small_session()) == std::string(small_head) + small_table);
}

TEST_CASE("a session without samples of the hand is a recording with a head, and reads as one", "[training][session]") {
  Session session = small_session();
  session.hand.clear();
  std::string const text = to_csv(session);
  CHECK(text == small_head + session.recording.to_csv());
  TemporaryFolder const folder;
  write_session_csv(folder / "session.csv", session);
  CHECK(Recording::read_csv(folder / "session.csv").to_csv() == session.recording.to_csv());
}

TEST_CASE("a file of a recording is a session of which little is known", "[training][session]") {
  TemporaryFolder const folder;
  Session const known = small_session();
  known.recording.write_csv(folder / "old.csv");
  Session const session = read_session_csv(folder / "old.csv");
  CHECK(session.recording.to_csv() == known.recording.to_csv());
  CHECK(session.version == "recording");
  CHECK(session.seed.value == 0);
  CHECK(session.configuration.size() == 0);
  CHECK(session.hand.empty());
  CHECK(session.device.rate == 1000.0);
  CHECK(session.events == std::vector<SessionEvent>{{0.001, "touch"}, {0.002, "puncture"}});
}

TEST_CASE("a recording of a solid that was cut, of torques too, is a session, and what it has is kept", "[training][session]") {
  TemporaryFolder const folder;
  for (bool const has_area : {false, true})
    for (bool const has_torque : {false, true}) {
      INFO("area " << has_area << ", torque " << has_torque);
      Recording recording;
      recording.append({.time = 0, .tip = {0.1, 0.2, 0.3}});
      recording.append({.time = 0.001, .cut_area = has_area ? 2.5e-5 : 0, .torque = {0, has_torque ? 0.125 : 0, 0}});
      recording.append({.time = 0.002, .cut_area = has_area ? 3e-5 : 0});
      recording.write_csv(folder / "plain.csv");
      Session const session = read_session_csv(folder / "plain.csv");
      CHECK_FALSE(first_difference(session.recording, recording));
      write_session(folder / "a.session", session), write_session_csv(folder / "a.csv", session);
      CHECK_FALSE(first_difference(read_session(folder / "a.session").recording, recording));
      CHECK_FALSE(first_difference(read_session(folder / "a.csv").recording, recording));
      CHECK(Recording::read_csv(folder / "a.csv").to_csv() == recording.to_csv());
      Session with_hand = session;
      with_hand.hand.assign(3, {.velocity = {1, 2, 3}});
      write_session(folder / "b.session", with_hand), write_session_csv(folder / "b.csv", with_hand);
      for (char const* const name : {"b.session", "b.csv"}) {
        Session const back = read_session(folder / name);
        CHECK_FALSE(first_difference(back.recording, recording));
        REQUIRE(back.hand.size() == 3);
        CHECK(back.hand[2].velocity == Vector3<double>(1, 2, 3));
      }
    }
  Recording one, other;
  one.append({.cut_area = 1e-4}), other.append({.cut_area = 2e-4});
  CHECK(first_difference(one, other) == std::optional<std::size_t>(0));
}

TEST_CASE("a session is a tool path", "[training][session]") {
  TemporaryFolder const folder;
  Session session = random_session(4, 0, false);
  for (int i = 0; i <= 100; ++i) {
    session.recording.append({.time = i / 1000.0, .tip = {0.1 * i, 0.5, 1e-3 * i}});
    session.hand.push_back({});
  }
  write_session_csv(folder / "session.csv", session);
  auto const path = read_trajectory<double>(folder / "session.csv");
  for (Tick const& tick : session.recording.ticks()) CHECK((path.at(tick.time).position - tick.tip).norm() <= 1e-13);
}

TEST_CASE("sessions come back to the bit from text and from bytes, and go out again to the byte", "[training][session]") {
  TemporaryFolder const folder;
  std::vector<Session> sessions{Session{}, small_session()};
  for (unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 20u}) sessions.push_back(random_session(seed, 400, seed % 2 == 0));
  sessions.back().recording.append(
      {.tip = {-0.0, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::quiet_NaN()}, .depth = -0.0});
  if (!sessions.back().hand.empty()) sessions.back().hand.push_back({.velocity = {-0.0, 0, 0}});
  for (Session const& session : sessions) {
    write_session_csv(folder / "a.csv", session);
    Session const text = read_session_csv(folder / "a.csv");
    CHECK(to_bytes(read_session(folder / "a.csv")) == to_bytes(text));
    CHECK((to_csv(text) == to_csv(session)));
    CHECK((to_bytes(text) == to_bytes(session)));
    write_session(folder / "a.session", session);
    CHECK((content_of(folder / "a.session") == to_bytes(session)));
    Session const bytes = read_session(folder / "a.session");
    CHECK((to_bytes(bytes) == to_bytes(session)));
    CHECK((to_csv(bytes) == to_csv(session)));
    CHECK(bytes.configuration == session.configuration);
    CHECK(bytes.events == session.events);
    CHECK(bytes.seed.value == session.seed.value);
    for (Session const* const read : {&bytes, &text}) {
      CHECK(read->device.reports_velocity == session.device.reports_velocity);
      CHECK(read->device.reports_orientation == session.device.reports_orientation);
      CHECK(read->device.max_torque.value == session.device.max_torque.value);
      CHECK(read->device.reports_gripper == session.device.reports_gripper);
      for (auto const value : {&Capabilities::max_force, &Capabilities::rate, &Capabilities::max_torque, &Capabilities::continuous_force, &Capabilities::max_stiffness,
                               &Capabilities::max_damping, &Capabilities::mass, &Capabilities::damping, &Capabilities::friction, &Capabilities::resolution}) {
        CHECK((read->device.*value).value == (session.device.*value).value);
        CHECK((read->device.*value).provenance == (session.device.*value).provenance);
      }
      REQUIRE(read->hand.size() == session.hand.size());
      bool same = true;
      for (std::size_t k = 0; k < session.hand.size(); ++k) same = same && read->hand[k].orientation.coeffs() == session.hand[k].orientation.coeffs() && read->hand[k].gripper == session.hand[k].gripper;
      CHECK(same);
    }
    if (session.recording.ticks().empty() || &session == &sessions.back()) continue;
    CHECK_FALSE(first_difference(bytes.recording, session.recording));
    CHECK_FALSE(first_difference(text.recording, session.recording));
  }
}

TEST_CASE("the binary form is what its description says, the lowest byte first", "[training][session]") {
  // Yardstick: the bytes by hand; CRC-32's check value of "123456789" is published as CBF43926.
  CHECK(detail::crc32("123456789") == 0xCBF43926u);
  Session session{.seed = Seed{0x0102030405060708u}, .device = {.max_force = 2.0, .rate = 1000.0}};
  session.recording.append({.time = 1.0, .tip = {0, 0, -2.0}});
  std::string const bytes = to_bytes(session);
  std::string const version = PALPATE_VERSION_STRING;
  CHECK(bytes.substr(0, 12) == std::string("\x89PLPS\r\n\x1A\x01\0\0\0", 12));
  CHECK(static_cast<std::size_t>(bytes[12]) == bytes.size() - 24);
  std::size_t const after_version = 24 + version.size();
  CHECK(bytes.substr(20, 4 + version.size()) == std::string(1, static_cast<char>(version.size())) + std::string(3, '\0') + version);
  CHECK(bytes.substr(after_version, 8) == "\x08\x07\x06\x05\x04\x03\x02\x01");
  CHECK(bytes.substr(after_version + 8, 8) == std::string("\0\0\0\0\0\0\0\x40", 8));   // 2.0 is 4000000000000000
  std::size_t const tick = after_version + 8 + 45 + 8 + 8 + 8;
  CHECK(bytes.substr(tick, 10) == std::string("\x80\x01\0\0\0\0\0\0\xF0\x3F", 10));   // silent, no energy; 1.0 is 3FF0000000000000
  CHECK(bytes.size() == tick + 34 + 4);
}

TEST_CASE("a session of a minute takes less than half of its text", "[training][session]") {
  Session session{};
  std::mt19937_64 generator(3);
  auto const any = [&] { return 1e-10 * static_cast<double>(generator() >> 34); };
  for (int i = 0; i < 6000; ++i)
    session.recording.append({.time = i / 1000.0,
                              .tip = {any() / 3, any() / 7, any() / 9},
                              .depth = any() / 3,
                              .phase = CuttingPhase::moving,
                              .force = {any() / 3, any() / 3, any() / 11}});
  std::size_t const binary = to_bytes(session).size(), text = to_csv(session).size();
  CHECK(binary < 6000u * 66u + 250u);
  CHECK(2 * binary < text);
}

TEST_CASE("every truncation of a binary session is refused", "[training][session]") {
  std::string const bytes = to_bytes(small_session());
  int accepted = 0, unclear = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::optional<std::string> problem;
    try {
      session_from_bytes(bytes.substr(0, size));
    } catch (FileError const& error) {
      problem = error.what();
    }
    if (!problem)
      ++accepted;
    else if (problem->find("session, byte ") != 0)
      ++unclear;
    // With a checksum of its own what is left has to be refused by its content.
    if (size < 24) continue;
    CHECK_THROWS_AS(session_from_bytes(sealed(bytes.substr(0, size))), FileError);
  }
  CHECK(accepted == 0);
  CHECK(unclear == 0);
}

TEST_CASE("every changed bit is found by the checksum, and what has a good checksum is taken apart without harm", "[training][session]") {
  std::string const bytes = to_bytes(small_session());
  int accepted = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(static_cast<unsigned char>(damaged[at]) ^ (1u << bit));
      try {
        session_from_bytes(damaged);
        ++accepted;
      } catch (FileError const&) {
      }
    }
  CHECK(accepted == 0);

  std::mt19937_64 generator(11);
  int refused = 0, read = 0, unlike = 0;
  for (int round = 0; round < 8000; ++round) {
    std::string damaged = bytes;
    for (auto flips = 1 + generator() % 4; flips > 0; --flips) {
      std::size_t const at = detail::session_frame + generator() % (bytes.size() - 24);
      damaged[at] = static_cast<char>(static_cast<unsigned char>(generator() % 3 == 0 ? 0xFFu : generator() & 0xFFu));
    }
    damaged = sealed(damaged);
    try {
      Session const session = session_from_bytes(damaged);
      ++read;
      if (to_bytes(session_from_bytes(to_bytes(session))) != to_bytes(session)) ++unlike;   // whatever it says, it is a session
    } catch (FileError const&) {
      ++refused;
    }
  }
  CHECK(refused > 1000);
  CHECK(read > 1000);
  CHECK(unlike == 0);
}

TEST_CASE("a damaged session says where", "[training][session]") {
  std::string const bytes = to_bytes(small_session());
  auto const said = [](std::string const& damaged) { return message_of([&] { session_from_bytes(damaged, "a.session"); }); };
  CHECK(unsaid(said(""), "a.session, byte 0: not a session in binary form") == "");
  CHECK(unsaid(said("time_s,tip_x_m"), "not a session in binary form", "a name that ends in .csv") == "");
  std::string other = bytes;
  other[8] = 2;
  CHECK(unsaid(said(other), "byte 8: the format is 2; this version reads 1") == "");
  CHECK(unsaid(said(bytes.substr(0, bytes.size() - 1)), "byte 12: the length is", "cut short") == "");
  other = bytes;
  other[40] = static_cast<char>(other[40] ^ 1);
  CHECK(unsaid(said(other), "the checksum is another one", "copy it again") == "");
  // A count that no file could hold is refused before room is made for it.
  std::size_t const count = detail::session_frame + 4 + std::strlen(PALPATE_VERSION_STRING) + 8 + 45;
  for (std::size_t i = 0; i < 8; ++i) (other = i == 0 ? bytes : other)[count + i] = '\x7F';
  CHECK(unsaid(said(sealed(other)), "byte " + std::to_string(count), "the configuration is cut short or damaged") == "");

  TemporaryFolder const folder;
  CHECK(unsaid(message_of([&] { read_session(folder / "none"); }), "the file does not exist") == "");
  CHECK(unsaid(message_of([&] { read_session(folder.path()); }), "this is a folder") == "");
}

TEST_CASE("a damaged text says where", "[training][session]") {
  TemporaryFolder const folder;
  std::string const text = to_csv(small_session());
  auto const said = [&](std::string const& damaged) {
    auto const file = folder.file("session.csv", damaged);
    CHECK_THROWS_AS(read_session_csv(file), FileError);
    return message_of([&] { read_session_csv(file); });
  };
  auto const with = [&](std::string_view old, std::string_view fresh) {
    std::string changed = text;
    return changed.replace(changed.find(old), old.size(), fresh);
  };
  CHECK(unsaid(said(""), "the table is missing") == "");
  CHECK(unsaid(said(text.substr(0, text.rfind("0.002,"))), "there are 2 ticks where the head says 3") == "");
  CHECK(unsaid(said(text.substr(0, text.size() - 8)), "line 18: there are 18 cells instead of 19") == "");
  CHECK(unsaid(said(with("session 1", "session 2")), "line 1: \"# palpate session 2\" is another format") == "");
  CHECK(unsaid(said(with("seed 1", "seed -1")), "line 4: the seed is \"-18446744073709551615\"; write a whole number") == "");
  CHECK(unsaid(said(with("Hz, reports velocity", "Hz")), "line 5: a device is, for example") == "");
  CHECK(unsaid(said(with("3.3 N", "NN N")), "line 5: the device's force is \"NN\"") == "");
  CHECK(unsaid(said(with("3.3 N", "-3.3 N")), "device maximum force is -3.3 N") == "");
  CHECK(unsaid(said(with("# configuration guided", "# configuration cutter")), "line 8: the key cutter is there twice") == "");
  CHECK(unsaid(said(with("# configuration guided", "# states friction 0.2 guessed\n# states friction 0.3 guessed\n# configuration guided")), "line 9: the device states its friction twice") == "");
  CHECK(unsaid(said(with("stale", "st\x1B[2Jale")), "line 17: the device's status \"st?[2Jale\" is unknown") == "");   // nothing that a terminal would obey
  CHECK(unsaid(said(with("# configuration guided", "# configuration guided\x07")), "the key is \"guided?\"; give one word") == "");
  CHECK(unsaid(said(with("# event 0.001", "# event soon")), "line 11: the time of the event is \"soon\"") == "");
  CHECK(unsaid(said(with("# event 0.001 touch", "# evening")), "line 11: \"evening\" is no line of a session") == "");
  CHECK(unsaid(said(with("# ticks 3\n", "")), "the line \"# ticks\" is missing") == "");
  CHECK(unsaid(said(with(",read,written", ",read")), "not the header of a session", "hand_x_m") == "");
  CHECK(unsaid(said(with("stale", "stall")), "line 17: the device's status \"stall\" is unknown") == "");
  CHECK(to_csv(read_session_csv(folder.file("crlf.csv", [&] {
          std::string dos;
          for (char const c : text) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
          return dos;
        }()))) == text);
}

TEST_CASE("what could not be read back is refused when it is set", "[training][session]") {
  Configuration configuration;
  CHECK(unsaid(message_of([&] { configuration.set("two words", 1); }), "Configuration: the key is \"two words\"", "one word") == "");
  CHECK(unsaid(message_of([&] { configuration.set("", 1); }), "the key is \"\"") == "");
  CHECK(unsaid(message_of([&] { configuration.set("a", "one\ntwo"); }), "the value of a", "one line") == "");
  CHECK(unsaid(message_of([&] { configuration.set("a", " b"); }), "without blanks at its ends") == "");
  CHECK(configuration.size() == 0);
  configuration.set("empty", "").set("third", 1.0 / 3.0).set("count", 7);
  CHECK(*configuration.find("third") == "0.3333333333333333");
  CHECK(*configuration.find("count") == "7");
  CHECK(configuration.find("none") == nullptr);
  Session session{.configuration = configuration};
  CHECK((to_bytes(session_from_bytes(to_bytes(session))) == to_bytes(session)));

  session.hand.resize(2);
  CHECK(unsaid(message_of([&] { to_bytes(session); }), "2 samples of the hand for 0 ticks") == "");
  session.hand.clear();
  session.events = {{0.0, ""}};
  CHECK(unsaid(message_of([&] { to_csv(session); }), "an event is called \"\"") == "");
  session.events = {{std::numeric_limits<double>::quiet_NaN(), "late"}};
  CHECK(unsaid(message_of([&] { to_csv(session); }), "\"late\" is at nan s") == "");
  session.events.clear();
  for (int const buttons : {-1, 33}) {
    session.device.buttons = buttons;
    CHECK(unsaid(message_of([&] { to_bytes(session); }), buttons < 0 ? "-1 buttons" : "33 buttons", "0 to 32") == "");
  }
  session.device.buttons = 32;
  session.recording.append({.time = 0.004, .torque = {0, 0.1, 0}});
  CHECK(unsaid(message_of([&] { to_bytes(session); }), "torque at 0.004 s", ".device.max_torque") == "");
  session.device.max_torque = 0.5;
  CHECK(session_from_bytes(to_bytes(session)).recording.ticks()[0].torque.y() == 0.1);
}

TEST_CASE("events are where the phases change", "[training][session]") {
  Recording recording;
  CuttingPhase const phases[] = {CuttingPhase::no_contact, CuttingPhase::indenting, CuttingPhase::indenting, CuttingPhase::no_contact,
                                 CuttingPhase::moving,     CuttingPhase::indenting, CuttingPhase::moving,    CuttingPhase::no_contact};
  for (int i = 0; i < 8; ++i) recording.append({.time = 0.25 * i, .phase = phases[i]});
  CHECK(phase_events(recording) ==
        std::vector<SessionEvent>{{0.25, "touch"}, {0.75, "lift"}, {1.0, "touch"}, {1.0, "puncture"}, {1.5, "puncture"}, {1.75, "lift"}});
}
