// SPDX-License-Identifier: MIT
#pragma once

#include "live.hpp"

#include <palpate/simulator/snapshot.hpp>

#include <vtkActor.h>
#include <vtkLineSource.h>
#include <vtkNew.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <array>

namespace viewer {

using Colour = std::array<double, 3>;

/// What each thing is drawn in, told apart by colour-blind readers too (Okabe and Ito's palette, but for the organ).
namespace colours {
constexpr Colour tissue{0.62, 0.25, 0.20}, wound{0.70, 0.07, 0.07}, interior{0.16, 0.01, 0.02};
constexpr Colour hook_force{0.34, 0.71, 0.91};
constexpr Colour tip{0.00, 0.45, 0.70}, proxy{0.94, 0.89, 0.26}, force{0.00, 0.62, 0.45}, energy{0.80, 0.40, 0.00};
}  // namespace colours

constexpr double arrow_per_newton = 0.040;   // m

/// The organ, the tool, its proxy and the force, in a part of a window. Tip, proxy and arrow are drawn in front of everything: the hand is
/// seen where it is, in the tissue too.
class Scene {
 public:
  Scene();
  void add_to(vtkRenderWindow* window);
  /// The part of the window, as shares of its size.
  void place(double left, double low, double right, double high);

  void show_body(palpate::BodySnapshot<double> const& body, bool is_uncut);
  /// `place` is what the pointer points at: a line shows the way there while the tool is in the air.
  void show(Moment const& now, Blade blade, Vector const& place);

  /// The second tool, where it is, and the force on the hand that holds it.
  void show_hook(palpate::ToolPose<double> const& pose, Vector const& force);
  void hide_hook();

  /// Looks at the whole organ, which casts a shadow.
  void look_at(Mesh const& organ);
  /// Turns the camera about the organ [degrees].
  void turn(double across, double upwards);
  void come_nearer(double factor);

  vtkRenderer* renderer() const noexcept { return renderer_; }

 private:
  vtkActor* add(vtkRenderer* renderer, Colour const& colour);
  void show_solid(palpate::BodySnapshot<double> const& body);
  void show_arrow(vtkActor* arrow, Vector const& from, Vector const& force);

  vtkNew<vtkRenderer> renderer_, in_front_;
  vtkActor *organ_, *walls_, *blade_, *handle_, *probe_, *stem_, *shadow_;
  vtkActor *tip_, *proxy_, *way_, *arrow_;
  vtkActor *hook_, *hook_arrow_;
  vtkNew<vtkProperty> inside_;   // of the organ
  vtkNew<vtkLineSource> way_line_;
  Vector middle_ = Vector::Zero();
  double framed_from_ = 1.0;   // m, the distance that shows the whole organ
};

}  // namespace viewer
