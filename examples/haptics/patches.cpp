// SPDX-License-Identifier: MIT
// A tool slides at 0.1 m/s over a ball of tissue of 20 mm radius, 1 mm below its surface. The surface is sent 30 times a second, and is a frame late.
#include "pictures.hpp"

#include <palpate/haptics/patch_handover.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace haptics {

using namespace palpate;

namespace {

constexpr double slide_stiffness = 500.0, slide_radius = 0.020, slide_depth = 0.001, slide_speed = 0.1;   // N/m, m, m, m/s
constexpr int frame_ticks = 33;                                                                            // ticks of 1 ms

Vector3<double> outward(int tick) {   // at rest before 0
  double const angle = std::max(0, tick) * 0.001 * slide_speed / (slide_radius - slide_depth);
  return {std::sin(angle), 0.0, std::cos(angle)};
}

struct Felt {
  double jump = 0.0, step = 0.0, error = 0.0;   // N, largest: where a patch takes over, the tip the same; in a tick; from the ball's own force
};

Felt slide(PlotSeries& series, bool curved, int handover_ticks) {
  PatchHandover<double> handover({.ticks = handover_ticks});
  std::uint64_t sequence = 0;
  Felt felt;
  SurfacePatch<double> before;
  Vector3<double> last = Vector3<double>::Zero();
  for (int tick = -2 * frame_ticks; tick < 8 * frame_ticks; ++tick) {
    Vector3<double> const tip = (slide_radius - slide_depth) * outward(tick);
    if (tick % frame_ticks == 0) {
      Vector3<double> const normal = outward(tick - frame_ticks);
      double const curvature = curved ? 1.0 / slide_radius : 0.0;
      handover.take({.point = slide_radius * normal, .normal = normal, .curvature = curvature, .stiffness = slide_stiffness}, ++sequence, tip);
    }
    SurfacePatch<double> const now = handover(tip);
    Vector3<double> const force = now.force(tip);
    if (tick >= -frame_ticks) add(series, tick, force.norm());
    if (tick > 0) {
      felt.jump = std::max(felt.jump, (force - before.force(tip)).norm());
      felt.step = std::max(felt.step, (force - last).norm());
      felt.error = std::max(felt.error, (force - slide_stiffness * slide_depth * outward(tick)).norm());
    }
    before = now;
    last = force;
  }
  return felt;
}

}  // namespace

Picture patches() {
  Picture picture("haptics_patches", "Over a ball of 20 mm radius at 0.1 m/s, the surface 30 times a second", "time [ms]", "force [N]");
  picture.x().from = -33.0, picture.x().to = 250.0;
  picture.y().from = 0.4, picture.y().to = 1.2;
  auto const show = [&](Colour colour, char const* label, bool curved, int ticks) {
    Felt const felt = slide(picture.line(colour, label), curved, ticks);
    picture.quote("%-18s jump %.4f N, largest step %.4f N a tick, off by up to %.3f N", label, felt.jump, felt.step, felt.error);
  };
  show(pink, "plane, at once", false, 1);
  show(orange, "plane, over 33 ms", false, frame_ticks);
  show(blue, "ball, over 33 ms", true, frame_ticks);
  return picture;
}

}  // namespace haptics
