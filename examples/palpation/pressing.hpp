// SPDX-License-Identifier: MIT
#pragma once

#include "organ.hpp"

#include <palpate/tissue/solid_fields.hpp>

#include <functional>
#include <vector>

namespace palpation {

/// A press that is balanced.
struct Press {
  double force = 0.0;   // N, along the normal, that holds the pad
  palpate::Matrix3X<double> positions;
  palpate::SolidFields<double> fields;
};

/// Presses each place of an organ, with its nodule or as if it were none: a pad of the skin is moved in along the normal, deepest in its middle, as by a round
/// fingertip that sticks, and the rest finds its balance. `done(place)` after each.
std::vector<Press> press(Options const& options, Organ const& organ, bool with_nodule, std::function<void(std::size_t)> const& done);

}  // namespace palpation
