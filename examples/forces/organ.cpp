// SPDX-License-Identifier: MIT
// The drag of the organ's inner walls.
#include "pictures.hpp"

#include <palpate/force/liver.hpp>
#include <palpate/force/organ_force.hpp>

#include <limits>

namespace forces {

using namespace palpate;

namespace {

/// The part of the drag that is against the motion, across the wall.
template <class Model>
double drag(Model const& model, double depth, double speed) {
  return -model({.phase = CuttingPhase::moving, .depth = depth, .previous_depth = depth, .velocity = {speed, 0.0, 0.0}}).x();
}

OrganForce<double> const damper{.coefficient = 2000.0, .max_damping = std::numeric_limits<double>::infinity()};
OrganForce<double> const capped{.coefficient = 2000.0};
OrganFriction<double> const friction = liver_friction<double>();

}  // namespace

Picture organ_over_depth() {
  Picture picture("forces_organ_depth", "Drag of the organ at 100 mm/s", "depth [mm]", "force against the motion [N]");
  sample(picture.line(blue, "damper"), 0.0, 0.020, 1000.0, [](double d) { return drag(damper, d, 0.1); });
  sample(picture.line(orange, "capped, 11 N s/m"), 0.0, 0.020, 1000.0, [](double d) { return drag(capped, d, 0.1); });
  sample(picture.line(green, "friction"), 0.0, 0.020, 1000.0, [](double d) { return drag(friction, d, 0.1); });
  picture.quote("the cap is met at %.1f mm", 1000 * capped.max_damping / capped.coefficient);
  return picture;
}

Picture organ_over_speed() {
  Picture picture("forces_organ_speed", "Drag of the organ 10 mm deep", "speed across the wall [mm/s]", "force against the motion [N]");
  picture.y().from = -4.0, picture.y().to = 4.0;
  sample(picture.line(blue, "damper"), -0.5, 0.5, 1000.0, [](double v) { return drag(damper, 0.010, v); });
  sample(picture.line(orange, "capped, 11 N s/m"), -0.5, 0.5, 1000.0, [](double v) { return drag(capped, 0.010, v); });
  sample(picture.line(green, "friction"), -0.5, 0.5, 1000.0, [](double v) { return drag(friction, 0.010, v); });
  for (double const v : {0.02, 0.2})
    picture.quote("10 mm deep at %g mm/s: damper %.3f N, capped %.3f N, friction %.3f N", 1000 * v, drag(damper, 0.010, v), drag(capped, 0.010, v),
                  drag(friction, 0.010, v));
  picture.quote("the thesis's 1.8e5 N s/m^2 at 10 mm and 20 mm/s: %.0f N", drag(OrganForce<double>{.coefficient = 1.8e5, .max_damping = std::numeric_limits<double>::infinity()}, 0.010, 0.02));
  return picture;
}

}  // namespace forces
