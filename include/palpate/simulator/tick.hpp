// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>

#include <cstdint>

namespace palpate {

/// One servo tick as it was: where the tip was, what it did, what the hand felt.
/// Units      time [s] since the start, tip [m] in the world frame, depth [m] below the home surface (0 without contact),
///            force [N] on the hand and torque [N m] about the tip, as written to the device, in the world frame; energy [J] that they have
///            taken from the hand in all runs so far, exact for a force that is held between ticks; below zero it was given;
///            cut_area [m²], of solids, undeformed, one wall, of all cuts so far.
struct Tick {
  double time = 0.0;
  Vector3<double> tip = Vector3<double>::Zero();
  double depth = 0.0;
  CuttingPhase phase = CuttingPhase::no_contact;
  std::uint32_t missed = 0;   ///< ticks that should have been before it, in real time; `time` goes on as if there had been none. Not in files of recordings
  Vector3<double> force = Vector3<double>::Zero();
  double energy = 0.0;
  double cut_area = 0.0;
  Vector3<double> torque = Vector3<double>::Zero();
};

}  // namespace palpate
