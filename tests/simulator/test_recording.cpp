// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "device/temporary_folder.hpp"

#include <palpate/device/trajectory.hpp>
#include <palpate/simulator/recording.hpp>

#include <algorithm>
#include <bit>
#include <clocale>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>

#if defined(__linux__)
#include <csignal>
#include <sys/resource.h>
#endif

using namespace palpate;
using palpate_test::content_of;
using palpate_test::message_of;
using palpate_test::TemporaryFolder;
using palpate_test::unsaid;

static_assert(noexcept(std::declval<Recording&>().try_append(std::declval<Tick const&>())));

namespace {

Recording small() {
  Recording recording;
  recording.append({.time = 0.0, .tip = {0.0312, 0.0533, 0.002}});
  recording.append({.time = 0.001, .tip = {0.0312, 0.0533, -0.0015}, .depth = 0.0015, .phase = CuttingPhase::indenting,
                    .force = {0.0, 0.0, 0.25}, .energy = 1e-5});
  recording.append({.time = 0.002, .tip = {1.0 / 3.0, -1e-7, 1e22}, .depth = 0.01, .phase = CuttingPhase::moving,
                    .force = {-3.0, 0.0, 4.0}, .energy = -2.5e-5});
  return recording;
}

constexpr char const* small_csv =
    "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J\n"
    "0,0.0312,0.0533,0.002,0,no contact,0,0,0,0\n"
    "0.001,0.0312,0.0533,-0.0015,0.0015,indenting,0,0,0.25,1e-05\n"
    "0.002,0.3333333333333333,-1e-07,1e+22,0.01,moving,-3,0,4,-2.5e-05\n";

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

bool same_bits(Tick const& a, Tick const& b) {
  bool same = same_bits(a.time, b.time) && same_bits(a.depth, b.depth) && same_bits(a.energy, b.energy) && a.phase == b.phase;
  for (int i = 0; i < 3; ++i) same = same && same_bits(a.tip(i), b.tip(i)) && same_bits(a.force(i), b.force(i));
  return same;
}

Recording random_recording(unsigned seed, int ticks) {   // doubles of every magnitude, subnormal ones too
  std::mt19937_64 generator(seed);
  auto const any = [&] {
    for (;;) {
      double const value = std::bit_cast<double>(generator());
      if (std::isfinite(value)) return value;
    }
  };
  Recording recording;
  for (int i = 0; i < ticks; ++i)
    recording.append({.time = i / 1000.0,
                      .tip = {any(), any(), any()},
                      .depth = any(),
                      .phase = static_cast<CuttingPhase>(generator() % 3),
                      .force = {any(), any(), any()},
                      .energy = any()});
  return recording;
}

std::size_t files_in(std::filesystem::path const& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

TEST_CASE("a recording is written as the agreed text", "[recording]") {
  // Yardstick: the lines above, by hand; the header is part of the contract.
  CHECK(small().to_csv() == small_csv);
  TemporaryFolder const folder;
  small().write_csv(folder / "session.csv");
  CHECK(content_of(folder / "session.csv") == small_csv);
  CHECK(Recording().to_csv() == std::string(Recording::csv_header) + "\n");
}

TEST_CASE("a recording of a solid that was cut has the area in a last column", "[recording]") {
  // Yardstick: the lines, by hand.
  Recording recording;
  recording.append({.time = 0.5, .force = {0.0, 0.25, 0.0}, .energy = 0.125});
  recording.append({.time = 0.75, .cut_area = 1e-4});
  std::string const text =
      "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J,cut_area_m2\n"
      "0.5,0,0,0,0,no contact,0,0.25,0,0.125,0\n"
      "0.75,0,0,0,0,no contact,0,0,0,0,1e-04\n";
  CHECK(recording.to_csv() == text);
  TemporaryFolder const folder;
  auto const back = Recording::read_csv(folder.file("cut.csv", text));
  REQUIRE(back.ticks().size() == 2);
  CHECK(same_bits(back.ticks()[1].cut_area, 1e-4));
  CHECK(back.to_csv() == text);
  CHECK_THROWS_WITH(Recording::read_csv(folder.file("short.csv", text.substr(0, text.size() - 7))), Catch::Contains("cells") || Catch::Contains("cut short"));
}

TEST_CASE("a recording of a device with torque has it in the last columns, after the area", "[recording]") {
  // Yardstick: the lines, by hand.
  std::string const head = "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J";
  TemporaryFolder const folder;
  for (bool const has_area : {false, true}) {
    Recording recording;
    recording.append({.time = 0.5, .cut_area = has_area ? 0.25 : 0.0, .torque = {0.125, -0.25, 0.0}});
    recording.append({.time = 0.75, .cut_area = has_area ? 0.25 : 0.0});
    std::string const area = has_area ? ",0.25" : "";
    std::string const text = head + (has_area ? ",cut_area_m2" : "") + ",torque_x_Nm,torque_y_Nm,torque_z_Nm\n" +
                             "0.5,0,0,0,0,no contact,0,0,0,0" + area + ",0.125,-0.25,0\n" +
                             "0.75,0,0,0,0,no contact,0,0,0,0" + area + ",0,0,0\n";
    CHECK(recording.to_csv() == text);
    auto const back = Recording::read_csv(folder.file("torque.csv", text));
    REQUIRE(back.ticks().size() == 2);
    CHECK(back.ticks()[0].torque == Vector3<double>(0.125, -0.25, 0));
    CHECK(back.to_csv() == text);
    CHECK_THROWS_WITH(Recording::read_csv(folder.file("word.csv", text.substr(0, text.size() - 2) + "x\n")), Catch::Contains("torque_z_Nm"));
  }
  CHECK_THROWS_WITH(Recording::read_csv(folder.file("head.csv", head + ",torque_x_Nm\n")), Catch::Contains("header"));
}

TEST_CASE("what was written is read back to the bit, and written again to the byte", "[recording]") {
  TemporaryFolder const folder;
  Recording const recording = random_recording(5, 3000);
  recording.write_csv(folder / "a.csv");
  Recording const back = Recording::read_csv(folder / "a.csv");
  REQUIRE(back.ticks().size() == recording.ticks().size());
  CHECK(std::equal(back.ticks().begin(), back.ticks().end(), recording.ticks().begin(),
                   [](Tick const& a, Tick const& b) { return same_bits(a, b); }));
  back.write_csv(folder / "b.csv");
  CHECK(content_of(folder / "a.csv") == content_of(folder / "b.csv"));
  CHECK(Recording::read_csv(folder.file("c.csv", Recording().to_csv())).ticks().empty());
}

TEST_CASE("times of a servo tick come out short", "[recording]") {
  Recording recording;
  for (int i = 0; i < 5000; ++i) recording.append({.time = i / 1000.0});
  std::string const text = recording.to_csv();
  CHECK(text.find("\n0.003,") != std::string::npos);
  CHECK(text.find("\n4.999,") != std::string::npos);
  CHECK(text.size() < 5000 * 40);   // no time with 17 digits
}

TEST_CASE("values that are not finite survive the file", "[recording]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  double const infinity = std::numeric_limits<double>::infinity();
  Recording recording;
  recording.append({.time = 0.0, .tip = {nan, -nan, -0.0}, .depth = -infinity, .force = {infinity, 0.0, 0.0}});
  CHECK(recording.to_csv().find("0,nan,nan,-0,-inf,no contact,inf,0,0,0\n") != std::string::npos);
  TemporaryFolder const folder;
  recording.write_csv(folder / "session.csv");
  Tick const back = Recording::read_csv(folder / "session.csv").ticks().front();
  CHECK(std::isnan(back.tip.x()));
  CHECK(std::signbit(back.tip.z()));
  CHECK(back.depth == -infinity);
  CHECK(back.force.x() == infinity);
}

TEST_CASE("the locale does not reach the file", "[recording]") {
  std::string const before = std::setlocale(LC_ALL, nullptr);
  for (char const* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    CHECK(small().to_csv() == small_csv);
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEST_CASE("the largest force is a magnitude, over finite forces", "[recording]") {
  CHECK(Recording().largest_force() == 0.0);
  Recording recording = small();
  CHECK(recording.largest_force() == 5.0);   // (-3, 0, 4)
  recording.append({.force = {std::numeric_limits<double>::quiet_NaN(), 100.0, 0.0}});
  CHECK(recording.largest_force() == 5.0);
}

TEST_CASE("the mean force is that of the ticks in between", "[recording]") {
  Recording recording;
  for (int k = 0; k < 10; ++k) recording.append({.time = 0.5 * k, .force = {1.0 * k, 0.0, -2.0}});
  CHECK(recording.mean_force(1.0, 2.0) == Vector3<double>(3.0, 0.0, -2.0));   // of 2, 3 and 4
  CHECK(recording.mean_force(2.1, 2.4).isZero(0));
}

TEST_CASE("a recording of the servo tick neither allocates nor grows; what finds no room is counted", "[recording][realtime]") {
  REQUIRE(palpate_test::trap_works());
  Recording recording(1000);
  std::size_t const room = recording.capacity();
  palpate_test::AllocationCount const allocations;
  std::size_t taken = 0;
  for (std::size_t i = 0; i < room + 234; ++i) taken += recording.try_append({.time = double(i)}) ? 1 : 0;
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(room >= 1000);
  CHECK(taken == room);
  CHECK(recording.ticks().size() == room);
  CHECK(recording.ticks().back().time == double(room - 1));   // the newest are dropped, the order stays
  CHECK(recording.dropped() == 234);
  recording.append({.time = -1.0});   // lock-step grows
  CHECK(recording.ticks().size() == room + 1);
  recording.clear();
  CHECK(recording.ticks().empty());
  CHECK(recording.dropped() == 0);
}

TEST_CASE("a recording replaces an older file and leaves nothing else behind", "[recording]") {
  TemporaryFolder const folder;
  auto const target = folder.file("session.csv", "an older session\n");
  auto const busy = folder.file("session.csv.part0", "another writer is at it\n");
  small().write_csv(target);
  CHECK(content_of(target) == small_csv);
  CHECK(content_of(busy) == "another writer is at it\n");
  CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("a place that can not be written is refused in one clear line, and nothing is left there", "[recording]") {
  TemporaryFolder const folder;
  auto const complaint = [](std::filesystem::path const& path) { return message_of([&] { small().write_csv(path); }); };

  CHECK_THROWS_AS(small().write_csv(folder / "nowhere/session.csv"), FileError);
  CHECK(unsaid(complaint(folder / "nowhere/session.csv"), "can not write", "nowhere/session.csv", "there is no folder",
               "create it first") == "");
  auto const file = folder.file("file", "not a folder");
  CHECK(unsaid(complaint(file / "session.csv"), "there is no folder", "create it first") == "");
  CHECK(unsaid(complaint(folder.path()), "is not a regular file") == "");
  CHECK(unsaid(complaint(folder.path() / ""), "it names no file") == "");
  CHECK(files_in(folder.path()) == 1);
#if defined(__linux__)
  CHECK(unsaid(complaint("/dev/null"), "is not a regular file") == "");
  CHECK(unsaid(complaint("/proc/session.csv"), "can not write /proc/session.csv", "check that folder /proc may be written") == "");
#endif
}

#if defined(__linux__)
TEST_CASE("when the disk is full the older file stays as it was", "[recording]") {
  // A limit on the size of files stands in for the full disk: writing fails half-way.
  TemporaryFolder const folder;
  auto const target = folder.file("session.csv", "an older session\n");
  Recording const large = random_recording(3, 2000);
  auto const handler = std::signal(SIGXFSZ, SIG_IGN);
  ::rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  ::rlimit const small_limit{.rlim_cur = 65536, .rlim_max = before.rlim_max};
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &small_limit) == 0);
  std::string const message = message_of([&] { large.write_csv(target); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK(unsaid(message, "can not write", "session.csv", "check the free space", "nothing was left half-written") == "");
  CHECK(content_of(target) == "an older session\n");
  CHECK(files_in(folder.path()) == 1);
  large.write_csv(target);
  CHECK(content_of(target) == large.to_csv());
}

TEST_CASE("a link stays a link: the file it names is replaced", "[recording]") {
  TemporaryFolder const folder;
  folder.file("real.csv", "old");
  std::filesystem::create_symlink("real.csv", folder / "link.csv");
  small().write_csv(folder / "link.csv");
  CHECK(std::filesystem::is_symlink(folder / "link.csv"));
  CHECK(content_of(folder / "real.csv") == small_csv);
}
#endif

TEST_CASE("a damaged recording says where", "[recording]") {
  TemporaryFolder const folder;
  auto const complaint = [&](std::string const& text) {
    auto const file = folder.file("session.csv", text);
    CHECK_THROWS_AS(Recording::read_csv(file), FileError);
    return message_of([&] { Recording::read_csv(file); });
  };
  std::string const text = small_csv;
  CHECK(unsaid(complaint(""), "the file is empty", "time_s,tip_x_m") == "");
  CHECK(unsaid(complaint("time_s,x_m,y_m,z_m\n"), "line 1: not the header of a recording") == "");
  CHECK(unsaid(complaint(text.substr(0, text.size() - 14)), "line 4: there are 7 cells instead of 10", "cut short") == "");
  CHECK(unsaid(complaint(text.substr(0, text.size() - 1)), "line 4: the last line does not end", "cut short") == "");
  CHECK(unsaid(complaint(text + "0.003,0,0,zero,0,moving,0,0,0,0\n"), "line 5: column tip_z_m holds \"zero\"") == "");
  CHECK(unsaid(complaint(text + "0.003,0,0,0,0,cutting,0,0,0,0\n"), "line 5: phase \"cutting\" is unknown", "\"no contact\"") == "");
  CHECK(unsaid(message_of([&] { Recording::read_csv(folder / "none.csv"); }), "does not exist") == "");
}

TEST_CASE("a recording is a tool path: it can be replayed", "[recording]") {
  // Yardstick: the recorded tips themselves.
  Recording recording;
  for (int i = 0; i <= 100; ++i) recording.append({.time = i / 1000.0, .tip = {std::sin(0.1 * i), 0.5, 1e-3 * i}});
  TemporaryFolder const folder;
  recording.write_csv(folder / "session.csv");
  auto const path = read_trajectory<double>(folder / "session.csv");
  for (Tick const& tick : recording.ticks()) CHECK((path.at(tick.time).position - tick.tip).norm() <= 1e-14);
}
