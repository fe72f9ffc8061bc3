// SPDX-License-Identifier: MIT
#pragma once

#include "charts.hpp"
#include "engine.hpp"
#include "panel.hpp"
#include "picture_clock.hpp"
#include "pointer.hpp"
#include "scene.hpp"

#include <vtkContextActor.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

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
  /// Takes it and draws a picture; the panel too, if it is due.
  void draw();
  void write_picture(std::filesystem::path const& file);

  vtkRenderWindowInteractor* interactor() const noexcept { return interactor_; }
  Scene const& scene() const noexcept { return scene_; }
  Charts const& charts() const noexcept { return charts_; }
  Live const& live() const noexcept { return live_; }
  Layout const& layout() const noexcept { return layout_; }
  HookTarget const& hook() const noexcept { return hook_; }

  // What the interactor's events come to; pixels from the lower left.
  void on_move(int x, int y);
  void on_left(bool down, int x, int y);
  void on_right(bool down) noexcept { turns_ = down; }
  void on_wheel(int notches);
  void on_key(std::string const& key);
  void on_timer();

  PictureClock const& pictures() const noexcept { return pictures_; }

 private:
  void aim(int x, int y);
  /// Puts the hook in where the pointer is on the organ, or takes it away.
  void toggle_hook();
  /// Draws it along the skin, by steps to the right and away, as the picture shows it.
  void draw_hook(int right, int away);
  void set_hook(HookTarget const& target);
  void arrange();
  /// Gives what is to be drawn to the scene, and to the panel.
  void prepare(bool with_panel);

  Engine& engine_;
  bool realtime_;
  std::shared_ptr<Simulation> shown_;
  Live live_;
  Layout layout_, drawn_;
  Pointer pointer_;
  HookTarget hook_;
  bool turns_ = false;
  int last_x_ = 0, last_y_ = 0;
  double seconds_left_ = 0.0;
  bool has_moved_ = false;   // the body, since it was drawn
  PictureClock pictures_;

  vtkNew<vtkRenderWindow> window_;
  vtkNew<vtkRenderWindowInteractor> interactor_;
  Scene scene_;
  Charts charts_;
  vtkNew<Panel> panel_;
  vtkNew<Cards> cards_;
  vtkNew<vtkContextActor> side_words_, side_charts_, scene_words_;   // each keeps the pictures of 50 texts
  vtkNew<vtkRenderer> side_, over_;   // of panel and charts, of the cards on the scene
};

}  // namespace viewer
