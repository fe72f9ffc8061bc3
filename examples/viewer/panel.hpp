// SPDX-License-Identifier: MIT
#pragma once

#include "layout.hpp"
#include "live.hpp"
#include "picture_clock.hpp"

#include <vtkContextItem.h>

#include <string>

namespace viewer {

/// What is written beside the scene: the state and the buttons.
class Panel : public vtkContextItem {
 public:
  vtkTypeMacro(Panel, vtkContextItem);
  static Panel* New();
  Panel(Panel const&) = delete;
  Panel& operator=(Panel const&) = delete;

  bool Paint(vtkContext2D* painter) override;

  void place(Layout const& layout) { layout_ = layout; }
  void show(Live const& live, double depth, bool realtime, PictureClock const& pictures) {
    live_ = live;
    press_depth_ = depth;
    realtime_ = realtime;
    pictures_ = pictures;
  }

 protected:
  Panel() = default;
  ~Panel() override = default;

 private:
  void paint_state(vtkContext2D* painter) const;
  void paint_buttons(vtkContext2D* painter) const;

  Layout layout_{};
  Live live_{};
  double press_depth_ = 0.0;   // m
  bool realtime_ = false;
  PictureClock pictures_;
};

/// What is written on the scene: what the colours mean, and the keys.
class Cards : public vtkContextItem {
 public:
  vtkTypeMacro(Cards, vtkContextItem);
  static Cards* New();
  Cards(Cards const&) = delete;
  Cards& operator=(Cards const&) = delete;

  bool Paint(vtkContext2D* painter) override;

  void place(Layout const& layout) { layout_ = layout; }
  void show(bool has_hook) { has_hook_ = has_hook; }
  void toggle_help() { helps_ = !helps_; }
  bool helps() const noexcept { return helps_; }

 protected:
  Cards() = default;
  ~Cards() override = default;

 private:
  void paint_legend(vtkContext2D* painter) const;
  void paint_help(vtkContext2D* painter) const;

  Layout layout_{};
  bool helps_ = true, has_hook_ = false;
};

}  // namespace viewer
