// SPDX-License-Identifier: MIT
#include "window.hpp"

#include <palpate/vtk/detail/off_screen.hpp>

#include <vtkAutoInit.h>
#include <vtkCamera.h>
#include <vtkContextScene.h>
#include <vtkInteractorStyle.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLRenderWindow.h>

#include <Eigen/Geometry>

#include <sstream>
#include <string>

VTK_MODULE_INIT(vtkInteractionStyle)
VTK_MODULE_INIT(vtkRenderingUI)   // the interactor of this system's windows

namespace viewer {

namespace {

constexpr int timer_milliseconds = 2, slice_milliseconds = 16;   // how often it is asked whether a picture is due; of lock-step

/// Whether the window's pictures are made without a graphics card: by Mesa's llvmpipe or softpipe, SwiftShader, Apple's or Microsoft's renderer.
bool draws_by_processor(vtkRenderWindow* window) {
  std::istringstream report(window->ReportCapabilities());
  for (std::string line; std::getline(report, line);)
    if (line.find("renderer string") != std::string::npos)
      for (char const* const name : {"llvmpipe", "softpipe", "swrast", "SWR", "SwiftShader", "Software", "GDI Generic", "Basic Render"})
        if (line.find(name) != std::string::npos) return true;
  return false;
}

constexpr double hook_step = 0.003, farthest_drawn = 0.0305;   // m

/// To the right and away along the skin, as the camera sees it.
struct AlongSkin {
  Vector right, away;
};
AlongSkin along_skin(Vector const& normal, vtkCamera* camera) {
  Vector const ahead(camera->GetDirectionOfProjection()), right = ahead.cross(Vector(camera->GetViewUp()));
  Vector const flat = right - right.dot(normal) * normal;
  Vector const along = flat.norm() > 0.1 * right.norm() ? Vector(flat.normalized()) : Vector(normal.unitOrthogonal());
  return {along, normal.cross(along)};
}

/// Passes events on; none of VTK's own keys and gestures.
class Gestures : public vtkInteractorStyle {
 public:
  vtkTypeMacro(Gestures, vtkInteractorStyle);
  static Gestures* New();
  Gestures(Gestures const&) = delete;
  Gestures& operator=(Gestures const&) = delete;

  Window* window = nullptr;

  void OnMouseMove() override { window->on_move(x(), y()); }
  void OnLeftButtonDown() override { window->on_left(true, x(), y()); }
  void OnLeftButtonUp() override { window->on_left(false, x(), y()); }
  void OnRightButtonDown() override { window->on_right(true); }
  void OnRightButtonUp() override { window->on_right(false); }
  void OnMouseWheelForward() override { window->on_wheel(1); }
  void OnMouseWheelBackward() override { window->on_wheel(-1); }
  void OnKeyPress() override {
    if (char const* const key = Interactor->GetKeySym()) window->on_key(key);
  }
  void OnChar() override {}
  void OnTimer() override { window->on_timer(); }

 protected:
  Gestures() = default;
  ~Gestures() override = default;

 private:
  int x() const { return Interactor->GetEventPosition()[0]; }
  int y() const { return Interactor->GetEventPosition()[1]; }
};
vtkStandardNewMacro(Gestures)

}  // namespace

Window::Window(Engine& engine, int width, int height, bool realtime) : engine_(engine), realtime_(realtime) {
  window_->SetWindowName("palpate");
  window_->SetSize(width, height);
  window_->SetMultiSamples(8);
  if (auto* const drawn = vtkOpenGLRenderWindow::SafeDownCast(window_)) drawn->SetFrameBlitModeToBlitToCurrent();   // without the depths, which nobody reads
  window_->SetNumberOfLayers(3);
  scene_.add_to(window_);
  for (vtkRenderer* const words : {side_.Get(), over_.Get()}) {
    words->SetLayer(2);
    words->InteractiveOff();
    words->PreserveDepthBufferOn();   // words are drawn in their order
    window_->AddRenderer(words);
  }
  side_->AddActor(side_words_);
  side_->AddActor(side_charts_);
  over_->AddActor(scene_words_);
  side_words_->GetScene()->AddItem(panel_);
  charts_.add_to(side_charts_->GetScene());
  scene_words_->GetScene()->AddItem(cards_);
  interactor_->SetRenderWindow(window_);
  vtkNew<Gestures> gestures;
  gestures->window = this;
  interactor_->SetInteractorStyle(gestures);
  update();
  scene_.look_at(shown_->home());
  prepare(true);
  window_->Render();
  interactor_->Initialize();
  if (draws_by_processor(window_)) pictures_.begin_by_processor();
}

Window::~Window() { interactor_->SetInteractorStyle(nullptr); }

void Window::arrange() {
  int const* const size = window_->GetSize();
  layout_ = layout_for(size[0], size[1]);
  scene_.place(0.0, 0.0, layout_.scene.width / size[0], 1.0);
}

void Window::update() {
  arrange();
  live_ = engine_.live();
  if (engine_.simulation() != shown_) {
    shown_ = engine_.simulation();
    pointer_.set_organ(shown_->home());
    has_moved_ = true;
  }
  if (hook_.is_held && hook_.number == live_.hook.lifted) toggle_hook();   // it was taken away with the body that it held
  has_moved_ |= shown_->snapshots().fetch();
  palpate::BodySnapshot<double> const& body = shown_->snapshots().latest();
  live_.is_uncut = live_.began_uncut && body.topology_revision == live_.began_with;
  live_.triangles = static_cast<int>(body.triangles.cols());
}

void Window::prepare(bool with_panel) {
  if (has_moved_) scene_.show_body(shown_->snapshots().latest(), live_.is_uncut);
  has_moved_ = false;
  scene_.show(live_.now, live_.setup.blade, pointer_.place());
  auto const& tools = shown_->snapshots().latest().tools;
  bool const has_hook = tools.size() > 1 && !live_.hook.is_parked();
  if (has_hook) scene_.show_hook(tools[1].pose, live_.hook.tick.force);
  else scene_.hide_hook();
  scene_.renderer()->ResetCameraClippingRange();
  cards_->show(has_hook);
  cards_->place(layout_);
  if (!with_panel) return;
  charts_.place(layout_);
  charts_.show(live_);
  panel_->place(layout_);
  panel_->show(live_, pointer_.depth(), realtime_, pictures_);
}

void Window::write_picture(std::filesystem::path const& file) {
  update();
  prepare(true);
  palpate::detail::write_png(file, window_);
}

void Window::run(double seconds) {
  seconds_left_ = seconds;
  interactor_->CreateRepeatingTimer(timer_milliseconds);
  interactor_->Start();
}

void Window::on_timer() {
  if (!pictures_.is_due(PictureClock::Clock::now())) return;
  if (!realtime_) engine_.advance(0.001 * slice_milliseconds);
  draw();
  if (seconds_left_ > 0.0 && live_.time >= seconds_left_) interactor_->TerminateApp();
}

void Window::draw() {
  auto const from = PictureClock::Clock::now();
  update();
  bool const with_panel = pictures_.is_panel_due(from) || layout_ != drawn_;
  prepare(with_panel);
  side_->SetDraw(with_panel);   // else it stays as it is in the frame
  window_->Render();
  side_->DrawOn();
  drawn_ = layout_;
  bool const was_plain = pictures_.is_plain();
  pictures_.drew(from, PictureClock::Clock::now(), with_panel);
  if (pictures_.is_plain() == was_plain) return;
  window_->SetMultiSamples(0);
  drawn_ = {};
}

void Window::aim(int x, int y) {
  vtkRenderer* const renderer = scene_.renderer();
  auto const world = [&](double depth) {
    renderer->SetDisplayPoint(x, y, depth);
    renderer->DisplayToWorld();
    double const* const p = renderer->GetWorldPoint();
    return Vector(p[0] / p[3], p[1] / p[3], p[2] / p[3]);
  };
  Vector const eye(renderer->GetActiveCamera()->GetPosition()), ahead(renderer->GetActiveCamera()->GetDirectionOfProjection());
  pointer_.aim({eye, (world(1.0) - eye).normalized()}, ahead);
  engine_.targets().write(pointer_.target());
}

void Window::toggle_hook() {
  HookTarget target = hook_;
  if (hook_.is_held) {
    target.is_held = false;
  } else if (pointer_.is_on_organ()) {
    target = {.place = pointer_.place(), .normal = pointer_.normal(), .is_held = true, .number = hook_.number + 1};
    auto const [right, away] = along_skin(target.normal, scene_.renderer()->GetActiveCamera());
    target.side = (away - right).normalized();   // out of the way
  }
  set_hook(target);
}

void Window::draw_hook(int right, int away) {
  if (!hook_.is_held) return;
  auto const along = along_skin(hook_.normal, scene_.renderer()->GetActiveCamera());
  HookTarget target = hook_;
  target.drawn += hook_step * (right * along.right + away * along.away);
  if (target.drawn.norm() < farthest_drawn) set_hook(target);
}

void Window::set_hook(HookTarget const& target) {
  hook_ = target;
  engine_.hook_targets().write(target);
}

void Window::on_move(int x, int y) {
  if (turns_) {
    scene_.turn(-0.4 * (x - last_x_), -0.4 * (y - last_y_));
  } else if (pointer_.is_pressed() || layout_.scene.contains(x, y)) {
    aim(x, y);
  }
  last_x_ = x;
  last_y_ = y;
}

void Window::on_left(bool down, int x, int y) {
  constexpr std::array<Command, all_buttons.size()> commands{Command::record, Command::replay, Command::undo, Command::undo_all};
  for (std::size_t k = 0; down && k < all_buttons.size(); ++k)
    if (layout_.buttons[k].contains(x, y)) engine_.post(commands[k]);
  if (down && !layout_.scene.contains(x, y)) return;
  pointer_.press(down);
  engine_.targets().write(pointer_.target());
}

void Window::on_wheel(int notches) {
  pointer_.turn_wheel(notches);
  engine_.targets().write(pointer_.target());
}

void Window::on_key(std::string const& key) {
  if (key == "t") engine_.post(Command::tissue);
  if (key == "i") engine_.post(Command::integrator);
  if (key == "c") engine_.post(Command::coupling);
  if (key == "k") engine_.post(Command::blade);
  if (key == "r") engine_.post(Command::record);
  if (key == "p") engine_.post(Command::replay);
  if (key == "u") engine_.post(Command::undo);
  if (key == "space") engine_.post(Command::undo_all);
  if (key == "2" || key == "KP_2") toggle_hook();
  if (key == "Right" || key == "Left") draw_hook(key == "Right" ? 1 : -1, 0);
  if (key == "Up" || key == "Down") draw_hook(0, key == "Up" ? 1 : -1);
  if (key == "h") cards_->toggle_help();
  if (key == "plus" || key == "equal" || key == "KP_Add") scene_.come_nearer(1.1);
  if (key == "minus" || key == "KP_Subtract") scene_.come_nearer(1.0 / 1.1);
  if (key == "q" || key == "Escape") interactor_->TerminateApp();
}

}  // namespace viewer
