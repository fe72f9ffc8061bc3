// SPDX-License-Identifier: MIT
#pragma once

#include "case.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <vector>

namespace work_precision {

/// E/E₀ after each step of the undamped body, pressed and let go (or after its impulse). It ends where the run diverged.
template <class I>
std::vector<double> energies(Case const& at, I const& integrator, int steps) {
  Counts unused;
  auto body = start(at.free_swing, integrator, unused);
  if (at.free_swing.velocity.isZero())
    for (int i = 0; i < body.size(); ++i)
      if (!body.tissue().nailed(i)) {
        body.drag(i, at.deflected.col(i));
        body.release(i);
      }
  auto const energy = [&] { return body.kinetic_energy() + body.potential_energy(); };
  double const first = energy();
  std::vector<double> shares;
  for (int k = 0; k < steps && body.step(at.swing_step); ++k) shares.push_back(energy() / first);
  return shares;
}

/// An undamped body keeps its energy. How far an integrator's swings, and whether it drifts away.
template <class I>
void add_energy(Rows& rows, Case const& at, char const* name, I const& integrator, int steps) {
  if (!at.scene.swings) return;
  std::vector<double> const shares = energies(at, integrator, steps);
  Row row = at.row("energy", name);
  row.step = at.swing_step;
  row.step_over_limit = 0.5;
  if (static_cast<int>(shares.size()) == steps) {
    row.energy_swing = 0;
    for (double const share : shares) row.energy_swing = std::max(row.energy_swing, std::abs(share - 1));
    auto const tenth = static_cast<std::ptrdiff_t>(steps / 10);
    row.energy_drift = std::accumulate(shares.end() - tenth, shares.end(), 0.0) / std::accumulate(shares.begin(), shares.begin() + tenth, 0.0) - 1;
    row.status = std::to_string(steps) + " steps";
  } else {
    row.energy_swing = row.energy_drift = std::numeric_limits<double>::infinity();
    row.status = "diverged after " + std::to_string(shares.size()) + " steps";
  }
  rows.push_back(row);
  // Its path in some points, each the mean since the one before: the swings of single steps do not show.
  std::size_t const apart = std::max<std::size_t>(1, static_cast<std::size_t>(steps / 40));
  for (std::size_t k = 0; k + apart <= shares.size(); k += apart) {
    Row point = at.row("energy_path", name);
    point.time = static_cast<double>(k + apart) * at.swing_step;
    auto const from = shares.begin() + static_cast<std::ptrdiff_t>(k);
    point.energy = std::accumulate(from, from + static_cast<std::ptrdiff_t>(apart), 0.0) / static_cast<double>(apart);
    rows.push_back(point);
  }
}

}  // namespace work_precision
