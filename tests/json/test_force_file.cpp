// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/fitting/fit.hpp>
#include <palpate/fitting/fit_network.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/json/force_file.hpp>

#include "catch.hpp"
#include "replaced.hpp"
#include "scratch_folder.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

using namespace palpate;

namespace {

std::string const small_text = R"({
  "format": "palpate force",
  "version": 1,
  "note": "No force of this library is validated for a patient or for the outcome of a training.",
  "source": "gel, \"steel\" probe",
  "depth_range_m": [0.001, 0.01],
  "speed_range_m_s": [0.0, 0.05],
  "model": "exponential",
  "coefficients": {
    "a": 0.1,
    "b": 250.0
  }
}
)";

ForcePreset const small{"exponential", {{"a", 0.1}, {"b", 250.0}}, {0.001, 0.01}, {0.0, 0.05}, "gel, \"steel\" probe"};

std::string error_of(std::string const& text) {
  try {
    parse_force<double>(text, "force.json");
  } catch (FileError const& error) {
    return error.what();
  }
  return "";
}

ToolContact<double> touching(CuttingPhase phase, double depth) { return {.phase = phase, .depth = depth, .previous_depth = depth}; }

}  // namespace

// Yardstick: the file typed in by hand, and its formula a (e^(b d) − 1).
TEST_CASE("a force's file is the documented text, and makes the force again") {
  CHECK(force_text(small) == small_text);
  auto force = parse_force<double>(small_text);
  CHECK(force.source() == "gel, \"steel\" probe");
  CHECK(force.speeds().high == 0.05);
  CHECK(force(touching(CuttingPhase::indenting, 0.006)).z() == Approx(0.1 * std::expm1(1.5)).epsilon(1e-12));
  auto narrow = parse_force<float>(small_text);
  CHECK_THROWS_WITH(parse_force<float>(replaced(small_text, "0.1,", "1e308,")), Catch::Contains("which the scalar asked for can hold"));
  CHECK(double(narrow({.phase = CuttingPhase::indenting, .depth = 0.006F, .previous_depth = 0.006F}).z()) == Approx(0.1 * std::expm1(1.5)).epsilon(1e-5));

  ScratchFolder const folder;
  write_force(folder.path() / "force.json", small);
  CHECK(read_force<double>(folder.path() / "force.json").source() == small.source);
  CHECK_THROWS_AS(read_force<double>(folder.path() / "other.json"), FileError);
  CHECK_THROWS_AS(write_force(folder.path() / "missing" / "force.json", small), FileError);
}

TEST_CASE("a fitted network goes into a force file with its curve") {
  std::vector<Measurement> data;
  auto const curve = liver_hysteresis<double>();
  for (int k = 0; k <= 40; ++k)
    for (auto const phase : {MeasuredPhase::loading, MeasuredPhase::unloading})
      data.push_back({0.0005 * k, 1e-4, phase, curve(0.0005 * k, phase == MeasuredPhase::loading ? Phase::loading : Phase::unloading)});
  NetworkFitOptions const quick{.training = {.starts = 1}, .epochs = 30, .folds = 0};
  auto const both = fit_network<Network<double, 2, 5, 1>>(data, quick);
  auto force = parse_force<double>(force_text(both, "the thesis's curve"));
  CHECK(force(touching(CuttingPhase::moving, 0.015)).z() == both.law(0.015, Phase::loading));
  CHECK(force.speeds().high == 1e-4);
  std::string const text = force_text(both, "");
  CHECK_THAT(error_of(replaced(text, "\"depth_range_m\": [0.0", "\"depth_range_m\": [0.001")), says("/depth_range_m is [0.001,0.02]", "that of the network's curve, [0, 0.02]"));
  CHECK(parse_force<float>(text).speeds().high == 1e-4);
  auto const one = fit_network<Network<double, 1, 5, 1>>(data, quick);
  CHECK(parse_force<double>(force_text(one, ""))(touching(CuttingPhase::moving, 0.015)).z() == one.law(0.015));
}

TEST_CASE("a malformed force file is refused with what, where and what to do") {
  CHECK_THAT(error_of(replaced(small_text, "palpate force", "palpate network")), says("force.json", "/format is \"palpate network\"", "\"palpate force\""));
  CHECK_THAT(error_of(replaced(small_text, "\"version\": 1", "\"version\": 2")), says("force.json", "/version is 2", "version 1", "write the file again"));
  CHECK_THAT(error_of(replaced(small_text, "\"a\": 0.1", "\"a\": \"0.1\"")), says("force.json", "/coefficients/a", "\"0.1\"", "a number"));
  CHECK_THAT(error_of(replaced(small_text, "\"a\": 0.1", "\"a\": -0.1")), says("force.json", "a = -0.1", "not below 0"));
  CHECK_THAT(error_of(replaced(small_text, "\"a\": 0.1,", "")), says("force.json", "no coefficient \"a\"", "in N"));
  CHECK(error_of(replaced(small_text, "\"a\": 0.1,", "\"a\": 0.1, \"a\": 0.2,")).find("/coefficients/a is there twice") != std::string::npos);
  CHECK(error_of(replaced(small_text, "exponential", "spline")).find("there is no model \"spline\"") != std::string::npos);
  CHECK_THAT(error_of(replaced(small_text, "[0.001, 0.01]", "[0.01, 0.001]")), says("force.json", "/depth_range_m is [0.01,0.001]", "the lower one first"));
  CHECK_THAT(error_of(replaced(small_text, "[0.001, 0.01]", "[0.01]")), says("force.json", "/depth_range_m", "1 entries", "give 2"));
  CHECK(error_of(replaced(small_text, "\"source\"", "\"Source\"")).find("has a key \"Source\" that means nothing here") != std::string::npos);
  CHECK_THAT(error_of(replaced(small_text, "\"exponential\"", "\"network\"")), says("force.json", "no key \"network\"", "add it"));
  ForcePreset const broken{"linear", {{"stiffness", std::numeric_limits<double>::quiet_NaN()}}, {0.0, 0.01}, {0.0, 1.0}, ""};
  CHECK_THROWS_WITH(force_text(broken), says("a number to be written is nan"));
  CHECK(error_of("[]").find("force.json: the document is []") == 0);
  CHECK(error_of("{\"format\": " + std::string(200000, '[') + std::string(200000, ']') + "}").find("more than 16 levels") != std::string::npos);
}

// Every truncation and a few thousand changed bytes: a force, or FileError.
TEST_CASE("a damaged force file makes a force or is refused, and nothing else") {
  for (std::size_t length = 0; length + 1 < small_text.size(); ++length) CHECK_FALSE(error_of(small_text.substr(0, length)).empty());
  Random random(Seed{6});
  int refused = 0;
  for (int k = 0; k < 4000; ++k) {
    std::string text = small_text;
    for (std::uint64_t n = 1 + random.below(3); n > 0; --n) text[static_cast<std::size_t>(random.below(text.size()))] = static_cast<char>(random.below(256));
    if (!error_of(text).empty()) ++refused;
  }
  CHECK(refused > 2000);
}
