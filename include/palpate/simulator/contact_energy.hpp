// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/phase.hpp>
#include <palpate/simulator/recording.hpp>

#include <cstddef>
#include <vector>

namespace palpate {

/// One contact of a recording, from the tick before the touch to the one in which it ends, and what the hand put into it.
/// Units      s; energy [J]: above zero the hand gave it, as into a cut or a damper; below zero it came out of the rendering, which is what a passive one
///            never does but for the ½ K |Δx|² a tick that a sampled spring leaks.
struct ContactEnergy {
  double begin = 0.0, end = 0.0;
  double energy = 0.0;
  bool cut = false;   ///< the tool went through the surface
};

/// The contacts of a recording of one session, in the order of time; one that is still there at its end counts up to it.
inline std::vector<ContactEnergy> contact_energies(Recording const& recording) {
  std::vector<ContactEnergy> contacts;
  auto const& ticks = recording.ticks();
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    Tick const& before = ticks[k > 0 ? k - 1 : 0];
    bool const was = k > 0 && before.phase != CuttingPhase::no_contact, is = ticks[k].phase != CuttingPhase::no_contact;
    if (!was && !is) continue;
    if (!was) contacts.push_back({.begin = before.time, .energy = -before.energy});
    ContactEnergy& contact = contacts.back();
    contact.cut = contact.cut || ticks[k].phase == CuttingPhase::moving;
    if (!is || k + 1 == ticks.size()) {
      contact.end = ticks[k].time;
      contact.energy += ticks[k].energy;
    }
  }
  return contacts;
}

}  // namespace palpate
