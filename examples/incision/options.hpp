// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace incision {

enum class Coupling { loose, tight };
enum class TissueName { springs, solid };
enum class IntegratorName { leapfrog, velocity_verlet, symplectic_euler, explicit_euler, runge_kutta_4, backward_euler };

constexpr double default_prestrain = 0.25, default_solid_prestrain = 0.08, default_young = 5000.0, default_poisson = 0.45;
constexpr double default_toughness = 60.0, default_lip_friction = 10.0;   // J/m², N/m
constexpr double longest_run = 3600.0;   // s of simulated time

/// What the command line asks for. SI units; an empty optional is worked out from the organ.
struct Options {
  // What is cut, and by which movement.
  std::filesystem::path mesh;   // empty: the library's own liver
  std::string unit = "m";
  std::string up = "auto";
  int resolution = 2000;
  std::filesystem::path tool;   // empty: a stroke across the upper side
  std::string device = "script";   // or an address: hd:, hd:<name>, sim:touch?hand=light
  std::optional<double> seconds;

  // Tissue.
  TissueName tissue = TissueName::springs;
  std::optional<double> young;             // Pa, of a solid
  std::optional<double> poisson;           // of a solid
  std::optional<double> edge;              // m, of the lattice that a solid is filled with
  std::optional<double> mass;              // kg
  std::optional<double> link_stiffness;    // N/m
  std::optional<double> link_damping;      // N s/m
  std::optional<double> home_stiffness;    // N/m
  std::optional<double> home_damping;      // N s/m
  std::optional<double> prestrain;
  std::optional<double> toughness;         // J/m², of a solid
  std::optional<double> lip_friction;      // N/m, of a solid
  int zone = 0;                            // rings; 0: the whole body
  std::optional<IntegratorName> integrator;

  // Cut and force.
  std::optional<double> puncture_depth;    // m
  double curve_factor = 4.0;
  double organ_coefficient = 800.0;        // N s/m²
  double snr_db = 30.0;
  std::uint64_t seed = 7;
  std::optional<Coupling> coupling;

  // What comes out.
  std::filesystem::path out = "incision-out";
  bool pictures = true;
  bool realtime = false;
};

/// The options, or the exit code when there is nothing more to do: 0 after --help and --version, 2 after a mistake, which has been
/// named in one line on standard error.
struct Parsed {
  Options options;
  std::optional<int> exit_code;
};
Parsed parse_options(int argc, char** argv);

}  // namespace incision
