// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace palpate {

/// What happened on the body's side.
struct BodyCounts {
  std::uint64_t ticks = 0;
  std::uint64_t steps = 0;           ///< body steps; more than ticks where a tick was split
  std::uint64_t capped = 0;          ///< ticks that wanted more steps than allowed; the rest of the tick is left out
  std::uint64_t stable_steps = 0;    ///< how often the stable step was found anew
  std::uint64_t stability_checks = 0;           ///< how often a body in motion was looked at, whether its stable step had fallen
  std::uint64_t guarded = 0;         ///< ticks in which tissue moved so fast that the guaranteed step was kept
  std::uint64_t diverged = 0;        ///< steps refused because they diverged; the rest of the tick is left out
  std::uint64_t inverted = 0;        ///< steps after which a tetrahedron was found flat or turned over, see StepReport
  int inverted_element = -1;         ///< the one of them that was turned over most, by the number it had then,
  double lowest_determinant = 1.0;   ///< and its det F
  int max_steps_a_tick = 0;
  int max_steps_wanted = 0;          ///< of a capped tick; 1e9 where no step is stable
  int steps_allowed = 0;             ///< in a tick: SimulatorOptions::max_body_steps
  double stable_step = 0.0;          ///< s, the last one found; infinite where any step is stable
  double seconds = 0.0;              ///< of simulated time, that the ticks were to cover
  double lag = 0.0;                  ///< s of that, which were left out: the body is so far behind the hand
};

}  // namespace palpate
