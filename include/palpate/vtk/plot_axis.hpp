// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace palpate {

/// One axis of a plot.
struct PlotAxis {
  std::string title{};        ///< with its unit
  bool logarithmic = false;   ///< values that are not above 0 are left out
  double from = 0, to = 0;    ///< equal: from the points; a point outside is left out
};

}  // namespace palpate
