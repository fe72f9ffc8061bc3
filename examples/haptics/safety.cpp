// SPDX-License-Identifier: MIT
// What the safety chain lets through of a force that is wanted.
#include "pictures.hpp"

#include <palpate/haptics/safety_chain.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptics {

using namespace palpate;

Picture safety() {
  Picture picture("haptics_safety", "A force through the safety chain", "time [s]", "force [N]");
  picture.x().to = 4.0;
  PlotSeries &wanted = picture.dashes(black, "wanted"), &written = picture.line(blue, "written");
  SafetyChain<double> chain;
  chain.begin({.damping = 0.0}, {.max_force = 3.3, .rate = 1000.0, .continuous_force = 0.88}, 30.0);
  auto const& limits = chain.limits();
  picture.quote("limits: %.2f N, %.0f N/s, arms below %.1f N, gap %.0f ms, stale after %.0f ms", limits.max_force, limits.slew, limits.arm_force,
                1000 * limits.gap, 1000 * limits.stale_after);
  WorkspaceMapping<double> const mapping;
  constexpr double skin = 200.0;   // N/m
  double age = 0.0, time = 0.0;
  for (int k = 0; k < 4000; ++k) {
    bool const gap = k == 1650, silent = k >= 2500 && k < 2850;   // 20 ms nothing; no local model for 350 ms
    time += gap ? 0.020 : 0.001;
    age = silent ? age + 0.001 : 0.0;
    double const deep = 0.003 * (1.0 - 1.15 * std::cos(2 * std::numbers::pi * (time / 1.0 - 0.4)));   // a press a second, begun inside
    double const force = skin * std::max(deep, 0.0);
    Vector3<double> const tip(0.0, 0.0, -deep);
    chain.read({.position = tip, .seconds = gap ? 0.020 : 0.001});
    Vector3<double> const out = chain({.force = {0.0, 0.0, force}, .elastic = force * force / skin / 2, .age = age}, mapping);
    add(wanted, time, force);
    add(written, time, out.z());
    while (auto const event = chain.pop_event()) picture.quote("%.3f s: %s", time, to_string(*event));
  }
  return picture;
}

}  // namespace haptics
