// SPDX-License-Identifier: MIT
#pragma once

#include "reference.hpp"
#include "row.hpp"

namespace work_precision {

struct Effort {
  double longest_run = 0.3;   // s: a sweep ends with the run that takes longer
  int repeats = 3;            // of a run; costs are medians
  int energy_steps = 5000;
  int limit_steps = 4000;
};

/// A scene with what all integrators share of it.
struct Case {
  Scene scene;
  Reference reference;
  double leapfrog_limit = 0;   // s, its stable_step()
  Scene free_swing;            // undamped, no load
  Matrix3X<double> deflected;  // where the free swing starts: pressed to rest
  double swing_step = 0;       // s, half of leapfrog's stable step there

  Row row(char const* kind, char const* integrator) const {
    return {.kind = kind, .scene = scene.name, .particles = scene.tissue.size(), .springs = scene.tissue.links().size(), .integrator = integrator};
  }
};

Case prepare(Scene scene);

}  // namespace work_precision
