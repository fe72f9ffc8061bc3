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

std::vector<std::string> distinct(Rows const& rows, char const* kind, std::string Row::*value) {
  std::vector<std::string> found;
  for (Row const& row : rows)
    if (row.kind == kind && std::find(found.begin(), found.end(), row.*value) == found.end()) found.push_back(row.*value);
  return found;
}

/// Where a sweep crosses a value, between two of its runs, on logarithmic scales; not a number where it does not.
struct Crossing {
  double cost = unknown, step_over_limit = unknown, error = unknown;
};

/// The cheapest place at which `of` falls below `wanted` on the way from coarse steps to fine ones (or `rising`: rises above it).
Crossing crossing(Rows const& rows, std::string const& scene, std::string const& integrator, double Row::*of, double wanted, bool rising = false) {
  auto const beyond = [&](Row const& row) { return rising ? row.*of >= wanted : row.*of <= wanted; };
  Crossing best;
  Row const* before = nullptr;
  for (Row const& row : rows) {
    if (row.kind != "precision" || row.scene != scene || row.integrator != integrator || row.status != "ok") continue;
    if (beyond(row) && (before == nullptr || !beyond(*before))) {
      double const share = before == nullptr ? 1 : std::log(wanted / before->*of) / std::log(row.*of / before->*of);
      auto const between = [&](double Row::*value) { return before == nullptr ? row.*value : before->*value * std::pow(row.*value / before->*value, share); };
      Crossing const found{between(&Row::cost), between(&Row::step_over_limit), between(&Row::error)};
      if (!(best.cost <= found.cost)) best = found;
    }
    before = &row;
  }
  return best;
}

Row const* find(Rows const& rows, char const* kind, std::string const& scene, std::string const& integrator) {
  for (Row const& row : rows)
    if (row.kind == kind && row.scene == scene && row.integrator == integrator) return &row;
  return nullptr;
}

/// The title and head of a table with a row for each integrator and a column for each scene; the last line is left open.
void print_head(std::string const& title, std::vector<std::string> const& scenes) {
  std::printf("\n%s\n| integrator |", title.c_str());
  for (auto const& scene : scenes) std::printf(" %s |", scene.c_str());
  std::printf("\n|---|");
  for (std::size_t k = 0; k < scenes.size(); ++k) std::printf("---|");
}

void print_costs(Rows const& rows, std::vector<std::string> const& scenes, std::vector<std::string> const& integrators, double wanted) {
  print_head("ms of computing for a second of the scene at an error of " + number(wanted, "%g") + ", between runs on logarithmic scales", scenes);
  for (auto const& integrator : integrators) {
    std::printf("\n| `%s` |", integrator.c_str());
    for (auto const& scene : scenes) std::printf(" %s |", number(1e3 * crossing(rows, scene, integrator, &Row::error, wanted).cost, "%.2g").c_str());
  }
  std::printf("\n");
}

void print_limits(Rows const& rows, std::vector<std::string> const& scenes, std::vector<std::string> const& integrators) {
  print_head("longest stable step, stable_step() / measured [ms]", scenes);
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
  print_head("energy of the undamped body at half of leapfrog's limit: largest swing / drift from the first tenth to the last", scenes);
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

bool is_implicit(Rows const& rows, std::string const& scene, std::string const& integrator) {
  return std::any_of(rows.begin(), rows.end(), [&](Row const& row) { return row.scene == scene && row.integrator == integrator && row.products > 0; });
}

/// Implicit steps on the scene with a slow load, in units of leapfrog's at its limit.
void print_slow_load(Rows const& rows) {
  for (auto const& scene : distinct(rows, "precision", &Row::scene)) {
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
    std::printf("\nimplicit steps beside leapfrog at its limit, where they cost as much and where their error is 1 %%, %s\n", scene.c_str());
    std::printf("| integrator | as cheap at a step over the limit of | its error there | 1 %% at a step over the limit of | cost there over leapfrog's |\n|---|---|---|---|---|\n");
    for (auto const& integrator : distinct(rows, "precision", &Row::integrator)) {
      if (!is_implicit(rows, scene, integrator)) continue;
      Crossing const even = crossing(rows, scene, integrator, &Row::cost, leapfrog->cost, true);
      Crossing const percent = crossing(rows, scene, integrator, &Row::error, 0.01);
      std::printf("| `%s` | %s | %s | %s | %s |\n", integrator.c_str(), number(even.step_over_limit, "%.2g").c_str(), number(even.error, "%.1e").c_str(),
                  number(percent.step_over_limit, "%.2g").c_str(), number(percent.cost / leapfrog->cost, "%.2g").c_str());
    }
  }
}

}  // namespace

void print_reference(Case const& at) {
  std::printf("%-20s %5d particles, %5d springs, leapfrog's limit %.3g ms, reference: %s, its own error %.1e\n", at.scene.name.c_str(), at.scene.tissue.size(),
              at.scene.tissue.links().size(), 1e3 * at.leapfrog_limit, at.reference.source.c_str(), at.reference.own_error);
}

void print_tables(Rows const& rows) {
  auto const scenes = distinct(rows, "precision", &Row::scene);
  auto const integrators = distinct(rows, "precision", &Row::integrator);
  for (double const wanted : {1e-2, 1e-4}) print_costs(rows, scenes, integrators, wanted);
  print_limits(rows, scenes, integrators);
  print_energies(rows, distinct(rows, "energy", &Row::scene), integrators);
  print_thesis(rows);
  print_slow_load(rows);
}

}  // namespace work_precision
