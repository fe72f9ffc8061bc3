// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>

namespace retraction {

struct Options {
  bool realtime = false;
  double body_rate = 200.0;   // Hz, in real time
  std::filesystem::path out = "retraction-out";
  bool pictures = true;
};

/// The options, or the exit code when there is nothing more to do; see main.
struct Parsed {
  Options options;
  std::optional<int> exit_code;
};
Parsed parse_options(int argc, char** argv);

}  // namespace retraction
