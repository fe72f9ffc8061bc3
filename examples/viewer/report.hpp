// SPDX-License-Identifier: MIT
#pragma once

#include "window.hpp"

#include <filesystem>
#include <string>

namespace viewer {

/// What the simulator and the camera say at the moment of a picture, as lines of a name and its values, for whoever compares them with the picture.
/// Units      s, m, N, J; the last point of a chart as a time and a value, and the pixels of two points of its axes. Pixels count from the lower
///            left.
class Report {
 public:
  void add(std::string const& name, Window const& window);
  void write(std::filesystem::path const& file) const;

 private:
  std::string text_;
};

}  // namespace viewer
