// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpation {

/// What the command line asks for. SI units.
struct Options {
  std::filesystem::path mesh;   // empty: the library's own liver
  std::string unit = "m";
  double edge = 0.008;          // m, of the lattice
  double young = 5000.0;        // Pa, of the organ
  double poisson = 0.45;        // of organ and nodule
  double density = 1060.0;      // kg/m³
  std::vector<double> nodule;   // x, y, z, r [m], Young's modulus [Pa]; empty: below the middle of the line
  int places = 21;
  double depth = 0.005;         // m, of a press, in the middle of the pad
  double pad = 0.010;           // m, radius of the finger's pad
  std::filesystem::path out = "palpation-out";
  bool pictures = true;
};

/// The options, or the exit code when there is nothing more to do; see main.
struct Parsed {
  Options options;
  std::optional<int> exit_code;
};
Parsed parse_options(int argc, char** argv);

}  // namespace palpation
