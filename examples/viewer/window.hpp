// SPDX-License-Identifier: MIT
#pragma once

#include "charts.hpp"
#include "engine.hpp"
#include "panel.hpp"
#include "pointer.hpp"
#include "scene.hpp"

#include <vtkContextActor.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

namespace viewer {

/// The window: it turns events into targets of the hand and commands to the engine, and draws what the engine shows.
class Window {
 public:
  Window(Engine& engine, int width, int height, bool realtime);
  ~Window();
  Window(Window const&) = delete;
  Window& operator=(Window const&) = delete;

  /// Handles events until the window is closed, or for so many seconds if that is more than 0.
  void run(double seconds);
  /// Takes what is new from the engine.
  void update();
  void write_picture(std::filesystem::path const& file);

  vtkRenderWindowInteractor* interactor() const noexcept { return interactor_; }
  Scene const& scene() const noexcept { return scene_; }
  Charts const& charts() const noexcept { return charts_; }
  Live const& live() const noexcept { return live_; }
  Layout const& layout() const noexcept { return layout_; }

  // What the interactor's events come to; pixels from the lower left.
  void on_move(int x, int y);
  void on_left(bool down, int x, int y);
  void on_right(bool down) noexcept { turns_ = down; }
  void on_wheel(int notches);
  void on_key(std::string const& key);
  void on_timer();

  /// How many pictures a second the timer has drawn so far.
  double picture_rate() const noexcept;

 private:
  void aim(int x, int y);
  void arrange();

  Engine& engine_;
  bool realtime_;
  std::shared_ptr<Simulation> shown_;
  Live live_;
  Layout layout_;
  Pointer pointer_;
  bool turns_ = false;
  int last_x_ = 0, last_y_ = 0;
  double seconds_left_ = 0.0;
  long long pictures_ = 0;
  std::chrono::steady_clock::time_point first_{}, last_{};   // picture

  vtkNew<vtkRenderWindow> window_;
  vtkNew<vtkRenderWindowInteractor> interactor_;
  Scene scene_;
  Charts charts_;
  vtkNew<Panel> panel_;
  vtkNew<vtkContextActor> words_;
  vtkNew<vtkRenderer> flat_;   // of the panel, over everything
};

}  // namespace viewer
