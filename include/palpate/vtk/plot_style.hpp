// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace palpate {

/// One axis of a plot.
struct PlotAxis {
  std::string title{};        ///< with its unit
  bool logarithmic = false;   ///< values that are not above 0 are left out
  double from = 0, to = 0;    ///< equal: from the points; a point outside is left out
};

/// So many series have colours of their own.
inline constexpr std::size_t plot_colours = 12;

/// Values over values. A series without points is left out, and the others keep the colours and marks they have with it.
struct PlotSeries {
  std::string label{};
  std::vector<double> x{}, y{};
  bool lines = true;   ///< joins the points in their order
  bool marks = true;
  bool arrows = false;   ///< show which way the line goes, for loops
  bool gaps = false;     ///< a value up that is NaN interrupts the line
};

struct PlotStyle {
  int width = 1280;   ///< pixels
  int height = 800;
  std::string title{};
  PlotAxis x{}, y{};
};

}  // namespace palpate
