// SPDX-License-Identifier: MIT
#include <palpate/fitting/measurements.hpp>

#include "catch.hpp"

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

using namespace palpate;

namespace {

/// A file with this text, gone at the end.
struct File {
  std::filesystem::path path = std::filesystem::temp_directory_path() / "palpate_measurements.csv";
  explicit File(std::string const& text) { std::ofstream(path, std::ios::binary) << text; }
  ~File() { std::filesystem::remove(path); }
};

std::string refusal(std::string const& text) {
  File const file(text);
  try {
    read_measurements(file.path);
  } catch (FileError const& error) {
    std::string const what = error.what();
    return what.substr(what.find(".csv") + 4);
  }
  return "accepted";
}

std::string const header = "depth_m,speed_m_s,phase,force_N\n";

}  // namespace

TEST_CASE("measurements are read in their units, comments skipped") {
  File const file("# generated\n" + header + "0.001,0.02,indenting,0.1\n\n# a note\n0.002, 0.02 ,loading,-0.25\r\n3e-3,0,unloading,1\n");
  std::vector<Measurement> const all = read_measurements(file.path);
  REQUIRE(all.size() == 3);
  CHECK(all[0].phase == MeasuredPhase::indenting);
  CHECK(all[1].depth == 0.002);
  CHECK(all[1].force == -0.25);
  CHECK(all[2].inward_speed() == 0.0);
  CHECK(Measurement{.speed = 0.5, .phase = MeasuredPhase::unloading}.inward_speed() == -0.5);
  CHECK(depths_of(all).low == 0.001);
  CHECK(depths_of(all).high == 3e-3);
  CHECK(speeds_of(all).contains(0.01));
  CHECK_FALSE(speeds_of(all).contains(0.03));
}

TEST_CASE("a file that holds anything else is refused with its line") {
  CHECK_THAT(refusal(""), says("empty", "depth_m,speed_m_s,phase,force_N"));
  CHECK_THAT(refusal("depth,force\n1,2\n"), says("line 1", "depth_m,speed_m_s,phase,force_N"));
  CHECK_THAT(refusal(header), says("there is no measurement after the header"));
  CHECK_THAT(refusal(header + "1,2,loading\n"), says("line 2", "3 cells instead of 4"));
  CHECK_THAT(refusal(header + "0.1,2,cutting,3\n"), says("line 2", "\"cutting\"", "\"indenting\", \"loading\" or \"unloading\""));
  CHECK_THAT(refusal(header + "0.1,2,loading,1\n-1,2,loading,3\n"), says("line 3", "depth is -1 m", "zero or more"));
  CHECK_THAT(refusal(header + "0.1,-2,loading,3\n"), says("line 2", "speed is -2 m/s", "without sign"));
  // Depths of 0.2 and 6 mm, the second past what any tool reaches in metres.
  CHECK_THAT(refusal(header + "0.2,0.01,loading,0.1\n6,0.01,loading,3\n"), says("line 3", "depth is 6 m", "in mm it would be 0.006 m", "write depths in metres"));
  CHECK_THAT(refusal(header + "1,2,loading,nan\n"), says("line 2", "force_N holds nan", "finite"));
  CHECK(refusal(header + "1,2,loading,1.0.0\n").find("line 2: column force_N holds \"1.0.0\"") != std::string::npos);
  CHECK_THROWS_AS(read_measurements("no such file.csv"), FileError);
}

// Every truncation and many changed bytes: read or refused, nothing else.
TEST_CASE("a damaged file is refused or read, and nothing else") {
  std::string const good = header + "0.001,0.02,indenting,0.1\n0.002,0.02,loading,0.25\n";
  for (std::size_t length = 0; length < good.size(); ++length) refusal(good.substr(0, length));
  for (std::size_t at = 0; at < good.size(); ++at)
    for (char const byte : {'\0', '\n', ',', '-', '"', '\xff', '9'}) {
      std::string text = good;
      text[at] = byte;
      refusal(text);
    }
  SUCCEED();
}
