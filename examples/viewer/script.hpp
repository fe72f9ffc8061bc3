// SPDX-License-Identifier: MIT
#pragma once

#include "engine.hpp"
#include "window.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace viewer {

/// A mouse and a keyboard as a text file, one step a line, one after the other; # begins a remark. Pixels count from the upper left of the window.
///   move X Y [SECONDS]     the pointer goes there, evenly
///   left down|up           the button; also: right
///   wheel NOTCHES          away from the user is positive
///   key NAME               as X calls it: r, space, plus, 2, Down …
///   click NAME             moves to a button of the panel and presses it: record, replay, undo, reset
///   wait SECONDS
///   shot NAME              writes NAME.png, and what the simulator says at that moment to report.txt
struct Step {
  std::string verb, name;
  double x = 0.0, y = 0.0, seconds = 0.0;
};

/// Throws palpate::FileError with the line for what is not a script.
std::vector<Step> read_script(std::filesystem::path const& file);

/// Plays it through the interactor's own events. In lock-step the same script gives the same motion and forces.
void play(std::vector<Step> const& script, Engine& engine, Window& window, std::filesystem::path const& out, bool realtime);

}  // namespace viewer
