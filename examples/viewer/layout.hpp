// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace viewer {

/// A part of the window in pixels; y goes up, as VTK counts.
struct Box {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;

  bool contains(double px, double py) const noexcept { return px >= x && px < x + width && py >= y && py < y + height; }
  double top() const noexcept { return y + height; }
  double right() const noexcept { return x + width; }
  friend bool operator==(Box const&, Box const&) = default;
};

enum class Button { record, replay, undo, undo_all };
constexpr std::array<Button, 4> all_buttons{Button::record, Button::replay, Button::undo, Button::undo_all};

/// Where everything is in a window of so many pixels: the scene to the left, a panel with words, buttons and two charts to the right.
struct Layout {
  Box scene, panel, title, rows, force_chart, energy_chart, help;
  std::array<Box, all_buttons.size()> buttons;
  double row_height = 22.0;
  friend bool operator==(Layout const&, Layout const&) = default;
};

constexpr int row_count = 11;

inline Layout layout_for(int width, int height) {
  constexpr double margin = 14.0, title = 50.0, button = 34.0, gap = 8.0;
  double const w = width, h = height, panel = std::round(std::clamp(0.32 * w, 340.0, 460.0));
  Layout layout;
  layout.scene = {0.0, 0.0, w - panel, h};
  layout.panel = {w - panel, 0.0, panel, h};
  double const left = layout.panel.x + margin, inner = panel - 2.0 * margin;
  double y = h - title;
  layout.title = {left, y, inner, title};
  layout.rows = {left, y - row_count * layout.row_height, inner, row_count * layout.row_height};
  y = layout.rows.y - margin - button;
  double const each = (inner - 3.0 * gap) / 4.0;
  for (std::size_t k = 0; k < layout.buttons.size(); ++k) layout.buttons[k] = {left + static_cast<double>(k) * (each + gap), y, each, button};
  y -= gap;
  double const chart = std::max(60.0, (y - gap) / 2.0);
  layout.force_chart = {layout.panel.x + 4.0, y - chart, panel - 10.0, chart};
  layout.energy_chart = {layout.panel.x + 4.0, y - 2.0 * chart, panel - 10.0, chart};
  layout.help = {margin, margin, 268.0, 270.0};
  return layout;
}

}  // namespace viewer
