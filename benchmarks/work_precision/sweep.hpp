// SPDX-License-Identifier: MIT
#pragma once

#include "case.hpp"
#include "energy.hpp"
#include "limit.hpp"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace work_precision {

inline double median(std::vector<double> values) {
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Runs a scene with one step and adds its error and cost. False when finer steps are not worth their time.
template <class I>
bool add_precision(Rows& rows, Case const& at, char const* name, I const& integrator, int steps_an_interval, double tolerance, Effort const& effort) {
  Scene const& scene = at.scene;
  Path const path = run(scene, integrator, steps_an_interval, 10 * effort.longest_run);
  Row row = at.row("precision", name);
  row.step = scene.interval() / steps_an_interval;
  row.step_over_limit = row.step / at.leapfrog_limit;
  row.tolerance = tolerance;
  if (!path.complete(scene)) {
    row.status = path.diverged ? "diverged" : "takes too long";
    rows.push_back(row);
    return path.diverged && path.seconds < effort.longest_run;
  }
  std::vector<double> seconds{path.seconds};
  // The clock ticks in microseconds: a short run is timed many times over.
  int const at_once = path.seconds < 1e-3 ? 50 : 1;
  for (int k = 1; k < effort.repeats; ++k) {
    double sum = 0;
    for (int j = 0; j < at_once; ++j) sum += run(scene, integrator, steps_an_interval).seconds;
    seconds.push_back(sum / at_once);
  }
  row.status = "ok";
  row.cost = median(seconds) / scene.duration;
  row.step_cost = median(seconds) / (scene.samples * steps_an_interval);
  row.evaluations = static_cast<double>(path.counts.evaluations) / scene.duration;
  row.products = static_cast<double>(path.counts.products) / scene.duration;
  row.error = at.reference.error_of(path.displacement);
  if (at.reference.balance) row.static_error = at.reference.static_error_of(path.displacement);
  rows.push_back(row);
  return path.seconds < effort.longest_run && row.error > std::max(1e-9, 3 * at.reference.own_error);
}

/// Error over cost of an integrator with a fixed step, run with finer and finer ones: from its limit on, or, where it has none, from a whole
/// interval on.
template <Integrator I>
void add_precisions(Rows& rows, Case const& at, char const* name, I const& integrator, double limit, Effort const& effort) {
  if (std::isfinite(limit) && limit > 0) {
    int const least = static_cast<int>(std::ceil(at.scene.interval() / limit));
    for (int factor = 1; factor <= 65536 && add_precision(rows, at, name, integrator, factor * least, unknown, effort); factor *= 2) {}
    return;
  }
  for (int decade = 1; decade <= 100000; decade *= 10)
    for (int const factor : {1, 2, 5})
      if (!add_precision(rows, at, name, integrator, factor * decade, unknown, effort)) return;
}

/// Everything about one integrator in one scene.
template <Integrator I>
void compare(Rows& rows, Case const& at, char const* name, I const& integrator, Effort const& effort) {
  Counts unused;
  double const stable = start(at.scene, integrator, unused).stable_step();
  Row row = at.row("stability", name);
  row.stable_step = stable;
  row.step_over_limit = stable / at.leapfrog_limit;
  // Where the limit is tiny the fast modes hardly move in the steps that are cheap: it is not measured.
  if (std::isfinite(stable) && stable > 0.02 * at.leapfrog_limit) row.measured_limit = measured_limit(at.scene, integrator, stable, effort.limit_steps);
  row.status = stable > 0 ? "ok" : "no step is stable";
  rows.push_back(row);
  // A limit that is stated for the least damping that is certain may be far below the real one.
  bool const cautious = row.measured_limit > 1.1 * stable;
  add_precisions(rows, at, name, integrator, cautious ? 0.95 * row.measured_limit : stable, effort);
  add_energy(rows, at, name, integrator, effort.energy_steps);
}

/// The same for a method that chooses its own steps: `with(tolerance)` makes one, and it is run with smaller and smaller tolerances, a step
/// being a whole interval, or, under a load that changes within it, a hundredth.
template <class With>
  requires Integrator<std::invoke_result_t<With, double>>
void compare(Rows& rows, Case const& at, char const* name, With const& with, Effort const& effort) {
  int const steps = at.scene.smooth_load ? 100 : 1;
  for (double tolerance = 1e-2; tolerance > 1e-11; tolerance /= 10)
    if (!add_precision(rows, at, name, with(tolerance), steps, tolerance, effort)) break;
  add_energy(rows, at, name, with(1e-6), effort.energy_steps);
}

}  // namespace work_precision
