// SPDX-License-Identifier: MIT
#pragma once

#include "setup.hpp"

#include <filesystem>
#include <optional>

namespace viewer {

struct Options {
  Setup setup;
  std::filesystem::path script, replay;   // empty: none
  std::filesystem::path out = "viewer-out";
  double seconds = 0.0;                   // 0: until the window is closed
  bool realtime = true;
  int width = 1280, height = 800;         // pixels
};

/// The options, or the exit code when there is nothing more to do: 0 after --help and --version, 2 after a mistake, which has been
/// named in one line on standard error.
struct Parsed {
  Options options;
  std::optional<int> exit_code;
};
Parsed parse_options(int argc, char** argv);

}  // namespace viewer
