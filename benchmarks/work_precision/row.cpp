// SPDX-License-Identifier: MIT
#include "row.hpp"

#include <palpate/core/error.hpp>

#include <cmath>
#include <fstream>

namespace work_precision {

namespace {

struct Column {
  char const* name;
  double Row::*value;
};

constexpr Column columns[] = {{"step_s", &Row::step},
                              {"step_over_leapfrog_limit", &Row::step_over_limit},
                              {"tolerance", &Row::tolerance},
                              {"error", &Row::error},
                              {"static_error", &Row::static_error},
                              {"cost_s_per_s", &Row::cost},
                              {"cost_s_per_step", &Row::step_cost},
                              {"evaluations_per_s", &Row::evaluations},
                              {"products_per_s", &Row::products},
                              {"stable_step_s", &Row::stable_step},
                              {"measured_limit_s", &Row::measured_limit},
                              {"energy_swing", &Row::energy_swing},
                              {"energy_drift", &Row::energy_drift},
                              {"time_s", &Row::time},
                              {"energy", &Row::energy}};

}  // namespace

void write_csv(std::filesystem::path const& file, Rows const& rows) {
  std::ofstream out(file);
  out.precision(6);
  out << "kind,scene,particles,springs,integrator";
  for (Column const& column : columns) out << ',' << column.name;
  out << ",status\n";
  for (Row const& row : rows) {
    out << row.kind << ',' << row.scene << ',' << row.particles << ',' << row.springs << ',' << row.integrator;
    for (Column const& column : columns) {
      out << ',';
      if (!std::isnan(row.*column.value)) out << row.*column.value;
    }
    out << ",\"" << row.status << "\"\n";
  }
  if (!out.flush()) throw palpate::FileError("can not write " + file.string());
}

Rows thesis_rows() {
  struct {
    int particles, springs;
    double euler, runge_kutta, leapfrog;   // s
  } constexpr table[] = {{225, 450, 0.016, 0.024, 0.016}, {400, 800, 0.016, 0.042, 0.016}, {625, 1250, 0.022, 0.064, 0.022}};
  Rows rows;
  for (auto const& line : table)
    for (auto const& [name, cost] : {std::pair("ExplicitEuler", line.euler), std::pair("RungeKutta4", line.runge_kutta), std::pair("LeapfrogVerlet", line.leapfrog)}) {
      Row row{.kind = "thesis", .scene = "grid_" + std::to_string(line.particles), .particles = line.particles, .springs = line.springs, .integrator = name};
      row.step_cost = cost;
      row.status = "PC of 2006, drawing included";
      rows.push_back(row);
    }
  return rows;
}

}  // namespace work_precision
