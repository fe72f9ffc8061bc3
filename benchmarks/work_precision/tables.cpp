// SPDX-License-Identifier: MIT
#include "tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace work_precision {

namespace {

std::string number(double value, char const* format) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return "any";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

template <class Value>
std::vector<std::string> distinct(Rows const& rows, char const* kind, Value value) {
  std::vector<std::string> found;
  for (Row const& row : rows)
    if (row.kind == kind && std::find(found.begin(), found.end(), value(row)) == found.end()) found.push_back(value(row));
  return found;
}

/// The cheapest run of an integrator with an error not above `wanted`; none: a null pointer.
Row const* cheapest(Rows const& rows, std::string const& scene, std::string const& integrator, double wanted, double Row::*error = &Row::error) {
  Row const* best = nullptr;
  for (Row const& row : rows)
    if (row.kind == "precision" && row.scene == scene && row.integrator == integrator && row.*error <= wanted && (best == nullptr || row.cost < best->cost)) best = &row;
  return best;
}

Row const* find(Rows const& rows, char const* kind, std::string const& scene, std::string const& integrator) {
  for (Row const& row : rows)
    if (row.kind == kind && row.scene == scene && row.integrator == integrator) return &row;
  return nullptr;
}

void print_costs(Rows const& rows, std::vector<std::string> const& scenes, std::vector<std::string> const& integrators, double wanted) {
  std::printf("\nms of computing for a second of the scene, cheapest run with an error of %g or less\n| integrator |", wanted);
  for (auto const& scene : scenes) std::printf(" %s |", scene.c_str());
  std::printf("\n|---|");
  for (std::size_t k = 0; k < scenes.size(); ++k) std::printf("---|");
  for (auto const& integrator : integrators) {
    std::printf("\n| `%s` |", integrator.c_str());
    for (auto const& scene : scenes) {
      Row const* const best = cheapest(rows, scene, integrator, wanted);
      std::printf(" %s |", best == nullptr ? "-" : number(1e3 * best->cost, "%.3g").c_str());
    }
  }
  std::printf("\n");
}

void print_limits(Rows const& rows, std::vector<std::string> const& scenes, std::vector<std::string> const& integrators) {
  std::printf("\nlongest stable step, stable_step() / measured [ms]\n| integrator |");
  for (auto const& scene : scenes) std::printf(" %s |", scene.c_str());
  std::printf("\n|---|");
  for (std::size_t k = 0; k < scenes.size(); ++k) std::printf("---|");
  for (auto const& integrator : integrators) {
    std::printf("\n| `%s` |", integrator.c_str());
    for (auto const& scene : scenes) {
      Row const* const row = find(rows, "stability", scene, integrator);
      if (row == nullptr || std::isinf(row->stable_step))
        std::printf(" any |");
      else if (row->stable_step == 0)
        std::printf(" none |");
      else
        std::printf(" %s / %s |", number(1e3 * row->stable_step, "%.3g").c_str(), number(1e3 * row->measured_limit, "%.3g").c_str());
    }
  }
  std::printf("\n");
}

void print_energies(Rows const& rows, std::vector<std::string> const& scenes, std::vector<std::string> const& integrators) {
  std::printf("\nenergy of the undamped body at half of leapfrog's limit: largest swing / drift, shares of the first\n| integrator |");
  for (auto const& scene : scenes) std::printf(" %s |", scene.c_str());
  std::printf("\n|---|");
  for (std::size_t k = 0; k < scenes.size(); ++k) std::printf("---|");
  for (auto const& integrator : integrators) {
    std::printf("\n| `%s` |", integrator.c_str());
    for (auto const& scene : scenes) {
      Row const* const row = find(rows, "energy", scene, integrator);
      if (row == nullptr)
        std::printf(" - |");
      else if (std::isinf(row->energy_swing) || row->energy_swing > 1e6)
        std::printf(" blows up |");
      else
        std::printf(" %.1e / %+.1e |", row->energy_swing, row->energy_drift);
    }
  }
  std::printf("\n");
}

/// The thesis's rows beside ours: a step's time, and the accuracy that it buys at the step used.
void print_thesis(Rows const& rows) {
  std::printf("\na step of the thesis's grids\n| particles | integrator | thesis: PC of 2006, drawing included [ms] | here, no drawing [ms] | longest step here [ms] | its error |\n|---|---|---|---|---|---|\n");
  for (Row const& row : rows) {
    if (row.kind != "thesis") continue;
    Row const* coarsest = nullptr;
    for (Row const& ours : rows)
      if (ours.kind == "precision" && ours.scene == row.scene && ours.integrator == row.integrator && ours.status == "ok" && coarsest == nullptr) coarsest = &ours;
    std::printf("| %d | `%s` | %.0f |", row.particles, row.integrator.c_str(), 1e3 * row.step_cost);
    if (coarsest == nullptr)
      std::printf(" - | - | - |\n");
    else
      std::printf(" %.4f | %.3g | %.1e |\n", 1e3 * coarsest->step_cost, 1e3 * coarsest->step, coarsest->error);
  }
}

/// Implicit steps on the scene with a slow load, in units of leapfrog's at its limit.
void print_slow_load(Rows const& rows) {
  for (auto const& scene : distinct(rows, "precision", [](Row const& row) { return row.scene; })) {
    Row const* leapfrog = nullptr;
    for (Row const& row : rows)
      if (row.kind == "precision" && row.scene == scene && row.integrator == "LeapfrogVerlet" && !std::isnan(row.static_error) && leapfrog == nullptr) leapfrog = &row;
    if (leapfrog == nullptr) continue;
    std::printf("\nimplicit steps beside leapfrog at its limit, %s\n| integrator | step over leapfrog's limit | cost over leapfrog's | products a step | error | static error |\n|---|---|---|---|---|---|\n", scene.c_str());
    for (Row const& row : rows) {
      bool const implicit = row.products > 0;
      if (row.kind != "precision" || row.scene != scene || row.status != "ok" || !(implicit || row.integrator == "LeapfrogVerlet")) continue;
      std::printf("| `%s` | %.3g | %.3g | %.3g | %.1e | %.1e |\n", row.integrator.c_str(), row.step_over_limit, row.cost / leapfrog->cost, row.products * row.step, row.error,
                  row.static_error);
    }
  }
}

}  // namespace

void print_reference(Case const& at) {
  std::printf("%-20s %5d particles, %5d springs, leapfrog's limit %.3g ms, reference: %s, its own error %.1e\n", at.scene.name.c_str(), at.scene.tissue.size(),
              at.scene.tissue.links().size(), 1e3 * at.leapfrog_limit, at.reference.source.c_str(), at.reference.own_error);
}

void print_tables(Rows const& rows) {
  auto const scenes = distinct(rows, "precision", [](Row const& row) { return row.scene; });
  auto const integrators = distinct(rows, "precision", [](Row const& row) { return row.integrator; });
  for (double const wanted : {1e-2, 1e-4}) print_costs(rows, scenes, integrators, wanted);
  print_limits(rows, scenes, integrators);
  print_energies(rows, scenes, integrators);
  print_thesis(rows);
  print_slow_load(rows);
}

}  // namespace work_precision
