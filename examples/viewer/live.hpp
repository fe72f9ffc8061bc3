// SPDX-License-Identifier: MIT
#pragma once

#include "hook_hand.hpp"
#include "simulation.hpp"

#include <palpate/core/phase.hpp>
#include <palpate/simulator/tick.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace viewer {

enum class Doing { nothing, recording, replaying };

struct ChartSample {
  double time = 0.0, force = 0.0, energy = 0.0;   // s, N, J
};

/// What the window shows of the last servo tick.
struct Moment {
  palpate::Tick tick{};
  bool touches = false;
  Vector proxy = Vector::Zero();   // m, where the tool would be if it could not enter: on the surface
  double energy = 0.0;             // J, taken from the hand by this organ; negative: given
};

/// The one place that knows where these come from: the proxy is `way_out` from the tip, as the force saw it; the energy is the ticks' own.
inline Moment moment_of(palpate::Tick const& tick, Vector const& way_out, double energy) noexcept {
  bool const touches = tick.phase != palpate::CuttingPhase::no_contact;
  return {.tick = tick, .touches = touches, .proxy = touches ? Vector(tick.tip + way_out) : tick.tip, .energy = energy};
}

/// What it shows of the hook.
struct HookMoment {
  palpate::Tick tick{.tip = HookHand::parked_at()};
  bool is_hooked = false;
  unsigned lifted = 0;   // the number of the target that it was taken away from

  bool is_parked() const noexcept { return HookHand::is_parked(tick.tip); }
};

/// All that the window shows besides the body.
struct Live {
  double time = 0.0;   // s, since the program began
  Moment now{};
  HookMoment hook{};
  ServoTimes servo{};
  Setup setup{};
  std::size_t began_with = 0;   // the body's revision when the run began, and whether it was uncut then
  bool began_uncut = true;
  Wound wound{};
  Doing doing = Doing::nothing;
  double doing_seconds = 0.0;
  bool can_replay = false;
  std::string note;                  // what just happened, in a line
  std::vector<ChartSample> chart;    // of the last seconds, the oldest first
  // Of the body as it is drawn:
  int triangles = 0;
  bool is_uncut = true;
};

constexpr double chart_seconds = 10.0;

}  // namespace viewer
