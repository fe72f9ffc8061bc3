// SPDX-License-Identifier: MIT
#pragma once

#include "hand.hpp"

namespace viewer {

struct Ray {
  Vector origin = Vector::Zero();
  Vector direction = -Vector::UnitZ();   // of length 1, away from the eye
};

/// Two dimensions of a mouse and its wheel made three: the place under the pointer is where the ray from the eye meets the undeformed organ, and the
/// tip is so far above or below it, along the smooth normal there. Beside the organ the place keeps to the plane, parallel to the picture, through
/// the last one.
///   button up       `height` above: the tool glides over the organ
///   button down     `depth` below: it presses, and cuts where that is deep enough
///   wheel           one of the two, whichever is in use
/// A tip that keeps to a plane parallel to the picture would leave the tissue within centimetres, or dive into it, since nobody looks straight down.
class Pointer {
 public:
  void set_organ(Mesh home);

  void aim(Ray const& ray, Vector const& ahead);
  void press(bool pressed) noexcept { pressed_ = pressed; }
  void turn_wheel(int notches) noexcept;

  HandTarget target() const noexcept;
  bool is_pressed() const noexcept { return pressed_; }
  double depth() const noexcept { return depth_; }
  Vector const& place() const noexcept { return place_; }
  /// Of the undisturbed organ there, smooth.
  Vector const& normal() const noexcept { return normal_; }
  /// Is the place on the organ, and not beside it?
  bool is_on_organ() const noexcept { return is_on_organ_; }

 private:
  Mesh home_;
  palpate::Matrix3X<double> normals_;   // at its vertices
  Vector place_{0.0, 0.0, 0.04}, normal_ = Vector::UnitZ();   // m; and away from the organ
  double height_ = 0.012, depth_ = 0.005;   // m
  bool pressed_ = false, is_on_organ_ = false;
};

}  // namespace viewer
