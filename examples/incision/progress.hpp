// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdio>
#include <string>

#include <unistd.h>

namespace incision {

/// Shows how far the run is: a bar that is redrawn where a person looks on, else a line every quarter.
class Progress {
 public:
  explicit Progress(std::string what) : what_(std::move(what)), terminal_(isatty(fileno(stderr)) != 0) {}
  ~Progress() { finish(); }
  Progress(Progress const&) = delete;
  Progress& operator=(Progress const&) = delete;

  void show(double share, std::string const& state) {
    share = std::clamp(share, 0.0, 1.0);
    int const percent = static_cast<int>(100.0 * share);
    if (terminal_) {
      if (percent == percent_ && state == state_) return;
      constexpr int width = 32;
      int const full = static_cast<int>(width * share);
      std::string const bar = std::string(static_cast<std::size_t>(full), '#') + std::string(static_cast<std::size_t>(width - full), '.');
      std::fprintf(stderr, "\r%s [%s] %3d %%  %-12s", what_.c_str(), bar.c_str(), percent, state.c_str());
      std::fflush(stderr);
      open_ = true;
    } else if (percent / 25 > percent_ / 25) {
      std::fprintf(stderr, "%s %3d %%\n", what_.c_str(), percent / 25 * 25);
    }
    percent_ = percent;
    state_ = state;
  }

  void finish() {
    if (open_) std::fputc('\n', stderr);
    open_ = false;
  }

 private:
  std::string what_, state_;
  bool terminal_, open_ = false;
  int percent_ = 0;
};

}  // namespace incision
