// SPDX-License-Identifier: MIT
#pragma once

#include "layout.hpp"
#include "live.hpp"

#include <vtkContextItem.h>

#include <string>

namespace viewer {

/// Everything in the window that is words: the state, the buttons and the keys.
class Panel : public vtkContextItem {
 public:
  vtkTypeMacro(Panel, vtkContextItem);
  static Panel* New();
  Panel(Panel const&) = delete;
  Panel& operator=(Panel const&) = delete;

  bool Paint(vtkContext2D* painter) override;

  void place(Layout const& layout) { layout_ = layout; }
  void show(Live const& live, double depth, bool realtime) {
    live_ = live;
    press_depth_ = depth;
    realtime_ = realtime;
  }
  void toggle_help() { helps_ = !helps_; }
  bool helps() const noexcept { return helps_; }

 protected:
  Panel() = default;
  ~Panel() override = default;

 private:
  void paint_state(vtkContext2D* painter) const;
  void paint_buttons(vtkContext2D* painter) const;
  void paint_help(vtkContext2D* painter) const;
  void paint_legend(vtkContext2D* painter) const;

  Layout layout_{};
  Live live_{};
  double press_depth_ = 0.0;   // m
  bool realtime_ = false, helps_ = true;
};

}  // namespace viewer
