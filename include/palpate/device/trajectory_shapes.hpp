// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/trajectory.hpp>

#include <numbers>

namespace palpate {

/// Presses, slides and lifts: what a finger does to feel friction, and a blade to cut.
template <RealScalar Scalar>
struct SlideShape {
  Vector3<Scalar> down = {0, 0, Scalar(-0.002)};   ///< m, the way of the press; it is lifted by as much
  Vector3<Scalar> along = {Scalar(0.04), 0, 0};    ///< m
  double press_seconds = 0.5;                      ///< s, for the press, and again for the lift; both begin and end at rest
  double slide_seconds = 2.0;
  Pace pace = Pace::constant;                      ///< of the slide
};

/// The path, and a slide from where it ended.
template <RealScalar Scalar>
Trajectory<Scalar> slide(Trajectory<Scalar> path, SlideShape<Scalar> const& shape) {
  Vector3<Scalar> const pressed = path.end() + shape.down, slid = pressed + shape.along;
  path.line(pressed, shape.press_seconds, Pace::minimum_jerk).line(slid, shape.slide_seconds, shape.pace);
  path.line(slid - shape.down, shape.press_seconds, Pace::minimum_jerk);
  return path;
}

/// The path, and whole circles around the axis through `centre` from where it ended, counter-clockwise seen against the axis; negative turns go the
/// other way.
template <RealScalar Scalar>
Trajectory<Scalar> circle(Trajectory<Scalar> path, Vector3<Scalar> const& centre, Vector3<Scalar> const& axis, double seconds, int turns = 1,
                          Pace pace = Pace::constant) {
  if (turns == 0) throw InvalidArgument("circle: 0 turns; give 1 or more, or -1 or less to go the other way");
  path.arc(centre, axis, static_cast<Scalar>(2.0 * std::numbers::pi * turns), seconds, pace);
  return path;
}

/// The path, and a few strokes there and back by `reach`, each way in `seconds`, resting at both ends: what measures hysteresis.
template <RealScalar Scalar>
Trajectory<Scalar> strokes(Trajectory<Scalar> path, Vector3<Scalar> const& reach, double seconds, int times = 1, Pace pace = Pace::minimum_jerk) {
  if (times < 1) throw InvalidArgument(detail::message("strokes: ", times, " times; give 1 or more"));
  Vector3<Scalar> const here = path.end();
  for (int k = 0; k < times; ++k) path.line(here + reach, seconds, pace).line(here, seconds, pace);
  return path;
}

}  // namespace palpate
