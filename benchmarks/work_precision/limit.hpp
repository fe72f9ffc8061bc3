// SPDX-License-Identifier: MIT
#pragma once

#include "run.hpp"

#include <palpate/core/random.hpp>

namespace work_precision {

/// Whether a body whose particles were all kicked (1e-6 of an edge a step) stays bounded: its kinetic energy in the last quarter of the steps is not above that
/// in the second, and never far above what the kick gave.
template <class I>
bool stays_bounded(Scene const& scene, I const& integrator, double h, int steps) {
  Counts unused;
  Scene still = scene;
  still.velocity.setZero();
  auto body = start(still, integrator, unused);
  Random random(Seed{7});
  double const kick = 1e-6 * body.mean_edge() / (h * h);   // m/s²
  for (int i = 0; i < body.size(); ++i)
    body.apply_force(i, body.tissue().mass(i) * kick * Vector3<double>(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)));
  double first = 0, early = 0, late = 0;
  for (int k = 0; k < steps; ++k) {
    if (!body.step(h)) return false;
    double const energy = body.kinetic_energy();
    if (k == 0) first = energy;
    if (energy > 1e3 * first) return false;
    if (k >= steps / 4 && k < steps / 2) early += energy;
    if (k >= 3 * steps / 4) late += energy;
  }
  return late <= 1.1 * early;
}

/// The longest step that stays bounded [s], by halving from both sides to 1 %.
template <class I>
double measured_limit(Scene const& scene, I const& integrator, double stated, int steps) {
  double low = stated, high = 1.25 * stated;
  while (low > 1e-3 * stated && !stays_bounded(scene, integrator, low, steps)) high = low, low *= 0.8;
  while (high < 1e3 * stated && stays_bounded(scene, integrator, high, steps)) low = high, high *= 1.25;
  while (high > 1.01 * low) {
    double const middle = (low + high) / 2;
    (stays_bounded(scene, integrator, middle, steps) ? low : high) = middle;
  }
  return low;
}

}  // namespace work_precision
