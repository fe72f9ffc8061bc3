// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace work_precision {

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// One line of the CSV. What does not apply is not a number, and left blank in the file.
struct Row {
  std::string kind;                 // precision, stability, energy, energy_path, reference, thesis
  std::string scene;
  int particles = 0, springs = 0;
  std::string integrator;
  double step = unknown;            // s
  double step_over_limit = unknown;  // step over leapfrog's stable_step() in this scene
  double tolerance = unknown;       // relative, of a method that chooses its own steps
  double error = unknown;           // largest distance of a particle from the reference, over the largest displacement
  double static_error = unknown;    // the same at the end, from the balance
  double cost = unknown;            // s of computing for a second of the scene: the median of repeats
  double step_cost = unknown;       // s of computing for a step
  double evaluations = unknown;     // of all forces, for a second of the scene
  double products = unknown;        // with the tangent, likewise
  double stable_step = unknown;     // s, what stable_step() says
  double measured_limit = unknown;  // s, the longest step that stayed bounded
  double energy_swing = unknown;    // largest |E − E₀|/E₀ of an undamped run
  double time = unknown;            // s, on the energy's path
  double energy = unknown;          // E/E₀ then, a mean since the point before
  double energy_drift = unknown;    // mean energy in the last tenth of that run over that in the first, less 1
  std::string status{};             // ok, diverged; where from
};

using Rows = std::vector<Row>;

/// One file with all rows, a header line first.
void write_csv(std::filesystem::path const& file, Rows const& rows);

/// The rows of the thesis: average time of a step on a PC of 2006, drawing included.
Rows thesis_rows();

}  // namespace work_precision
