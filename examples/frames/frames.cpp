// SPDX-License-Identifier: MIT
// From the hand to the scene and back. A device with a workspace of 16 × 12 × 7 cm palpates a liver of 25 cm that a camera looks at from above:
//   world ← view ← touch ← workspace     points and velocities go this way, forces the other
// Shown: the chain of frames beside matrices multiplied by hand, what one newton and one stiffness of the scene become in the hand, that the hand does
// exactly the work that the tissue takes, and how a clutch lets a small workspace go over a large organ.
#include "../album.hpp"

#include <palpate/core/matrix.hpp>
#include <palpate/core/similarity.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace {

using namespace palpate;
using Vector = Vector3<double>;
using Matrix4 = Eigen::Matrix4d;

Eigen::Quaterniond turn(double degrees, Vector const& axis) { return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis)); }

/// The same by hand: homogeneous coordinates, Rodrigues' rotation about x.
Matrix4 by_hand(double scale, double degrees_about_x, Vector const& offset) {
  double const c = std::cos(degrees_about_x * std::numbers::pi / 180.0), s = std::sin(degrees_about_x * std::numbers::pi / 180.0);
  Matrix4 m;
  m << scale, 0, 0, offset.x(),            //
      0, scale * c, -scale * s, offset.y(), //
      0, scale * s, scale * c, offset.z(),  //
      0, 0, 0, 1;
  return m;
}

void print(char const* what, Vector const& v, char const* unit) { std::printf("%-34s %9.5f %9.5f %9.5f %s\n", what, v.x(), v.y(), v.z(), unit); }

drawing::Album frames() {
  using namespace drawing;
  // The camera stands 60 cm over the organ and looks down at it, its x to the right; the hand works 60 cm in front of the camera; the device's y is up
  // in the picture, and its 16 cm are 25 cm there.
  Vector const camera(0.0, 0.0, 0.6), ahead(0.0, 0.0, -0.6);
  double const tilt = 30.0, scale = 0.25 / 0.16;
  FrameChain<double> const chain{.world_from_view = Similarity<double>::make(1.0, turn(tilt, Vector::UnitX()), camera),
                                 .view_from_touch = Similarity<double>::make(1.0, turn(0.0, Vector::UnitX()), ahead),
                                 .touch_from_workspace = Similarity<double>::make(scale, turn(-tilt, Vector::UnitX()), Vector::Zero())};
  Matrix4 const matrix = by_hand(1.0, tilt, camera) * by_hand(1.0, 0.0, ahead) * by_hand(scale, -tilt, Vector::Zero());
  WorkspaceMapping<double> mapping(chain.world_from_workspace());

  Vector const hand(0.05, -0.02, 0.01), hand_speed(0.03, 0.0, -0.01), tissue_force(0.2, 0.1, 0.9);
  Vector const tip = mapping.to_world(hand), tip_by_hand = (matrix * hand.homogeneous()).head<3>();
  print("hand, in the workspace", hand, "m");
  print("tip, in the world", tip, "m");
  print("the same, matrices by hand", tip_by_hand, "m");
  std::printf("%-34s %9.1e m\n", "difference", (tip - tip_by_hand).norm());

  Vector const tip_speed = mapping.velocity_to_world(hand_speed), hand_force = mapping.force_to_device(tissue_force);
  print("\nforce of the tissue, in the world", tissue_force, "N");
  print("force on the hand, in its frame", hand_force, "N");
  std::printf("%-34s %9.7f W\n%-34s %9.7f W\n", "power that the tissue takes", tissue_force.dot(tip_speed), "power of the hand", hand_force.dot(hand_speed));
  std::printf("%-34s %9.4f N/m, %.4f by scale squared\n", "100 N/m in the scene are felt as", mapping.felt_stiffness(100.0), 100.0 * scale * scale);

  // For fine work the workspace covers 4 cm of the organ alone: a quarter of the hand's way. Three strokes, on the way back with the clutch held.
  DeviceWorkspace const workspace{.lower = {-0.08, -0.06, -0.035}, .upper = {0.08, 0.06, 0.035}, .provenance = Provenance::datasheet};
  auto const near = WorkspaceMapping<double>::fit_box(workspace, {-0.08, -0.015, -0.00875}, {-0.04, 0.015, 0.00875});
  mapping = near;
  Picture strokes("frames_clutch", "A clutch takes a small workspace over a large organ", "time [s]", "position along x [mm]");
  strokes.y().from = -100.0, strokes.y().to = 150.0;
  PlotSeries &device = strokes.line(blue, "hand, in the workspace"), &scene = strokes.line(orange, "tip, in the world");
  PlotSeries& held = strokes.dots(black, "clutch held");
  double const reach = 0.07;   // m, to each side
  double const from = mapping.to_world({-reach, 0, 0}).x();
  Vector at(-reach, 0, 0);
  double jump = 0.0, x = from;
  for (int k = 0; k < 5000; ++k) {
    double const t = 1e-3 * k;
    int const stroke = k / 1000;   // forward in the even ones, back with the clutch held in the others
    bool const back = stroke % 2 == 1;
    double const share = (1.0 - std::cos(std::numbers::pi * (t - stroke))) / 2;
    at.x() = reach * (back ? 1.0 - 2.0 * share : 2.0 * share - 1.0);
    if (back && !mapping.clutch_open()) mapping.open_clutch(at);
    if (!back && mapping.clutch_open()) mapping.close_clutch(at);
    double const now = mapping.clutch_open() ? mapping.held().x() : mapping.to_world(at).x();
    jump = std::max(jump, std::abs(now - x));
    x = now;
    if (k % 20 == 0) {
      add(device, t, 1e3 * at.x());
      add(scene, t, 1e3 * x);
      if (back) add(held, t, -90.0);
    }
  }
  std::printf("\n%-34s %9.4f m\n%-34s %9.4f m, %.4f by scale times what the hand went\n", "tip at the beginning", from, "tip after three strokes", x,
              from + 3.0 * near.world_from_device().scale() * 2.0 * reach);
  std::printf("%-34s %9.2e m in a tick, %.2e by the hand's fastest\n", "the tip never jumps:", jump,
              near.world_from_device().scale() * reach * std::numbers::pi * 1e-3);
  return {.charts = {strokes}, .views = {}};
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("frames", argc, argv, frames); }
